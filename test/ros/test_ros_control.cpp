// Every service of the running node and every refusal; each test begins with a restart.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <set>
#include <sstream>
#include <thread>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <visualization_msgs/MarkerArray.h>

#include "node_client.hpp"
#include "train_derail/GetInputs.h"
#include "train_derail/Inputs.h"
#include "train_derail/Seek.h"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/scene/palette.hpp"

namespace train_derail::test {
namespace {

using diagnostic_msgs::DiagnosticArray;
using diagnostic_msgs::DiagnosticStatus;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInterval = 0.02;

std::string g_scenario_file;

/// Enough work a point of the grid that a run lasts until it is stopped.
const std::vector<std::string> kHeavy = {"consist[0].count=1000", "stop.time_max=100", "ground.on_track_friction=0.001",
                                         "ground.off_track_friction=0.001"};

class Control : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(node.wait_until_up());
    ASSERT_TRUE(wait_for([&] {
      return clock.connected() && tf.connected() && cars.connected() && couplers.connected() && markers.connected() &&
             diagnostics.connected() && !run_info.empty() && !outcome.empty() && !inputs.empty();
    }));
    ASSERT_TRUE(node.set_rate(0.0).success);
    const Restart::Response r = node.restart({}, true, whole_scenario());
    ASSERT_TRUE(r.success) << r.message;
    run_id = r.run_id;
    ASSERT_TRUE(wait_for_run(run_id));
  }

  static std::string whole_scenario() {
    std::ifstream file(g_scenario_file);
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }

  /// Until every stream is at the first point of that run.
  bool wait_for_run(std::uint32_t id) {
    return wait_for([&] {
      return !cars.empty() && cars.last().run_id == id && couplers.last().run_id == id &&
             run_info.last().run_id == id && inputs.last().run_id == id && outcome.last().run_id == id &&
             !clock.empty() && clock.last().clock >= run_info.last().start && !markers.empty() &&
             std::any_of(markers.messages.begin(), markers.messages.end(),
                         [&](const auto& array) { return array.markers.back().header.stamp >= run_info.last().start; });
    });
  }
  bool wait_for_end() {
    return wait_for(
               [&] { return run_info.last().state == RunInfo::ENDED || run_info.last().state == RunInfo::FAILED; }) &&
           wait_for([&] {
             const ros::Time end = run_info.last().header.stamp;
             return outcome.last().ended != Outcome::RUNNING && cars.last().header.stamp == end &&
                    couplers.last().header.stamp == end && clock.last().clock >= end;
           });
  }
  bool wait_for_state(std::uint8_t state) {
    return wait_for([&] { return run_info.last().state == state; });
  }
  bool wait_for_time(double t) {
    return wait_for([&] { return cars.last().time >= t && couplers.last().time >= t; });
  }
  /// Lets the wall clock run on: `count` reports that the node sends by it, after those under way.
  bool wait_for_reports(std::size_t count) {
    const std::size_t wanted = diagnostics.messages.size() + count + 1;
    return wait_for([&] { return diagnostics.messages.size() >= wanted; });
  }
  std::vector<CarStates> cars_of(std::uint32_t id) const { return of_run(cars.messages, id); }
  std::vector<CouplerForces> couplers_of(std::uint32_t id) const { return of_run(couplers.messages, id); }

  template <class Message>
  static std::vector<Message> of_run(const std::vector<Message>& all, std::uint32_t id) {
    std::vector<Message> found;
    for (const Message& m : all) {
      if (m.run_id == id) found.push_back(m);
    }
    return found;
  }

  const NodeClient node{"/train_derail"};
  Record<rosgraph_msgs::Clock> clock{"/clock"};
  Record<tf2_msgs::TFMessage> tf{"/tf"};
  Record<CarStates> cars{"/train_derail/cars"};
  Record<CouplerForces> couplers{"/train_derail/couplers"};
  Record<visualization_msgs::MarkerArray> markers{"/train_derail/markers"};
  Record<RunInfo> run_info{"/train_derail/run_info"};
  Record<Outcome> outcome{"/train_derail/outcome"};
  Record<Inputs> inputs{"/train_derail/inputs"};
  Record<DiagnosticArray> diagnostics{"/diagnostics"};
  std::uint32_t run_id = 0;
};

