// Events, messages and topics, without a master.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <regex>
#include <set>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "train_derail/Event.h"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/ros/message_fields.hpp"
#include "train_derail/ros/messages.hpp"
#include "train_derail/ros/topics.hpp"
#include "train_derail/scene/event_detector.hpp"
#include "train_derail/simulation/fields.hpp"

namespace train_derail::ros_face {

using namespace scene;

namespace {

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

}  // namespace
}  // namespace train_derail::ros_face

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
