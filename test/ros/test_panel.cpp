// The panel inside RViz on a virtual display, clicked and typed at, with a real node that comes, goes and freezes.
#include <atomic>
#include <clocale>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <mutex>
#include <thread>

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <rviz/panel.h>
#include <rviz/visualization_frame.h>
#include <rviz/visualization_manager.h>
#include <yaml-cpp/yaml.h>
#include <QAbstractItemView>
#include <QApplication>
#include <QCheckBox>
#include <QClipboard>
#include <QComboBox>
#include <QDir>
#include <QElapsedTimer>
#include <QFileDialog>
#include <QLabel>
#include <QLineEdit>
#include <QPlainTextEdit>
#include <QPushButton>
#include <QScreen>
#include <QScrollArea>
#include <QScrollBar>
#include <QSlider>
#include <QSpinBox>
#include <QTemporaryDir>
#include <QTest>
#include <QTimer>
#include <QToolButton>
#include <QWindow>

#include "child_process.hpp"
#include "node_client.hpp"
#include "rviz/qt_charts.hpp"
#include "train_derail/GetInputs.h"
#include "train_derail/Inputs.h"
#include "train_derail/Seek.h"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/ros/message_fields.hpp"

namespace train_derail::test {
namespace {

constexpr double kMph = inputs::kMph;
constexpr const char* kNode = "/train_derail";

/// Lets RViz go on until `condition` holds; false after `limit` seconds of wall time.
bool wait_in_rviz(const std::function<bool()>& condition, double limit = 150.0) {
  QElapsedTimer elapsed;
  elapsed.start();
  QTimer wake;  // so that the loop turns even if nothing happens
  wake.start(20);
  while (!condition()) {
    if (static_cast<double>(elapsed.elapsed()) > 1000.0 * limit) return false;
    QApplication::processEvents(QEventLoop::WaitForMoreEvents);
  }
  return true;
}

void write_config(const std::string& path, const std::string& panel) {
  std::ofstream(path) << "Panels:\n"
                         "  - Class: train_derail/SimulationPanel\n"
                         "    Name: Simulation\n"
                      << panel
                      << "Preferences:\n"
                         "  PromptSaveOnExit: true\n"
                         "Visualization Manager:\n"
                         "  Displays:\n"
                         "    - Class: rviz/Grid\n"
                         "      Name: Grid\n"
                         "  Global Options:\n"
                         "    Fixed Frame: map\n"
                         "Window Geometry:\n"
                         "  Height: 880\n"
                         "  Width: 1500\n";
}

class Panel : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(folder.isValid());
    open_rviz("");
  }
  void TearDown() override { close_panel(); }

  std::string file(const std::string& name) const { return (folder.path() + "/").toStdString() + name; }

  /// RViz can be made but once in a process: a new configuration makes new panels.
  void open_rviz(const std::string& panel) {
    write_config(file("panel.rviz"), panel);
    if (frame == nullptr) {
      frame = new rviz::VisualizationFrame;
      frame->setApp(qApp);
      frame->setSplashPath("");
      frame->initialize(QString::fromStdString(file("panel.rviz")));
      frame->show();
    } else {
      frame->loadDisplayConfigHelper(file("panel.rviz"), true);
    }
    ASSERT_TRUE(wait_in_rviz([&] { return frame->isVisible() && frame->findChild<QLineEdit*>("node") != nullptr; }))
        << "RViz has not loaded the panel";
    ASSERT_TRUE(wait_in_rviz([&] { return !label("presence")->text().isEmpty(); }));
  }
  void close_panel() {
    std::ofstream(file("empty.rviz")) << "Panels: []\nVisualization Manager:\n  Displays: []\n";
    frame->loadDisplayConfigHelper(file("empty.rviz"), true);
    ASSERT_EQ(frame->findChild<QLineEdit*>("node"), nullptr);
  }

  void start_node(const std::string& name = "train_derail") {
    node_process.reset();
    node_process = std::make_unique<ChildProcess>(std::vector<std::string>{TRAIN_DERAIL_NODE, "__name:=" + name});
  }
  /// A node whose inputs are shown.
  void start_node_and_wait() {
    start_node();
    ASSERT_TRUE(wait_in_rviz([&] { return usable() && !edit("input:initial.speed")->text().isEmpty(); })) << presence();
  }

  template <class Widget>
  Widget* find(const char* name) const {
    auto* widget = frame->findChild<Widget*>(name);
    if (widget == nullptr) throw std::runtime_error(std::string("no widget ") + name);
    return widget;
  }
  QLineEdit* edit(const char* name) const { return find<QLineEdit>(name); }
  QPushButton* button(const char* name) const { return find<QPushButton>(name); }
  QLabel* label(const char* name) const { return find<QLabel>(name); }

  bool usable() const { return button("restart")->isEnabled(); }
  std::string presence() const { return label("presence")->text().toStdString(); }
  std::string state() const { return label("state")->text().toStdString(); }
  std::string message() const { return label("message")->text().toStdString(); }
  bool message_is_red() const {
    const QColor color = label("message")->palette().color(QPalette::WindowText);
    return color.red() > 150 && color.green() < 80 && color.blue() < 80;
  }
  bool is_wrong(const char* name) const {
    return edit(name)->palette().color(QPalette::Base) != QApplication::palette().color(QPalette::Base);
  }
  bool differs(const char* name) const {
    for (const QLabel* l : frame->findChildren<QLabel*>()) {
      if (l->buddy() == edit(name)) return l->font().bold();
    }
    return false;
  }

  void type(const char* name, const char* text) const {
    QLineEdit* e = edit(name);
    QTest::mouseClick(e, Qt::LeftButton);
    QTest::keyClick(e, Qt::Key_A, Qt::ControlModifier);
    if (*text == '\0') QTest::keyClick(e, Qt::Key_Delete);
    QTest::keyClicks(e, text);
  }
  void click(const char* name) const {
    ASSERT_TRUE(wait_in_rviz([&] { return button(name)->isEnabled(); })) << name << " stays greyed out";
    QTest::mouseClick(button(name), Qt::LeftButton);
  }
  bool wait_for_state(const std::string& text) const {
    return wait_in_rviz([&] { return state().find(text) != std::string::npos; });
  }
  /// The longest time for which RViz has not served its event loop until `condition` held [s].
  double longest_stall(const std::function<bool()>& condition) const {
    QElapsedTimer since;
    qint64 longest = 0;
    QTimer beat;
    QObject::connect(&beat, &QTimer::timeout, [&] { longest = std::max(longest, since.restart()); });
    since.start();
    beat.start(10);
    EXPECT_TRUE(wait_in_rviz(condition));
    return 0.001 * static_cast<double>(longest);
  }