TEST_F(Control, StepsByTicksAndBySeconds) {
  Step::Response r = node.step(5, 0.0);
  EXPECT_TRUE(r.success) << r.message;
  EXPECT_EQ(r.ticks, 5U);
  EXPECT_NEAR(r.time, 5 * kInterval, 1e-12);
  ASSERT_TRUE(wait_for_time(5 * kInterval));
  EXPECT_EQ(cars.last().time, r.time);
  r = node.step(0, 0.05);
  EXPECT_TRUE(r.success);
  EXPECT_EQ(r.ticks, 3U) << "rounded up to whole ticks";
  r = node.step(0, 0.06);
  EXPECT_EQ(r.ticks, 3U) << "0.06 s are three ticks, whatever 0.06 / 0.02 is";
  EXPECT_EQ(run_info.last().state, RunInfo::PAUSED);
  ASSERT_TRUE(wait_for_time(11 * kInterval));
  EXPECT_EQ(cars_of(run_id).size(), 12U) << "one message a tick, and the start";
}

TEST_F(Control, StepRefusesWhatMakesNoSense) {
  for (const double seconds : {-1.0, kNaN, std::numeric_limits<double>::infinity(), 1e12}) {
    const Step::Response r = node.step(0, seconds);
    expect_refused(r.success, r.message, {"seconds", "allowed"});
  }
  Step::Response r = node.step(0, 0.0);
  expect_refused(r.success, r.message, {"ticks = 0", "seconds = 0"});
  r = node.step(1, 1.0);
  expect_refused(r.success, r.message, {"ticks = 1", "seconds = 1"});
  EXPECT_EQ(r.time, 0.0) << "nothing has moved";
}

TEST_F(Control, StepOnlyWhilePaused) {
  ASSERT_TRUE(node.set_rate(0.01).success);
  ASSERT_TRUE(node.trigger("resume").success);
  const Step::Response r = node.step(1, 0.0);
  expect_refused(r.success, r.message, {"paused"});
}

TEST_F(Control, StepsBeyondTheEndSayWhereItIs) {
  Step::Response r = node.step(0, 100.0);
  expect_refused(r.success, r.message, {"ended at 3 s"});
  EXPECT_EQ(r.ticks, 150U);
  EXPECT_EQ(r.time, 3.0);
  r = node.step(1, 0.0);
  expect_refused(r.success, r.message, {"ended", "restart"});
  const auto resume = node.trigger("resume");
  expect_refused(resume.success, resume.message, {"ended", "restart"});
  EXPECT_TRUE(node.trigger("pause").success) << "nothing moves: that is what was wanted";
}

