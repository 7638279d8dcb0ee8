#include "rviz/run_box.hpp"

#include <algorithm>
#include <cmath>

#include <QHBoxLayout>
#include <QLineEdit>
#include <QVBoxLayout>

#include "rviz/look.hpp"

namespace train_derail::rviz_panel {

namespace {

constexpr const char* kFastest = "fastest";  // rate 0
/// Of a node that does not say how far apart its moments are [s].
constexpr double kIntervalDefault = 0.01;

QString rate_text(double rate) { return rate == 0.0 ? QString(kFastest) : QString::number(rate, 'g', 4); }

}  // namespace

RunBox::RunBox(QWidget* parent) : QWidget(parent), slider_interval_(kIntervalDefault) {
  make_column(this);
  add_state();
  add_buttons();
  add_slider();
}

void RunBox::add_state() {
  auto* line = new QHBoxLayout;
  state_ = new QLabel(this);
  state_->setObjectName("state");
  state_->setTextFormat(Qt::PlainText);
  QFont bold = state_->font();
  bold.setBold(true);
  state_->setFont(bold);
  time_ = new QLabel(this);
  time_->setObjectName("time");
  time_->setToolTip(tr("Simulated time, and simulated seconds per wall second that the node achieves."));
  line->addWidget(state_, 1);
  line->addWidget(time_);
  static_cast<QVBoxLayout*>(layout())->addLayout(line);
}

void RunBox::add_buttons() {
  const auto button = [&](const QString& text, const char* name, const QString& tip) {
    auto* b = new QPushButton(text, this);
    b->setObjectName(name);
    b->setToolTip(tip);
    b->setMinimumWidth(b->fontMetrics().horizontalAdvance(text) + 16);
    return b;
  };
  auto* line = new QHBoxLayout;
  line->setSpacing(4);
  run_ = button(tr("&Run again"), "run", "");  // the longest of its texts, for its width
  pause_ = button(tr("Pa&use"), "pause", tr("Stand still; cuts steps short."));
  step_ = button(tr("S&tep"), "step", tr("Advance a paused run by so many points of the output grid."));
  ticks_ = new QSpinBox(this);
  ticks_->setObjectName("ticks");
  ticks_->setRange(1, 100000);
  ticks_->setPrefix(QString::fromUtf8("\u00d7 "));
  ticks_->setToolTip(step_->toolTip());
  rate_ = new QComboBox(this);
  rate_->setObjectName("rate");
  rate_->setEditable(true);
  rate_->setInsertPolicy(QComboBox::NoInsert);
  rate_->addItems({"0.1", "0.25", "0.5", "1", "2", "5", "10", kFastest});
  rate_->setCurrentText(rate_text(1.0));
  rate_->setMinimumContentsLength(6);
  rate_->setSizeAdjustPolicy(QComboBox::AdjustToMinimumContentsLengthWithIcon);
  rate_->setFocusPolicy(Qt::StrongFocus);
  rate_->setToolTip(tr("Simulated seconds per wall second: 0.001 to 1000; 0 or \"%1\": as fast as the integrator goes.")
                        .arg(kFastest));
  auto* label = new QLabel(tr("R&ate"), this);
  label->setBuddy(rate_);
  for (QWidget* w : {static_cast<QWidget*>(run_), static_cast<QWidget*>(pause_), static_cast<QWidget*>(step_),
                     static_cast<QWidget*>(ticks_)}) {
    line->addWidget(w);
  }
  line->addStretch(1);
  line->addWidget(label);
  line->addWidget(rate_);
  static_cast<QVBoxLayout*>(layout())->addLayout(line);

  connect(run_, &QPushButton::clicked, this, &RunBox::run);
  connect(pause_, &QPushButton::clicked, this, &RunBox::pause);
  connect(step_, &QPushButton::clicked, this, &RunBox::step);
  connect(ticks_, QOverload<int>::of(&QSpinBox::valueChanged), this, &RunBox::ticks_changed);
  connect(rate_, QOverload<int>::of(&QComboBox::activated), this, &RunBox::read_rate);
  connect(rate_->lineEdit(), &QLineEdit::returnPressed, this, &RunBox::read_rate);
}

void RunBox::add_slider() {
  auto* line = new QHBoxLayout;
  line->setSpacing(4);
  auto* label = new QLabel(tr("Ti&me"), this);
  slider_ = new QSlider(Qt::Horizontal, this);
  slider_->setObjectName("time_slider");
  label->setBuddy(slider_);
  slider_range_ = new QLabel(this);
  slider_range_->setObjectName("time_range");
  slider_range_->setMinimumWidth(slider_range_->fontMetrics().horizontalAdvance("00.00 of 00.00 s"));
  line->addWidget(label);
  line->addWidget(slider_, 1);
  line->addWidget(slider_range_);
  static_cast<QVBoxLayout*>(layout())->addLayout(line);

  connect(slider_, &QSlider::valueChanged, this, [this](int moment) { Q_EMIT seek(slider_interval_ * moment); });
}

void RunBox::read_rate() {
  const QString text = rate_->currentText();
  bool is_number = true;
  const double rate = text.trimmed() == kFastest ? 0.0 : text.toDouble(&is_number);
  if (is_number) Q_EMIT rate_wanted(rate);
  else Q_EMIT not_a_rate(text);
}

void RunBox::show_node(const NodeView& view) {
  show_state(view);
  show_slider(view);
  enable_buttons(view);
}

void RunBox::show_rate(const NodeView& view) {
  if (view.run_info) rate_->setCurrentText(rate_text(view.run_info->rate));
}

void RunBox::show_state(const NodeView& view) {
  if (!view.run_info) {
    state_->setText(tr("No run"));
    set_text_color(state_, quiet_color());
    time_->clear();
    return;
  }
  const RunInfo& info = *view.run_info;
  QString state;
  QColor color = quiet_color();
  switch (info.state) {
    case RunInfo::PAUSED:
      state = view.pending.count("step") > 0 ? tr("stepping") : tr("paused");
      color = waiting_color();
      break;
    case RunInfo::RUNNING:
      state = tr("running");
      color = good_color();
      break;
    case RunInfo::ENDED: state = tr("ended"); break;
    case RunInfo::FAILED:
      state = tr("failed");
      color = error_color();
      break;
    default: state = tr("state %1").arg(info.state);
  }
  if (!info.message.empty()) state += ": " + QString::fromStdString(info.message);
  state_->setText(tr("Run %1 %2").arg(info.run_id).arg(state));
  state_->setToolTip("<p>" + QString::fromStdString(info.title).toHtmlEscaped() + "</p>");
  set_text_color(state_, color);
  const double time = view.train.run_id == info.run_id ? view.train.time : info.time;
  QString text = tr("%1 s").arg(time, 0, 'f', 2);
  if (info.state == RunInfo::RUNNING && (view.present || is_replay(view))) {
    text += view.achieved_rate ? tr(", rate %1").arg(*view.achieved_rate, 0, 'f', 2) : tr(", rate \u2026");
  }
  time_->setText(text);
  if (!rate_->hasFocus() && !rate_->lineEdit()->hasFocus() && view.pending.count("set_rate") == 0) show_rate(view);
}

/// The slider follows the moment that is shown, unless somebody moves it.
void RunBox::show_slider(const NodeView& view) {
  const bool offered = view.present && view.run_info && view.run_info->kept_until > 0.0;
  const bool stands = view.run_info && view.run_info->state != RunInfo::RUNNING && view.pending.count("step") == 0;
  const bool enabled = offered && (stands || plays_a_recording(view));
  slider_->setEnabled(enabled);
  slider_->setToolTip(enabled    ? tr("Shows the run as it was at that time. The run itself is not changed.")
                      : !offered ? tr("No states of this run are kept: it has none yet, or comes from a bag.")
                                 : tr("Pause the run to look back."));
  const bool known = view.run_info && view.train.run_id == view.run_info->run_id;
  if (!offered || !known) {
    slider_range_->clear();
    return;
  }
  const RunInfo& info = *view.run_info;
  const double time = view.train.time, end = std::max(info.kept_until, time);
  const QSignalBlocker quiet(slider_);
  slider_interval_ = info.interval > 0.0 ? info.interval : kIntervalDefault;
  slider_->setRange(0, static_cast<int>(std::lround(end / slider_interval_)));
  slider_->setPageStep(std::max(1, slider_->maximum() / 20));
  const bool moved_by_node = time != slider_time_ || info.run_id != slider_run_;
  if (moved_by_node && !slider_->isSliderDown() && view.pending.count("seek") == 0) {
    slider_time_ = time;
    slider_run_ = info.run_id;
    slider_->setValue(static_cast<int>(std::lround(time / slider_interval_)));
  }
  slider_range_->setText(tr("%1 of %2 s").arg(time, 0, 'f', 2).arg(end, 0, 'f', 2));
}

void RunBox::enable_buttons(const NodeView& view) {
  const auto pending = [&](const char* service) { return view.pending.count(service) > 0; };
  const int state = view.run_info ? view.run_info->state : -1;
  const bool stepping = pending("step"), ended = has_ended(view), recorded = plays_a_recording(view);
  const bool drivable = !is_replay(view);
  const auto set = [drivable](QWidget* widget, bool enabled) { enable(widget, enabled && drivable); };
  const QString over = state == RunInfo::FAILED ? tr("The run has failed: \"Run again\" begins a new one.")
                       : recorded               ? tr("The recording is over: \"Play again\" begins at its start.")
                                                : tr("The run has ended: \"Run again\" begins a new one.");
  run_->setText(!ended ? tr("&Run") : recorded ? tr("Play &again") : tr("&Run again"));
  run_->setToolTip(!ended     ? tr("Go on.")
                   : recorded ? tr("Play the recording from its start.")
                              : tr("Begin a new run with the inputs as they stand below."));
  set(run_, ended ? !pending("restart") : state == RunInfo::PAUSED && !stepping && !pending("resume"));
  pause_->setToolTip(ended ? over : tr("Stand still; cuts steps short."));
  set(pause_, (state == RunInfo::RUNNING || stepping) && !pending("pause"));
  step_->setToolTip(ended                       ? over
                    : state == RunInfo::RUNNING ? tr("Pause the run to step.")
                                                : tr("Advance a paused run by so many points of the output grid."));
  set(step_, state == RunInfo::PAUSED && !stepping);
  set(ticks_, true);
  set(rate_, true);
}

}  // namespace train_derail::rviz_panel
