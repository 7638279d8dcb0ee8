/// \file
/// The one list of the topics of a run. Node, bags, panel, tests and docs/topics.md walk it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>

#include <rosgraph_msgs/Clock.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include "train_derail/CarStates.h"
#include "train_derail/CouplerForces.h"
#include "train_derail/Event.h"
#include "train_derail/Impacts.h"
#include "train_derail/Inputs.h"
#include "train_derail/Outcome.h"
#include "train_derail/PileUp.h"
#include "train_derail/RunInfo.h"

namespace train_derail::ros_face {

/// Whether a subscriber that comes late gets the last message of a topic.
enum class Latched { no, yes };

/// What there is to know of a topic besides the type of its messages.
struct TopicFacts {
  std::string_view name;     ///< "~cars": below the name of the node; "/tf": the same for all nodes
  std::uint32_t queue;       ///< messages that are kept for a subscriber that is slow
  Latched latched;           ///< streams are latched too, so that who joins a paused run sees where it stands
  std::string_view meaning;  ///< as in docs/topics.md
};

/// Deep enough for a subscriber that keeps up on average at rate 0; a bound for one that has stopped reading.
inline constexpr std::uint32_t kStreamQueue = 1000;

struct ClockTopic {
  using Message = rosgraph_msgs::Clock;
  static constexpr TopicFacts facts{"/clock", kStreamQueue, Latched::yes,
                                    "simulated time; never goes back, not even across restarts"};
};
struct TfTopic {
  using Message = tf2_msgs::TFMessage;
  static constexpr TopicFacts facts{"/tf", kStreamQueue, Latched::yes,
                                    "`map` to `car_001`, ... and `pile_up`, which follows the derailed part"};
};
struct TfStaticTopic {
  using Message = tf2_msgs::TFMessage;
  static constexpr TopicFacts facts{"/tf_static", 1, Latched::yes, "`map` to `pod`, the point of derailment"};
};
struct CarsTopic {
  using Message = CarStates;
  static constexpr TopicFacts facts{"~cars", kStreamQueue, Latched::yes,
                                    "pose, twist, derailed and by what, truck displacement of every car; on the grid "
                                    "`output.interval` of simulated time"};
};
struct CouplersTopic {
  using Message = CouplerForces;
  static constexpr TopicFacts facts{"~couplers", kStreamQueue, Latched::yes,
                                    "gap, axial force (buff +), lateral force, end moments, swing angles, broken or "
                                    "not; same grid and stamps as `~cars`"};
};
struct MarkersTopic {
  using Message = visualization_msgs::MarkerArray;
  static constexpr TopicFacts facts{
      "~markers", kStreamQueue, Latched::no,
      "cars with the body of their block's name, number and what they are on the roof, in their own frames; arrows at "
      "couplers by force (buff: towards each other), broken ones; a star with the closing speed where two cars come to "
      "touch. Only what has changed; who comes late gets everything once"};
};
struct TrackMarkersTopic {
  using Message = visualization_msgs::MarkerArray;
  static constexpr TopicFacts facts{"~track_markers", 1, Latched::yes,
                                    "what does not move: ground, ballast, ties, rails with their curves, the point of "
                                    "derailment, a ruler of 50 m and of 100 ft along the track; once a run"};
};
struct PileUpTopic {
  using Message = PileUp;
  static constexpr TopicFacts facts{"~pile_up", kStreamQueue, Latched::yes,
                                    "where the heap of cars lies, how long and wide it is, for cameras; same grid and "
                                    "stamps as `~cars`"};
};
struct EventsTopic {
  using Message = Event;
  static constexpr TopicFacts facts{"~events", kStreamQueue, Latched::no,
                                    "a car passes the point of derailment, leaves the rails (and why), cars touch, a "
                                    "coupler breaks (and why) or peaks above `events/coupler_force`, the end"};
};
struct InputsTopic {
  using Message = Inputs;
  static constexpr TopicFacts facts{"~inputs", 1, Latched::yes, "the scenario in full, SI; once a run"};
};
struct ImpactsTopic {
  using Message = Impacts;
  static constexpr TopicFacts facts{
      "~impacts", 1, Latched::yes,
      "bodies that hit each other: which cars, head or side, where, when, closing speed, impulse, peak force; "
      "histogram of normal closing speeds in steps of 5 mph; at most once a simulated second"};
};
struct OutcomeTopic {
  using Message = Outcome;
  static constexpr TopicFacts facts{"~outcome", kStreamQueue, Latched::yes,
                                    "what has come out so far, ten times a simulated second; final at the end"};
};
struct RunInfoTopic {
  using Message = RunInfo;
  static constexpr TopicFacts facts{"~run_info", 1, Latched::yes, "run id, state, rate, stamp of time 0"};
};

/// All topics of a run.
using Topics = std::tuple<ClockTopic, TfTopic, TfStaticTopic, CarsTopic, CouplersTopic, PileUpTopic, TrackMarkersTopic,
                          MarkersTopic, EventsTopic, InputsTopic, ImpactsTopic, OutcomeTopic, RunInfoTopic>;

inline constexpr std::size_t kTopicCount = std::tuple_size_v<Topics>;

/// Calls `use` with an object of every topic's type, in order.
template <class Use>
void for_each_topic(const Use& use) {
  std::apply([&](auto... topic) { (use(topic), ...); }, Topics());
}

/// Returns the place of a topic in Topics, which must have it.
template <class Topic>
constexpr std::size_t topic_number() {
  return std::apply(
      [](auto... topic) {
        std::size_t number = 0;
        static_cast<void>(((std::is_same_v<decltype(topic), Topic> ? true : (++number, false)) || ...));
        return number;
      },
      Topics());
}

/// Returns the facts of the topic in place `number` of Topics.
inline const TopicFacts& topic_facts(std::size_t number) {
  static constexpr auto all = std::apply([](auto... topic) { return std::array{decltype(topic)::facts...}; }, Topics());
  return all.at(number);
}

/// Returns the full name of a topic of the node that is called `node`, e.g. "/train_derail/cars".
inline std::string topic_name(const TopicFacts& topic, const std::string& node) {
  if (topic.name.front() != '~') return std::string(topic.name);
  return node + "/" + std::string(topic.name.substr(1));
}

}  // namespace train_derail::ros_face
