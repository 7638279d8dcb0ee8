// The node as launched: what it sends from the first point of the grid to the end of the run, and what it keeps
// latched.
#include <map>
#include <set>

#include <tf2_ros/static_transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>
#include <visualization_msgs/MarkerArray.h>

#include "marker_check.hpp"
#include "node_client.hpp"
#include "train_derail/Event.h"
#include "train_derail/Impacts.h"
#include "train_derail/Inputs.h"
#include "train_derail/PileUp.h"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/ros/topics.hpp"

namespace train_derail::test {
namespace {

std::string g_scenario_file;

/// One whole run, recorded once for all tests.
class Streams : public RecordedOnce<Streams> {
 public:
  static void record() {
    node = new NodeClient("/train_derail");
    clock = new Record<rosgraph_msgs::Clock>("/clock");
    tf = new Record<tf2_msgs::TFMessage>("/tf");
    cars = new Record<CarStates>("/train_derail/cars");
    couplers = new Record<CouplerForces>("/train_derail/couplers");
    markers = new Record<visualization_msgs::MarkerArray>("/train_derail/markers");
    events = new Record<Event>("/train_derail/events");
    outcome = new Record<Outcome>("/train_derail/outcome");
    run_info = new Record<RunInfo>("/train_derail/run_info");
    ASSERT_TRUE(node->wait_until_up());
    ASSERT_TRUE(wait_for([] {
      return clock->connected() && tf->connected() && cars->connected() && couplers->connected() &&
             markers->connected() && events->connected() && !outcome->empty() && !run_info->empty() && !cars->empty();
    }));
    paused_info = run_info->last();
    // A new run after all are connected, so that nobody misses its first point.
    ASSERT_TRUE(node->restart({}, false).success);
    // Each topic has its own connection: the outcome may overtake the streams.
    ASSERT_TRUE(wait_for([] { return outcome->last().run_id == 2 && outcome->last().ended != Outcome::RUNNING; }));
    const ros::Time end = outcome->last().header.stamp;
    ASSERT_TRUE(wait_for([&] {
      return cars->last().header.stamp == end && couplers->last().header.stamp == end && clock->last().clock >= end &&
             tf->last().transforms.at(0).header.stamp >= end && !events->empty() && events->last().type == Event::END &&
             run_info->last().state == RunInfo::ENDED;
    })) << "streams do not reach the end of the run at "
        << end << ": cars " << cars->last().header.stamp << ", couplers " << couplers->last().header.stamp << ", clock "
        << clock->last().clock << ", tf " << tf->last().transforms.at(0).header.stamp << ", " << events->messages.size()
        << " events";
    forget_before(2);
  }

  /// Keeps the second run only.
  static void forget_before(std::uint32_t run_id) {
    const auto old = [&](const auto& m) { return m.run_id < run_id; };
    cars->messages.erase(cars->messages.begin(), std::find_if_not(cars->messages.begin(), cars->messages.end(), old));
    couplers->messages.erase(couplers->messages.begin(),
                             std::find_if_not(couplers->messages.begin(), couplers->messages.end(), old));
    events->messages.erase(events->messages.begin(),
                           std::find_if_not(events->messages.begin(), events->messages.end(), old));
  }