TEST_F(Control, EarlierMomentsAreShownAgainAndTheRunGoesOnFromWhereItStood) {
  ASSERT_TRUE(node.step(0, 1.0).success);
  ASSERT_TRUE(wait_for_time(1.0));
  const auto seek = [&](double time) {
    Seek::Request request;
    request.time = time;
    return node.call<Seek>("seek", request);
  };
  const std::vector<CarStates> first_second = cars_of(run_id);
  const auto there =
      std::find_if(first_second.begin(), first_second.end(), [](const auto& m) { return m.time == 0.5; });
  ASSERT_NE(there, first_second.end());
  const Seek::Response shown = seek(0.507);
  ASSERT_TRUE(shown.success) << shown.message;
  EXPECT_EQ(shown.time, 0.5);
  ASSERT_TRUE(wait_for([&] { return cars.last().time == 0.5 && couplers.last().time == 0.5; }));
  EXPECT_EQ(cars.last().cars, there->cars);
  EXPECT_GT(cars.last().header.stamp, first_second.back().header.stamp) << "tf takes no stamp twice";
  ASSERT_TRUE(wait_for([&] { return outcome.last().stop_time == 0.5; }));
  EXPECT_EQ(outcome.last().ended, Outcome::RUNNING);
  for (const double wrong : {-0.1, 1.1, std::nan("")}) {
    const Seek::Response refused = seek(wrong);
    expect_refused(refused.success, refused.message, {"time", "allowed: 0 to 1 s"});
    EXPECT_EQ(refused.time, 1.0);
  }
  ASSERT_TRUE(node.trigger("resume").success);
  ASSERT_TRUE(wait_for_end());
  expect_strictly_newer(clock.messages);
  // Without what was shown again, the run is the one that it would have been.
  std::vector<CarStates> all_cars = cars_of(run_id);
  std::vector<CouplerForces> all_couplers = couplers_of(run_id);
  const auto again = static_cast<std::ptrdiff_t>(first_second.size());
  all_cars.erase(all_cars.begin() + again);
  all_couplers.erase(all_couplers.begin() + again);
  expect_equal_to_simulation(all_cars, all_couplers, inputs::read_scenario_file(g_scenario_file));
  const double end = cars.last().time;
  EXPECT_EQ(run_info.last().kept_until, end);
  ASSERT_TRUE(seek(0.0).success);
  ASSERT_TRUE(wait_for([&] { return cars.last().time == 0.0; }));
  EXPECT_EQ(cars.last().cars, first_second.front().cars);
  ASSERT_TRUE(seek(end).success);
  ASSERT_TRUE(wait_for([&] { return cars.last().time == end && outcome.last().ended != Outcome::RUNNING; }));
  ASSERT_TRUE(node.set_rate(0.01).success);
  ASSERT_TRUE(node.restart({}, false).success);
  const Seek::Response running = seek(0.0);
  expect_refused(running.success, running.message, {"~pause first"});
}

TEST_F(Control, PauseWaitResumeIsBitEqualToARunWithoutPause) {
  ASSERT_TRUE(node.set_rate(1.0).success);
  ASSERT_TRUE(node.trigger("resume").success);
  ASSERT_TRUE(wait_for_time(0.3));
  const auto paused = node.trigger("pause");
  ASSERT_TRUE(paused.success) << paused.message;
  ASSERT_TRUE(wait_for_state(RunInfo::PAUSED));
  ASSERT_TRUE(wait_for([&] { return cars.last().time == run_info.last().time; }));
  const std::size_t count = cars.messages.size();
  const ros::Time stood_at = clock.last().clock;
  EXPECT_EQ(stood_at, run_info.last().header.stamp);
  ASSERT_TRUE(wait_for_reports(5));
  EXPECT_EQ(cars.messages.size(), count);
  EXPECT_EQ(clock.last().clock, stood_at);
  EXPECT_TRUE(node.trigger("pause").success) << "pausing twice does no harm";

  ASSERT_TRUE(node.trigger("resume").success);
  ASSERT_TRUE(wait_for_time(0.5));
  ASSERT_TRUE(node.set_rate(0.0).success);
  ASSERT_TRUE(wait_for_end());
  ASSERT_EQ(cars_of(run_id).size(), 151U);
  expect_equal_to_simulation(cars_of(run_id), couplers_of(run_id), inputs::read_scenario_file(g_scenario_file));
  expect_strictly_newer(clock.messages);
}

TEST_F(Control, ARestartForgetsWhatTheRunBeforeHasKept) {
  ASSERT_TRUE(node.step(20, 0.0).success);
  ASSERT_TRUE(wait_for([&] { return run_info.last().kept_until == 20 * kInterval; }));
  const Restart::Response r = node.restart({}, true);
  ASSERT_TRUE(r.success) << r.message;
  ASSERT_TRUE(wait_for_run(r.run_id));
  EXPECT_EQ(run_info.last().kept_until, 0.0);
}

