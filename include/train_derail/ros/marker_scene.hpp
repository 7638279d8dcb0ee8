// The picture of a run for RViz: a few list markers in the world frame, each array complete in itself, so that whoever
// joins late or jumps about in a bag sees everything.
#pragma once

#include <string>
#include <vector>

#include <ros/time.h>
#include <visualization_msgs/MarkerArray.h>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/ros/car_shape.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// One object a run. One namespace a kind of thing.
class MarkerScene {
 public:
  /// `cars` of the scenario. `frame`: the world's name. `interval` between two arrays [s]: a touch is shown for a
  /// second, but at least once.
  MarkerScene(const inputs::Scenario& scenario, const std::vector<model::Car>& cars, const std::string& frame,
              double interval);

  /// How long a touch of two cars is shown, simulated [s].
  double flash_time() const { return flash_time_; }

  /// `touches` in the order of time, at least those of the last flash_time();
  /// (pile_up_x, pile_up_y): where the close-up camera looks [m].
  void update(const simulation::Snapshot& now, const outcome::Outcome& outcome,
              const std::vector<outcome::Closing>& touches, double pile_up_x, double pile_up_y,
              const ::ros::Time& stamp);

  const visualization_msgs::MarkerArray& markers() const { return array_; }
  /// The same after a command that removes everything shown before: for the first array of a run.
  visualization_msgs::MarkerArray markers_on_empty() const;

 private:
  void add_track(const inputs::Scenario& scenario);
  void add_legends();
  /// Of the bodies of cars in this state.
  std::size_t body_slot(const simulation::CarSnapshot& car) const;
  void draw_cars(const simulation::Snapshot& now);
  void draw_couplers(const simulation::Snapshot& now);
  std::string status_text(const simulation::Snapshot& now, const outcome::Outcome& outcome) const;
  void draw_text(const simulation::Snapshot& now, const outcome::Outcome& outcome, double pile_up_x, double pile_up_y);
  void draw_flashes(double time, const std::vector<outcome::Closing>& touches);

  const std::vector<model::Car> cars_;
  std::vector<CarShape> shapes_;                   // of every car
  const bool rails_yield_;                         // bodies are coloured by what derailed them
  double train_length_;                            // m
  double far_text_ = 0.0;                          // height of text that is read when the whole train is in view [m]
  double force_axis_y_ = 0.0;                      // m
  double middle_x_ = 0.0, status_y_ = 0.0;         // of what is read when the whole train is in view [m]
  double flash_time_;                              // s
  std::vector<geometry_msgs::Point> near_legend_;  // places of its markers about its centre
  visualization_msgs::MarkerArray array_;
};

}  // namespace train_derail::ros_face
