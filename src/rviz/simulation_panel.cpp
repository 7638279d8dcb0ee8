#include "rviz/simulation_panel.hpp"

#include <QFrame>
#include <QHBoxLayout>
#include <QScrollBar>
#include <QVBoxLayout>
#include <pluginlib/class_list_macros.hpp>

#include "rviz/look.hpp"
#include "train_derail/ros/clock_watch.hpp"

namespace train_derail::rviz_panel {

namespace {

constexpr const char* kDefaultNode = "/train_derail";
constexpr int kRefreshMs = 100;
constexpr const char* kFastest = "fastest";  // rate 0

QString rate_text(double rate) { return rate == 0.0 ? QString(kFastest) : QString::number(rate, 'g', 4); }

QString capitalized(const std::string& text) {
  QString result = QString::fromStdString(text);
  return result.isEmpty() ? result : result.replace(0, 1, result[0].toUpper());
}

QString replay_reason(const NodeView& view) {
  return QObject::
      tr("A replay: %1 plays the topics of %2. It shows what was recorded and cannot be driven from here; the player's "
         "own keys are in its terminal: space to pause and go on, s to step.")
          .arg(QString::fromStdString(view.player), QString::fromStdString(view.node));
}

QVBoxLayout* make_column(QWidget* box) {
  auto* column = new QVBoxLayout(box);
  column->setContentsMargins(0, 0, 0, 0);
  column->setSpacing(3);
  return column;
}

QFrame* make_rule(QWidget* parent) {
  auto* rule = new QFrame(parent);
  rule->setFrameStyle(QFrame::HLine | QFrame::Sunken);
  return rule;
}

}  // namespace

SimulationPanel::SimulationPanel(QWidget* parent) : rviz::Panel(parent), link_(kDefaultNode) {
  auto* content = new QWidget(this);
  auto* column = new QVBoxLayout(content);
  column->setContentsMargins(4, 4, 4, 4);
  column->setSpacing(4);
  column->addWidget(make_node_row());
  presence_ = new QLabel(content);
  presence_->setObjectName("presence");
  presence_->setWordWrap(true);
  presence_->setTextFormat(Qt::PlainText);
  column->addWidget(presence_);

  live_ = new QWidget(content);
  outcome_ = new OutcomeTable(live_);
  charts_ = new ForceCharts(live_);
  auto* live = make_column(live_);
  live->addWidget(make_run_box());
  live->addWidget(make_rule(live_));
  live->addWidget(make_inputs_box());
  live->addWidget(make_rule(live_));
  live->addWidget(make_caption(tr("Outcome so far"), live_));
  live->addWidget(outcome_);
  live->addWidget(make_rule(live_));
  live->addWidget(charts_, 1);
  column->addWidget(live_, 1);

  scroll_ = new QScrollArea(this);
  scroll_->setWidget(content);
  scroll_->setWidgetResizable(true);
  scroll_->setFrameShape(QFrame::NoFrame);
  scroll_->setHorizontalScrollBarPolicy(Qt::ScrollBarAlwaysOff);
  make_column(this)->addWidget(scroll_);

  connect(&timer_, &QTimer::timeout, this, &SimulationPanel::refresh);
  timer_.start(kRefreshMs);
  refresh();
}

QWidget* SimulationPanel::make_node_row() {
  auto* row = new QWidget(this);
  auto* line = new QHBoxLayout(row);
  line->setContentsMargins(0, 0, 0, 0);
  auto* label = new QLabel(tr("&Node"), row);
  node_ = new QLineEdit(kDefaultNode, row);
  node_->setObjectName("node");
  node_->setToolTip(tr("Name of the simulation's node."));
  label->setBuddy(node_);
  line->addWidget(label);
  line->addWidget(node_, 1);
  connect(node_, &QLineEdit::editingFinished, this, [this] {
    if (!node_->isModified()) return;
    node_->setModified(false);
    link_.set_node(node_->text().trimmed().toStdString());
    refresh();
    Q_EMIT configChanged();
  });
  return row;
}

QWidget* SimulationPanel::make_run_box() {
  auto* box = new QWidget(this);
  auto* column = make_column(box);
  auto* first = new QHBoxLayout;
  state_ = new QLabel(box);
  state_->setObjectName("state");
  state_->setTextFormat(Qt::PlainText);
  QFont bold = state_->font();
  bold.setBold(true);
  state_->setFont(bold);
  time_ = new QLabel(box);
  time_->setObjectName("time");
  time_->setToolTip(tr("Simulated time, and simulated seconds per wall second that the node achieves."));
  first->addWidget(state_, 1);
  first->addWidget(time_);
  column->addLayout(first);

  const auto button = [&](const QString& text, const char* name, const QString& tip) {
    auto* b = new QPushButton(text, box);
    b->setObjectName(name);
    b->setToolTip(tip);
    b->setMinimumWidth(b->fontMetrics().horizontalAdvance(text) + 16);
    return b;
  };
  auto* second = new QHBoxLayout;
  second->setSpacing(4);
  run_ = button(tr("&Run"), "run", tr("Go on."));
  pause_ = button(tr("Pa&use"), "pause", tr("Stand still; cuts steps short."));
  step_ = button(tr("S&tep"), "step", tr("Advance a paused run by so many points of the output grid."));
  ticks_ = new QSpinBox(box);
  ticks_->setObjectName("ticks");
  ticks_->setRange(1, 100000);
  ticks_->setPrefix(QString::fromUtf8("\u00d7 "));
  ticks_->setToolTip(step_->toolTip());
  rate_ = new QComboBox(box);
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
  auto* rate_label = new QLabel(tr("R&ate"), box);
  rate_label->setBuddy(rate_);
  for (QWidget* w : {static_cast<QWidget*>(run_), static_cast<QWidget*>(pause_), static_cast<QWidget*>(step_),
                     static_cast<QWidget*>(ticks_)}) {
    second->addWidget(w);
  }
  second->addStretch(1);
  second->addWidget(rate_label);
  second->addWidget(rate_);
  column->addLayout(second);

  connect(run_, &QPushButton::clicked, this, [this] {
    link_.resume();
    refresh();
  });
  connect(pause_, &QPushButton::clicked, this, [this] {
    link_.pause();
    refresh();
  });
  connect(step_, &QPushButton::clicked, this, [this] {
    link_.step(static_cast<std::uint32_t>(ticks_->value()));
    refresh();
  });
  connect(ticks_, QOverload<int>::of(&QSpinBox::valueChanged), this, &SimulationPanel::configChanged);
  connect(rate_, QOverload<int>::of(&QComboBox::activated), this, [this](int) { set_rate(rate_->currentText()); });
  connect(rate_->lineEdit(), &QLineEdit::returnPressed, this, [this] { set_rate(rate_->currentText()); });
  return box;
}

QWidget* SimulationPanel::make_inputs_box() {
  auto* box = new QWidget(this);
  auto* column = make_column(box);
  column->addWidget(make_caption(tr("Inputs"), box));
  inputs_ = new InputsForm(box);
  column->addWidget(inputs_);
  auto* line = new QHBoxLayout;
  restart_ = new QPushButton(tr("R&estart"), box);
  restart_->setObjectName("restart");
  restart_->setToolTip(tr("Begin a new run with these inputs. Those in bold differ from the run that is under way."));
  revert_ = new QPushButton(tr("Re&vert"), box);
  revert_->setObjectName("revert");
  revert_->setToolTip(tr("Back to the inputs of the run that is under way."));
  start_paused_ = new QCheckBox(tr("start pause&d"), box);
  start_paused_->setObjectName("start_paused");
  line->addWidget(restart_);
  line->addWidget(start_paused_);
  line->addStretch(1);
  line->addWidget(revert_);
  column->addLayout(line);
  message_ = new QLabel(box);
  message_->setObjectName("message");
  message_->setTextFormat(Qt::PlainText);
  message_->setWordWrap(true);
  message_->setTextInteractionFlags(Qt::TextSelectableByMouse);
  message_->hide();
  column->addWidget(message_);

  connect(restart_, &QPushButton::clicked, this, &SimulationPanel::restart);
  connect(revert_, &QPushButton::clicked, inputs_, &InputsForm::revert);
  connect(inputs_, &InputsForm::changed, this, [this] { enable_buttons(link_.view()); });
  connect(inputs_, &InputsForm::edited, this, &SimulationPanel::configChanged);
  connect(start_paused_, &QCheckBox::toggled, this, &SimulationPanel::configChanged);
  return box;
}

void SimulationPanel::refresh() {
  const NodeView view = link_.view();
  show_presence(view);
  show_run(view);
  enable_buttons(view);
  if (view.inputs && view.inputs != inputs_seen_) {
    inputs_seen_ = view.inputs;
    const QString problem = inputs_->show_run(view.inputs->yaml);
    if (!problem.isEmpty()) show_message(problem, error_color());
  }
  if (view.answer.number != answer_seen_) {
    answer_seen_ = view.answer.number;
    show_answer(view.answer);
  }
  keep_width();
  if (!isVisible()) return;
  outcome_->show_outcome(view);
  charts_->show_forces(view.forces);
}

/// A window that is too low scrolls; one that is too narrow would clip.
void SimulationPanel::keep_width() {
  const QScrollBar* bar = scroll_->verticalScrollBar();
  const int width = scroll_->widget()->minimumSizeHint().width() + (bar->isVisible() ? bar->sizeHint().width() : 0);
  if (scroll_->minimumWidth() != width) scroll_->setMinimumWidth(width);
}

void SimulationPanel::show_presence(const NodeView& view) {
  const bool known = view.run_info && view.inputs;
  const QString node = QString::fromStdString(view.node);
  QString text;
  if (view.node.empty()) text = tr("Not a node's name: %1").arg(QString::fromStdString(view.name_error));
  else if (is_replay(view)) text = replay_reason(view);
  else if (!view.present) text = tr("No simulation at %1. Waiting for it.").arg(node);
  else if (!known) text = tr("%1 is there but has sent nothing yet.").arg(node);
  const bool rivals = !view.clock_publishers.empty();
  if (rivals) text += (text.isEmpty() ? "" : "\n") + capitalized(ros_face::rivals_text(view.clock_publishers)) + ".";
  presence_->setText(text);
  presence_->setVisible(!text.isEmpty());
  set_text_color(presence_, view.node.empty() || rivals ? error_color() : waiting_color());
  live_->setEnabled((view.present && known) || is_replay(view));
}

void SimulationPanel::show_run(const NodeView& view) {
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
  if (info.state == RunInfo::ENDED) state.replace('_', ' ');
  state_->setText(tr("Run %1 %2").arg(info.run_id).arg(state));
  state_->setToolTip("<p>" + QString::fromStdString(info.title).toHtmlEscaped() + "</p>");
  set_text_color(state_, color);
  const double time = view.train.run_id == info.run_id ? view.train.time : info.time;
  QString text = tr("%1 s").arg(time, 0, 'f', 2);
  if (info.state == RunInfo::RUNNING && (view.present || is_replay(view))) {
    text += view.achieved_rate ? tr(", rate %1").arg(*view.achieved_rate, 0, 'f', 2) : tr(", rate \u2026");
  }
  time_->setText(text);
  if (!rate_->hasFocus() && !rate_->lineEdit()->hasFocus() && view.pending.count("set_rate") == 0) {
    rate_->setCurrentText(rate_text(info.rate));
  }
}

void SimulationPanel::enable_buttons(const NodeView& view) {
  const auto pending = [&](const char* service) { return view.pending.count(service) > 0; };
  const int state = view.run_info ? view.run_info->state : -1;
  const bool stepping = pending("step");
  const bool drivable = !is_replay(view);
  const auto set = [drivable](QWidget* widget, bool enabled) {
    enabled = enabled && drivable;
    if (widget->isEnabledTo(widget->parentWidget()) != enabled) widget->setEnabled(enabled);
  };
  set(run_, state == RunInfo::PAUSED && !stepping && !pending("resume"));
  set(pause_, (state == RunInfo::RUNNING || stepping) && !pending("pause"));
  set(step_, state == RunInfo::PAUSED && !stepping);
  set(ticks_, true);
  set(rate_, true);
  set(inputs_, true);
  set(restart_, !pending("restart"));
  set(start_paused_, true);
  set(revert_, inputs_->differs());
}

void SimulationPanel::show_answer(const Answer& answer) {
  const QString text = QString::fromStdString(answer.message);
  if (answer.success) show_message(QString::fromStdString(answer.service) + ": " + text, quiet_color());
  else show_message(text, error_color());
}

void SimulationPanel::show_message(const QString& text, const QColor& color) {
  message_->setText(text);
  set_text_color(message_, color);
  message_->show();
}

void SimulationPanel::set_rate(const QString& text) {
  bool is_number = true;
  const double rate = text.trimmed() == kFastest ? 0.0 : text.toDouble(&is_number);
  if (is_number) link_.set_rate(rate);
  else show_message(tr("rate = '%1': not a number").arg(text), error_color());
}

void SimulationPanel::restart() {
  const std::vector<std::string> overrides = inputs_->overrides();
  if (const QString error = inputs_->error(); !error.isEmpty()) {
    show_message(error, error_color());
    return;
  }
  link_.restart(overrides, start_paused_->isChecked());
  refresh();
}

void SimulationPanel::load(const rviz::Config& config) {
  rviz::Panel::load(config);
  QString node;
  int ticks = 0;
  bool paused = false;
  if (config.mapGetString("Node", &node)) {
    node_->setText(node);
    link_.set_node(node.toStdString());
  }
  if (config.mapGetInt("Step Ticks", &ticks)) ticks_->setValue(ticks);
  if (config.mapGetBool("Start Paused", &paused)) start_paused_->setChecked(paused);
  std::map<std::string, std::string> texts;
  const rviz::Config inputs = config.mapGetChild("Inputs");
  for (auto it = inputs.mapIterator(); it.isValid(); it.advance()) {
    texts[it.currentKey().toStdString()] = it.currentChild().getValue().toString().toStdString();
  }
  QString others;
  if (config.mapGetString("Other Inputs", &others)) texts[""] = others.toStdString();
  inputs_->type(texts);
}

void SimulationPanel::save(rviz::Config config) const {
  rviz::Panel::save(config);
  config.mapSetValue("Node", node_->text());
  config.mapSetValue("Step Ticks", ticks_->value());
  config.mapSetValue("Start Paused", start_paused_->isChecked());
  rviz::Config inputs = config.mapMakeChild("Inputs");
  inputs.setType(rviz::Config::Map);
  for (const auto& [key, text] : inputs_->typed()) {
    if (key.empty()) config.mapSetValue("Other Inputs", QString::fromStdString(text));
    else inputs.mapSetValue(QString::fromStdString(key), QString::fromStdString(text));
  }
}

}  // namespace train_derail::rviz_panel

PLUGINLIB_EXPORT_CLASS(train_derail::rviz_panel::SimulationPanel, rviz::Panel)
