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
    QLabel *value, *si;
  };
  Row add_row(const char* name, const char* title, const char* meaning);

  QGridLayout* grid_;
  Row derailed_, speed_, buff_, draft_, closing_, pile_up_, residual_;
};

}  // namespace train_derail::rviz_panel
