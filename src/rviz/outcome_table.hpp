#pragma once

#include <QGridLayout>
#include <QLabel>
#include <QWidget>

#include "rviz/node_link.hpp"

namespace train_derail::rviz_panel {

/// What the run has yielded so far, in mph, kip, ft and beside it in SI.
class OutcomeTable : public QWidget {
  Q_OBJECT

 public:
  explicit OutcomeTable(QWidget* parent = nullptr);

  void show_outcome(const NodeView& view);

 private:
  struct Row {
    QLabel *title, *value, *si;
  };
  Row add_row(const char* name, const char* title, const char* meaning);
  /// One text over both columns.
  Row add_wide_row(const char* name, const char* title, const char* meaning);
  /// What the paper's model does not have: shown if there is some.
  void show_accident(const Outcome* outcome);

  QGridLayout* grid_;
  Row warnings_, derailed_, causes_, speed_, buff_, draft_, broken_, blockage_, closing_, impacts_, impact_force_,
      pile_up_, site_, spent_, residual_;
};

}  // namespace train_derail::rviz_panel
