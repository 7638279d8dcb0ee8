// The parts of the ROS face that need no master: pace, clock, parameters, events, markers, commands.
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <thread>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "marker_check.hpp"
#include "train_derail/Event.h"
#include "train_derail/model/track.hpp"
#include "train_derail/ros/car_shape.hpp"
#include "train_derail/ros/command_queue.hpp"
#include "train_derail/ros/event_detector.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/marker_scene.hpp"
#include "train_derail/ros/messages.hpp"
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
  return {x, 0.0, 0.0, 10.0, 0.0, 0.0, past_pod, off_track, 0.0, 0.0, past_pod};
}
simulation::CouplerSnapshot coupler(double force) { return {1.2, 0.0, force, 0.0, 0.0, 0.0, 0.0, 0.0, false}; }

TEST(EventDetector, SaysOnceWhatHappens) {
  EventDetector detector(1000.0);
  outcome::Outcome outcome;
  const model::Incidents incidents;
  const auto types = [&](const simulation::Snapshot& s) {
    std::vector<int> found;
    for (const Occurrence& o : detector.observe(s, outcome, incidents)) found.push_back(o.type);
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
  const model::Incidents incidents;
  std::vector<Occurrence> found;
  const double forces[] = {0, 1500, -2500, 900, 1200, 400, 0, -1100, -300};
  for (int i = 0; i < 9; ++i) {
    const simulation::Snapshot s{0.1 * i, {car(-5, false, false), car(-25, false, false)}, {coupler(forces[i])}};
    for (const Occurrence& o : detector.observe(s, outcome, incidents)) found.push_back(o);
  }
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].type, Event::COUPLER_PEAK);
  EXPECT_EQ(found[0].coupler, 1);
  EXPECT_EQ(found[0].value, -2500.0);
  EXPECT_NEAR(found[0].time, 0.2, 1e-12);
  EXPECT_EQ(found[1].value, -1100.0);
}

TEST(EventDetector, SaysWhatDerailedACarAndWhatBrokeACoupler) {
  EventDetector detector(1e9);
  const outcome::Outcome outcome;
  model::Incidents incidents;
  const simulation::Snapshot now{2.0, {car(5, false, false), car(-15, false, false)}, {coupler(0)}};
  EXPECT_TRUE(detector.observe(now, outcome, incidents).empty());
  incidents.derailments = {{1.5, 1, false, model::Cause::lateral, 0.0, 0.0},
                           {1.6, 1, true, model::Cause::pod, 0.0, 0.0}};
  incidents.broken = {{1.7, 0, model::BrokenCoupler::By::swing}};
  std::vector<Occurrence> found = detector.observe(now, outcome, incidents);
  ASSERT_EQ(found.size(), 2U) << "a car derails once, with its first truck";
  EXPECT_EQ(found[0].type, Event::CAR_DERAILED);
  EXPECT_EQ(found[0].car, 2);
  EXPECT_EQ(found[0].time, 1.5);
  EXPECT_EQ(found[0].value, 10.0);
  EXPECT_NE(found[0].text.find("lateral"), std::string::npos) << found[0].text;
  EXPECT_NE(found[0].text.find("rear"), std::string::npos) << found[0].text;
  EXPECT_EQ(found[1].type, Event::COUPLER_BROKEN);
  EXPECT_EQ(found[1].coupler, 1);
  EXPECT_EQ(found[1].time, 1.7);
  EXPECT_NE(found[1].text.find("swing"), std::string::npos) << found[1].text;
  EXPECT_TRUE(detector.observe(now, outcome, incidents).empty());
  incidents.derailments.push_back({1.9, 0, true, model::Cause::torn_track, 0.0, 0.0});
  found = detector.observe(now, outcome, incidents);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].car, 1);
  EXPECT_NE(found[0].text.find("torn"), std::string::npos) << found[0].text;
}

model::Impact impact(double closing_normal) {
  return {3.0, 3.5, 4, 6, model::Face::rear, model::Face::left, -8.0, 2.0, 12.0, -1.0, 9.0, closing_normal, 4e5, 7e6};
}