  QTemporaryDir folder;
  std::unique_ptr<ChildProcess> node_process;
  static inline rviz::VisualizationFrame* frame = nullptr;
  // Served by RViz, which spins the global queue.
  Record<Inputs> inputs{"/train_derail/inputs"};
  Record<CarStates> cars{"/train_derail/cars"};
  Record<RunInfo> run_info{"/train_derail/run_info"};
};

TEST_F(Panel, WithoutANodeItIsGreyAndSaysSo) {
  ASSERT_TRUE(wait_in_rviz([&] { return presence() == "No simulation at /train_derail. Waiting for it."; }))
      << presence();
  for (const char* name : {"run", "pause", "step", "restart", "revert"})
    EXPECT_FALSE(button(name)->isEnabled()) << name;
  EXPECT_FALSE(edit("input:initial.speed")->isEnabled());
  EXPECT_TRUE(edit("node")->isEnabled());
}

TEST_F(Panel, ShowsTheInputsOfTheRunWithUnitsRangesAndMeanings) {
  start_node_and_wait();
  EXPECT_FALSE(label("presence")->isVisible());
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  EXPECT_EQ(edit("input:initial.yaw_rate")->text(), "0.2 rad/s");
  EXPECT_EQ(edit("input:consist[0].count")->text(), "12");
  EXPECT_EQ(edit("input:consist[0].weight")->text(), "150 kip");
  EXPECT_EQ(find<QComboBox>("input:ground.on_track_law")->currentText(), "isotropic");
  EXPECT_EQ(find<QComboBox>("input:ground.on_track_law")->count(), 4);
  const QString tip = edit("input:initial.speed")->toolTip();
  for (const char* part : {"initial.speed", "forward along the track", "mph", "Allowed: [0, "}) {
    EXPECT_TRUE(tip.contains(part)) << tip.toStdString() << " lacks " << part;
  }
  EXPECT_TRUE(wait_for_state("Run 1 paused")) << state();
}

TEST_F(Panel, RestartsWithAnotherSpeed) {
  start_node_and_wait();
  type("input:initial.speed", "50 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return differs("input:initial.speed"); }));
  find<QCheckBox>("start_paused")->setChecked(true);
  click("restart");
  ASSERT_TRUE(wait_in_rviz(
      [&] { return !inputs.empty() && inputs.last().run_id == 2 && !cars.empty() && cars.last().run_id == 2; }));
  EXPECT_DOUBLE_EQ(inputs.last().speed, 50 * kMph);
  ASSERT_EQ(cars.last().time, 0.0);
  for (const CarState& car : cars.last().cars) EXPECT_DOUBLE_EQ(car.twist.linear.x, 50 * kMph);
  EXPECT_TRUE(wait_in_rviz([&] {
    return !differs("input:initial.speed") && message() == "restart: run 2 waits, paused";
  })) << message();
  EXPECT_FALSE(message_is_red());
  EXPECT_EQ(edit("input:initial.speed")->text(), "50 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:speed")->text() == "50.0 mph"; }));
}

TEST_F(Panel, RestartsWithAllOfItsInputs) {
  start_node_and_wait();
  type("input:initial.speed", "20");
  type("input:initial.yaw_rate", "-0.1");
  type("input:consist[0].count", "9");
  type("input:consist[0].weight", "100000 lbf");
  type("input:ground.on_track_friction", "0.1");
  type("input:ground.off_track_friction", "0.6");
  type("input:coupler.slack", "2 inch");
  auto* law = find<QComboBox>("input:ground.on_track_law");
  law->setFocus();
  QTest::keyClicks(law, "guided");
  type("input:", "solver.method=bdf; initial.perturbation.seed = 7");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  const Inputs& now = inputs.last();
  EXPECT_DOUBLE_EQ(now.speed, 20 * kMph) << "a bare number is in the unit that is shown";
  EXPECT_EQ(now.yaw_rate, -0.1);
  EXPECT_EQ(now.cars, 9U);
  EXPECT_EQ(now.on_track_friction, 0.1);
  EXPECT_EQ(now.off_track_friction, 0.6);
  EXPECT_NEAR(now.coupler_slack, 0.0508, 1e-12);
  EXPECT_EQ(now.on_track_law, "guided");
  EXPECT_EQ(now.method, "bdf");
  EXPECT_EQ(now.model, "paper");
  EXPECT_EQ(now.seed, 7);
  EXPECT_NE(now.yaml.find("weight: 4448"), std::string::npos) << now.yaml;
  EXPECT_TRUE(wait_for_state("Run 2 running")) << state();
}

TEST_F(Panel, InputsOutOfRangeAreMarkedAndNotSent) {
  start_node_and_wait();
  type("input:initial.speed", "-5 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return is_wrong("input:initial.speed"); }));
  click("restart");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("initial.speed") != std::string::npos; })) << message();
  EXPECT_TRUE(message_is_red());
  EXPECT_NE(message().find("allowed: [0, 200] m/s"), std::string::npos) << message();
  EXPECT_TRUE(edit("input:initial.speed")->toolTip().contains("out of range"));
  click("revert");
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  EXPECT_FALSE(is_wrong("input:initial.speed"));
  EXPECT_FALSE(differs("input:initial.speed"));
  EXPECT_EQ(run_info.last().run_id, 1U);
}

TEST_F(Panel, ARefusedRestartShowsTheServicesWordsInRed) {
  start_node_and_wait();
  const Restart::Response refusal = NodeClient(kNode).restart({"coupler.slack=9 ft", "no.such_key=1"});
  ASSERT_FALSE(refusal.success);
  type("input:", "coupler.slack=9 ft; no.such_key=1");
  click("restart");
  EXPECT_TRUE(wait_in_rviz([&] { return message() == refusal.message; }))
      << message() << " instead of " << refusal.message;
  EXPECT_TRUE(message_is_red());
  EXPECT_TRUE(label("message")->isVisible());
  EXPECT_EQ(run_info.last().run_id, 1U);
}

