// The parts of the ROS face that need no master: pace, clock, parameters, events, markers, commands.
#include <cmath>
#include <limits>
#include <thread>

#include <gtest/gtest.h>

#include "marker_check.hpp"
#include "train_derail/Event.h"
#include "train_derail/ros/command_queue.hpp"
#include "train_derail/ros/event_detector.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/marker_scene.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/pile_up_follower.hpp"
#include "train_derail/ros/sim_clock.hpp"

namespace train_derail::ros_face {
namespace {

using XmlRpc::XmlRpcValue;

const WallTime kStart{std::chrono::hours(5)};
WallTime at(double s) { return kStart + wall_seconds(s); }

TEST(Pacer, IsDueAlongTheRate) {
  Pacer pacer(2.0, 0.02);
  pacer.anchor(at(0.0), 10.0);
  EXPECT_NEAR(to_seconds(pacer.due(13.0) - at(0.0)), 1.5, 1e-6);
  pacer.set_rate(0.5);
  pacer.anchor(at(4.0), 13.0);
  EXPECT_NEAR(to_seconds(pacer.due(14.0) - at(4.0)), 2.0, 1e-6);
}

TEST(Pacer, NeverBurstsAfterASlowSpell) {
  Pacer pacer(1.0, 0.02);
  pacer.anchor(at(0.0), 0.0);
  // Ten ticks in time, one that takes 5 s, then the machine is quick again: waits as its loop does.
  double wall = 0.0, last_sent = 0.0;
  for (int tick = 1; tick <= 200; ++tick) {
    const double t = 0.02 * tick;
    wall = std::max(wall, to_seconds(pacer.due(t) - at(0.0)));
    wall += tick == 11 ? 5.0 : 1e-4;
    pacer.done(at(wall), t);
    if (tick > 12) {
      EXPECT_GT(wall - last_sent, 0.019) << "tick " << tick;
    }
    last_sent = wall;
  }
  EXPECT_NEAR(pacer.take_lost(), 5.0, 0.001);
  EXPECT_EQ(pacer.take_lost(), 0.0);
}

TEST(Pacer, CatchesUpWithOrdinaryJitter) {
  Pacer pacer(1.0, 0.02);
  pacer.anchor(at(0.0), 0.0);
  double wall = 0.0;
  for (int tick = 1; tick <= 1000; ++tick) {
    wall = std::max(wall, to_seconds(pacer.due(0.02 * tick) - at(0.0))) + (tick % 7 == 0 ? 0.004 : 0.0002);
    EXPECT_LE(pacer.done(at(wall), 0.02 * tick), 0.0041);
  }
  EXPECT_EQ(pacer.take_lost(), 0.0);
  EXPECT_NEAR(wall, 20.0, 0.01) << "the pace is the anchor's, not a sum of waits";
}

TEST(Pacer, MeasuresTheAchievedRate) {
  Pacer pacer(1.0, 0.02);
  pacer.anchor(at(1.0), 0.0);
  EXPECT_NEAR(pacer.take_achieved_rate(at(3.0), 1.0), 0.5, 1e-9);
  EXPECT_NEAR(pacer.take_achieved_rate(at(4.0), 3.0), 2.0, 1e-9);
}

TEST(SimClock, StampsAreOnTheGridAndNeverGoBack) {
  SimClock clock;
  clock.start_run();
  EXPECT_GT(clock.now(), ros::Time(0));
  ros::Time last = clock.now();
  for (int run = 0; run < 3; ++run) {
    for (int tick = 1; tick <= 170; ++tick) {
      clock.advance(tick * 0.02);
      EXPECT_EQ((clock.now() - clock.start()).toNSec(), tick * 20000000LL);
      EXPECT_GT(clock.now(), last);
      last = clock.now();
    }
    clock.start_run();
    EXPECT_GT(clock.now(), last);
    EXPECT_EQ(clock.start().nsec, 0U);
    last = clock.now();
  }
}

XmlRpcValue from_xml(const std::string& members) {
  int offset = 0;
  return XmlRpcValue("<value><struct>" + members + "</struct></value>", &offset);
}
std::string member(const std::string& name, const std::string& value) {
  return "<member><name>" + name + "</name><value>" + value + "</value></member>";
}

TEST(Parameters, NumbersKeepEveryDigitOnTheWayToYaml) {
  const double awkward[] = {0.1, 1.0 / 3.0, 1e-300, 123456789.123456789, -2.5e17};
  for (const double x : awkward) {
    const YAML::Node node = to_yaml_tree(XmlRpcValue(x), "x");
    EXPECT_EQ(std::strtod(node.Scalar().c_str(), nullptr), x);
  }
  EXPECT_EQ(to_yaml_tree(XmlRpcValue(std::numeric_limits<double>::infinity()), "x").Scalar(), ".inf");
  EXPECT_EQ(to_yaml_tree(XmlRpcValue(3), "x").Scalar(), "3");
  EXPECT_EQ(to_yaml_tree(XmlRpcValue(true), "x").Scalar(), "true");
  EXPECT_EQ(to_yaml_tree(XmlRpcValue("50e6 lbf/ft"), "x").Scalar(), "50e6 lbf/ft");
}

TEST(Parameters, TreesKeepTheirShape) {
  XmlRpcValue tree;
  tree["consist"][0]["count"] = 3;
  tree["consist"][1]["count"] = 4;
  tree["ground"]["on_track_law"] = "guided";
  const YAML::Node yaml = to_yaml_tree(tree, "/n/scenario");
  EXPECT_EQ(yaml["consist"].size(), 2U);
  EXPECT_EQ(yaml["consist"][1]["count"].Scalar(), "4");
  EXPECT_EQ(yaml["ground"]["on_track_law"].Scalar(), "guided");
}

TEST(Parameters, DefaultsAndValues) {
  const NodeParameters d = read_node_parameters(XmlRpcValue(), "/n");
  EXPECT_EQ(d.rate, 1.0);
  EXPECT_FALSE(d.start_paused);
  XmlRpcValue tree;
  tree["rate"] = "5e-1";
  tree["publish"]["clock"] = false;
  tree["publish"]["markers_every"] = 2;
  tree["events"]["coupler_force"] = "500 kip";
  tree["scenario"]["anything"] = 1;
  const NodeParameters p = read_node_parameters(tree, "/n");
  EXPECT_EQ(p.rate, 0.5);
  EXPECT_FALSE(p.publish_clock);
  EXPECT_EQ(p.stream.markers_every, 2);
  EXPECT_NEAR(p.stream.event_coupler_force, 500.0 * inputs::kKip, 1e-3);
}

void expect_refused(const std::string& xml, const std::string& key, const std::string& value,
                    const std::string& allowed) {
  try {
    read_node_parameters(from_xml(xml), "/n");
    ADD_FAILURE() << "accepted: " << xml;
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(e.where(), "/n");
    EXPECT_EQ(e.key(), key);
    EXPECT_EQ(e.value(), value);
    EXPECT_NE(e.allowed().find(allowed), std::string::npos) << e.what();
  }
}

TEST(Parameters, MistakesNameParameterValueAndRange) {
  expect_refused(member("rate", "<double>-1</double>"), "rate", "-1", "0.001 to 1000");
  expect_refused(member("rate", "<double>nan</double>"), "rate", "nan", "0.001 to 1000");
  expect_refused(member("rate", "<string>fast</string>"), "rate", "fast", "");
  expect_refused(member("rate", "<string>2 m</string>"), "rate", "2 m", "");
  expect_refused(member("start_paused", "<int>1</int>"), "start_paused", "1", "true, false");
  expect_refused(member("frame_prefix", "<string>/a</string>"), "frame_prefix", "/a", "not beginning with /");
  expect_refused(member("raet", "<double>1</double>"), "raet", "1", "rate");
  expect_refused(member("publish", "<struct>" + member("clok", "<boolean>1</boolean>") + "</struct>"), "publish/clok",
                 "true", "publish/clock");
  expect_refused(member("publish", "<struct>" + member("markers_every", "<double>1.5</double>") + "</struct>"),
                 "publish/markers_every", "1.5", "0 to 1000");
  expect_refused(member("publish", "<boolean>1</boolean>"), "publish", "true", "publish/clock");
  expect_refused(member("events", "<struct>" + member("coupler_force", "<string>5 m</string>") + "</struct>"),
                 "events/coupler_force", "5 m", "N");
}

TEST(Parameters, SpeedAndSetBecomeOverrides) {
  XmlRpcValue tree;
  tree["scenario"]["title"] = "x";
  tree["speed"] = "50 mph";
  tree["set"] = " initial.yaw_rate=0.3;coupler.slack = 1 in ; initial.speed=10; ";
  const ScenarioSource source = read_scenario_source(tree, "/n");
  ASSERT_EQ(source.overrides.size(), 3U);
  EXPECT_EQ(source.overrides.back().key, "initial.speed");
  EXPECT_EQ(source.overrides.back().value, "10");
  EXPECT_THROW(read_scenario_source(XmlRpcValue(), "/n"), inputs::InputError);
}

TEST(Frames, NumbersHaveThreeDigitsAtLeast) {
  const Frames frames{"map", "a/"};
  EXPECT_EQ(frames.car(7), "a/car_007");
  EXPECT_EQ(frames.car(1000), "a/car_1000");
}

simulation::CarSnapshot car(double x, bool past_pod, bool off_track) {
  return {x, 0.0, 0.0, 10.0, 0.0, 0.0, past_pod, off_track, 0.0, 0.0};
}
simulation::CouplerSnapshot coupler(double force) { return {1.2, 0.0, force, 0.0, 0.0, 0.0, 0.0, 0.0}; }

TEST(EventDetector, SaysOnceWhatHappens) {
  EventDetector detector(1000.0);
  outcome::Outcome outcome;
  const auto types = [&](const simulation::Snapshot& s) {
    std::vector<int> found;
    for (const Occurrence& o : detector.observe(s, outcome)) found.push_back(o.type);
    return found;
  };
  EXPECT_EQ(types({0.0, {car(0, true, false), car(-20, false, false)}, {coupler(0)}}),
            std::vector<int>{Event::CAR_PAST_POD});
  EXPECT_TRUE(types({0.1, {car(1, true, false), car(-19, false, false)}, {coupler(999)}}).empty());
  EXPECT_EQ(types({0.2, {car(2, true, false), car(-18, false, true)}, {coupler(0)}}),
            std::vector<int>{Event::CAR_OFF_TRACK});
  outcome.touches = 1;
  outcome.closing_speed_max.speed = 2.0;
  EXPECT_EQ(types({0.3, {car(3, true, false), car(-17, false, true)}, {coupler(0)}}), std::vector<int>{Event::CONTACT});
  outcome.touches = 2;  // slower than the first
  EXPECT_TRUE(types({0.4, {car(3, true, false), car(-17, false, true)}, {coupler(0)}}).empty());
  outcome.touches = 3;
  outcome.closing_speed_max.speed = 3.0;
  EXPECT_EQ(types({0.5, {car(3, true, false), car(-17, false, true)}, {coupler(0)}}), std::vector<int>{Event::CONTACT});
  outcome.ended = outcome::Ended::at_rest;
  EXPECT_EQ(types({0.6, {car(3, true, false), car(-17, false, true)}, {coupler(2000)}}),
            (std::vector<int>{Event::COUPLER_PEAK, Event::END}));
  EXPECT_TRUE(types({0.6, {car(3, true, false), car(-17, false, true)}, {coupler(2000)}}).empty());
}

TEST(EventDetector, GivesThePeakOfEachExcursion) {
  EventDetector detector(1000.0);
  const outcome::Outcome outcome;
  std::vector<Occurrence> found;
  const double forces[] = {0, 1500, -2500, 900, 1200, 400, 0, -1100, -300};
  for (int i = 0; i < 9; ++i) {
    const simulation::Snapshot s{0.1 * i, {car(-5, false, false), car(-25, false, false)}, {coupler(forces[i])}};
    for (const Occurrence& o : detector.observe(s, outcome)) found.push_back(o);
  }
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].type, Event::COUPLER_PEAK);
  EXPECT_EQ(found[0].coupler, 1);
  EXPECT_EQ(found[0].value, -2500.0);
  EXPECT_NEAR(found[0].time, 0.2, 1e-12);
  EXPECT_EQ(found[1].value, -1100.0);
}

