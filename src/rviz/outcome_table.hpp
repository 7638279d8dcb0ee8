#pragma once

#include <string_view>
#include <utility>
#include <vector>

#include <QGridLayout>
#include <QLabel>
#include <QWidget>

#include "rviz/node_link.hpp"
#include "train_derail/outcome/fields.hpp"

namespace train_derail::rviz_panel {

/// What the run has yielded so far: a row for each outcome that its description calls a headline, in the unit that
/// people read and beside it in SI, and what the run before it had yielded.
class OutcomeTable : public QWidget {
  Q_OBJECT

 public:
  explicit OutcomeTable(QWidget* parent = nullptr);

  void show_outcome(const NodeView& view);
  /// All rows and their remarks, or the leading ones alone; remarks are then tooltips.
  void set_full(bool full);
  bool is_full() const { return full_; }
  /// Height that the other rows need.
  int height_of_rest() const;

 private:
  struct Row {
    QLabel *title, *value, *si, *before;
    QLabel* note;  ///< below the others, over the whole width: where, when, why
    QString meaning;
  };
  /// A row whose value is called "outcome:NAME".
  Row add_row(std::string_view name, std::string_view title, std::string_view meaning);
  void show_speed(const TrainNow& train);
  void show_caption(const NodeView& view);

  QGridLayout* grid_;
  QLabel *warnings_, *this_run_, *run_before_;
  Row speed_;
  std::vector<std::pair<const fields::Field<outcome::Outcome>*, Row>> rows_;
  bool full_ = true;
  int rest_ = 0;                                 ///< rows and remarks that are left out or could be
  Inputs::ConstPtr inputs_now_, inputs_before_;  ///< that the caption compares
  QString change_, changes_;                     ///< in which inputs the two runs differ, short and in full
};

}  // namespace train_derail::rviz_panel
