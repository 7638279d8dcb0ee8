// The parts of the ROS face that need no master: pace, clock, parameters, events, messages, commands.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <regex>
#include <set>
#include <thread>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "train_derail/Event.h"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/ros/command_queue.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/message_fields.hpp"
#include "train_derail/ros/messages.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/pile_up_follower.hpp"
#include "train_derail/ros/run_history.hpp"
#include "train_derail/ros/sim_clock.hpp"
#include "train_derail/ros/simulation_loop.hpp"
#include "train_derail/ros/topics.hpp"
#include "train_derail/scene/event_detector.hpp"
#include "train_derail/simulation/fields.hpp"

namespace train_derail::ros_face {

using namespace scene;

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
  EXPECT_NEAR(p.event_coupler_force, 500.0 * inputs::kKip, 1e-3);
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

/// A folder of results, and one beside it of which nothing may be read.
class Restarts : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    for (const char* name : {"results", "outside"}) {
      std::filesystem::create_directory(folder_ / name);
      std::ofstream(folder_ / name / "base.yaml") << kScenario;
      std::ofstream(folder_ / name / "train.csv") << "Car Kind,L/E\nhopper,L\nhopper,L\n";
      std::ofstream(folder_ / name / "broken.yaml") << "secret-4711: {\n";
    }
    std::filesystem::create_directory_symlink(folder_ / "outside", folder_ / "results" / "link");
    bounds_ = std::make_shared<const FileBounds>((folder_ / "results").string(), std::vector<std::string>());
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string outside(const std::string& name) const { return (folder_ / "outside" / name).string(); }
  /// What is said against a restart; empty if it could begin.
  std::string refusal(const std::string& scenario) const { return refusal_of({scenario, {}, {}, true}); }
  std::string refusal_of(const RestartRequest& request) const {
    try {
      prepare(request, ScenarioSource(), bounds_);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  }

  static constexpr char kScenario[] =
      "consist: [{count: 3, length: 18 m, weight: 265 kip}]\ninitial: {speed: 10, yaw_rate: 0.1}\nstop: {time_max: "
      "1}\n";
  std::filesystem::path folder_;
  std::shared_ptr<const FileBounds> bounds_;
};

TEST_F(Restarts, ReadWhatTheNodeMayReadAndNothingElse) {
  const auto with_base = [](const std::string& file) { return "base: " + file + "\ninitial: {speed: 12}\n"; };
  const std::string own = "initial: {speed: 10, yaw_rate: 0.1}\nconsist: ";
  EXPECT_EQ(refusal(kScenario), "");
  EXPECT_EQ(refusal(with_base("base.yaml")), "");
  EXPECT_EQ(refusal(with_base((folder_ / "results" / "base.yaml").string())), "");
  EXPECT_EQ(refusal(own + "{file: train.csv}\n"), "");

  const auto expect_outside = [&](const std::string& scenario) {
    const std::string said = refusal(scenario);
    EXPECT_NE(said.find("~restart: base or consist"), std::string::npos) << said;
    EXPECT_NE(said.find("outside of what may be read"), std::string::npos) << said;
    EXPECT_EQ(said.find("secret-4711"), std::string::npos) << said;
  };
  for (const std::string& file :
       {outside("base.yaml"), outside("broken.yaml"), outside("none.yaml"), std::string("../outside/base.yaml"),
        std::string("link/base.yaml"), std::string("/etc/passwd"), std::string("/etc/nonexistent")}) {
    expect_outside(with_base(file));
    expect_outside(own + "{file: " + file + "}\n");
    expect_outside(own + "{file: train.csv, types: " + file + "}\n");
  }
  // Nor by way of a base that may be read.
  std::ofstream(folder_ / "results" / "middle.yaml") << with_base("../outside/base.yaml");
  expect_outside(with_base("middle.yaml"));
  std::ofstream(folder_ / "results" / "middle.yaml") << own << "{file: ../outside/train.csv}\n";
  expect_outside(with_base("middle.yaml"));
}

TEST_F(Restarts, ByParametersReadTheFilesThatTheNodeStartedWith) {
  XmlRpcValue tree;
  tree["scenario"]["base"] = outside("base.yaml");
  EXPECT_NE(refusal_of({"", tree, {}, true}).find("outside of what may be read"), std::string::npos);
  FileBounds known = *bounds_;
  const ScenarioSource source = read_scenario_source(tree, "/n");
  EXPECT_EQ(source.files(), std::vector<std::string>{outside("base.yaml")});
  for (const std::string& file : source.files()) known.allow(file);
  bounds_ = std::make_shared<const FileBounds>(known);
  EXPECT_EQ(refusal_of({"", tree, {}, true}), "");
  tree["scenario"]["base"] = outside("broken.yaml");
  EXPECT_NE(refusal_of({"", tree, {}, true}).find("outside of what may be read"), std::string::npos);
}

TEST(Frames, NumbersHaveThreeDigitsAtLeast) {
  const Frames frames{"map", "a/"};
  EXPECT_EQ(frames.car(7), "a/car_007");
  EXPECT_EQ(frames.car(1000), "a/car_1000");
}

TEST(Frames, OfACarRollsWithIt) {
  // On its right side: what was above the rails is now to the right, as far.
  std::vector<model::Car> train(1);
  train[0].centre_height = 2.0;
  simulation::CarSnapshot car;
  car.x = 10.0;
  car.y = 5.0;
  car.z = -0.5;  // its centre of mass is 1.5 m above the top of the rails
  car.qx = car.qw = std::sqrt(0.5);
  const geometry_msgs::Transform t = to_transforms(train, {car}, {}, {}).transforms.at(0).transform;
  EXPECT_NEAR(t.translation.x, 10.0, 1e-12);
  EXPECT_NEAR(t.translation.y, 5.0 + 2.0, 1e-12) << "the wheels point to the left";
  EXPECT_NEAR(t.translation.z, 1.5, 1e-12);
  EXPECT_EQ(t.rotation.x, car.qx);
  car.qx = 0.0;
  car.qw = 1.0;
  EXPECT_EQ(to_transforms(train, {car}, {}, {}).transforms.at(0).transform.translation.z, car.z);
}

simulation::CarSnapshot car(double x, bool past_pod, bool off_track) {
  simulation::CarSnapshot car;
  car.x = x;
  car.vx = 10.0;
  car.past_pod = car.derailed = past_pod;
  car.off_track = off_track;
  return car;
}
/// As at the last step: what it bears now is the largest since the last message, at `time`.
simulation::CouplerSnapshot coupler(double force, double time = 0.0) {
  simulation::CouplerSnapshot coupler;
  coupler.gap = 1.2;
  coupler.axial_force = force;
  coupler.buff_peak = std::max(force, 0.0);
  coupler.draft_peak = std::max(-force, 0.0);
  coupler.buff_peak_time = coupler.draft_peak_time = time;
  return coupler;
}

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
    const simulation::Snapshot s{
        0.1 * i, {car(-5, false, false), car(-25, false, false)}, {coupler(forces[i], 0.1 * i)}};
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
  incidents.broken = {{1.7, 0, model::BrokenCoupler::By::swing, -1e5}};
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

model::Impact impact(double closing_speed_normal) {
  return {3.0, 3.5, 4, 6, model::Face::rear, model::Face::left, -8.0, 2.0, 12.0, -1.0, 2.5, 9.0, closing_speed_normal,
          4e5, 7e6};
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
  EXPECT_EQ(i.z, 2.5);
  EXPECT_EQ(i.closing_speed, 9.0);
  EXPECT_EQ(i.closing_speed_normal, 5.0);
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

/// A record whose every field has a value of its own.
template <class Record>
Record distinct(const fields::Fields<Record>& all) {
  Record record;
  int number = 1;
  for (const auto& field : all) {
    if (!field.set) continue;
    ++number;
    fields::Value value = field.get(record);
    if (std::holds_alternative<double>(value)) value = 0.5 + number;
    else if (std::holds_alternative<bool>(value)) value = true;
    else if (std::holds_alternative<std::string>(value)) value = fmt::format("text {}", number);
    else if (std::holds_alternative<std::vector<std::string>>(value)) value = std::vector<std::string>{"a", "b"};
    else value = static_cast<std::int64_t>(field.names.empty() ? number : 2);
    field.set(record, value);
  }
  return record;
}

/// Every entry of the description but `elsewhere` is a field of the message, and has its value there.
template <class Message, class Record>
void expect_carries(const Message& message, const fields::Fields<Record>& all, const Record& record,
                    const std::set<std::string_view>& elsewhere, const std::set<std::string>& own) {
  const Record back = read<Record>(message, all);
  std::set<std::string> known = own;
  for (const auto& field : all) {
    if (elsewhere.count(field.name) > 0) continue;
    known.insert(std::string(field.name));
    if (field.set) {
      EXPECT_TRUE(field.get(back) == field.get(record)) << field.name;
    }
  }
  const std::vector<std::string> names = field_names<Message>();
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()), known);
}