TEST_F(Control, RateSetsThePace) {
  const auto wall_time_to = [&](double t) {
    const auto start = std::chrono::steady_clock::now();
    EXPECT_TRUE(node.trigger("resume").success);
    EXPECT_TRUE(wait_for_time(t));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  // A busy machine may be late, but never early.
  ASSERT_TRUE(node.set_rate(5.0).success);
  const double quick = wall_time_to(1.5);
  EXPECT_GE(quick, 1.5 / 5.0);
  EXPECT_LT(quick, 1.4) << "rate 1 would take 1.5 s";

  ASSERT_TRUE(node.trigger("pause").success);
  ASSERT_TRUE(node.set_rate(0.25).success);
  ASSERT_TRUE(wait_for([&] { return run_info.last().rate == 0.25; }));
  EXPECT_GE(wall_time_to(run_info.last().time + 0.1), 0.1 / 0.25);
}

TEST_F(Control, RateRefusesWhatMakesNoSense) {
  for (const double rate : {-1.0, kNaN, std::numeric_limits<double>::infinity(), 1e-6, 1e6}) {
    const SetRate::Response r = node.set_rate(rate);
    expect_refused(r.success, r.message, {"rate", "0.001 to 1000"});
  }
  EXPECT_EQ(run_info.last().rate, 0.0);
}

TEST_F(Control, ColoursCarsByPostureAtOnceAndInTheNextRun) {
  const auto colour_of_first = [&](std::size_t from) -> int {
    for (std::size_t i = markers.messages.size(); i-- > from;) {
      for (const visualization_msgs::Marker& m : markers.messages[i].markers) {
        if (m.ns == "cars" && m.id == 1 && m.action == visualization_msgs::Marker::ADD)
          return static_cast<int>(std::lround(255.0 * m.color.g));
      }
    }
    return -1;
  };
  // A car past the point, so that the two colours differ.
  ASSERT_TRUE(node.step(0, 1.0).success);
  const int past = scene::facts_of(scene::Look::past_point).colour.g,
            upright = scene::facts_of(scene::Lie::upright).colour.g;
  ASSERT_TRUE(wait_for([&] { return colour_of_first(0) == past; })) << colour_of_first(0);
  EXPECT_EQ(run_info.last().colours, "cause");
  const std::size_t before = markers.messages.size();
  ASSERT_TRUE(node.set_colours("posture").success);
  EXPECT_TRUE(wait_for([&] { return colour_of_first(before) == upright; })) << colour_of_first(before);
  EXPECT_TRUE(wait_for([&] { return run_info.last().colours == "posture"; }));
  const Restart::Response restarted = node.restart({}, true);
  ASSERT_TRUE(wait_for_run(restarted.run_id));
  EXPECT_EQ(run_info.last().colours, "posture");
  const SetColours::Response r = node.set_colours("mood");
  expect_refused(r.success, r.message, {"colours", "mood", "cause, posture"});
  EXPECT_TRUE(node.set_colours("cause").success);
  EXPECT_TRUE(wait_for([&] { return run_info.last().colours == "cause"; }));
}

TEST_F(Control, SaysSoWhenItCannotKeepUp) {
  ASSERT_TRUE(node.restart(kHeavy, true).success);
  ASSERT_TRUE(node.set_rate(1000.0).success);
  const std::size_t before = diagnostics.messages.size();
  ASSERT_TRUE(node.trigger("resume").success);
  EXPECT_TRUE(wait_for([&] {
    for (std::size_t i = before; i < diagnostics.messages.size(); ++i) {
      const DiagnosticStatus& s = diagnostics.messages[i].status[0];
      if (s.level == DiagnosticStatus::WARN && s.message.find("cannot keep up") != std::string::npos) return true;
    }
    return false;
  }));
}

TEST_F(Control, SlowIsNotTooSlow) {
  ASSERT_TRUE(node.set_rate(0.01).success);  // 2 s of wall time a tick
  ASSERT_TRUE(node.trigger("resume").success);
  const std::size_t before = diagnostics.messages.size();
  ASSERT_TRUE(wait_for_reports(5));
  for (std::size_t i = before; i < diagnostics.messages.size(); ++i) {
    EXPECT_EQ(diagnostics.messages[i].status[0].level, DiagnosticStatus::OK)
        << diagnostics.messages[i].status[0].message;
  }
}

TEST_F(Control, DiagnosticsGoOnWhilePausedAndSayWhatTheSolverDid) {
  ASSERT_TRUE(node.step(10, 0.0).success);
  ASSERT_TRUE(wait_for_reports(3));
  const DiagnosticStatus& s = diagnostics.last().status.at(0);
  EXPECT_EQ(s.name, "/train_derail: simulation");
  EXPECT_EQ(s.level, DiagnosticStatus::OK);
  std::set<std::string> keys;
  for (const auto& pair : s.values) {
    keys.insert(pair.key);
    if (pair.key == "solver steps") {
      EXPECT_GT(std::stoi(pair.value), 0);
    }
  }
  for (const char* key : {"achieved rate", "solver steps", "rejected steps", "lateness, largest [s]", "run id"}) {
    EXPECT_EQ(keys.count(key), 1U) << key;
  }
}

TEST_F(Control, GetInputsGivesTheScenarioOfTheRun) {
  const GetInputs::Response r = node.call<GetInputs>("get_inputs", {});
  EXPECT_TRUE(r.success);
  EXPECT_EQ(r.inputs.run_id, run_id);
  EXPECT_EQ(r.inputs.yaml, inputs.last().yaml);
  EXPECT_EQ(r.inputs.cars, 12U);
}

TEST_F(Control, RestartWithOverridesRunsTheNewInputs) {
  ASSERT_TRUE(node.step(20, 0.0).success);
  ASSERT_TRUE(wait_for_time(20 * kInterval));
  const ros::Time before = clock.last().clock;
  const Restart::Response r = node.restart({"initial.speed=50 mph", "consist[0].count=7"}, false);
  ASSERT_TRUE(r.success) << r.message;
  EXPECT_EQ(r.run_id, run_id + 1);
  ASSERT_TRUE(wait_for_run(r.run_id));
  ASSERT_TRUE(wait_for_end());
  EXPECT_GT(run_info.last().start, before);
  EXPECT_NEAR(inputs.last().speed, 50.0 * inputs::kMph, 1e-12);
  expect_strictly_newer(clock.messages);
  const inputs::Scenario expected =
      inputs::read_scenario_file(g_scenario_file, {{"initial.speed", "50 mph"}, {"consist[0].count", "7"}});
  expect_equal_to_simulation(cars_of(r.run_id), couplers_of(r.run_id), expected);
  bool cleared = false;
  for (const auto& array : markers.messages) {
    if (array.markers[0].header.stamp != run_info.last().start) continue;
    cleared = cleared || array.markers[0].action == visualization_msgs::Marker::DELETEALL;
  }
  EXPECT_TRUE(cleared) << "the longer train's markers must go";

  // What is not named stays as it was last.
  const Restart::Response again = node.restart({"initial.yaw_rate=0.1"}, true);
  ASSERT_TRUE(wait_for_run(again.run_id));
  EXPECT_NEAR(inputs.last().speed, 50.0 * inputs::kMph, 1e-12);
  EXPECT_EQ(inputs.last().yaw_rate, 0.1);
}

TEST_F(Control, RefusedRestartLeavesTheRunUntouched) {
  ASSERT_TRUE(node.step(20, 0.0).success);
  const auto refused = [&](const Restart::Response& r, const std::vector<std::string>& said) {
    expect_refused(r.success, r.message, said);
    EXPECT_EQ(r.run_id, run_id);
  };
  refused(node.restart({"ground.on_track_friction=-0.1"}), {"ground.on_track_friction", "-0.1", "allowed"});
  refused(node.restart({"initial.sped=3"}), {"initial.sped", "speed"});
  refused(node.restart({"initial.speed=3 kg"}), {"initial.speed", "3 kg"});
  refused(node.restart({"initial.speed"}), {"initial.speed"});
  refused(node.restart({}, true, "{consist: [], initial: {speed: 1, yaw_rate: 0}}"), {"consist"});
  refused(node.restart({}, true, "{ this: is: not yaml"), {"restart"});
  refused(node.restart({}, true, whole_scenario(), true), {"scenario", "reload_parameters"});
  EXPECT_EQ(inputs.last().run_id, run_id);
  ASSERT_TRUE(node.trigger("resume").success);
  ASSERT_TRUE(wait_for_end());
  EXPECT_EQ(run_info.last().run_id, run_id);
  ASSERT_EQ(cars_of(run_id).size(), 151U);
  expect_equal_to_simulation(cars_of(run_id), couplers_of(run_id), inputs::read_scenario_file(g_scenario_file));
  const Restart::Response r = node.restart();
  EXPECT_TRUE(r.success) << "nothing of what was refused is kept: " << r.message;
}

TEST_F(Control, RestartReadsTheParametersAgain) {
  ros::param::set("/train_derail/scenario/initial/speed", "11 m/s");
  ros::param::set("/train_derail/set", "initial.yaw_rate=0.05");
  const Restart::Response kept = node.restart();
  ASSERT_TRUE(wait_for_run(kept.run_id));
  EXPECT_NEAR(inputs.last().speed, 37.0 * inputs::kMph, 1e-12) << "not asked to read them";
  const Restart::Response r = node.restart({}, true, "", true);
  ASSERT_TRUE(r.success) << r.message;
  ASSERT_TRUE(wait_for_run(r.run_id));
  EXPECT_EQ(inputs.last().speed, 11.0);
  EXPECT_EQ(inputs.last().yaw_rate, 0.05);
  ros::param::set("/train_derail/scenario/initial/speed", "eleven");
  const Restart::Response refused = node.restart({}, true, "", true);
  expect_refused(refused.success, refused.message, {"/train_derail/scenario", "initial.speed", "eleven"});
}

TEST_F(Control, AHundredRestartsNeverTurnTimeBack) {
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(node.restart({}, true).success);
    ASSERT_TRUE(node.step(1 + i % 3, 0.0).success);
  }
  ASSERT_TRUE(wait_for_run(run_id + 100));
  ASSERT_TRUE(wait_for([&] { return tf.last().transforms.at(0).header.stamp == clock.last().clock; }));
  expect_strictly_newer(clock.messages);
  // The first message may be the latched one of a test before.
  for (std::size_t i = 1; i < tf.messages.size(); ++i) {
    ASSERT_GT(tf.messages[i].transforms[0].header.stamp, tf.messages[i - 1].transforms[0].header.stamp) << i;
  }
  EXPECT_GE(tf.messages.size(), 200U);
}