TEST_F(Panel, RunsPausesStepsAndSetsTheRate) {
  start_node_and_wait();
  ASSERT_TRUE(wait_for_state("paused"));
  EXPECT_FALSE(button("pause")->isEnabled());
  find<QSpinBox>("ticks")->setValue(3);
  click("step");
  ASSERT_TRUE(wait_in_rviz([&] { return !cars.empty() && std::abs(cars.last().time - 0.06) < 1e-9; }));
  EXPECT_TRUE(wait_in_rviz([&] { return label("time")->text() == "0.06 s"; })) << label("time")->text().toStdString();

  auto* rate = find<QComboBox>("rate");
  rate->setFocus();
  rate->lineEdit()->selectAll();
  QTest::keyClicks(rate, "0.01\r");
  ASSERT_TRUE(wait_in_rviz([&] { return !run_info.empty() && run_info.last().rate == 0.01; }));
  click("run");
  ASSERT_TRUE(wait_for_state("running"));
  EXPECT_FALSE(button("run")->isEnabled());
  EXPECT_FALSE(button("step")->isEnabled());
  EXPECT_TRUE(wait_in_rviz([&] { return label("time")->text().contains("rate 0.01"); }))
      << label("time")->text().toStdString();
  click("pause");
  ASSERT_TRUE(wait_for_state("paused"));

  rate->lineEdit()->selectAll();
  QTest::keyClicks(rate, "-1\r");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("0.001 to 1000") != std::string::npos; })) << message();
  EXPECT_TRUE(message_is_red());
  edit("node")->setFocus();
  EXPECT_TRUE(wait_in_rviz([&] { return rate->currentText() == "0.01"; })) << "what was refused does not stay";
}

TEST_F(Panel, ColoursByPostureOnDemand) {
  auto* posture = find<QToolButton>("colours:posture");
  EXPECT_FALSE(posture->isEnabled());
  start_node_and_wait();
  EXPECT_TRUE(wait_in_rviz([&] { return posture->isEnabled() && !posture->isChecked(); }));
  Record<RunInfo> run_info("/train_derail/run_info");
  for (const char* wanted : {"posture", "cause"}) {
    posture->click();
    EXPECT_TRUE(wait_in_rviz([&] { return !run_info.empty() && run_info.last().colours == wanted; })) << wanted;
    EXPECT_TRUE(wait_in_rviz([&] { return posture->isChecked() == (run_info.last().colours == "posture"); }));
  }
}

TEST_F(Panel, FollowsARunToItsEnd) {
  start_node_and_wait();
  ASSERT_TRUE(NodeClient(kNode).set_rate(0.0).success);
  click("run");
  ASSERT_TRUE(wait_for_state("Run 1 ended: time limit reached")) << state();
  Record<Outcome> outcome("/train_derail/outcome");
  ASSERT_TRUE(wait_in_rviz([&] { return !outcome.empty() && outcome.last().ended == Outcome::TIME_MAX; }));
  const Outcome& o = outcome.last();
  const auto text = [&](const char* name) { return label(name)->text().toStdString(); };
  EXPECT_TRUE(wait_in_rviz([&] {
    return text("outcome:coupler_buff_peak") ==
           QString("%1 kip").arg(o.coupler_buff_peak / inputs::kKip, 0, 'f', 0).toStdString();
  })) << text("outcome:coupler_buff_peak");
  const std::string coupler = std::to_string(o.coupler_buff_peak_coupler);
  EXPECT_EQ(text("outcome_note:coupler_buff_peak").rfind("coupler " + coupler + "-", 0), 0U)
      << text("outcome_note:coupler_buff_peak");
  EXPECT_EQ(text("outcome:cars"), "12");
  auto* all = find<QToolButton>("all_outcomes");
  if (all->text() == "show all") all->click();
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:cars")->isVisible(); }));
  const auto known = ros_face::read<outcome::Outcome>(o, outcome::outcome_fields());
  for (const auto& field : outcome::outcome_fields()) {
    if (!field.headline) continue;
    const std::string name = "outcome:" + std::string(field.name);
    const bool shown = !field.when || field.when(known);
    EXPECT_EQ(label(name.c_str())->isVisible(), shown) << name;
    if (!shown) continue;
    const outcome::FieldRow row = outcome::row_of(field, known);
    EXPECT_EQ(text(name.c_str()), row.shown.empty() ? row.si : row.shown) << name;
  }
  EXPECT_EQ(text("outcome:cars_past_pod"), std::to_string(o.cars_past_pod));
  EXPECT_EQ(text("outcome:cars_off_track"), std::to_string(o.cars_off_track));
  EXPECT_EQ(text("outcome:energy_residual"), QString::number(o.energy_residual, 'e', 1).toStdString());
  EXPECT_TRUE(button("restart")->isEnabled());
}

TEST_F(Panel, GreysOutWhenTheNodeIsKilledAndRecoversByItself) {
  start_node_and_wait();
  type("input:initial.speed", "44 mph");
  click("restart");
  ASSERT_TRUE(wait_for_state("Run 2"));
  node_process->kill_now();
  ASSERT_TRUE(wait_in_rviz([&] { return !usable(); }));
  EXPECT_NE(presence().find("No simulation"), std::string::npos) << presence();
  start_node();
  ASSERT_TRUE(wait_in_rviz([&] { return usable() && state() == "Run 1 paused"; })) << presence() << ", " << state();
  type("input:initial.speed", "55 mph");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && std::abs(inputs.last().speed - 55 * kMph) < 1e-9; }));
}

TEST_F(Panel, ANodeThatAnswersNothingDoesNotStopRviz) {
  start_node_and_wait();
  node_process->send(SIGSTOP);
  click("restart");
  const auto begin = std::chrono::steady_clock::now();
  const auto frames = frame->getManager()->getFrameCount();
  EXPECT_LT(longest_stall([&] { return std::chrono::steady_clock::now() - begin > std::chrono::seconds(3); }), 1.0);
  EXPECT_GT(frame->getManager()->getFrameCount(), frames + 10) << "RViz goes on drawing";
  EXPECT_FALSE(button("restart")->isEnabled()) << "still under way";
  node_process->send(SIGCONT);
  EXPECT_TRUE(wait_for_state("Run 2")) << state();

  // Nor does it keep the window from closing.
  node_process->send(SIGSTOP);
  click("restart");
  const auto close_begin = std::chrono::steady_clock::now();
  close_panel();
  EXPECT_LT(std::chrono::steady_clock::now() - close_begin, std::chrono::seconds(15));
}

TEST_F(Panel, LooksToAnotherNodeAndRefusesWhatIsNoName) {
  start_node_and_wait();
  type("node", "/no where");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  EXPECT_TRUE(wait_in_rviz([&] { return presence().find("Not a node's name") == 0; })) << presence();
  EXPECT_FALSE(usable());
  type("node", "/elsewhere");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  EXPECT_TRUE(wait_in_rviz([&] { return presence() == "No simulation at /elsewhere. Waiting for it."; })) << presence();
  type("node", "/train_derail");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  EXPECT_TRUE(wait_in_rviz([&] { return usable(); })) << presence();
}