TEST(Messages, CarryWhatIsDescribed) {
  const outcome::Outcome o = distinct(outcome::outcome_fields());
  const Outcome m = to_message(o, {}, 1);
  expect_carries(m, outcome::outcome_fields(), o, {"wall_time"}, {"header", "run_id"});
  EXPECT_EQ(m.coupler_force_peak, std::max(o.coupler_buff_peak.force, o.coupler_draft_peak.force));
  EXPECT_EQ(m.work_kicks, o.energy.work_kicks);
  EXPECT_EQ(m.ended, Outcome::TIME_MAX);

  const simulation::CarSnapshot car = distinct(simulation::car_fields());
  const CarState state = to_message(std::vector<simulation::CarSnapshot>{car}, 0.0, {}, 1).cars.at(0);
  expect_carries(state, simulation::car_fields(), car,
                 {"x", "y", "z", "qx", "qy", "qz", "qw", "vx", "vy", "vz", "wx", "wy", "omega"},
                 {"number", "pose", "twist"});
  EXPECT_EQ(state.pose.position.y, car.y);
  EXPECT_EQ(state.pose.orientation.w, car.qw);
  EXPECT_EQ(state.twist.linear.x, car.vx);
  EXPECT_EQ(state.twist.angular.z, car.omega);

  const simulation::CouplerSnapshot coupler = distinct(simulation::coupler_fields());
  const CouplerForce force = to_message(std::vector<simulation::CouplerSnapshot>{coupler}, 0.0, {}, 1).couplers.at(0);
  expect_carries(force, simulation::coupler_fields(), coupler, {}, {"number"});
}