  static inline NodeClient* node = nullptr;
  static inline Record<rosgraph_msgs::Clock>* clock = nullptr;
  static inline Record<tf2_msgs::TFMessage>* tf = nullptr;
  static inline Record<CarStates>* cars = nullptr;
  static inline Record<CouplerForces>* couplers = nullptr;
  static inline Record<visualization_msgs::MarkerArray>* markers = nullptr;
  static inline Record<Event>* events = nullptr;
  static inline Record<Outcome>* outcome = nullptr;
  static inline Record<RunInfo>* run_info = nullptr;
  static inline RunInfo paused_info;
};

TEST_F(Streams, StartedPausedAsAsked) {
  EXPECT_EQ(paused_info.state, RunInfo::PAUSED);
  EXPECT_EQ(paused_info.run_id, 1U);
  EXPECT_EQ(paused_info.time, 0.0);
  EXPECT_EQ(paused_info.cars, 12U);
  EXPECT_EQ(paused_info.rate, 0.0);
}

TEST_F(Streams, EveryPointOfTheGridOnce) {
  const ros::Time start = run_info->last().start;
  const double interval = inputs::read_scenario_file(g_scenario_file).output.interval;
  ASSERT_EQ(cars->messages.size(), 151U) << "3 s at 0.02 s, both ends";
  for (std::size_t k = 0; k < cars->messages.size(); ++k) {
    const CarStates& m = cars->messages[k];
    ASSERT_EQ(m.run_id, 2U);
    ASSERT_EQ(m.header.frame_id, "map");
    ASSERT_EQ(m.time, static_cast<double>(k) * interval);
    ASSERT_EQ((m.header.stamp - start).toNSec(), static_cast<std::int64_t>(k) * 20000000);
  }
}

TEST_F(Streams, ClockNeverGoesBackAndCoversEveryStamp) {
  expect_strictly_newer(clock->messages);
  std::set<ros::Time> known;
  for (const auto& c : clock->messages) known.insert(c.clock);
  for (const CarStates& m : cars->messages) EXPECT_EQ(known.count(m.header.stamp), 1U) << m.header.stamp;
}

TEST_F(Streams, ForcesAndStatesEqualASimulationInThisProcess) {
  expect_equal_to_simulation(cars->messages, couplers->messages, inputs::read_scenario_file(g_scenario_file));
}

TEST_F(Streams, TransformsAreCompleteAndOneParentHasAll) {
  std::map<std::string, ros::Time> last;
  std::set<ros::Time> stamps;
  for (const tf2_msgs::TFMessage& m : tf->messages) {
    ASSERT_EQ(m.transforms.size(), 13U) << "12 cars and the pile-up";
    for (const auto& t : m.transforms) {
      EXPECT_EQ(t.header.frame_id, "map");
      EXPECT_EQ(t.header.stamp, m.transforms[0].header.stamp);
      EXPECT_GT(t.header.stamp, last[t.child_frame_id]) << t.child_frame_id;
      last[t.child_frame_id] = t.header.stamp;
      const auto& q = t.transform.rotation;
      EXPECT_NEAR(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w, 1.0, 1e-12);
    }
    stamps.insert(m.transforms[0].header.stamp);
  }
  EXPECT_EQ(last.size(), 13U);
  EXPECT_EQ(last.count("car_001") + last.count("car_012") + last.count("pile_up"), 3U);
  for (const CarStates& m : cars->messages) EXPECT_EQ(stamps.count(m.header.stamp), 1U);
}

TEST_F(Streams, TransformsAreThePosesOfTheCars) {
  const CarStates& state = cars->last();
  for (const tf2_msgs::TFMessage& m : tf->messages) {
    if (m.transforms[0].header.stamp != state.header.stamp) continue;
    for (std::size_t k = 0; k < state.cars.size(); ++k) {
      const auto& t = m.transforms[k].transform;
      EXPECT_EQ(t.translation.x, state.cars[k].pose.position.x);
      EXPECT_EQ(t.translation.y, state.cars[k].pose.position.y);
      EXPECT_NEAR(std::remainder(2.0 * std::atan2(t.rotation.z, t.rotation.w) - state.cars[k].theta, 2.0 * M_PI), 0.0,
                  1e-12);
    }
    return;
  }
  ADD_FAILURE() << "no transforms at the end";
}

TEST_F(Streams, LateListenerFindsTheTreeOfARunThatStandsStill) {
  tf2_ros::Buffer buffer;
  tf2_ros::TransformListener listener(buffer);
  for (const char* frame : {"car_001", "car_012", "pod", "pile_up"}) {
    EXPECT_TRUE(wait_for([&] { return buffer.canTransform("map", frame, ros::Time(0)); })) << frame;
  }
  const auto t = buffer.lookupTransform("map", "car_012", ros::Time(0));
  EXPECT_EQ(t.transform.translation.x, cars->last().cars[11].pose.position.x);
  Record<rosgraph_msgs::Clock> late("/clock");
  EXPECT_TRUE(wait_for([&] { return !late.empty() && late.last().clock >= cars->last().header.stamp; }));
}

TEST_F(Streams, TopicsAreThoseOfTheTable) {
  ros::master::V_TopicInfo all;
  ASSERT_TRUE(ros::master::getTopics(all));
  std::map<std::string, std::string> types;
  for (const ros::master::TopicInfo& info : all) types[info.name] = info.datatype;
  ros_face::for_each_topic([&](auto topic) {
    using Topic = decltype(topic);
    const std::string name = ros_face::topic_name(Topic::facts, "/train_derail");
    EXPECT_EQ(types[name], ros::message_traits::datatype<typename Topic::Message>()) << name;
    types.erase(name);
    if (Topic::facts.latched == ros_face::Latched::no) return;
    Record<typename Topic::Message> late(name);
    EXPECT_TRUE(wait_for([&] { return !late.empty(); })) << name << " is latched";
  });
  // What is left tells of nodes and studies, not of a run.
  for (const auto& [name, type] : types) {
    EXPECT_TRUE(name.rfind("/rosout", 0) == 0 || name == "/diagnostics" ||
                name.rfind("/train_derail/run_study/", 0) == 0)
        << name << " is not in the table";
  }
}

TEST_F(Streams, MarkersAreChangesAndANewcomerGetsThemAll) {
  using visualization_msgs::Marker;
  Shown shown;
  std::size_t bytes = 0, with_touches = 0;
  for (const auto& array : markers->messages) {
    ASSERT_FALSE(array.markers.empty());
    expect_valid(array, "map");
    const bool first_of_run =
        array.markers[0].header.stamp == run_info->last().start || array.markers[0].header.stamp == paused_info.start;
    if (array.markers[0].action == Marker::DELETEALL) {
      EXPECT_TRUE(first_of_run) << array.markers[0].header.stamp;
    }
    shown.receive(array);
    bytes += ros::serialization::serializationLength(array);
    with_touches += shown.count("touches") > 0 ? 1 : 0;
  }
  EXPECT_GT(with_touches, 0U);
  EXPECT_LT(bytes, cars->messages.size() * ros::serialization::serializationLength(cars->messages[0]))
      << "less than the states of the cars";
  for (const char* kind : {"cars", "car_parts"}) EXPECT_EQ(shown.count(kind), 12U) << kind;
  // A star stays as long as time stands; nothing else is sent any more.
  Record<visualization_msgs::MarkerArray> late("/train_derail/markers");
  ASSERT_TRUE(wait_for([&] { return !late.empty(); }));
  Shown newcomer;
  for (const auto& array : late.messages) newcomer.receive(array);
  EXPECT_TRUE(newcomer == shown) << newcomer.all().size() << " markers instead of " << shown.all().size();
}

TEST_F(Streams, TheHeapIsWhereTheCarsAre) {
  Record<PileUp> pile_up("/train_derail/pile_up");
  ASSERT_TRUE(wait_for([&] { return !pile_up.empty(); }));
  const PileUp& heap = pile_up.last();
  EXPECT_EQ(heap.time, cars->last().time);
  ASSERT_GE(heap.first_car, 1U);
  ASSERT_LE(heap.last_car, 12U);
  for (std::uint32_t i = heap.first_car; i <= heap.last_car; ++i) {
    const geometry_msgs::Point& p = cars->last().cars[i - 1].pose.position;
    EXPECT_LE(std::abs(p.x - heap.pose.position.x), 0.5 * heap.length) << i;
    EXPECT_LE(std::abs(p.y - heap.pose.position.y), 0.5 * heap.width) << i;
  }
}

TEST_F(Streams, OutcomeIsThatOfTheSimulation) {
  simulation::Simulation simulation(inputs::read_scenario_file(g_scenario_file));
  simulation.run();
  const outcome::Outcome expected = simulation.outcome();
  const Outcome& m = outcome->last();
  EXPECT_EQ(m.ended, Outcome::TIME_MAX);
  EXPECT_EQ(m.stop_time, expected.stop_time);
  EXPECT_EQ(m.cars, 12U);
  EXPECT_EQ(m.cars_past_pod, static_cast<unsigned>(expected.cars_past_pod));
  EXPECT_EQ(m.cars_off_track, static_cast<unsigned>(expected.cars_off_track));
  EXPECT_EQ(m.coupler_buff_peak, expected.coupler_buff_peak.force);
  EXPECT_EQ(m.coupler_buff_peak_coupler, static_cast<unsigned>(expected.coupler_buff_peak.coupler));
  EXPECT_EQ(m.coupler_draft_peak, expected.coupler_draft_peak.force);
  EXPECT_EQ(m.closing_speed_max, expected.closing_speed_max.speed);
  EXPECT_EQ(m.relative_speed_max, expected.relative_speed_max.speed);
  EXPECT_EQ(m.pile_up_length, expected.pile_up.length);
  EXPECT_EQ(m.energy_residual, expected.energy_residual);
  EXPECT_EQ(m.steps, static_cast<unsigned>(expected.solver.steps));
  std::vector<double> times;
  for (const Outcome& o : outcome->messages) {
    if (o.run_id == 2) times.push_back(o.stop_time);
  }
  ASSERT_EQ(times.size(), 31U) << "ten times a simulated second";
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], 0.1 * static_cast<double>(i), 1e-9);
}