TEST_F(Panel, IsSavedAndLoadedWithTheConfiguration) {
  start_node_and_wait();
  // RViz counts no changes in the first second after loading.
  ASSERT_TRUE(wait_in_rviz([&] {
    find<QCheckBox>("start_paused")->click();
    return frame->isWindowModified();
  }));
  ASSERT_TRUE(frame->saveDisplayConfig(QString::fromStdString(file("saved.rviz"))));
  ASSERT_FALSE(frame->isWindowModified());
  EXPECT_TRUE(NodeClient(kNode).restart({"initial.speed=30 mph"}).success);
  EXPECT_TRUE(wait_in_rviz([&] { return edit("input:initial.speed")->text() == "30 mph"; }));
  EXPECT_FALSE(frame->isWindowModified()) << "what the node does is nothing to save";
  type("input:initial.speed", "61 mph");
  type("input:", "solver.rtol=1.0e-6");
  find<QSpinBox>("ticks")->setValue(25);
  find<QCheckBox>("start_paused")->setChecked(true);
  EXPECT_TRUE(frame->isWindowModified());
  type("node", "/elsewhere");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  ASSERT_TRUE(frame->saveDisplayConfig(QString::fromStdString(file("saved.rviz"))));
  close_panel();

  const YAML::Node panel = YAML::LoadFile(file("saved.rviz"))["Panels"][0];
  EXPECT_EQ(panel["Class"].as<std::string>(), "train_derail/SimulationPanel");
  EXPECT_EQ(panel["Node"].as<std::string>(), "/elsewhere");
  EXPECT_EQ(panel["Inputs"]["initial.speed"].as<std::string>(), "61 mph");

  open_rviz("    Node: /elsewhere\n");
  frame->loadDisplayConfigHelper(file("saved.rviz"), true);
  ASSERT_TRUE(
      wait_in_rviz([&] { return edit("node")->text() == "/elsewhere" && find<QSpinBox>("ticks")->value() == 25; }));
  EXPECT_TRUE(find<QCheckBox>("start_paused")->isChecked());
  EXPECT_EQ(edit("input:")->text(), "solver.rtol=1.0e-6");
  EXPECT_EQ(edit("input:initial.speed")->text(), "61 mph");
  type("node", "/train_derail");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  ASSERT_TRUE(wait_in_rviz([&] { return usable() && differs("input:initial.speed"); }));
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 3; }));
  EXPECT_DOUBLE_EQ(inputs.last().speed, 61 * kMph);
  EXPECT_EQ(inputs.last().rtol, 1.0e-6);
}

TEST_F(Panel, ShowsAReplayAndSaysThatItIsOne) {
  const std::string bag = file("run.bag"), scenario = file("scenario.yaml");
  std::ofstream(scenario) << "title: from a bag\nconsist:\n  - {count: 12, length: 61.1 ft, weight: 150 kip}\n"
                             "initial: {speed: 37 mph, yaw_rate: 0.2}\nstop: {time_max: 3 s}\n";
  ASSERT_EQ(std::system((TRAIN_DERAIL_CLI " run --quiet --bag '" + bag + "' '" + scenario + "'").c_str()), 0);
  Record<Outcome> outcome("/train_derail/outcome");
  auto player = std::make_unique<ChildProcess>(std::vector<std::string>{
      "/usr/lib/rosbag/play", "--clock", "--hz=200", "--rate=4", "--keep-alive", bag, "__name:=player"});
  ASSERT_TRUE(wait_in_rviz([&] { return presence().find("A replay: /player plays the topics of /train_derail") == 0; }))
      << presence();
  EXPECT_EQ(presence().find("time jumps"), std::string::npos) << presence();
  ASSERT_TRUE(wait_for_state("Run 1 ended: time limit reached")) << state();
  ASSERT_TRUE(wait_in_rviz([&] { return !outcome.empty() && outcome.last().ended == Outcome::TIME_MAX; }));
  const auto text = [&](const char* name) { return label(name)->text().toStdString(); };
  EXPECT_TRUE(wait_in_rviz([&] {
    return text("outcome_note:coupler_buff_peak")
               .rfind("coupler " + std::to_string(outcome.last().coupler_buff_peak_coupler) + "-", 0) == 0;
  })) << text("outcome_note:coupler_buff_peak");
  EXPECT_TRUE(label("outcome:coupler_buff_peak")->isEnabled());
  EXPECT_EQ(text("time"), "3.00 s");
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  for (const char* name : {"run", "pause", "step", "restart", "revert"})
    EXPECT_FALSE(button(name)->isEnabled()) << name;
  EXPECT_FALSE(find<QComboBox>("rate")->isEnabled());
  EXPECT_FALSE(edit("input:initial.speed")->isEnabled());

  // A simulator beside it: time jumps.
  start_node();
  EXPECT_TRUE(wait_in_rviz([&] {
    return presence().find("Time jumps: /clock is published by /player and /train_derail") != std::string::npos;
  })) << presence();
  player.reset();
  EXPECT_TRUE(wait_in_rviz([&] { return !label("presence")->isVisible() && usable() && state() == "Run 1 paused"; }))
      << presence();
  EXPECT_TRUE(edit("input:initial.speed")->isEnabled());
}

TEST_F(Panel, NamesTheBlockThatItsInputsBelongTo) {
  start_node_and_wait();
  const auto label_of = [&](const char* name) {
    for (const QLabel* l : frame->findChildren<QLabel*>()) {
      if (l->buddy() == edit(name)) return l->text().toStdString();
    }
    return std::string();
  };
  EXPECT_EQ(label_of("input:consist[0].weight"), "Car &weight") << "there is one block only";
  ASSERT_TRUE(NodeClient(kNode)
                  .restart({}, true,
                           "consist:\n  - {name: locomotive, count: 2, length: 70 ft, weight: 420 kip}\n"
                           "  - {name: tank_car, count: 9, length: 55 ft, weight: 286 kip}\n"
                           "initial: {speed: 30 mph, yaw_rate: 0}\n")
                  .success);
  EXPECT_TRUE(wait_in_rviz([&] { return label_of("input:consist[0].weight") == "Car &weight,\nlocomotive 1\u20132"; }))
      << label_of("input:consist[0].weight");
}

TEST_F(Panel, OffersOnlyInputsThatAct) {
  start_node_and_wait();
  EXPECT_TRUE(edit("input:ground.on_track_friction")->isVisible());
  // With air brakes the friction on the track acts on nothing.
  std::ifstream file(TRAIN_DERAIL_SOURCE_DIR "/config/accident.yaml");
  const std::string accident((std::istreambuf_iterator<char>(file)), {});
  ASSERT_TRUE(NodeClient(kNode).restart({}, true, accident).success);
  EXPECT_TRUE(wait_in_rviz([&] { return !edit("input:ground.on_track_friction")->isVisible(); }));
  EXPECT_TRUE(edit("input:initial.speed")->isVisible());
}