TEST_F(Control, PauseCutsStepsShortAndTheyAnswer) {
  ASSERT_TRUE(node.restart(kHeavy, true).success);
  Step::Response answer;
  std::thread stepping([&] { answer = node.step(100000, 0.0); });
  EXPECT_TRUE(wait_for([&] { return cars.last().cars.size() == 1000 && cars.last().time > 0.0; }));
  const Step::Response other = node.step(1, 0.0);
  expect_refused(other.success, other.message, {"under way"});
  const auto resume = node.trigger("resume");
  expect_refused(resume.success, resume.message, {"under way"});
  EXPECT_TRUE(node.trigger("pause").success);
  stepping.join();
  expect_refused(answer.success, answer.message, {"cut short by ~pause"});
  EXPECT_GT(answer.ticks, 0U);
  EXPECT_LT(answer.time, 100.0);
}

TEST_F(Control, FailedIntegrationIsAnOutcomeAndTheNodeLivesOn) {
  ASSERT_TRUE(node.restart({"solver.steps_max=40"}, false).success);
  ASSERT_TRUE(wait_for_state(RunInfo::FAILED));
  ASSERT_TRUE(wait_for([&] { return outcome.last().ended == Outcome::INTEGRATION_FAILED; }));
  EXPECT_FALSE(outcome.last().message.empty());
  EXPECT_FALSE(run_info.last().message.empty());
  EXPECT_TRUE(wait_for([&] { return diagnostics.last().status.at(0).level == DiagnosticStatus::ERROR; }));
  const auto resume = node.trigger("resume");
  expect_refused(resume.success, resume.message, {"failed", "restart"});
  const Restart::Response r = node.restart({"solver.steps_max=100000"}, false);
  ASSERT_TRUE(r.success) << r.message;
  ASSERT_TRUE(wait_for_run(r.run_id));
  ASSERT_TRUE(wait_for_end());
  EXPECT_EQ(run_info.last().state, RunInfo::ENDED);
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_ros_control");
  if (argc < 2) return 2;
  train_derail::test::g_scenario_file = argv[1];
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
