/// \file
/// The moving part of the scene that RViz shows: cars, forces of couplers, places where cars touch.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <visualization_msgs/MarkerArray.h>

#include "train_derail/model/train.hpp"
#include "train_derail/outcome/outcome.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/scene/car_shape.hpp"
#include "train_derail/scene/palette.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// The markers of one run. What belongs to a car lies in the car's tf frame, locked to it, so that only what looks
/// different from before need be sent. Stamps are the sender's.
///
/// Namespaces, with the car's number as id: `cars` (the body in the colour of why it left the track, or of how
/// it lies), `car_parts` (trucks,
/// outlines, number and bars on the roof, broken couplers), `couplers_front` and `couplers_rear` (an arrow on the roof:
/// towards the coupler in buff, away from it in draft, in the colour of the force's class). `touches` lie in the world:
/// a star where cars come to touch, and the closing speed above it; they fade within a simulated second.
class MarkerScene {
 public:
  /// `cars` are those of `scenario`; `interval` is the longest time from one update to the next, simulated [s].
  MarkerScene(const inputs::Scenario& scenario, const std::vector<model::Car>& cars, const Frames& frames,
              double interval, scene::Colours colours = scene::Colours::cause);

  /// Returns how long a touch is shown, simulated [s].
  double flash_time() const { return flash_time_; }
  /// Makes the scene that of `now`, later or earlier than what it has been. `touches` need hold only those that are at
  /// most flash_time() old.
  void update(const simulation::Snapshot& now, const std::vector<outcome::FirstTouch>& touches);

  /// What the colours of cars say from the next update() on.
  void colour_by(scene::Colours colours) { colours_ = colours; }

  /// Returns what has to be sent for those who have had everything so far. Forces may wait for a tenth of a simulated
  /// second unless `all` is set. May be empty.
  visualization_msgs::MarkerArray take_changes(bool all);
  /// Returns everything that is shown.
  visualization_msgs::MarkerArray whole() const;
  /// Returns everything, after a marker that removes what was shown of the run before.
  visualization_msgs::MarkerArray whole_on_empty() const;

 private:
  using Marker = visualization_msgs::Marker;

  /// What a car looks like.
  struct Shown {
    const scene::LookFacts* facts = &facts_of(scene::Look::on_track);  ///< of its Look or of its Lie
    bool front_broken = false, rear_broken = false;
    int front_force = 0, rear_force = 0;  ///< classes of forces

    bool same_body(const Shown& o) const {
      return facts == o.facts && front_broken == o.front_broken && rear_broken == o.rear_broken;
    }
  };
  /// A star in the world, and the words above it.
  struct Flash {
    int step = 0;  ///< how far it has faded
    Marker star;
    std::optional<Marker> text;
  };
  using TouchKey = std::pair<int, int>;  ///< the two cars

  Shown shown_of(const simulation::Snapshot& now, std::size_t car) const;
  Marker body(std::size_t car) const;
  Marker parts(std::size_t car) const;
  /// At which a car is drawn in its frame [m].
  double layer_height(std::size_t car) const;
  /// Of the front or the rear coupler; empty if it has no force.
  std::optional<Marker> arrow(std::size_t car, bool front) const;
  void update_flashes(const simulation::Snapshot& now, const std::vector<outcome::FirstTouch>& touches);
  /// `height`: of the star [m].
  Flash make_flash(const outcome::FirstTouch& touch, double height, int id, int step, bool told) const;

  const std::vector<model::Car> cars_;
  const Frames frames_;
  const bool rails_yield_;
  const double flash_time_;
  scene::Colours colours_;
  const double layer_step_;              ///< [m]
  const double above_roofs_;             ///< of all cars, above the height of one [m]
  std::vector<scene::CarShape> shapes_;  ///< one for each car
  std::vector<Shown> now_, sent_;
  double time_ = 0.0, forces_sent_ = -1.0;  ///< simulated [s]
  std::map<TouchKey, Flash> flashes_;
  std::map<TouchKey, Flash> flashes_sent_;
};

}  // namespace train_derail::ros_face
