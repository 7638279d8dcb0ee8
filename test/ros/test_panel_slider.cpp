// The panel and moments of a run that are looked back at, with a node that answers when the test wants.
#include <atomic>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <ros/ros.h>
#include <QComboBox>
#include <QSlider>
#include <QTest>
#include <QToolButton>

#include "panel_fixture.hpp"
#include "rviz/qt_charts.hpp"
#include "train_derail/GetInputs.h"
#include "train_derail/Inputs.h"
#include "train_derail/Seek.h"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::test {
namespace {

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

}  // namespace
}  // namespace train_derail::test