inputs::Scenario short_train(int cars) {
  inputs::Scenario s;
  inputs::CarBlock block;
  block.count = cars;
  block.length = 18.0;
  block.weight = 6.0e5;
  s.consist = {block};
  s.initial.speed = 16.0;
  s.initial.yaw_rate = 0.2;
  return s;
}

TEST(MarkerScene, IsValidFromStartToEnd) {
  for (const int cars : {1, 12}) {
    simulation::Simulation simulation(short_train(cars));
    MarkerScene scene(simulation.cars(), 1.2, "map");
    for (double t = 0.0; t <= 4.0; t += 0.5) {
      simulation.advance(t);
      scene.update(simulation.snapshot(), simulation.outcome(), 0.0, 0.0, ros::Time(1.0 + t));
      test::expect_valid(scene.markers(), "map");
      test::expect_valid(scene.markers_on_empty(), "map");
      EXPECT_EQ(scene.markers_on_empty().markers.front().action, visualization_msgs::Marker::DELETEALL);
    }
  }
}

TEST(MarkerScene, EveryCarIsWhereItIsAndCouplersShowTheirForce) {
  simulation::Simulation simulation(short_train(12));
  simulation.advance(1.5);
  const simulation::Snapshot now = simulation.snapshot();
  MarkerScene scene(simulation.cars(), 1.2, "map");
  scene.update(now, simulation.outcome(), 0.0, 0.0, ros::Time(1.0));
  std::size_t body_points = 0, past_pod_points = 0, past_pod = 0;
  for (const simulation::CarSnapshot& c : now.cars) past_pod += c.past_pod ? 1 : 0;
  for (const auto& m : scene.markers().markers) {
    if (m.ns.rfind("cars_o", 0) == 0 && m.ns != "cars_outline") body_points += m.points.size();
    if (m.ns == "cars_past_pod") past_pod_points = m.points.size();
    if (m.ns == "couplers") {
      EXPECT_EQ(m.points.size(), 6 * now.couplers.size());
      for (std::size_t i = 0; i < now.couplers.size(); ++i) {
        const auto& c = m.colors[6 * i];
        if (now.couplers[i].axial_force > 1e5) {
          EXPECT_GT(c.r, c.b) << "buff is red";
        }
        if (now.couplers[i].axial_force < -1e5) {
          EXPECT_GT(c.b, c.r) << "draft is blue";
        }
        if (now.couplers[i].axial_force == 0.0) {
          EXPECT_NEAR(c.r, c.b, 1e-6) << "neutral is grey";
        }
      }
    }
    if (m.ns != "cars_outline") continue;
    for (std::size_t i = 0; i < now.cars.size(); ++i) {
      double x = 0.0, y = 0.0;
      for (std::size_t k = 0; k < 8; ++k) {
        x += m.points[8 * i + k].x / 8.0;
        y += m.points[8 * i + k].y / 8.0;
      }
      EXPECT_NEAR(x, now.cars[i].x, 1e-9);
      EXPECT_NEAR(y, now.cars[i].y, 1e-9);
    }
  }
  ASSERT_GT(past_pod, 0U);
  EXPECT_EQ(past_pod_points % past_pod, 0U);
  EXPECT_EQ(body_points + past_pod_points, past_pod_points / past_pod * now.cars.size()) << "each car in one list";
}

