#include "train_derail/ros/publishers.hpp"

#include <rosgraph_msgs/Clock.h>

#include "train_derail/ros/messages.hpp"

namespace train_derail::ros_face {

namespace {

// Deep enough for a subscriber that keeps up on average with rate 0; a bound for one that has stopped reading.
constexpr std::uint32_t kStreamQueue = 1000;
constexpr std::uint32_t kMarkerQueue = 100;
constexpr bool kLatch = true;

}  // namespace

Publishers::Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters)
    : frames_{parameters.world_frame, parameters.frame_prefix},
      publish_clock_(parameters.publish_clock),
      publish_tf_(parameters.publish_tf),
      markers_every_(parameters.markers_every) {
  if (publish_clock_) clock_ = private_handle.advertise<rosgraph_msgs::Clock>("/clock", kStreamQueue, kLatch);
  if (publish_tf_) {
    tf_ = private_handle.advertise<tf2_msgs::TFMessage>("/tf", kStreamQueue, kLatch);
    tf_static_ = private_handle.advertise<tf2_msgs::TFMessage>("/tf_static", 1, kLatch);
  }
  cars_ = private_handle.advertise<CarStates>("cars", kStreamQueue, kLatch);
  couplers_ = private_handle.advertise<CouplerForces>("couplers", kStreamQueue, kLatch);
  if (markers_every_ > 0) {
    markers_ = private_handle.advertise<visualization_msgs::MarkerArray>("markers", kMarkerQueue, kLatch);
  }
  events_ = private_handle.advertise<Event>("events", kStreamQueue);
  inputs_ = private_handle.advertise<Inputs>("inputs", 1, kLatch);
  outcome_ = private_handle.advertise<Outcome>("outcome", 1, kLatch);
  run_info_ = private_handle.advertise<RunInfo>("run_info", 1, kLatch);
}

void Publishers::start_run(std::uint32_t run_id, const inputs::Scenario& scenario, const std::vector<model::Car>& cars,
                           const ::ros::Time& start) {
  if (publish_tf_ && run_id_ == 0) {
    tf2_msgs::TFMessage fixed;
    fixed.transforms.push_back(make_transform(header(start), frames_.pod(), 0.0, 0.0, 0.0));
    tf_static_.publish(fixed);
  }
  run_id_ = run_id;
  scene_.emplace(cars, scenario.coupler.length, frames_.world);
  pile_up_ = PileUpFollower();
  grid_points_ = 0;
  markers_empty_ = true;
  inputs_message_ = to_message(scenario, cars, header(start), run_id);
  inputs_.publish(inputs_message_);
}

void Publishers::grid_point(const simulation::Snapshot& now, const outcome::Outcome& outcome,
                            const ::ros::Time& stamp) {
  const std_msgs::Header h = header(stamp);
  pile_up_.update(now);
  if (publish_clock_) {
    rosgraph_msgs::Clock clock;
    clock.clock = stamp;
    clock_.publish(clock);
  }
  if (publish_tf_) {
    tf2_msgs::TFMessage moving = to_transforms(now.cars, h, frames_);
    moving.transforms.push_back(make_transform(h, frames_.pile_up(), pile_up_.x(), pile_up_.y(), 0.0));
    tf_.publish(moving);
  }
  cars_.publish(to_message(now.cars, now.time, h, run_id_));
  couplers_.publish(to_message(now.couplers, now.time, h, run_id_));

  last_ = now;
  last_outcome_ = outcome;
  last_stamp_ = stamp;
  markers_sent_ = false;
  if (markers_every_ > 0 &&
      (markers_empty_ || (grid_points_ % markers_every_ == 0 && markers_.getNumSubscribers() > 0))) {
    send_markers();
  }
  ++grid_points_;
}

void Publishers::complete_markers() {
  if (markers_every_ > 0 && !markers_sent_) send_markers();
}

void Publishers::send_markers() {
  scene_->update(last_, last_outcome_, pile_up_.x(), pile_up_.y(), last_stamp_);
  if (markers_empty_) {
    markers_.publish(scene_->markers_on_empty());
  } else {
    markers_.publish(scene_->markers());
  }
  markers_empty_ = false;
  markers_sent_ = true;
}

void Publishers::event(const Occurrence& occurrence, const ::ros::Time& stamp) {
  events_.publish(to_message(occurrence, header(stamp), run_id_));
}

void Publishers::outcome(const outcome::Outcome& outcome, const ::ros::Time& stamp) {
  outcome_.publish(to_message(outcome, header(stamp), run_id_));
}

void Publishers::run_info(RunInfo info, const ::ros::Time& stamp) {
  info.header = header(stamp);
  info.run_id = run_id_;
  run_info_.publish(info);
}

bool Publishers::has_subscribers() const {
  for (const ::ros::Publisher* p : {&tf_, &cars_, &couplers_, &markers_, &events_, &inputs_, &outcome_, &run_info_}) {
    if (*p && p->getNumSubscribers() > 0) return true;
  }
  return false;
}

std_msgs::Header Publishers::header(const ::ros::Time& stamp) const {
  std_msgs::Header h;
  h.stamp = stamp;
  h.frame_id = frames_.world;
  return h;
}

}  // namespace train_derail::ros_face
