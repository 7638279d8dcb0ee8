/// \file
/// The topics of the running node.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/publisher.h>
#include <ros/serialized_message.h>

#include "train_derail/ros/message_sink.hpp"
#include "train_derail/ros/parameters.hpp"

namespace train_derail::ros_face {

/// A message as it goes to subscribers.
struct MessageBytes {
  ::ros::SerializedMessage bytes;
};

/// Publishes the topics of a run. Each has one publisher object for the whole life of the node, as a latched one that
/// is made anew would forget its message. Messages wait until publish_waiting(): each one that goes wakes the thread of
/// roscpp that writes to sockets, and that thread bars the next one while it writes. For the simulation thread only.
class Publishers : public MessageSink {
 public:
  /// Advertises every topic except those that `parameters` switch off. `private_handle` is that of the node ("~").
  Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters);

  /// Publishes what has been received since the last call.
  void publish_waiting();

  void idle(const rosgraph_msgs::Clock& clock, const tf2_msgs::TFMessage& frames) override;
  bool wants_markers() const override;

  /// Returns whether somebody sees and charts the run: there are listeners to the markers and to the couplers, as far
  /// as there are such topics.
  bool is_watched() const;
  /// Returns whether somebody has begun to listen to the markers since the last call.
  bool take_newcomers();

  /// Returns whether roscpp has handed all messages but the newest of each topic to the sockets of those who listen.
  bool all_but_newest_sent() const;

  /// Returns whether anybody listens to what the run yields; /clock and /tf_static do not count.
  bool has_subscribers() const;

 private:
  void receive(const AnyMessage& message) override;
  bool has_listeners(std::size_t topic) const;

  ::ros::CallbackQueue newcomers_;  ///< says who begins to listen to the markers
  bool has_newcomers_ = false;
  std::vector<std::pair<std::size_t, MessageBytes>> waiting_;  ///< each with the number of its topic
  std::array<MessageBytes, kTopicCount> newest_, before_;      ///< that have been published last, of each topic
  std::array<::ros::Publisher, kTopicCount>
      publishers_;  ///< in the order of Topics; an empty one for each topic that is off
};

}  // namespace train_derail::ros_face