TEST(PileUpFollower, GoesToTheMiddleOfTheDerailedCars) {
  PileUpFollower follower;
  follower.update({0.0, {car(0, true, false), car(-20, false, false)}, {}});
  EXPECT_EQ(follower.x(), 0.0);
  for (int i = 1; i < 500; ++i)
    follower.update({0.02 * i, {car(30, true, false), car(10, false, true), car(-90, false, false)}, {}});
  EXPECT_NEAR(follower.x(), 20.0, 1e-3);
}

TEST(CommandQueue, AnswersWithdrawsAndCloses) {
  CommandQueue queue;
  bool ran = false;
  const Answer late = queue.call([&](const CommandQueue::TicketPtr&) { ran = true; }, std::chrono::milliseconds(20));
  EXPECT_FALSE(late.success);
  queue.execute();
  EXPECT_FALSE(ran) << "withdrawn work must not run";

  CommandQueue::TicketPtr kept;
  std::thread loop([&] {
    while (!kept) {
      queue.wait_until(WallClock::now() + std::chrono::seconds(10));
      queue.execute();
    }
    queue.answer(kept, {true, "later"});
    queue.answer(kept, {false, "too late"});
  });
  const Answer answer =
      queue.call([&](const CommandQueue::TicketPtr& ticket) { kept = ticket; }, std::chrono::seconds(10));
  loop.join();
  EXPECT_TRUE(answer.success);
  EXPECT_EQ(answer.message, "later");
  queue.close();
  EXPECT_FALSE(queue.call([](const CommandQueue::TicketPtr&) {}, std::chrono::seconds(10)).success);
}

}  // namespace
}  // namespace train_derail::ros_face

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
