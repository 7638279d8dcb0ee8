#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include <rviz/panel.h>
#include <QCheckBox>
#include <QLabel>
#include <QLineEdit>
#include <QPushButton>
#include <QScrollArea>
#include <QTimer>
#include <QToolButton>

#include "rviz/force_charts.hpp"
#include "rviz/inputs_form.hpp"
#include "rviz/node_link.hpp"
#include "rviz/outcome_table.hpp"
#include "rviz/run_box.hpp"
#include "rviz/scenario_chooser.hpp"
#include "rviz/section.hpp"
#include "rviz/study_link.hpp"
#include "rviz/sweep_box.hpp"
#include "rviz/view_buttons.hpp"

namespace train_derail::rviz_panel {

/// Drives one train_derail node from RViz and shows what its run yields. Looks at the link a few times a second and
/// never waits for it, so that RViz goes on drawing whatever the node does.
class SimulationPanel : public rviz::Panel {
  Q_OBJECT

 public:
  explicit SimulationPanel(QWidget* parent = nullptr);

  void onInitialize() override;
  /// As narrow as it can be: the scene has the rest of the window.
  QSize sizeHint() const override;
  void load(const rviz::Config& config) override;
  void save(rviz::Config config) const override;

 private:
  /// What the message is about; it goes when that is over.
  enum class Cause { run, rate, inputs, sweep };

  Section* add_section(const char* name, const QString& caption, QWidget* content);
  QWidget* make_node_row();
  RunBox* make_run_box();
  QWidget* make_inputs_box();
  QWidget* make_sweep_box();
  QWidget* make_outcome_box();
  /// Those whose state is saved whether the user has touched them or not.
  std::array<std::pair<const char*, Section*>, 3> remembered_sections() const {
    return {{{"Inputs", inputs_section_}, {"Sweep", sweep_section_}, {"Outcome", outcome_section_}}};
  }

  void refresh();
  void show_presence(const NodeView& view);
  void show_answer(const Answer& answer);
  void show_message(const QString& text, const QColor& color, Cause cause);
  void clear_message(Cause cause);
  void enable_buttons(const NodeView& view);
  void keep_width();
  void fit();
  void fit_window();

  void set_node(const QString& name);
  void run();
  void restart();
  void load_scenario(const QString& path);
  void copy_command();
  void start_sweep();

  NodeLink link_;
  StudyLink study_;
  QTimer timer_;
  std::uint64_t answer_seen_ = 0;
  Inputs::ConstPtr inputs_seen_;

  Cause cause_ = Cause::run;      // of the message
  bool refused_locally_ = false;  // the message is about what the form holds, not what the node has refused
  std::optional<bool> charts_wanted_, all_outcomes_wanted_;  // by the user; none: where there is room
  bool fit_window_ = false, window_fitted_ = false;

  ViewButtons* views_;
  QLineEdit* node_;
  QLabel *presence_, *message_;
  RunBox* run_box_;
  QPushButton *restart_, *revert_, *copy_;
  QCheckBox* start_paused_;
  QToolButton* all_outcomes_;
  ScenarioChooser* scenario_;
  InputsForm* inputs_;
  SweepBox* sweep_;
  OutcomeTable* outcome_;
  ForceCharts* charts_;
  Section *inputs_section_, *sweep_section_, *outcome_section_, *charts_section_;
  QScrollArea* scroll_;
  QWidget* live_;  // all that is of no use without a node
};

}  // namespace train_derail::rviz_panel
