#pragma once

#include <cstdint>

#include <QComboBox>
#include <QLabel>
#include <QPushButton>
#include <QSlider>
#include <QSpinBox>
#include <QWidget>

#include "rviz/node_link.hpp"

namespace train_derail::rviz_panel {

/// How the run stands, and what drives it: run, pause, step, rate, a slider over what has been. It asks for things; it
/// does nothing itself.
class RunBox : public QWidget {
  Q_OBJECT

 public:
  explicit RunBox(QWidget* parent = nullptr);

  void show_node(const NodeView& view);
  /// The rate of the node again, whatever is typed.
  void show_rate(const NodeView& view);
  /// The slider goes back to the moment that is shown.
  void forget_slider() { slider_time_ = -1.0; }

  /// Points of the output grid in a step.
  int ticks() const { return ticks_->value(); }
  void set_ticks(int ticks) { ticks_->setValue(ticks); }

 Q_SIGNALS:
  void run();  // or go on, or play again
  void pause();
  void step();
  void seek(double time);  // simulated [s]
  void rate_wanted(double rate);
  void not_a_rate(const QString& text);
  void ticks_changed();

 private:
  void add_state();
  void add_buttons();
  void add_slider();
  void read_rate();
  void show_state(const NodeView& view);
  void show_slider(const NodeView& view);
  void enable_buttons(const NodeView& view);

  double slider_interval_, slider_time_ = -1.0;  // simulated [s]: per step of the slider; that it stands at
  std::uint32_t slider_run_ = 0;

  QLabel *state_, *time_, *slider_range_;
  QPushButton *run_, *pause_, *step_;
  QSlider* slider_;
  QSpinBox* ticks_;
  QComboBox* rate_;
};

}  // namespace train_derail::rviz_panel