TEST(Messages, ImpactsSayWhoHitWhomAndWhere) {
  std_msgs::Header header;
  header.stamp = ros::Time(7.0);
  const Impacts m = to_message(std::vector<model::Impact>{impact(5.0)}, 4.0, header, 3);
  EXPECT_EQ(m.header.stamp, header.stamp);
  EXPECT_EQ(m.run_id, 3U);
  EXPECT_EQ(m.time, 4.0);
  ASSERT_EQ(m.impacts.size(), 1U);
  const Impact& i = m.impacts[0];
  EXPECT_EQ(i.time, 3.0);
  EXPECT_EQ(i.end, 3.5);
  EXPECT_EQ(i.car_a, 5U);
  EXPECT_EQ(i.car_b, 7U);
  EXPECT_EQ(i.face_a, Impact::REAR);
  EXPECT_EQ(i.face_b, Impact::LEFT);
  EXPECT_EQ(i.along_a, -8.0);
  EXPECT_EQ(i.along_b, 2.0);
  EXPECT_EQ(i.x, 12.0);
  EXPECT_EQ(i.y, -1.0);
  EXPECT_EQ(i.closing_speed, 9.0);
  EXPECT_EQ(i.closing_normal, 5.0);
  EXPECT_EQ(i.impulse, 4e5);
  EXPECT_EQ(i.peak_force, 7e6);
}

TEST(Messages, HistogramOfImpactsHasStepsOfFiveMph) {
  const auto histogram = [](const std::vector<double>& mph) {
    std::vector<model::Impact> all;
    for (const double v : mph) all.push_back(impact(v * inputs::kMph));
    return to_message(all, 0.0, {}, 1);
  };
  EXPECT_TRUE(histogram({}).counts.empty());
  EXPECT_TRUE(histogram({}).bin_edges.empty());
  const Impacts m = histogram({-1.0, 0.0, 4.9, 5.1, 22.0, 6.0});
  EXPECT_EQ(m.counts, (std::vector<std::uint32_t>{3, 2, 0, 0, 1}));
  ASSERT_EQ(m.bin_edges.size(), 6U);
  for (std::size_t i = 0; i < m.bin_edges.size(); ++i) {
    EXPECT_NEAR(m.bin_edges[i], 5.0 * static_cast<double>(i) * inputs::kMph, 1e-12);
  }
}

TEST(Messages, OutcomeHasWhatTheExtendedModelYields) {
  outcome::Outcome o;
  o.cars_derailed = 1;
  o.derailed_by = {2, 3, 4};
  o.couplers_broken = 5;
  o.impacts = {6, 7.0, 8.0, 9.0};
  o.blockage_force = 10.0;
  o.pile_up.area = 11.0;
  o.pile_up.cars_across = 12;
  o.pile_up.groups = 13;
  o.pile_up.main_cars = 14;
  o.pile_up.main_length = 15.0;
  o.energy.work_rails = 16.0;
  o.energy.work_coupler_damping = 17.0;
  o.energy.work_coupler_break = 18.0;
  o.energy.work_impact_normal = 19.0;
  o.energy.work_impact_friction = 20.0;
  o.energy.work_grade = 21.0;
  o.energy.work_kicks = -22.0;
  const Outcome m = to_message(o, {}, 1);
  EXPECT_EQ(m.cars_derailed, 1U);
  EXPECT_EQ(m.derailed_by_pod, 2U);
  EXPECT_EQ(m.derailed_by_lateral, 3U);
  EXPECT_EQ(m.derailed_by_torn_track, 4U);
  EXPECT_EQ(m.couplers_broken, 5U);
  EXPECT_EQ(m.impacts, 6U);
  EXPECT_EQ(m.impact_speed_max, 7.0);
  EXPECT_EQ(m.impact_force_peak, 8.0);
  EXPECT_EQ(m.impact_impulse_max, 9.0);
  EXPECT_EQ(m.blockage_force, 10.0);
  EXPECT_EQ(m.pile_up_area, 11.0);
  EXPECT_EQ(m.cars_across, 12U);
  EXPECT_EQ(m.groups, 13U);
  EXPECT_EQ(m.main_pile_cars, 14U);
  EXPECT_EQ(m.main_pile_length, 15.0);
  EXPECT_EQ(m.work_rails, 16.0);
  EXPECT_EQ(m.work_coupler_damping, 17.0);
  EXPECT_EQ(m.work_coupler_break, 18.0);
  EXPECT_EQ(m.work_impact_normal, 19.0);
  EXPECT_EQ(m.work_impact_friction, 20.0);
  EXPECT_EQ(m.work_grade, 21.0);
  EXPECT_EQ(m.work_kicks, -22.0);
}