TEST_F(Panel, SaysWhyInputsCannotBeShownAndSendsNoneWithoutAUnit) {
  ros::NodeHandle handle;
  int restarts = 0;
  const boost::function<bool(GetInputs::Request&, GetInputs::Response&)> answer =
      [](GetInputs::Request&, GetInputs::Response&) { return true; };
  const boost::function<bool(Restart::Request&, Restart::Response&)> count =
      [&](Restart::Request&, Restart::Response&) { return ++restarts > 0; };
  const ros::ServiceServer get_inputs = handle.advertiseService("/fake/get_inputs", answer);
  const ros::ServiceServer restart = handle.advertiseService("/fake/restart", count);
  const auto inputs_topic = handle.advertise<Inputs>("/fake/inputs", 1, true);
  const auto info_topic = handle.advertise<RunInfo>("/fake/run_info", 1, true);
  Inputs wrong;
  wrong.yaml = "of: another version";
  inputs_topic.publish(wrong);
  info_topic.publish(RunInfo());
  type("node", "/fake");
  QTest::keyClick(edit("node"), Qt::Key_Return);
  ASSERT_TRUE(wait_in_rviz([&] { return message().find("The inputs of this run cannot be shown: ") == 0; }))
      << message();
  EXPECT_NE(message().find("consist: missing"), std::string::npos) << message();
  EXPECT_TRUE(message_is_red());
  EXPECT_TRUE(label("message")->isVisible());
  type("input:initial.speed", "12");
  label("message")->clear();
  click("restart");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("The inputs of this run cannot be shown: ") == 0; }))
      << message();
  EXPECT_EQ(restarts, 0);
  type("node", "/train_derail");
  QTest::keyClick(edit("node"), Qt::Key_Return);
}

/// What a node with a run that can be looked back at offers, with answers that take as long as the test wants.
class FakeNode {
 public:
  FakeNode() : spinner_(1, &queue_) {
    handle_.setCallbackQueue(&queue_);
    services_ = {
        handle_.advertiseService("/fake/get_inputs", &FakeNode::get_inputs, this),
        handle_.advertiseService("/fake/seek", &FakeNode::seek, this),
        handle_.advertiseService("/fake/resume", &FakeNode::resume, this),
        handle_.advertiseService("/fake/restart", &FakeNode::restart, this),
    };
    inputs_ = handle_.advertise<Inputs>("/fake/inputs", 1, true);
    info_ = handle_.advertise<RunInfo>("/fake/run_info", 1, true);
    cars_ = handle_.advertise<CarStates>("/fake/cars", 1000, true);
    couplers_ = handle_.advertise<CouplerForces>("/fake/couplers", 1000, true);
    outcome_ = handle_.advertise<Outcome>("/fake/outcome", 1000, true);
    Inputs inputs;
    inputs.run_id = 1;
    inputs.yaml = "consist:\n  - {count: 3, length: 60 ft, weight: 150 kip}\ninitial: {speed: 30 mph, yaw_rate: 0}\n";
    inputs_.publish(inputs);
    spinner_.start();
  }
  ~FakeNode() { spinner_.stop(); }

  void say(std::uint8_t state, double kept_until, bool replay = false) {
    RunInfo info;
    info.run_id = 1;
    info.state = state;
    info.interval = 0.1;
    info.kept_until = kept_until;
    info.replay = replay;
    info.message = state == RunInfo::ENDED ? "all cars at rest" : "";
    info_.publish(info);
  }
  /// A car and a coupler whose force is the time in MN.
  void show(double time) {
    CarStates cars;
    cars.run_id = 1;
    cars.time = time;
    cars.cars.resize(3);
    cars_.publish(cars);
    CouplerForces couplers;
    couplers.run_id = 1;
    couplers.time = time;
    couplers.couplers.resize(2);
    for (CouplerForce& c : couplers.couplers) c.axial_force = 1.0e6 * time;
    couplers_.publish(couplers);
  }
  void come_to(double time, int derailed = 0) {
    show(time);
    Outcome outcome;
    outcome.run_id = 1;
    outcome.stop_time = time;
    outcome.cars = 3;
    outcome.cars_derailed = outcome.cars_past_pod = static_cast<std::uint32_t>(derailed);
    outcome.pile_up_length = 18.0;
    outcome_.publish(outcome);
  }
  bool heard() const { return cars_.getNumSubscribers() > 0 && couplers_.getNumSubscribers() > 0; }
  std::vector<double> sought() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return sought_;
  }
  int restarts() const { return restarts_; }
  int restarts_by_closing_connections() const { return restarts_by_closing_connections_; }
  int resumes() const { return resumes_; }

  std::atomic<bool> holds_seeks{false}, refuses_seeks{false};

 private:
  bool get_inputs(GetInputs::Request&, GetInputs::Response&) { return true; }
  bool resume(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    ++resumes_;
    return response.success = true;
  }
  bool restart(ros::ServiceEvent<Restart::Request, Restart::Response>& event) {
    if (event.getConnectionHeader().at("persistent") != "1") ++restarts_by_closing_connections_;
    ++restarts_;
    event.getResponse().success = 1;
    return true;
  }
  bool seek(Seek::Request& request, Seek::Response& response) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      sought_.push_back(request.time);
    }
    while (holds_seeks && ros::ok()) std::this_thread::yield();
    response.success = !refuses_seeks;
    response.message = "no such moment";
    if (response.success) show(request.time);
    return true;
  }

  ros::CallbackQueue queue_;
  ros::NodeHandle handle_;
  mutable std::mutex mutex_;
  std::vector<double> sought_;
  std::atomic<int> restarts_{0}, restarts_by_closing_connections_{0}, resumes_{0};
  std::vector<ros::ServiceServer> services_;
  ros::Publisher inputs_, info_, cars_, couplers_, outcome_;
  ros::AsyncSpinner spinner_;
};

class PanelOnFake : public Panel {
 protected:
  void SetUp() override {
    Panel::SetUp();
    look_at("/fake");
    ASSERT_TRUE(wait_in_rviz([&] { return node.heard(); }));
  }
  void TearDown() override {
    look_at(kNode);
    Panel::TearDown();
  }
  void look_at(const char* name) const {
    type("node", name);
    QTest::keyClick(edit("node"), Qt::Key_Return);
  }
  QSlider* slider() const { return find<QSlider>("time_slider"); }
  QVector<QPointF> line(const char* chart, const char* name) const {
    for (QtCharts::QAbstractSeries* series : find<QtCharts::QChartView>(chart)->chart()->series()) {
      if (series->name() == name) return static_cast<QtCharts::QLineSeries*>(series)->points().toVector();
    }
    throw std::runtime_error(std::string("no line ") + name);
  }
  /// A run that has ended at 10 s, with its forces.
  void run_to_the_end() {
    node.say(RunInfo::RUNNING, 0.0);
    for (int k = 0; k <= 100; ++k) node.come_to(0.1 * k, 2);
    node.say(RunInfo::ENDED, 10.0);
    ASSERT_TRUE(wait_in_rviz([&] { return slider()->isEnabled() && slider()->value() == 100; })) << state();
  }

