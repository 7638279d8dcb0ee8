// Where the messages of a run go: topics, a bag, or several of them.
#pragma once

#include <variant>

#include "train_derail/ros/topics.hpp"

namespace train_derail::ros_face {

namespace detail {

template <class Topics>
struct AnyMessage;
template <class... Topic>
struct AnyMessage<std::tuple<Topic...>> {
  using Type = std::variant<const typename Topic::Message*...>;
};

}  // namespace detail

/// A message on its way to its topic. index() is the topic's number in Topics. Points to what the sender keeps.
using AnyMessage = detail::AnyMessage<Topics>::Type;

/// Takes the messages of a run in the order in which they belong. Stamps never go back.
class MessageSink {
 public:
  virtual ~MessageSink() = default;

  /// Sends `message` to `Topic`, one of Topics.
  template <class Topic>
  void send(const typename Topic::Message& message) {
    receive(AnyMessage(std::in_place_index<topic_number<Topic>()>, &message));
  }

  /// Time after the end of a run, and where everything stands: for those who listen, not for a record of the run.
  virtual void idle(const rosgraph_msgs::Clock&, const tf2_msgs::TFMessage&) {}

  /// Markers are costly: they are made only if some sink wants them.
  virtual bool wants_markers() const = 0;

 protected:
  virtual void receive(const AnyMessage& message) = 0;
};

}  // namespace train_derail::ros_face