TEST(Messages, CarsAndCouplersSayWhatBecameOfThem) {
  simulation::CarSnapshot off = car(1.0, false, true);
  off.derailed = true;
  const std::vector<std::pair<model::Cause, int>> causes{{model::Cause::none, CarState::NONE},
                                                         {model::Cause::pod, CarState::POD},
                                                         {model::Cause::lateral, CarState::LATERAL},
                                                         {model::Cause::torn_track, CarState::TORN_TRACK}};
  for (const auto& [cause, constant] : causes) {
    off.cause = cause;
    const CarState m = to_message(std::vector<simulation::CarSnapshot>{off}, 0.0, {}, 1).cars.at(0);
    EXPECT_TRUE(m.derailed);
    EXPECT_EQ(m.cause, constant);
  }
  simulation::CouplerSnapshot broken = coupler(0.0);
  broken.broken = true;
  const CouplerForces m = to_message(std::vector<simulation::CouplerSnapshot>{coupler(0.0), broken}, 0.0, {}, 1);
  EXPECT_FALSE(m.couplers.at(0).broken);
  EXPECT_TRUE(m.couplers.at(1).broken);
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

/// On rails that yield.
inputs::Scenario short_accident(int cars) {
  inputs::Scenario s = short_train(cars);
  s.ground.on_track_law = inputs::OnTrackLaw::rails;
  s.brakes.law = inputs::BrakeLaw::air;
  s.solver.method = inputs::Method::semi_implicit;
  s.solver.fixed_step = 0.002;
  return s;
}

using visualization_msgs::Marker;

const std::vector<std::string> kBodies{"tank_car", "hopper", "boxcar", "locomotive", "car"};

inputs::Scenario train_of_all_bodies() {
  inputs::Scenario s = short_train(1);
  const inputs::CarBlock block = s.consist[0];
  s.consist.clear();
  for (const std::string& body : kBodies) {
    s.consist.push_back(block);
    s.consist.back().name = body;
  }
  return s;
}

/// The marker with this key if it is shown.
const Marker* shown(const MarkerScene& scene, const std::string& ns, int id) {
  for (const Marker& m : scene.markers().markers) {
    if (m.ns == ns && m.id == id && m.action == Marker::ADD) return &m;
  }
  return nullptr;
}

double grey(const std_msgs::ColorRGBA& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

model::Car car_of(const std::string& body, double length) { return {body, 6e4, 6e5, 1e6, length, 0.6 * length, 3.0}; }

TEST(CarShape, FitsTheFootprintAndFacesUp) {
  for (const std::string& body : kBodies) {
    for (const double length : {1.0, 12.0, 24.0}) {
      const CarShape shape = car_shape(car_of(body, length));
      ASSERT_GT(shape.body.size(), 0U);
      EXPECT_EQ(shape.body.size() % 3, 0U);
      EXPECT_EQ(shape.dark.size() % 3, 0U);
      EXPECT_EQ(shape.edges.size() % 2, 0U);
      double reach = 0.0, side = 0.0, top = 0.0;
      for (const auto& p : shape.body) {
        reach = std::max(reach, std::abs(p.x));
        side = std::max(side, std::abs(p.y));
        top = std::max(top, p.z);
      }
      EXPECT_LE(reach, 0.5 * length + 1e-9) << body;
      EXPECT_GE(reach, 0.9 * 0.5 * length) << body;
      EXPECT_LE(side, 1.5 + 1e-9) << body;
      EXPECT_GE(side, 0.9 * 1.5) << body;
      EXPECT_NEAR(top, kRoofHeight, 1e-9) << body;
      for (std::size_t i = 0; i < 8; ++i) {
        EXPECT_NEAR(std::abs(shape.edges[i].x), 0.5 * length, 1e-9) << body;
        EXPECT_NEAR(std::abs(shape.edges[i].y), 1.5, 1e-9) << body;
      }
      // RViz lights a face from the side that its corners run round counter-clockwise.
      for (std::size_t i = 0; i < shape.body.size(); i += 3) {
        const auto &a = shape.body[i], &b = shape.body[i + 1], &c = shape.body[i + 2];
        const Eigen::Vector3d n = Eigen::Vector3d(b.x - a.x, b.y - a.y, b.z - a.z)
                                      .cross(Eigen::Vector3d(c.x - a.x, c.y - a.y, c.z - a.z))
                                      .normalized();
        if (a.z + b.z + c.z > 3.0 * 2.8 && std::abs(n.z()) > 0.6) {
          EXPECT_GT(n.z(), 0.0) << body << ", corner " << i;
        }
      }
    }
  }
}

TEST(CarShape, TellsTheNamesApart) {
  std::set<std::vector<double>> bodies;
  for (const std::string& body : kBodies) {
    std::vector<double> all;
    for (const auto& p : car_shape(car_of(body, 18.0)).body) all.insert(all.end(), {p.x, p.y, p.z});
    EXPECT_TRUE(bodies.insert(all).second) << body << " looks like another one";
    EXPECT_LT(all.size() / 3, 200U) << body << ": a thousand cars are sent fifty times a second";
  }
  const CarShape other = car_shape(car_of("caboose", 18.0)), plain = car_shape(car_of("car", 18.0));
  EXPECT_EQ(other.body, plain.body);
}

TEST(MarkerScene, IsValidFromStartToEnd) {
  for (const inputs::Scenario& scenario : {short_train(1), short_train(12), train_of_all_bodies(), short_accident(12)}) {
    simulation::Simulation simulation(scenario);
    MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
    for (double t = 0.0; t <= 4.0; t += 0.5) {
      simulation.advance(t);
      scene.update(simulation.snapshot(), simulation.outcome(), simulation.touches(), 0.0, 0.0, ros::Time(1.0 + t));
      test::expect_valid(scene.markers(), "map");
      test::expect_valid(scene.markers_on_empty(), "map");
      EXPECT_EQ(scene.markers_on_empty().markers.front().action, Marker::DELETEALL);
    }
  }
}

TEST(MarkerScene, EveryCarIsWhereItIsInTheColourOfItsState) {
  simulation::Simulation simulation(train_of_all_bodies());
  simulation.advance(1.5);
  simulation::Snapshot now = simulation.snapshot();
  now.cars[0].past_pod = now.cars[1].past_pod = true;
  now.cars[2].past_pod = now.cars[3].past_pod = now.cars[4].past_pod = now.cars[4].off_track = false;
  now.cars[2].off_track = now.cars[3].off_track = true;
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  scene.update(now, simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
  const Marker *edges = shown(scene, "cars_outline", 0), *past_pod = shown(scene, "cars_past_pod", 0),
               *off_track = shown(scene, "cars_off_track", 0), *on_track = shown(scene, "cars_on_track", 0);
  ASSERT_TRUE(edges && past_pod && off_track && on_track);
  std::vector<std::size_t> size;
  std::size_t edge = 0;
  for (std::size_t i = 0; i < now.cars.size(); ++i) {
    const CarShape shape = car_shape(simulation.cars()[i]);
    double x = 0.0, y = 0.0;
    for (std::size_t k = 0; k < 8; ++k) {
      x += edges->points.at(edge + k).x / 8.0;
      y += edges->points.at(edge + k).y / 8.0;
    }
    EXPECT_NEAR(x, now.cars[i].x, 1e-9);
    EXPECT_NEAR(y, now.cars[i].y, 1e-9);
    edge += shape.edges.size();
    size.push_back(shape.body.size());
  }
  EXPECT_EQ(past_pod->points.size(), size[0] + size[1]);
  EXPECT_EQ(off_track->points.size(), size[2] + size[3]);
  EXPECT_EQ(on_track->points.size(), size[4]);
  for (const Marker* m : {past_pod, off_track, on_track}) EXPECT_TRUE(m->colors.empty()) << "unlit in RViz";
  // Printed in grey the states are still three.
  EXPECT_GT(grey(past_pod->color), grey(on_track->color) + 0.15);
  EXPECT_GT(grey(off_track->color), grey(past_pod->color) + 0.15);
}

TEST(MarkerScene, CouplersShowTheirForceByColourAndByArrows) {
  simulation::Simulation simulation(short_train(4));
  simulation::Snapshot now = simulation.snapshot();
  now.couplers[0].axial_force = 1.0e6;
  now.couplers[1].axial_force = -1.0e6;
  now.couplers[2].axial_force = 0.0;
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  scene.update(now, simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
  const Marker *couplers = shown(scene, "couplers", 0), *arrows = shown(scene, "coupler_arrows", 0),
               *bars = shown(scene, "coupler_force_bars", 1);
  ASSERT_TRUE(couplers && arrows && bars);
  ASSERT_EQ(couplers->points.size(), 6U);
  ASSERT_EQ(arrows->points.size(), 12U) << "none without force";
  for (const Marker* m : {couplers, arrows, bars}) {
    const std::size_t each = m == arrows ? 6 : 2;
    EXPECT_GT(m->colors[0].r, m->colors[0].b) << m->ns << ": buff is red";
    EXPECT_GT(m->colors[each].b, m->colors[each].r) << m->ns << ": draft is blue";
    if (m != arrows) {
      EXPECT_NEAR(m->colors[4].r, m->colors[4].b, 1e-6) << m->ns << ": neutral is grey";
    }
  }
  EXPECT_GT(bars->points[1].y, bars->points[0].y);
  EXPECT_LT(bars->points[3].y, bars->points[2].y);
  for (std::size_t i = 0; i < 2; ++i) {
    const double middle = 0.5 * (couplers->points[2 * i].x + couplers->points[2 * i + 1].x);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto* corner = &arrows->points[6 * i + 3 * k];
      const double tip = std::abs(corner[0].x - middle), base = std::abs(corner[1].x - middle);
      EXPECT_EQ(tip < base, i == 0) << "arrows press on the coupler in buff and leave it in draft";
      EXPECT_EQ(corner[1].x, corner[2].x);
    }
  }
}

TEST(MarkerScene, LegendsSayWhatTheColoursMean) {
  simulation::Simulation simulation(short_train(12));
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  const auto places_at = [&](double x, double y) {
    scene.update(simulation.snapshot(), simulation.outcome(), {}, x, y, ros::Time(1.0));
    std::vector<geometry_msgs::Point> places;
    for (const Marker& m : scene.markers().markers) {
      if (m.ns == "legend_near") places.push_back(m.pose.position);
    }
    return places;
  };
  const auto before = places_at(0.0, 0.0), after = places_at(100.0, 7.0);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_NEAR(after[i].x - before[i].x, 100.0, 1e-9);
    EXPECT_NEAR(after[i].y - before[i].y, 7.0, 1e-9);
  }
  for (const std::string ns : {"legend", "legend_near"}) {
    std::map<std::string, geometry_msgs::Point> words;
    const Marker* swatches = nullptr;
    for (const Marker& m : scene.markers().markers) {
      if (m.ns != ns) continue;
      EXPECT_EQ(m.action, Marker::ADD);
      if (m.type == Marker::TEXT_VIEW_FACING) words[m.text.substr(0, m.text.find(' '))] = m.pose.position;
      if (m.type == Marker::TRIANGLE_LIST) swatches = &m;
      if (m.text.find("kip") != std::string::npos) {
        double kip = 0.0, kn = 0.0;
        ASSERT_EQ(std::sscanf(m.text.c_str(), "%lf kip\n%lf kN", &kip, &kn), 2) << m.text;
        EXPECT_NEAR(kip * inputs::kKip, kn * 1000.0, 1000.0);
      }
    }
    ASSERT_TRUE(swatches != nullptr);
    for (const char* word : {"draft", "buff", "0", "on", "off", "past"}) EXPECT_EQ(words.count(word), 1U) << word;
    EXPECT_LT(words["draft"].x, words["0"].x);
    EXPECT_GT(words["buff"].x, words["0"].x);
    // The colour beside a word is that of the thing.
    const auto colour_near = [&](const geometry_msgs::Point& place) {
      double best = 1e9;
      std_msgs::ColorRGBA found;
      for (std::size_t i = 6; i < swatches->points.size(); ++i) {  // after the background
        const double dx = swatches->points[i].x + swatches->pose.position.x - place.x;
        const double dy = swatches->points[i].y + swatches->pose.position.y - place.y;
        if (std::hypot(dx, dy) < best) {
          best = std::hypot(dx, dy);
          found = swatches->colors[i];
        }
      }
      return found;
    };
    const auto draft = colour_near(words["draft"]), buff = colour_near(words["buff"]);
    EXPECT_GT(draft.b, draft.r);
    EXPECT_GT(buff.r, buff.b);
    EXPECT_EQ(colour_near(words["past"]), shown(scene, "cars_past_pod", 0)->color);
    EXPECT_EQ(colour_near(words["on"]), shown(scene, "cars_on_track", 0)->color);
  }
}

TEST(MarkerScene, BodiesShowWhatDerailedThem) {
  simulation::Simulation simulation(short_accident(4));
  simulation::Snapshot now = simulation.snapshot();
  const model::Cause causes[] = {model::Cause::pod, model::Cause::lateral, model::Cause::torn_track,
                                 model::Cause::none};
  const char* const kinds[] = {"cars_derailed_pod", "cars_derailed_lateral", "cars_derailed_torn_track",
                               "cars_on_track"};
  // The words beside the same colours in the legend.
  const char* const words[] = {"at the\npoint", "by lateral\nforce", "on torn\ntrack", "on the\ntrack"};
  for (std::size_t i = 0; i < 4; ++i) {
    now.cars[i].cause = causes[i];
    now.cars[i].derailed = causes[i] != model::Cause::none;
  }
  now.cars[3].past_pod = true;  // stands on the rails all the same
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  outcome::Outcome outcome;
  outcome.cars_derailed = 60;
  outcome.derailed_by = {10, 20, 30};
  scene.update(now, outcome, {}, 0.0, 0.0, ros::Time(1.0));
  test::expect_valid(scene.markers(), "map");
  std::vector<double> greys;
  for (std::size_t i = 0; i < 4; ++i) {
    const Marker* body = shown(scene, kinds[i], 0);
    ASSERT_TRUE(body) << kinds[i];
    EXPECT_EQ(body->points.size(), car_shape(simulation.cars()[i]).body.size()) << kinds[i];
    double x = 0.0;
    for (const auto& p : body->points) x += p.x / static_cast<double>(body->points.size());
    EXPECT_NEAR(x, now.cars[i].x, 0.5) << kinds[i];
    greys.push_back(grey(body->color));

    const Marker *swatches = shown(scene, "legend", 0), *word = nullptr;
    for (const Marker& m : scene.markers().markers) {
      if (m.ns == "legend" && m.text == words[i]) word = &m;
    }
    ASSERT_TRUE(swatches && word) << words[i];
    bool painted = false;
    for (std::size_t k = 6; k < swatches->points.size(); ++k) {
      const double dx = swatches->points[k].x + swatches->pose.position.x - word->pose.position.x;
      const double dy = swatches->points[k].y + swatches->pose.position.y - word->pose.position.y;
      painted = painted || (std::abs(dx) < 3.0 * word->scale.z && dy > 0.0 && dy < 3.0 * word->scale.z &&
                            swatches->colors[k] == body->color);
    }
    EXPECT_TRUE(painted) << words[i];
  }
  EXPECT_FALSE(shown(scene, "cars_past_pod", 0));
  std::sort(greys.begin(), greys.end());
  for (std::size_t i = 1; i < 4; ++i) EXPECT_GT(greys[i], greys[i - 1] + 0.12) << "apart in grey";
  const Marker* status = shown(scene, "status", 0);
  ASSERT_TRUE(status);
  EXPECT_NE(status->text.find("derailed: 60 (point 10, lateral 20, torn 30) of 4"), std::string::npos) << status->text;
  EXPECT_EQ(status->text.find("broken"), std::string::npos) << status->text;
  outcome.couplers_broken = 7;
  outcome.impacts.count = 8;
  scene.update(now, outcome, {}, 0.0, 0.0, ros::Time(1.0));
  EXPECT_NE(shown(scene, "status", 0)->text.find("couplers broken 7, impacts 8"), std::string::npos);
}

TEST(MarkerScene, ABrokenCouplerIsAGapWithoutForce) {
  simulation::Simulation simulation(short_accident(4));
  simulation::Snapshot now = simulation.snapshot();
  for (simulation::CouplerSnapshot& c : now.couplers) c.axial_force = 1.0e6;
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  const auto points = [&](const char* ns, int id) {
    const Marker* m = shown(scene, ns, id);
    return m == nullptr ? std::vector<geometry_msgs::Point>() : m->points;
  };
  scene.update(now, {}, {}, 0.0, 0.0, ros::Time(1.0));
  EXPECT_TRUE(points("couplers_broken", 0).empty());
  now.couplers[1].broken = true;
  scene.update(now, {}, {}, 0.0, 0.0, ros::Time(1.0));
  test::expect_valid(scene.markers(), "map");
  EXPECT_EQ(points("couplers", 0).size(), 4U);
  EXPECT_EQ(points("coupler_force_bars", 1).size(), 4U);
  EXPECT_EQ(points("coupler_arrows", 0).size(), 12U);
  const double lead = now.cars[1].x - 0.5 * simulation.cars()[1].length;
  const double trail = now.cars[2].x + 0.5 * simulation.cars()[2].length;
  const auto broken = points("couplers_broken", 0);
  ASSERT_EQ(broken.size(), 8U);
  for (const auto& p : broken) {
    EXPECT_LE(std::min(std::abs(p.x - lead), std::abs(p.x - trail)), 1.0);
    EXPECT_LE(std::abs(p.y - now.cars[1].y), 1.6);
  }
  for (const auto& p : points("couplers", 0)) EXPECT_FALSE(p.x > trail + 1e-6 && p.x < lead - 1e-6);
}

TEST(MarkerScene, TheTrackIsDrawnAlongItsCurves) {
  inputs::Scenario scenario = short_accident(12);
  scenario.track.curves = {{-150.0, 100.0, -1.0 / 300.0}, {20.0, 60.0, 1.0 / 200.0}};
  simulation::Simulation simulation(scenario);
  MarkerScene scene(scenario, simulation.cars(), "map", 0.02);
  scene.update(simulation.snapshot(), simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
  test::expect_valid(scene.markers(), "map");
  const model::Track track(scenario, -400.0, 400.0);
  const Marker* rails = shown(scene, "track", 1);
  ASSERT_TRUE(rails);
  double last = -1e9, lowest = 0.0;
  for (std::size_t i = 0; i < rails->points.size(); i += 4) {
    for (const std::size_t end : {i, i + 1}) {
      const auto &right = rails->points.at(end), &left = rails->points.at(end + 2);
      EXPECT_NEAR(std::hypot(left.x - right.x, left.y - right.y), 1.435, 1e-9);
      const Eigen::Vector2d middle(0.5 * (left.x + right.x), 0.5 * (left.y + right.y));
      const double s = track.foot(middle, middle.x());
      EXPECT_NEAR((track.at(s).point - middle).norm(), 0.0, 0.02) << "at " << s << " m";
      EXPECT_GE(s, last - 1e-3) << "no gap";
      last = s;
      lowest = std::min(lowest, middle.y());
    }
  }
  EXPECT_GT(last, 100.0);
  EXPECT_LT(lowest, -10.0);
  EXPECT_GT(rails->points.size(), 4U * 16U);
  EXPECT_LT(rails->points.size(), 4U * 40U) << "sent fifty times a second";
  // What is read beside the train keeps clear of it.
  EXPECT_LT(shown(scene, "status", 0)->pose.position.y, lowest - 50.0);
  const auto cars = simulation.snapshot().cars;
  for (const auto& c : cars) EXPECT_GT(shown(scene, "coupler_force_bars", 0)->points.at(0).y, c.y + 50.0);
}

TEST(MarkerScene, WhatIsReadBesideALongTrainIsInTheShippedView) {
  for (const inputs::Scenario& scenario : {short_train(100), short_accident(100)}) {
    simulation::Simulation simulation(scenario);
    MarkerScene scene(scenario, simulation.cars(), "map", 0.02);
    scene.update(simulation.snapshot(), simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
    const Marker *legend = shown(scene, "legend", 0), *status = shown(scene, "status", 0);
    ASSERT_TRUE(legend && status);
    // 1026 by 745 pixels of 1 / 0.85 m, the middle at x = -550 m.
    for (const auto& p : legend->points) {
      EXPECT_LT(std::abs(p.x + legend->pose.position.x + 550.0), 600.0);
      EXPECT_LT(p.y + legend->pose.position.y, 430.0);
    }
    EXPECT_NEAR(status->pose.position.x, -550.0, 100.0);
    EXPECT_LT(status->pose.position.y + 0.5 * 6.0 * 1.2 * status->scale.z, 0.0) << "six lines beside the track";
  }
}

outcome::Closing touch_at(double time, double speed) { return {speed, speed, 1, 2, time, 10.0 * speed, 3.0}; }

TEST(MarkerScene, TouchesFlashForASecondOfSimulatedTime) {
  simulation::Simulation simulation(short_train(2));
  simulation::Snapshot now = simulation.snapshot();
  const std::vector<outcome::Closing> touches{touch_at(0.5, 4.0), touch_at(2.0, 5.0), touch_at(2.1, 0.2)};
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  const auto show_at = [&](MarkerScene& in, double time) {
    now.time = time;
    in.update(now, simulation.outcome(), touches, 0.0, 0.0, ros::Time(10.0 + time));
    test::expect_valid(in.markers(), "map");
  };
  show_at(scene, 2.1);
  ASSERT_TRUE(shown(scene, "touches", 0));
  const Marker star = *shown(scene, "touches", 0);
  ASSERT_TRUE(shown(scene, "touches", 1));
  const Marker text = *shown(scene, "touches", 1);
  EXPECT_EQ(text.text, "11.2 mph (5.0 m/s)");
  EXPECT_EQ(text.pose.position.x, 50.0);
  EXPECT_NEAR(text.pose.position.y, 3.0, 20.0);
  EXPECT_FALSE(shown(scene, "touches", 2)) << "the slow one has no text";
  const auto star_size = [](const Marker& m, double x) {
    double size = 0.0;
    for (const auto& p : m.points) {
      if (std::abs(p.x - x) < 10.0) size = std::max(size, std::abs(p.x - x));
    }
    return size;
  };
  EXPECT_GT(star_size(star, 50.0), star_size(star, 2.0)) << "the faster the larger";

  show_at(scene, 2.9);
  ASSERT_TRUE(shown(scene, "touches", 1));
  EXPECT_LT(shown(scene, "touches", 1)->color.a, text.color.a) << "fades";
  EXPECT_LT(star_size(*shown(scene, "touches", 0), 50.0), star_size(star, 50.0));
  show_at(scene, 2.9);
  EXPECT_TRUE(shown(scene, "touches", 1)) << "stays as long as time stands";
  show_at(scene, 3.05);
  EXPECT_FALSE(shown(scene, "touches", 1));
  EXPECT_TRUE(shown(scene, "touches", 0)) << "the later one is still there";
  show_at(scene, 3.1);
  EXPECT_FALSE(shown(scene, "touches", 0));

  // Arrays that are farther apart than a second still show each touch once.
  MarkerScene coarse(simulation.scenario(), simulation.cars(), "map", 4.0);
  show_at(coarse, 4.0);
  ASSERT_TRUE(shown(coarse, "touches", 2));
  show_at(coarse, 8.0);
  EXPECT_FALSE(shown(coarse, "touches", 0));
}

TEST(MarkerScene, TellsTheFastestOfManyTouches) {
  simulation::Simulation simulation(short_train(2));
  simulation::Snapshot now = simulation.snapshot();
  now.time = 1.0;
  std::vector<outcome::Closing> touches;
  for (int i = 0; i < 40; ++i) touches.push_back(touch_at(0.5 + 0.01 * i, 2.0 + (i * 7) % 40));
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  scene.update(now, simulation.outcome(), touches, 0.0, 0.0, ros::Time(1.0));
  std::size_t told = 0;
  for (const Marker& m : scene.markers().markers) {
    if (m.ns != "touches" || m.type != Marker::TEXT_VIEW_FACING || m.action != Marker::ADD) continue;
    ++told;
    EXPECT_GE(m.pose.position.x, 10.0 * 30.0);
  }
  EXPECT_EQ(told, 12U);
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
