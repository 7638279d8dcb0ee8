#pragma once

#include <array>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "train_derail/ros/message_sink.hpp"
#include "train_derail/ros/parameters.hpp"

namespace train_derail::ros_face {

/// The topics of a run, one publisher object each for the whole life of the node: a latched one made anew would forget.
/// Simulation thread only.
class Publishers : public MessageSink {
 public:
  /// Advertises every topic but those that `parameters` switch off. `private_handle`: of the node, "~".
  Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters);

  void idle(const rosgraph_msgs::Clock& clock, const tf2_msgs::TFMessage& frames) override;
  bool wants_markers() const override;

  /// Whether anybody listens to what the run yields.
  bool has_subscribers() const;

 private:
  void receive(const AnyMessage& message) override;

  std::array<::ros::Publisher, kTopicCount> publishers_;  ///< in the order of Topics; empty for what is switched off
};

}  // namespace train_derail::ros_face