  FakeNode node;
};

TEST_F(PanelOnFake, TheSliderShowsAnyMomentOfARunThatStandsStill) {
  node.say(RunInfo::RUNNING, 5.0);
  node.come_to(5.0);
  EXPECT_TRUE(wait_for_state("running"));
  EXPECT_FALSE(slider()->isEnabled()) << "the run goes on";
  run_to_the_end();
  EXPECT_TRUE(wait_for_state("Run 1 ended: all cars at rest")) << state();
  EXPECT_TRUE(wait_in_rviz([&] { return label("time_range")->text() == "10.00 of 10.00 s"; }));
  if (!find<QToolButton>("section:charts")->isChecked()) find<QToolButton>("section:charts")->click();
  ASSERT_TRUE(wait_in_rviz([&] { return line("chart:along", "now").size() == 2; }));
  EXPECT_TRUE(line("chart:time", "mark").isEmpty());

  slider()->setFocus();
  QTest::keyClick(slider(), Qt::Key_Home);
  ASSERT_TRUE(wait_in_rviz([&] { return label("time_range")->text() == "0.00 of 10.00 s"; }));
  slider()->setValue(30);
  ASSERT_TRUE(wait_in_rviz([&] { return label("time_range")->text() == "3.00 of 10.00 s"; }))
      << label("time_range")->text().toStdString();
  EXPECT_EQ(node.sought(), (std::vector<double>{0.0, 0.1 * 30}));
  EXPECT_TRUE(wait_in_rviz([&] {
    const auto mark = line("chart:time", "mark");
    return mark.size() == 2 && std::abs(mark[0].x() - 3.0) < 1e-9 && mark[0].y() < mark[1].y();
  }));
  EXPECT_NEAR(line("chart:along", "now")[0].y(), 3.0e6 / inputs::kKip, 1e-6) << "the force at that time";
  slider()->setValue(100);
  EXPECT_TRUE(wait_in_rviz([&] { return line("chart:time", "mark").isEmpty(); }));
}

TEST_F(PanelOnFake, OfManyMomentsOnlyTheLastIsAskedForWhenTheNodeIsSlow) {
  run_to_the_end();
  node.holds_seeks = true;
  slider()->setValue(90);
  ASSERT_TRUE(wait_in_rviz([&] { return node.sought().size() == 1; }));
  for (int k = 80; k >= 20; --k) slider()->setValue(k);
  EXPECT_EQ(node.sought().size(), 1U) << "one call at a time";
  node.holds_seeks = false;
  ASSERT_TRUE(wait_in_rviz([&] { return label("time_range")->text() == "2.00 of 10.00 s"; }));
  EXPECT_EQ(node.sought(), (std::vector<double>{0.1 * 90, 0.1 * 20}));
}

TEST_F(PanelOnFake, ARefusedMomentIsSaidAndTheSliderGoesBack) {
  run_to_the_end();
  node.refuses_seeks = true;
  slider()->setValue(40);
  EXPECT_TRUE(wait_in_rviz([&] { return message() == "no such moment" && slider()->value() == 100; })) << message();
  EXPECT_TRUE(message_is_red());
}

TEST_F(PanelOnFake, BeforeAnythingHasHappenedNothingIsCounted) {
  node.say(RunInfo::PAUSED, 0.0);
  node.come_to(0.0, 1);
  ASSERT_TRUE(wait_in_rviz([&] { return label("outcome:cars")->text() == "3"; }));
  EXPECT_EQ(label("outcome:cars_derailed")->text(), QString::fromUtf8("\u2013"));
  EXPECT_FALSE(label("outcome:pile_up_length")->isVisible());
  node.come_to(1.0, 2);
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:cars_derailed")->text() == "2"; }));
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:pile_up_length")->isVisible(); }));
}

TEST_F(PanelOnFake, ARecordedRunIsPlayedAndNotChanged) {
  node.say(RunInfo::RUNNING, 10.0, true);
  node.come_to(4.0);
  ASSERT_TRUE(wait_in_rviz([&] { return presence().find("A recorded run") == 0; })) << presence();
  EXPECT_TRUE(wait_in_rviz([&] { return slider()->isEnabled(); })) << "while it plays, too";
  EXPECT_TRUE(button("pause")->isEnabled());
  EXPECT_FALSE(button("restart")->isEnabled());
  EXPECT_FALSE(find<QComboBox>("scenario")->isEnabled());
  EXPECT_FALSE(edit("input:initial.speed")->isEnabled());
  EXPECT_EQ(edit("input:initial.speed")->text(), "30 mph");
  node.say(RunInfo::ENDED, 10.0, true);
  ASSERT_TRUE(wait_in_rviz([&] { return button("run")->text() == "Play &again" && button("run")->isEnabled(); }));
  click("run");
  EXPECT_TRUE(wait_in_rviz([&] { return node.resumes() == 1; }));
  EXPECT_EQ(node.sought(), std::vector<double>{0.0});
  EXPECT_EQ(node.restarts(), 0);
}

std::ptrdiff_t open_files() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

// If the node closes the connection with its answer, roscpp may drop that answer (ros_comm issue 1976).
TEST_F(PanelOnFake, TheNodeNeverClosesTheConnectionOfACallAndThePanelAlwaysDoes) {
  constexpr int kCalls = 20;
  run_to_the_end();
  const std::ptrdiff_t before = open_files();
  for (int k = 1; k <= kCalls; ++k) {
    ASSERT_TRUE(wait_in_rviz([&] { return button("restart")->isEnabled(); }));
    click("restart");
    ASSERT_TRUE(wait_in_rviz([&] { return node.restarts() == k; }));
  }
  EXPECT_EQ(node.restarts_by_closing_connections(), 0);
  EXPECT_TRUE(wait_in_rviz([&] { return open_files() < before + kCalls; })) << "one or two a call are left open";
}