TEST(Messages, ConstantsAreTheNamesInCapitals) {
  const std::vector<int> causes{CarState::NONE,       CarState::POD,       CarState::LATERAL,
                                CarState::TORN_TRACK, CarState::BAD_TRACK, CarState::DEFECT};
  const std::vector<int> ended{Outcome::RUNNING, Outcome::AT_REST, Outcome::TIME_MAX, Outcome::INTEGRATION_FAILED,
                               Outcome::ROLLED_AWAY};
  ASSERT_EQ(causes.size(), model::kCauseNames.size());
  ASSERT_EQ(ended.size(), outcome::kEndedNames.size());
  for (std::size_t i = 0; i < causes.size(); ++i) EXPECT_EQ(causes[i], static_cast<int>(i));
  for (std::size_t i = 0; i < ended.size(); ++i) EXPECT_EQ(ended[i], static_cast<int>(i));
  const auto has = [](const std::string& definition, std::string_view name, std::size_t value) {
    std::string capitals(name);
    for (char& c : capitals) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    EXPECT_NE(definition.find(fmt::format("uint8 {} = {}", capitals, value)), std::string::npos) << capitals;
  };
  for (std::size_t i = 0; i < causes.size(); ++i)
    has(::ros::message_traits::definition<CarState>(), model::kCauseNames[i], i);
  for (std::size_t i = 0; i < ended.size(); ++i)
    has(::ros::message_traits::definition<Outcome>(), outcome::kEndedNames[i], i);
}

