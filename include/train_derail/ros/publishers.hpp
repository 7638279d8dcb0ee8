#pragma once

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "train_derail/ros/message_sink.hpp"
#include "train_derail/ros/parameters.hpp"

namespace train_derail::ros_face {

/// All topics of the node, one publisher object each for its whole life: a latched one made anew would forget.
/// Streams are latched too, so that who joins a paused run sees where it stands. Simulation thread only.
class Publishers : public MessageSink {
 public:
  Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters);

  void clock(const rosgraph_msgs::Clock& m) override { publish(clock_, m); }
  void tf(const tf2_msgs::TFMessage& m) override { publish(tf_, m); }
  void tf_static(const tf2_msgs::TFMessage& m) override { publish(tf_static_, m); }
  void cars(const CarStates& m) override { publish(cars_, m); }
  void couplers(const CouplerForces& m) override { publish(couplers_, m); }
  void markers(const visualization_msgs::MarkerArray& m) override { publish(markers_, m); }
  void event(const Event& m) override { publish(events_, m); }
  void inputs(const Inputs& m) override { publish(inputs_, m); }
  void impacts(const Impacts& m) override { publish(impacts_, m); }
  void outcome(const Outcome& m) override { publish(outcome_, m); }
  void run_info(const RunInfo& m) override { publish(run_info_, m); }
  void idle(const rosgraph_msgs::Clock& m, const tf2_msgs::TFMessage& frames) override {
    clock(m);
    tf(frames);
  }
  bool wants_markers() const override { return markers_ && markers_.getNumSubscribers() > 0; }

  /// Whether anybody listens to what the run yields.
  bool has_subscribers() const;

 private:
  /// Topics that the parameters switch off have no publisher.
  template <class Message>
  static void publish(const ::ros::Publisher& topic, const Message& message) {
    if (topic) topic.publish(message);
  }

  ::ros::Publisher clock_, tf_, tf_static_, cars_, couplers_, markers_, events_, inputs_, impacts_, outcome_, run_info_;
};

}  // namespace train_derail::ros_face
