/// \file
/// Where the messages of a run go: to topics, into a bag, or both.
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

/// A message on its way to its topic. index() is the number of the topic in Topics. It points to an object of the
/// sender, which must outlive the call.
using AnyMessage = detail::AnyMessage<Topics>::Type;

/// Receives the messages of a run in their order. Stamps never go back.
class MessageSink {
 public:
  virtual ~MessageSink() = default;

  /// Sends `message` to `Topic`, one of Topics.
  template <class Topic>
  void send(const typename Topic::Message& message) {
    receive(AnyMessage(std::in_place_index<topic_number<Topic>()>, &message));
  }

  /// Receives the time after the end of a run, and the frames where everything came to rest. This is for those who
  /// listen; a record of the run ignores it.
  virtual void idle(const rosgraph_msgs::Clock&, const tf2_msgs::TFMessage&) {}

  /// Returns whether markers are wanted. They are costly, and are made only if some sink wants them.
  virtual bool wants_markers() const = 0;

  /// Returns whether somebody may begin in the middle of what the sink has received, unnoticed, as with a bag. Markers
  /// that have not changed are then repeated for it now and then.
  virtual bool is_read_from_the_middle() const { return false; }

 protected:
  /// Does what the sink does with a message.
  virtual void receive(const AnyMessage& message) = 0;
};

}  // namespace train_derail::ros_face