TEST(Messages, CarsAndCouplersSayWhatBecameOfThem) {
  simulation::CarSnapshot off = car(1.0, false, true);
  off.derailed = true;
  const std::vector<std::pair<model::Cause, int>> causes{
      {model::Cause::none, CarState::NONE},           {model::Cause::pod, CarState::POD},
      {model::Cause::lateral, CarState::LATERAL},     {model::Cause::torn_track, CarState::TORN_TRACK},
      {model::Cause::bad_track, CarState::BAD_TRACK}, {model::Cause::defect, CarState::DEFECT}};
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

TEST(Topics, PageIsTheTable) {
  std::string table = "| topic | type | latched | queue |\n|---|---|---|---|\n", meanings;
  for_each_topic([&](auto topic) {
    using Topic = decltype(topic);
    table += fmt::format("| `{}` | {} | {} | {} |\n", Topic::facts.name,
                         ::ros::message_traits::datatype<typename Topic::Message>(),
                         Topic::facts.latched == Latched::yes ? "yes" : "no", Topic::facts.queue);
    meanings += fmt::format(" - `{}`: {}", Topic::facts.name, Topic::facts.meaning);
  });
  std::ifstream file(TRAIN_DERAIL_SOURCE_DIR "/docs/topics.md");
  const std::string page(std::istreambuf_iterator<char>(file), {});
  EXPECT_NE(page.find("\n\n" + table + "\n"), std::string::npos) << "docs/topics.md is to hold:\n" << table;
  const std::string unwrapped = std::regex_replace(page, std::regex("\\s+"), " ");
  EXPECT_NE(unwrapped.find(meanings + " "), std::string::npos) << "docs/topics.md is to hold:\n" << meanings;
}

TEST(Topics, NamesAreBelowTheNodeOrForAll) {
  EXPECT_EQ(topic_name(CarsTopic::facts, "/yard/left"), "/yard/left/cars");
  EXPECT_EQ(topic_name(TfTopic::facts, "/yard/left"), "/tf");
  std::set<std::string_view> names;
  for_each_topic([&](auto topic) {
    const TopicFacts& facts = decltype(topic)::facts;
    EXPECT_TRUE(names.insert(facts.name).second) << facts.name << " is there twice";
    EXPECT_EQ(topic_facts(topic_number<decltype(topic)>()).name, facts.name);
  });
}

TEST(PileUpFollower, GoesToTheMiddleOfTheHeap) {
  PileUpFollower follower;
  scene::Heap heap;
  follower.update(heap, 0.0);
  EXPECT_EQ(follower.x(), 0.0);
  heap.x = 20.0;
  heap.y = -3.0;
  for (int i = 1; i < 500; ++i) follower.update(heap, 0.02 * i);
  EXPECT_NEAR(follower.x(), 20.0, 1e-3);
  EXPECT_NEAR(follower.y(), -3.0, 1e-3);
}

TEST(RunHistory, KeepsEveryMomentWithinItsMemoryAndThinsOutBeyond) {
  const auto moment = [](int i) {
    simulation::Snapshot now{0.02 * i, {}, {}};
    now.cars.resize(100);
    return now;
  };
  const std::size_t one = 100 * sizeof(simulation::CarSnapshot);
  RunHistory history(50 * one);
  EXPECT_EQ(history.nearest(1.0), nullptr);
  for (int i = 0; i < 1000; ++i) {
    history.add(moment(i), {});
    ASSERT_LE(history.size() * one, 50 * one);
    ASSERT_EQ(history.until(), 0.02 * i) << "the newest is always there";
    ASSERT_EQ(history.nearest(0.0)->now.time, 0.0);
  }
  EXPECT_GT(history.size(), 20U);
  for (double t = 0.0; t < 20.0; t += 0.37) EXPECT_NEAR(history.nearest(t)->now.time, t, 0.5 * 0.02 * 32 + 1e-9) << t;
  double last = -1.0;
  for (double t = 0.0; t < 20.0; t += 0.01) {
    const double time = history.nearest(t)->now.time;
    EXPECT_GE(time, last);
    last = time;
  }
  history.clear();
  EXPECT_EQ(history.size(), 0U);
  RunHistory none(0);
  none.add(moment(0), {});
  EXPECT_EQ(none.nearest(0.0), nullptr);
}

/// Counts what it is sent.
struct CountingSink : MessageSink {
  explicit CountingSink(bool bag) : is_bag(bag) {}
  bool wants_markers() const override { return true; }
  bool is_read_from_the_middle() const override { return is_bag; }
  void receive(const AnyMessage& message) override {
    ++count[message.index()];
    if (message.index() == topic_number<MarkersTopic>()) markers = *std::get<topic_number<MarkersTopic>()>(message);
  }
  const bool is_bag;
  std::array<int, kTopicCount> count{};
  visualization_msgs::MarkerArray markers;  // the newest
};

TEST(RunStream, LookingBackIsNotWrittenToBags) {
  inputs::Scenario scenario;
  scenario.consist.emplace_back();
  scenario.consist[0].count = 3;
  scenario.consist[0].length = 18.0;
  scenario.consist[0].weight = 1.2e6;
  scenario.initial.speed = 16.0;
  scenario.initial.yaw_rate = 0.2;
  simulation::Simulation simulation(scenario);
  SimulationView view(simulation, 1.0e6);
  CountingSink bag(true), listener(false);
  StreamOptions options;
  options.history_bytes = 1U << 20;
  RunStream stream(options, {&bag, &listener});
  const auto go_to = [&](int point) {
    simulation.advance(point * scenario.output.interval);
    stream.grid_point(view);
  };
  stream.start_run(view, RunState());
  for (int point = 1; point <= 10; ++point) go_to(point);
  const auto recorded = bag.count, heard = listener.count;
  const RunHistory::Moment* moment = stream.history().nearest(0.1);
  ASSERT_TRUE(moment);
  stream.show(view, moment->now, *moment->outcome);
  EXPECT_EQ(bag.count, recorded);
  EXPECT_EQ(listener.count[topic_number<CarsTopic>()], heard[topic_number<CarsTopic>()] + 1);
  // Changes of the next point are those against the moment that was shown: the bag gets the whole scene.
  go_to(11);
  ASSERT_FALSE(bag.markers.markers.empty());
  EXPECT_EQ(bag.markers.markers.front().action, visualization_msgs::Marker::DELETEALL);
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
