// The picture of a run for RViz: a few list markers in the world frame, each array complete in itself, so that whoever
// joins late or jumps about in a bag sees everything.
#pragma once

#include <string>
#include <vector>

#include <ros/time.h>
#include <visualization_msgs/MarkerArray.h>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// One object a run. One namespace a kind of thing.
class MarkerScene {
 public:
  /// `frame`: the world's name.
  MarkerScene(const std::vector<model::Car>& cars, double coupler_length, const std::string& frame);

  /// (pile_up_x, pile_up_y): where the close-up camera looks [m].
  void update(const simulation::Snapshot& now, const outcome::Outcome& outcome, double pile_up_x, double pile_up_y,
              const ::ros::Time& stamp);

  const visualization_msgs::MarkerArray& markers() const { return array_; }
  /// The same after a command that removes everything shown before: for the first array of a run.
  visualization_msgs::MarkerArray markers_on_empty() const;

 private:
  void add_track();
  void draw_cars(const simulation::Snapshot& now);
  void draw_couplers(const simulation::Snapshot& now);
  void draw_text(const simulation::Snapshot& now, const outcome::Outcome& outcome, double pile_up_x, double pile_up_y);

  const std::vector<model::Car> cars_;
  double train_length_;  // m
  visualization_msgs::MarkerArray array_;
};

}  // namespace train_derail::ros_face