TEST_F(Panel, ARunThatHasEndedCanBeRunAgainWithTheInputsOfTheForm) {
  start_node_and_wait();
  ASSERT_TRUE(NodeClient(kNode).set_rate(0.0).success);
  EXPECT_EQ(button("run")->text(), "&Run");
  click("run");
  ASSERT_TRUE(wait_for_state("Run 1 ended: time limit reached")) << state();
  ASSERT_TRUE(wait_in_rviz([&] { return button("run")->text() == "&Run again"; }));
  for (const char* name : {"pause", "step"}) {
    EXPECT_FALSE(button(name)->isEnabled());
    EXPECT_TRUE(button(name)->toolTip().contains("The run has ended")) << button(name)->toolTip().toStdString();
  }
  ASSERT_TRUE(wait_in_rviz([&] { return label("outcome:coupler_buff_peak")->text().contains("kip"); }));
  const std::string first = label("outcome:coupler_buff_peak")->text().toStdString();
  type("input:initial.speed", "25 mph");
  click("run");
  ASSERT_TRUE(wait_for_state("Run 2 ended")) << state() << message();
  EXPECT_TRUE(wait_in_rviz([&] { return std::abs(inputs.last().speed - 25 * kMph) < 1e-12; })) << inputs.last().speed;
  // Beside what it has yielded stands what the first had.
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome:this_run")->text() == "Run 2"; }));
  EXPECT_EQ(label("outcome:run_before")->text(), "Run 1, 37 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return label("outcome_before:coupler_buff_peak")->text().toStdString() == first; }))
      << label("outcome_before:coupler_buff_peak")->text().toStdString() << " instead of " << first;
  EXPECT_TRUE(label("outcome_before:coupler_buff_peak")->isVisible());
  EXPECT_NE(label("outcome:coupler_buff_peak")->text().toStdString(), first);
  EXPECT_TRUE(label("outcome:run_before")->toolTip().contains("initial.speed: 25 mph, before 37 mph"));
}

TEST_F(Panel, EnterInAFieldStartsTheRun) {
  start_node_and_wait();
  find<QCheckBox>("start_paused")->setChecked(true);
  type("input:initial.speed", "48");
  QTest::keyClick(edit("input:initial.speed"), Qt::Key_Return);
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  EXPECT_DOUBLE_EQ(inputs.last().speed, 48 * kMph);
}

TEST_F(Panel, RedMessagesGoWithTheirCause) {
  start_node_and_wait();
  type("input:initial.speed", "-5 mph");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return message_is_red() && label("message")->isVisible(); }));
  type("input:initial.speed", "38 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return !label("message")->isVisible(); })) << message();
  type("input:", "coupler.slack=9 ft");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return message().find("coupler.slack") != std::string::npos; }));
  click("revert");
  EXPECT_TRUE(wait_in_rviz([&] { return !label("message")->isVisible(); })) << message();
}

TEST_F(Panel, ScenariosAreChosenFromAListOrAFile) {
  start_node_and_wait();
  find<QCheckBox>("start_paused")->setChecked(true);
  auto* chooser = find<QComboBox>("scenario");
  const auto choose = [&](const QString& part) {
    for (int i = 1; i < chooser->count(); ++i) {
      if (!chooser->itemText(i).contains(part)) continue;
      chooser->showPopup();
      chooser->view()->setCurrentIndex(chooser->model()->index(i, 0));
      QTest::keyClick(chooser->view(), Qt::Key_Return);
      return true;
    }
    return false;
  };
  // One whose base is another file, which the node need not have.
  ASSERT_TRUE(choose("lac_megantic_2013.yaml"));
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  EXPECT_EQ(inputs.last().title, "Lac-Megantic, Quebec, 2013");
  EXPECT_TRUE(wait_in_rviz([&] { return chooser->currentText() == "Lac-Megantic, Quebec, 2013"; }));
  EXPECT_EQ(inputs.last().model, "extended") << "the base's";

  const auto open = [&](const std::string& path) {
    ASSERT_TRUE(choose("Open file"));
    QFileDialog* dialog = nullptr;
    ASSERT_TRUE(wait_in_rviz([&] { return (dialog = frame->findChild<QFileDialog*>("open_scenario")) != nullptr; }));
    Q_EMIT dialog->fileSelected(QString::fromStdString(path));
    dialog->reject();
  };
  std::ofstream(file("broken.yaml")) << "consist:\n  - {count: 5, length: 60 ft, weight: 150 kip}\n"
                                        "initial: {speed: 900 mph, yaw_rate: 0.1}\n";
  open(file("broken.yaml"));
  EXPECT_TRUE(wait_in_rviz([&] { return message_is_red() && label("message")->isVisible(); }));
  for (const char* said : {"broken.yaml:3", "initial.speed", "900 mph", "allowed: [0, 200] m/s"})
    EXPECT_NE(message().find(said), std::string::npos) << message() << " lacks " << said;
  std::ofstream(file("mine.yaml")) << "title: Mine\nconsist:\n  - {count: 5, length: 60 ft, weight: 150 kip}\n"
                                      "initial: {speed: 21 mph, yaw_rate: 0.1}\nstop: {time_max: 2 s}\n";
  open(file("mine.yaml"));
  ASSERT_TRUE(wait_in_rviz([&] { return inputs.last().title == "Mine"; })) << message();
  EXPECT_GE(chooser->findText("mine.yaml"), 1) << "among those chosen lately";

  // The command repeats the run: from the file, with what was changed.
  type("input:initial.speed", "23.456 mph");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return std::abs(inputs.last().speed - 23.456 * kMph) < 1e-9; })) << message();
  ASSERT_TRUE(NodeClient(kNode).step(0, 5.0).time > 1.9);
  Record<Outcome> outcome("/train_derail/outcome");
  ASSERT_TRUE(wait_in_rviz([&] { return !outcome.empty() && outcome.last().ended == Outcome::TIME_MAX; }));
  click("copy_command");
  std::string command = QApplication::clipboard()->text().toStdString();
  EXPECT_EQ(command.find("rosrun train_derail derail run '" + file("mine.yaml") + "' --set 'initial.speed=23.456 mph'"),
            0U)
      << command;
  const std::string program = "rosrun train_derail derail", json = file("again.json");
  command.replace(command.find(program), program.size(), TRAIN_DERAIL_CLI);
  command.insert(command.find_last_not_of('\n') + 1, " --quiet --json '" + json + "'");
  ASSERT_EQ(std::system(command.c_str()), 0) << command;
  const YAML::Node again = YAML::LoadFile(json);
  EXPECT_EQ(again["coupler_buff_peak"].as<double>(), outcome.last().coupler_buff_peak);
  EXPECT_EQ(again["energy_residual"].as<double>(), outcome.last().energy_residual);

  // They are saved with the configuration.
  ASSERT_TRUE(frame->saveDisplayConfig(QString::fromStdString(file("saved.rviz"))));
  const YAML::Node saved = YAML::LoadFile(file("saved.rviz"))["Panels"][0]["Recent Scenarios"];
  ASSERT_EQ(saved.size(), 2U);
  EXPECT_EQ(saved[0].as<std::string>(), file("mine.yaml"));
}

