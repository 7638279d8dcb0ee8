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
/// people read and beside it in SI.
class OutcomeTable : public QWidget {
  Q_OBJECT

 public:
  explicit OutcomeTable(QWidget* parent = nullptr);

  void show_outcome(const NodeView& view);

 private:
  struct Row {
    QLabel *title, *value, *si;
    QLabel* note;  ///< below the others, over the whole width: where, when, why
  };
  /// A row whose value is called "outcome:NAME".
  Row add_row(std::string_view name, std::string_view title, std::string_view meaning);
  void show_speed(const TrainNow& train);

  QGridLayout* grid_;
  QLabel* warnings_;
  Row speed_;
  std::vector<std::pair<const fields::Field<outcome::Outcome>*, Row>> rows_;
};

}  // namespace train_derail::rviz_panel
