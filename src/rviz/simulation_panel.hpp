#pragma once

#include <cstdint>

#include <rviz/panel.h>
#include <QCheckBox>
#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QScrollArea>
#include <QSpinBox>
#include <QTimer>

#include "rviz/force_charts.hpp"
#include "rviz/inputs_form.hpp"
#include "rviz/node_link.hpp"
#include "rviz/outcome_table.hpp"

namespace train_derail::rviz_panel {

/// Drives one train_derail node from RViz and shows what its run yields. Looks at the link a few times a second and
/// never waits for it, so that RViz goes on drawing whatever the node does.
class SimulationPanel : public rviz::Panel {
  Q_OBJECT

 public:
  explicit SimulationPanel(QWidget* parent = nullptr);

  void load(const rviz::Config& config) override;
  void save(rviz::Config config) const override;

 private:
  QWidget* make_node_row();
  QWidget* make_run_box();
  QWidget* make_inputs_box();

  void refresh();
  void show_presence(const NodeView& view);
  void show_run(const NodeView& view);
  void show_answer(const Answer& answer);
  void show_message(const QString& text, const QColor& color);
  void enable_buttons(const NodeView& view);
  void keep_width();

  void set_rate(const QString& text);
  void restart();

  NodeLink link_;
  QTimer timer_;
  std::uint64_t answer_seen_ = 0;
  Inputs::ConstPtr inputs_seen_;

  QLineEdit* node_;
  QLabel *presence_, *state_, *time_, *message_;
  QPushButton *run_, *pause_, *step_, *restart_, *revert_;
  QSpinBox* ticks_;
  QComboBox* rate_;
  QCheckBox* start_paused_;
  InputsForm* inputs_;
  OutcomeTable* outcome_;
  ForceCharts* charts_;
  QScrollArea* scroll_;
  QWidget* live_;  // all that is of no use without a node
};

}  // namespace train_derail::rviz_panel
