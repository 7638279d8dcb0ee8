#include "train_derail/ros/publishers.hpp"

namespace train_derail::ros_face {

namespace {

// Deep enough for a subscriber that keeps up on average with rate 0; a bound for one that has stopped reading.
constexpr std::uint32_t kStreamQueue = 1000;
constexpr std::uint32_t kMarkerQueue = 100;
constexpr bool kLatch = true;

}  // namespace

Publishers::Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters) {
  if (parameters.publish_clock) {
    clock_ = private_handle.advertise<rosgraph_msgs::Clock>("/clock", kStreamQueue, kLatch);
  }
  if (parameters.publish_tf) {
    tf_ = private_handle.advertise<tf2_msgs::TFMessage>("/tf", kStreamQueue, kLatch);
    tf_static_ = private_handle.advertise<tf2_msgs::TFMessage>("/tf_static", 1, kLatch);
  }
  cars_ = private_handle.advertise<CarStates>("cars", kStreamQueue, kLatch);
  couplers_ = private_handle.advertise<CouplerForces>("couplers", kStreamQueue, kLatch);
  if (parameters.stream.markers_every > 0) {
    markers_ = private_handle.advertise<visualization_msgs::MarkerArray>("markers", kMarkerQueue, kLatch);
  }
  events_ = private_handle.advertise<Event>("events", kStreamQueue);
  inputs_ = private_handle.advertise<Inputs>("inputs", 1, kLatch);
  impacts_ = private_handle.advertise<Impacts>("impacts", 1, kLatch);
  outcome_ = private_handle.advertise<Outcome>("outcome", kStreamQueue, kLatch);
  run_info_ = private_handle.advertise<RunInfo>("run_info", 1, kLatch);
}

bool Publishers::has_subscribers() const {
  for (const ::ros::Publisher* p :
       {&tf_, &cars_, &couplers_, &markers_, &events_, &inputs_, &impacts_, &outcome_, &run_info_}) {
    if (*p && p->getNumSubscribers() > 0) return true;
  }
  return false;
}

}  // namespace train_derail::ros_face