TEST_F(Panel, SweepsOverOneInputAndDrawsWhatCameOut) {
  const QTemporaryDir results;
  ros::param::set("/train_derail/results_folder", results.path().toStdString());
  start_node_and_wait();
  ros::param::del("/train_derail/results_folder");
  find<QToolButton>("section:sweep")->click();
  auto* key = find<QComboBox>("sweep:key");
  EXPECT_EQ(key->currentText(), "initial.speed");
  EXPECT_LT(key->findText("initial.perturbation.seed"), 0);
  EXPECT_LT(key->findText("contact.friction"), 0) << "has no effect here";
  type("sweep:from", "50 kip");
  click("sweep:start");
  EXPECT_TRUE(wait_in_rviz([&] { return message().find("50 kip") != std::string::npos && message_is_red(); }))
      << message();
  type("sweep:from", "10");
  type("sweep:to", "20 mph");
  find<QSpinBox>("sweep:points")->setValue(3);
  find<QSpinBox>("sweep:runs")->setValue(4);
  click("sweep:start");
  ASSERT_TRUE(wait_in_rviz([&] { return find<QtCharts::QChartView>("sweep_chart")->isVisible(); }))
      << label("sweep:message")->text().toStdString() << message();
  EXPECT_FALSE(label("message")->isVisible()) << message();
  const QStringList folders = QDir(results.path()).entryList({"panel_sweep_*"}, QDir::Dirs);
  ASSERT_EQ(folders.size(), 1);
  // The line is the median of summary.csv, point by point.
  auto* outcomes = find<QComboBox>("sweep:outcome");
  outcomes->setCurrentIndex(outcomes->findData("coupler_buff_peak"));
  QVector<QPointF> median;
  for (QtCharts::QAbstractSeries* series : find<QtCharts::QChartView>("sweep_chart")->chart()->series()) {
    if (auto* line = qobject_cast<QtCharts::QLineSeries*>(series)) median = line->points().toVector();
  }
  ASSERT_EQ(median.size(), 3);
  EXPECT_NEAR(median[0].x(), 10.0, 1e-9);
  EXPECT_NEAR(median[1].x(), 15.0, 1e-9);
  std::ifstream summary((results.path() + "/" + folders[0] + "/summary.csv").toStdString());
  int seen = 0;
  for (std::string row; std::getline(summary, row);) {
    const QStringList fields = QString::fromStdString(row).split(',');
    if (fields.size() < 13 || fields[2] != "coupler_buff_peak") continue;
    EXPECT_NEAR(median[seen++].y(), fields[10].toDouble() / inputs::kKip, 1e-6);
    EXPECT_EQ(fields[4], "4");
  }
  EXPECT_EQ(seen, 3);
}

TEST_F(Panel, FitsALowWindowAndUsesATallOne) {
  start_node_and_wait();
  ASSERT_TRUE(NodeClient(kNode).step(100, 0.0).success);
  frame->resize(1366, 768);
  auto* scroll = frame->findChild<QLineEdit*>("node")->parentWidget();
  while (qobject_cast<QScrollArea*>(scroll) == nullptr) scroll = scroll->parentWidget();
  auto* bar = static_cast<QScrollArea*>(scroll)->verticalScrollBar();
  EXPECT_TRUE(wait_in_rviz([&] { return frame->height() == 768 && bar->maximum() == 0; })) << bar->maximum();
  EXPECT_FALSE(find<QToolButton>("section:charts")->isChecked());
  frame->resize(1366, 1400);
  EXPECT_TRUE(wait_in_rviz([&] { return find<QToolButton>("section:charts")->isChecked(); }));
  EXPECT_TRUE(wait_in_rviz(
      [&] { return label("outcome:groups")->isVisible() || label("outcome:cars_past_pod")->isVisible(); }));
  EXPECT_EQ(bar->maximum(), 0);
  find<QToolButton>("section:charts")->click();
  EXPECT_TRUE(wait_in_rviz([&] { return !find<QtCharts::QChartView>("chart:time")->isVisible(); }))
      << "the user's word";
  frame->resize(1500, 880);
}

TEST_F(Panel, FitsTheWindowToTheScreenIfTheConfigurationSaysSo) {
  close_panel();
  frame->resize(1000, 700);
  open_rviz("    Fit Window To Screen: true\n");
  const QRect room = frame->windowHandle()->screen()->availableGeometry();
  EXPECT_TRUE(wait_in_rviz([&] { return frame->geometry().size() == room.size(); }))
      << frame->width() << " x " << frame->height();
  frame->resize(1500, 880);
}

/// In the user's locale, whatever that is: decimal points are points.
TEST_F(Panel, ReadsAndShowsNumbersTheSameInAnyLocale) {
  const char* wanted = std::getenv("DECIMAL_POINT");
  if (wanted != nullptr) {
    ASSERT_STREQ(std::localeconv()->decimal_point, wanted) << "the locale is not in use";
  }
  start_node_and_wait();
  EXPECT_EQ(edit("input:initial.speed")->text(), "37 mph");
  EXPECT_EQ(edit("input:initial.yaw_rate")->text(), "0.2 rad/s");
  type("input:initial.yaw_rate", "0.25");
  type("input:initial.speed", "12.5");
  type("input:coupler.slack", "1.5 inch");
  click("restart");
  ASSERT_TRUE(wait_in_rviz([&] { return !inputs.empty() && inputs.last().run_id == 2; })) << message();
  EXPECT_DOUBLE_EQ(inputs.last().speed, 12.5 * kMph);
  EXPECT_TRUE(wait_in_rviz([&] { return edit("input:initial.speed")->text() == "12.5 mph"; }));
  EXPECT_DOUBLE_EQ(inputs.last().yaw_rate, 0.25);
  EXPECT_NEAR(inputs.last().coupler_slack, 0.0381, 1e-12);
  auto* rate = find<QComboBox>("rate");
  rate->setFocus();
  rate->lineEdit()->selectAll();
  QTest::keyClicks(rate, "0.25\r");
  EXPECT_TRUE(wait_in_rviz([&] { return !run_info.empty() && run_info.last().rate == 0.25; }));
  EXPECT_TRUE(wait_in_rviz([&] { return label("time")->text().contains('.'); })) << label("time")->text().toStdString();
  // A comma is no point anywhere: refused aloud.
  type("input:initial.speed", "12,5 mph");
  EXPECT_TRUE(wait_in_rviz([&] { return is_wrong("input:initial.speed"); }));
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  const train_derail::test::VirtualDisplay display;
  if (display.name().empty()) {
    std::fputs("no virtual display: Xvfb is missing\n", stderr);
    return 2;
  }
  ros::init(argc, argv, "test_panel", ros::init_options::NoSigintHandler);
  const ros::NodeHandle keep_alive;
  QApplication app(argc, argv);
  return RUN_ALL_TESTS();
}
