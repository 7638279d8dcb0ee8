#include "rviz/simulation_panel.hpp"

#include <exception>

#include <rviz/visualization_manager.h>
#include <rviz/window_manager_interface.h>
#include <QClipboard>
#include <QDateTime>
#include <QFrame>
#include <QGuiApplication>
#include <QHBoxLayout>
#include <QScreen>
#include <QScrollBar>
#include <QVBoxLayout>
#include <QWindow>
#include <pluginlib/class_list_macros.hpp>

#include "rviz/look.hpp"
#include "rviz/overlay_content.hpp"
#include "rviz/scenario_files.hpp"
#include "train_derail/ros/clock_watch.hpp"

namespace train_derail::rviz_panel {

namespace {

constexpr const char* kDefaultNode = "/train_derail";
constexpr int kRefreshMs = 100;
/// What a part must have to spare before it is unfolded by itself, so that it does not come and go [pixels].
constexpr int kSpare = 8;

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
  column->setSpacing(3);
  column->addWidget(make_node_row());
  presence_ = new QLabel(content);
  presence_->setObjectName("presence");
  presence_->setWordWrap(true);
  presence_->setTextFormat(Qt::PlainText);
  column->addWidget(presence_);

  live_ = new QWidget(content);
  auto* live = make_column(live_);
  live->addWidget(make_run_box());
  message_ = make_message("message", live_);
  live->addWidget(message_);
  inputs_section_ = add_section("inputs", tr("Inputs"), make_inputs_box());
  sweep_section_ = add_section("sweep", tr("Sweep over one input"), make_sweep_box());
  outcome_section_ = add_section("outcome", tr("Outcome so far"), make_outcome_box());
  outcome_section_->set_corner(all_outcomes_);
  charts_ = new ForceCharts(live_);
  charts_section_ = add_section("charts", tr("Forces"), charts_);
  live->addStretch(1);
  sweep_section_->set_open(false);
  charts_section_->set_open(false);
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

QSize SimulationPanel::sizeHint() const { return {scroll_->minimumWidth(), rviz::Panel::sizeHint().height()}; }

void SimulationPanel::onInitialize() { views_->set_view_manager(vis_manager_->getViewManager()); }

Section* SimulationPanel::add_section(const char* name, const QString& caption, QWidget* content) {
  auto* section = new Section(name, caption, live_);
  section->set_content(content);
  live_->layout()->addWidget(make_rule(live_));
  live_->layout()->addWidget(section);
  connect(section, &Section::clicked, this, [this, section] {
    if (section == charts_section_) charts_wanted_ = section->is_open();
    fit();
    Q_EMIT configChanged();
  });
  return section;
}

QWidget* SimulationPanel::make_node_row() {
  auto* row = new QWidget(this);
  auto* line = new QHBoxLayout(row);
  line->setContentsMargins(0, 0, 0, 0);
  views_ = new ViewButtons(row);
  auto* label = new QLabel(tr("&Node"), row);
  node_ = new QLineEdit(kDefaultNode, row);
  node_->setObjectName("node");
  node_->setMinimumWidth(node_->fontMetrics().horizontalAdvance("train_derail 0"));
  node_->setToolTip(tr("Name of the simulation's node."));
  label->setBuddy(node_);
  line->addWidget(views_);
  line->addStretch(1);
  line->addWidget(label);
  line->addWidget(node_, 2);
  connect(views_, &ViewButtons::colours_wanted, this, [this](scene::Colours wanted) { link_.set_colours(wanted); });
  connect(node_, &QLineEdit::editingFinished, this, [this] {
    if (!node_->isModified()) return;
    node_->setModified(false);
    set_node(node_->text());
    refresh();
    Q_EMIT configChanged();
  });
  return row;
}

RunBox* SimulationPanel::make_run_box() {
  run_box_ = new RunBox(live_);
  connect(run_box_, &RunBox::run, this, &SimulationPanel::run);
  connect(run_box_, &RunBox::pause, this, [this] {
    link_.pause();
    refresh();
  });
  connect(run_box_, &RunBox::step, this, [this] {
    link_.step(static_cast<std::uint32_t>(run_box_->ticks()));
    refresh();
  });
  connect(run_box_, &RunBox::seek, this, [this](double time) { link_.seek(time); });
  connect(run_box_, &RunBox::rate_wanted, this, [this](double rate) {
    clear_message(Cause::rate);
    link_.set_rate(rate);
  });
  connect(run_box_, &RunBox::not_a_rate, this, [this](const QString& text) {
    show_message(tr("rate = '%1': not a number").arg(text), error_color(), Cause::rate);
    run_box_->show_rate(link_.view());
  });
  connect(run_box_, &RunBox::ticks_changed, this, &SimulationPanel::configChanged);
  return run_box_;
}

QWidget* SimulationPanel::make_inputs_box() {
  auto* box = new QWidget(live_);
  auto* column = make_column(box);
  scenario_ = new ScenarioChooser(box);
  column->addWidget(scenario_);
  inputs_ = new InputsForm(box);
  column->addWidget(inputs_);
  auto* line = new QHBoxLayout;
  restart_ = new QPushButton(tr("R&estart"), box);
  restart_->setObjectName("restart");
  revert_ = new QPushButton(tr("Re&vert"), box);
  revert_->setObjectName("revert");
  revert_->setToolTip(tr("Back to the inputs of the run that is under way."));
  start_paused_ = new QCheckBox(tr("start pause&d"), box);
  start_paused_->setObjectName("start_paused");
  copy_ = new QPushButton(tr("Cop&y command"), box);
  copy_->setObjectName("copy_command");
  copy_->setToolTip(tr("Puts the command that repeats the run under way in a terminal onto the clipboard."));
  line->addWidget(restart_);
  line->addWidget(start_paused_);
  line->addStretch(1);
  line->addWidget(copy_);
  line->addWidget(revert_);
  column->addLayout(line);

  connect(scenario_, &ScenarioChooser::chosen, this, &SimulationPanel::load_scenario);
  connect(restart_, &QPushButton::clicked, this, &SimulationPanel::restart);
  connect(copy_, &QPushButton::clicked, this, &SimulationPanel::copy_command);
  connect(revert_, &QPushButton::clicked, this, [this] {
    inputs_->revert();
    clear_message(Cause::inputs);
  });
  connect(inputs_, &InputsForm::changed, this, [this] {
    if (refused_locally_ && inputs_->error().isEmpty()) clear_message(Cause::inputs);
    enable_buttons(link_.view());
  });
  connect(inputs_, &InputsForm::edited, this, [this] {
    if (!refused_locally_) clear_message(Cause::inputs);  // what the node has refused is no longer what stands there
    Q_EMIT configChanged();
  });
  connect(inputs_, &InputsForm::submitted, this, &SimulationPanel::restart);
  connect(start_paused_, &QCheckBox::toggled, this, &SimulationPanel::configChanged);
  return box;
}

QWidget* SimulationPanel::make_sweep_box() {
  sweep_ = new SweepBox(live_);
  connect(sweep_, &SweepBox::start, this, &SimulationPanel::start_sweep);
  connect(sweep_, &SweepBox::cancel, this, [this] { study_.cancel(); });
  return sweep_;
}

QWidget* SimulationPanel::make_outcome_box() {
  outcome_ = new OutcomeTable(live_);
  all_outcomes_ = new QToolButton(live_);
  all_outcomes_->setObjectName("all_outcomes");
  all_outcomes_->setAutoRaise(true);
  connect(all_outcomes_, &QToolButton::clicked, this, [this] {
    all_outcomes_wanted_ = !outcome_->is_full();
    fit();
    Q_EMIT configChanged();
  });
  return outcome_;
}

void SimulationPanel::refresh() {
  const NodeView view = link_.view();
  fit_window();
  show_presence(view);
  run_box_->show_node(view);
  if (view.inputs && view.inputs != inputs_seen_) {
    inputs_seen_ = view.inputs;
    const QString problem = inputs_->show_run(view.inputs->yaml);
    if (!problem.isEmpty()) show_message(problem, error_color(), Cause::run);
    else clear_message(Cause::run);
    scenario_->show_title(QString::fromStdString(view.inputs->title));
    sweep_->show_scenario(inputs_->of_run());
  }
  enable_buttons(view);
  if (view.answer.number != answer_seen_) {
    answer_seen_ = view.answer.number;
    show_answer(view.answer);
  }
  views_->set_cars(view.run_info ? static_cast<int>(view.run_info->cars) : 0);
  if (view.pending.count("set_colours") == 0)
    views_->show_colours(view.run_info && view.present ? std::optional(colours_of(view)) : std::nullopt);
  keep_width();
  if (!isVisible()) return;
  sweep_->show_study(study_.view());
  outcome_->show_outcome(view);
  charts_->show_forces(view.forces);
  fit();
}

/// A window that is too low scrolls; one that is too narrow would clip. The bar's place is kept whether it is there or
/// not: it comes in between two looks.
void SimulationPanel::keep_width() {
  const int width = scroll_->widget()->minimumSizeHint().width() + scroll_->verticalScrollBar()->sizeHint().width();
  if (scroll_->minimumWidth() != width) scroll_->setMinimumWidth(width);
}

/// Unfolds the charts and all of the outcome where there is room for them, unless the user has said what he wants.
void SimulationPanel::fit() {
  QWidget* const content = scroll_->widget();
  const QLayout* const layout = content->layout();
  const int width = scroll_->viewport()->width();
  int need = layout->hasHeightForWidth() ? layout->minimumHeightForWidth(width) : layout->minimumSize().height();
  const int charts_height = charts_->minimumSizeHint().height();
  const int rest_height = outcome_section_->is_open() ? outcome_->height_of_rest() : 0;
  if (charts_section_->is_open()) need -= charts_height;
  if (outcome_->is_full()) need -= rest_height;
  int room = scroll_->viewport()->height() - need;
  const auto fits = [&room](int height, bool is_there) { return height + (is_there ? 0 : kSpare) <= room; };
  const bool charts = charts_wanted_.value_or(fits(charts_height, charts_section_->is_open()));
  if (charts) room -= charts_height;
  const bool full = all_outcomes_wanted_.value_or(fits(rest_height, outcome_->is_full()));
  if (charts != charts_section_->is_open()) {
    charts_section_->set_open(charts);
    constexpr int kAll = 100;  // against the space below them
    static_cast<QVBoxLayout*>(live_->layout())->setStretchFactor(charts_section_, charts ? kAll : 0);
  }
  outcome_->set_full(full);
  all_outcomes_->setText(full ? tr("show less") : tr("show all"));
}

/// Once, when the window is there.
void SimulationPanel::fit_window() {
  if (!fit_window_ || window_fitted_ || vis_manager_ == nullptr) return;
  auto* const manager = vis_manager_->getWindowManager();
  QWidget* const window = manager != nullptr ? manager->getParentWindow() : nullptr;
  if (window == nullptr || !window->isVisible() || window->windowHandle() == nullptr) return;
  window_fitted_ = true;
  const QRect room = window->windowHandle()->screen()->availableGeometry();
  const QMargins border = window->windowHandle()->frameMargins();
  window->setGeometry(room.marginsRemoved(border));
}

void SimulationPanel::show_presence(const NodeView& view) {
  const bool known = view.run_info && view.inputs;
  const QString node = QString::fromStdString(view.node);
  QString text;
  if (view.node.empty()) text = tr("Not a node's name: %1").arg(QString::fromStdString(view.name_error));
  else if (is_replay(view)) text = replay_reason(view);
  else if (view.present && known && plays_a_recording(view))
    text = tr("A recorded run: it can be run, paused and looked at again at any time; its inputs cannot be changed.");
  else if (!view.present) text = tr("No simulation at %1. Waiting for it.").arg(node);
  else if (!known) text = tr("%1 is there but has sent nothing yet.").arg(node);
  const bool rivals = !view.clock_publishers.empty();
  if (rivals) text += (text.isEmpty() ? "" : "\n") + capitalized(ros_face::rivals_text(view.clock_publishers)) + ".";
  presence_->setText(text);
  presence_->setVisible(!text.isEmpty());
  set_text_color(presence_, view.node.empty() || rivals ? error_color() : waiting_color());
  live_->setEnabled((view.present && known) || is_replay(view));
}

void SimulationPanel::enable_buttons(const NodeView& view) {
  const auto pending = [&](const char* service) { return view.pending.count(service) > 0; };
  const bool recorded = plays_a_recording(view);
  const bool drivable = !is_replay(view), changeable = drivable && !recorded;
  const auto set = [drivable](QWidget* widget, bool enabled) { enable(widget, enabled && drivable); };
  const QString read_only = tr("A recorded run has the inputs that it has.");
  set(inputs_, changeable);
  set(scenario_, changeable && !pending("restart"));
  set(restart_, changeable && !pending("restart"));
  restart_->setToolTip(
      recorded
          ? read_only
          : tr("Begin a new run with these inputs; Enter in a field does the same. Those in bold differ from the run "
               "that is under way."));
  set(start_paused_, changeable);
  set(revert_, changeable && inputs_->differs());
  copy_->setEnabled(view.inputs != nullptr);
  set(sweep_, view.present);
}

void SimulationPanel::show_answer(const Answer& answer) {
  const QString text = QString::fromStdString(answer.message);
  const Cause cause = answer.service == "restart"    ? Cause::inputs
                      : answer.service == "set_rate" ? Cause::rate
                                                     : Cause::run;
  if (answer.success) {
    show_message(QString::fromStdString(answer.service) + ": " + text, quiet_color(), cause);
  } else {
    show_message(text, error_color(), cause);
    if (answer.service == "seek") run_box_->forget_slider();
    if (answer.service == "set_rate") run_box_->show_rate(link_.view());
  }
}

void SimulationPanel::show_message(const QString& text, const QColor& color, Cause cause) {
  message_->setText(text);
  set_text_color(message_, color);
  message_->show();
  cause_ = cause;
  refused_locally_ = false;
}

void SimulationPanel::clear_message(Cause cause) {
  if (cause_ != cause) return;
  message_->clear();
  message_->hide();
}

void SimulationPanel::set_node(const QString& name) {
  link_.set_node(name.trimmed().toStdString());
  views_->set_node(name.trimmed());
}

void SimulationPanel::run() {
  const NodeView view = link_.view();
  if (!has_ended(view)) {
    link_.resume();
  } else if (plays_a_recording(view)) {
    link_.seek(0.0);
    link_.resume();  // after it
  } else {
    restart();
  }
  refresh();
}

void SimulationPanel::restart() {
  if (!restart_->isEnabled()) return;
  const std::vector<std::string> overrides = inputs_->overrides();
  if (const QString error = inputs_->error(); !error.isEmpty()) {
    show_message(error, error_color(), Cause::inputs);
    refused_locally_ = true;
    return;
  }
  link_.restart(overrides, start_paused_->isChecked());
  refresh();
}

void SimulationPanel::load_scenario(const QString& path) {
  std::string yaml;
  try {
    yaml = whole_scenario(path.toStdString());
  } catch (const std::exception& e) {
    show_message(e.what(), error_color(), Cause::inputs);
    return;
  }
  inputs_->revert();
  link_.restart({}, start_paused_->isChecked(), yaml);
  scenario_->remember(path);
  refresh();
  Q_EMIT configChanged();
}

void SimulationPanel::copy_command() {
  const NodeView view = link_.view();
  if (!view.inputs) return;
  std::vector<std::string> files;
  for (const QString& path : scenario_->recent()) files.push_back(path.toStdString());
  if (!view.scenario_file.empty()) files.push_back(view.scenario_file);
  try {
    QGuiApplication::clipboard()->setText(QString::fromStdString(command_line(view.inputs->yaml, files)));
    show_message(tr("The command that repeats run %1 is on the clipboard.").arg(view.inputs->run_id), quiet_color(),
                 Cause::run);
  } catch (const std::exception& e) {
    show_message(e.what(), error_color(), Cause::run);
  }
}

void SimulationPanel::start_sweep() {
  if (study_.view().under_way()) return;
  try {
    const std::string text = sweep_->study(inputs_->scenario());
    // The node refuses a folder that holds results.
    const QString folder = "panel_sweep_" + QDateTime::currentDateTime().toString("yyyy-MM-dd_HH-mm-ss-zzz");
    study_.start(link_.view().node, text, folder.toStdString());
    clear_message(Cause::sweep);
  } catch (const std::exception& e) {
    show_message(e.what(), error_color(), Cause::sweep);
  }
  refresh();
}

void SimulationPanel::load(const rviz::Config& config) {
  rviz::Panel::load(config);
  QString node;
  int ticks = 0;
  bool paused = false;
  if (config.mapGetString("Node", &node)) {
    node_->setText(node);
    set_node(node);
  }
  if (config.mapGetInt("Step Ticks", &ticks)) run_box_->set_ticks(ticks);
  if (config.mapGetBool("Start Paused", &paused)) start_paused_->setChecked(paused);
  config.mapGetBool("Fit Window To Screen", &fit_window_);
  const rviz::Config sections = config.mapGetChild("Sections");
  bool open = false;
  for (const auto& [name, section] : remembered_sections()) {
    if (sections.mapGetBool(name, &open)) section->set_open(open);
  }
  if (sections.mapGetBool("Forces", &open)) charts_wanted_ = open;
  if (sections.mapGetBool("All Outcomes", &open)) all_outcomes_wanted_ = open;
  QStringList recent;
  const rviz::Config files = config.mapGetChild("Recent Scenarios");
  for (int i = 0; i < files.listLength(); ++i) recent << files.listChildAt(i).getValue().toString();
  scenario_->set_recent(recent);
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
  config.mapSetValue("Step Ticks", run_box_->ticks());
  config.mapSetValue("Start Paused", start_paused_->isChecked());
  config.mapSetValue("Fit Window To Screen", fit_window_);
  rviz::Config sections = config.mapMakeChild("Sections");
  for (const auto& [name, section] : remembered_sections()) sections.mapSetValue(name, section->is_open());
  if (charts_wanted_) sections.mapSetValue("Forces", *charts_wanted_);
  if (all_outcomes_wanted_) sections.mapSetValue("All Outcomes", *all_outcomes_wanted_);
  rviz::Config files = config.mapMakeChild("Recent Scenarios");
  files.setType(rviz::Config::List);
  for (const QString& path : scenario_->recent()) files.listAppendNew().setValue(path);
  rviz::Config inputs = config.mapMakeChild("Inputs");
  inputs.setType(rviz::Config::Map);
  for (const auto& [key, text] : inputs_->typed()) {
    if (key.empty()) config.mapSetValue("Other Inputs", QString::fromStdString(text));
    else inputs.mapSetValue(QString::fromStdString(key), QString::fromStdString(text));
  }
}

}  // namespace train_derail::rviz_panel

PLUGINLIB_EXPORT_CLASS(train_derail::rviz_panel::SimulationPanel, rviz::Panel)