TEST_F(Streams, EventsAgreeWithTheStatesAndTheOutcome) {
  std::map<int, int> count;
  std::set<std::uint32_t> past_pod;
  for (const Event& e : events->messages) {
    ++count[e.type];
    EXPECT_FALSE(e.text.empty());
    if (e.type == Event::CAR_PAST_POD) {
      EXPECT_TRUE(past_pod.insert(e.car).second);
    }
    if (e.type == Event::COUPLER_PEAK) {
      EXPECT_GT(std::abs(e.value), 100.0 * inputs::kKip);
    }
  }
  EXPECT_EQ(count[Event::END], 1);
  EXPECT_EQ(past_pod.size(), outcome->last().cars_past_pod);
  EXPECT_EQ(count[Event::CAR_OFF_TRACK], static_cast<int>(outcome->last().cars_off_track));
  EXPECT_EQ(count[Event::CONTACT] > 0, outcome->last().touches > 0);
  EXPECT_GT(count[Event::COUPLER_PEAK], 0);
  EXPECT_EQ(past_pod.count(1), 1U) << "car 1 starts at the point";
}

TEST_F(Streams, ImpactsAreEmptyWhereBodiesPassThroughEachOther) {
  Record<Impacts> impacts("/train_derail/impacts");
  ASSERT_TRUE(wait_for([&] { return !impacts.empty(); }));
  EXPECT_EQ(impacts.last().run_id, 2U);
  EXPECT_TRUE(impacts.last().impacts.empty());
  EXPECT_TRUE(impacts.last().counts.empty());
  EXPECT_EQ(outcome->last().cars_derailed, outcome->last().cars_past_pod);
  EXPECT_EQ(outcome->last().impacts + outcome->last().couplers_broken + outcome->last().derailed_by_pod, 0U);
}

TEST_F(Streams, InputsAreLatchedWhole) {
  Record<Inputs> inputs("/train_derail/inputs");
  ASSERT_TRUE(wait_for([&] { return !inputs.empty(); }));
  const inputs::Scenario expected = inputs::read_scenario_file(g_scenario_file);
  EXPECT_EQ(inputs.last().run_id, 2U);
  EXPECT_EQ(inputs.last().speed, expected.initial.speed);
  EXPECT_EQ(inputs.last().cars, 12U);
  EXPECT_EQ(inputs.last().on_track_law, "isotropic");
  const inputs::Scenario read_back = inputs::read_scenario(YAML::Load(inputs.last().yaml), "~inputs");
  EXPECT_EQ(inputs::to_yaml(read_back), inputs::to_yaml(expected));
  Record<Outcome> late("/train_derail/outcome");
  EXPECT_TRUE(wait_for([&] { return !late.empty() && late.last().ended == Outcome::TIME_MAX; }));
}

}  // namespace
}  // namespace train_derail::test

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "test_ros_streams");
  if (argc < 2) return 2;
  train_derail::test::g_scenario_file = argv[1];
  const ros::NodeHandle keep_alive;
  return RUN_ALL_TESTS();
}
