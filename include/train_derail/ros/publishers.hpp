#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "train_derail/Inputs.h"
#include "train_derail/RunInfo.h"
#include "train_derail/ros/event_detector.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/marker_scene.hpp"
#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/pile_up_follower.hpp"
#include "train_derail/ros/sim_clock.hpp"

namespace train_derail::ros_face {

/// All topics of the node, one publisher object each for its whole life: a latched one made anew would forget.
/// Streams are latched too, so that who joins a paused run sees where it stands. Simulation thread only.
class Publishers {
 public:
  Publishers(::ros::NodeHandle& private_handle, const NodeParameters& parameters);

  void start_run(std::uint32_t run_id, const inputs::Scenario& scenario, const std::vector<model::Car>& cars,
                 const ::ros::Time& start);

  /// One point of the grid of simulated time: clock, tf, cars, couplers, markers, in that order, all with `stamp`,
  /// which must be newer than that of the point before.
  void grid_point(const simulation::Snapshot& now, const outcome::Outcome& outcome, const ::ros::Time& stamp);
  /// Sends the markers of the last grid point if that was left out for want of subscribers.
  void complete_markers();

  void event(const Occurrence& occurrence, const ::ros::Time& stamp);
  void outcome(const outcome::Outcome& outcome, const ::ros::Time& stamp);
  void run_info(RunInfo info, const ::ros::Time& stamp);
  const Inputs& inputs() const { return inputs_message_; }

  /// Whether anybody listens to what the run yields.
  bool has_subscribers() const;

 private:
  std_msgs::Header header(const ::ros::Time& stamp) const;
  void send_markers();

  const Frames frames_;
  const bool publish_clock_, publish_tf_;
  const int markers_every_;
  ::ros::Publisher clock_, tf_, tf_static_, cars_, couplers_, markers_, events_, inputs_, outcome_, run_info_;

  std::uint32_t run_id_ = 0;
  Inputs inputs_message_;
  std::optional<MarkerScene> scene_;
  PileUpFollower pile_up_;
  std::int64_t grid_points_ = 0;  // of this run
  bool markers_empty_ = false;    // nothing of this run is shown yet

  // Of the last grid point, for complete_markers().
  bool markers_sent_ = false;
  simulation::Snapshot last_;
  outcome::Outcome last_outcome_;
  ::ros::Time last_stamp_;
};

}  // namespace train_derail::ros_face
