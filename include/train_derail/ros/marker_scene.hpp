/// \file
/// Picture of a run for RViz. It is a few list markers in the world frame. Each array is complete, so that someone who
/// joins late, or jumps about in a bag, sees everything.
#pragma once

#include <string>
#include <vector>

#include <ros/time.h>
#include <visualization_msgs/MarkerArray.h>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/ros/car_shape.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// Keeps the markers of one run up to date. Each run needs an object of its own. Each kind of thing has a namespace.
class MarkerScene {
 public:
  /// `cars` are those of `scenario`, `frame` is the name of the world frame, `interval` the simulated time between two
  /// arrays [s]. A touch is shown for a second, but at least once.
  MarkerScene(const inputs::Scenario& scenario, const std::vector<model::Car>& cars, const std::string& frame,
              double interval);

  /// Returns how long a touch of two cars is shown, in simulated time [s].
  double flash_time() const { return flash_time_; }

  /// Draws one point of the output grid. `touches` are in the order of time and hold at least those of the last
  /// flash_time(). (pile_up_x, pile_up_y) is where the close-up camera looks, in the world frame [m].
  void update(const simulation::Snapshot& now, const outcome::Outcome& outcome,
              const std::vector<outcome::FirstTouch>& touches, double pile_up_x, double pile_up_y,
              const ::ros::Time& stamp);

  /// Returns the markers of the last update().
  const visualization_msgs::MarkerArray& markers() const { return array_; }
  /// Returns the same behind a command that removes everything shown before: for the first array of a run.
  visualization_msgs::MarkerArray markers_on_empty() const;

 private:
  void add_track(const inputs::Scenario& scenario);
  void add_legends();
  /// Returns the index of the marker that holds the bodies of cars in the state of `car`.
  std::size_t body_slot(const simulation::CarSnapshot& car) const;
  void draw_cars(const simulation::Snapshot& now);
  void draw_couplers(const simulation::Snapshot& now);
  std::string status_text(const simulation::Snapshot& now, const outcome::Outcome& outcome) const;
  void draw_text(const simulation::Snapshot& now, const outcome::Outcome& outcome, double pile_up_x, double pile_up_y);
  void draw_flashes(double time, const std::vector<outcome::FirstTouch>& touches);

  const std::vector<model::Car> cars_;
  std::vector<CarShape> shapes_;                   ///< shape of every car
  const bool rails_yield_;                         ///< bodies are then coloured by what derailed them
  double train_length_;                            ///< [m]
  double far_text_ = 0.0;                          ///< height of text for a view of the whole train [m]
  double force_axis_y_ = 0.0;                      ///< line from which the forces are drawn [m]
  double middle_x_ = 0.0, status_y_ = 0.0;         ///< place of text for a view of the whole train [m]
  double flash_time_;                              ///< [s]
  std::vector<geometry_msgs::Point> near_legend_;  ///< places of its markers around its centre [m]
  visualization_msgs::MarkerArray array_;
};

}  // namespace train_derail::ros_face
