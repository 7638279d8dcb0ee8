/// \file
/// Makes an outcome of the engine's motion. It applies the definitions of outcome.hpp to poses and velocities only.
#pragma once

#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/model/train.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::multibody {

/// Length of a coupler and its rate of growth.
struct Gap {
  double length, rate;  // [m], [m/s]
};

/// Motion of one car as seen from above: angles counter-clockwise.
struct PlanMotion {
  double x, y, theta;                             // centre of mass [m] and heading [rad]
  double vx, vy, omega;                           // velocity of the centre of mass [m/s] and yaw rate [rad/s]
  std::optional<BodyMotion> body = std::nullopt;  // all of it, in space
};

/// What has become of each car.
struct Fates {
  std::vector<char> past;  // it has passed the point of derailment
  std::vector<char> derailed;
};

/// Keeps what the outcome needs of a motion.
class Observer {
 public:
  Observer(std::vector<model::Car> train, const inputs::Scenario& scenario);

  /// Must be called for every state of the integrator, in the order of time.
  void follow(double t, const std::vector<Gap>& gaps);
  /// Must be called for every state on the grid of outcome.sample_interval.
  void sample(double t, const std::vector<PlanMotion>& motion);

  /// Whether every truck centre was slower than stop.speed in the last sample.
  bool at_rest() const { return truck_speed_ < stop_speed_; }

  /// Two cars have come to touch. Where bodies press on each other that is for the engine to say; else sample() finds
  /// footprints that overlap.
  void note(const outcome::FirstTouch& touch);

  /// A coupler breaks: its cars have nothing to do with each other any more.
  void part(std::size_t coupler) { parted_[coupler] = 1; }

  /// What cars cover of the ground, where nothing tilts.
  std::vector<model::Footprint> footprints(const std::vector<PlanMotion>& motion) const;
  /// The car belongs to the pile-up.
  bool counts(const Fates& fates, std::size_t car) const { return fates.derailed[car] != 0 || off_track_[car] != 0; }
  /// Writes counts, speeds and pile-up to the outcome; the footprints are those of now.
  void report(const std::vector<model::Footprint>& footprints, const Fates& fates, outcome::Outcome& o) const;

  /// Couplers that have been shortest and longest, counted from 1; 0: none has been shorter (longer) than at the start.
  struct Extreme {
    double length;
    int coupler = 0;
    double time = 0.0;
  };
  const Extreme& shortest() const { return shortest_; }
  const Extreme& longest() const { return longest_; }

 private:
  /// Where a point of the axis of car `k` is, `ahead` of its centre, and how it moves; in space it is so high above the
  /// rails where the car stands on them.
  struct PointMotion {
    Eigen::Vector3d place, velocity;
  };
  PointMotion point(std::size_t k, const PlanMotion& motion, double ahead, double height) const;
  void consider(int coupler, double length, double t);
  void find_touches(double t, const std::vector<PlanMotion>& motion);

  const std::vector<model::Car> train_;
  const double threshold_, stop_speed_, coupler_height_;
  const bool bodies_press_;
  double time_ = 0.0;
  std::vector<Gap> gaps_;
  Extreme shortest_, longest_;
  std::vector<char> off_track_, parted_;
  std::set<std::pair<std::size_t, std::size_t>> touching_;
  outcome::FirstTouch closing_;
  int touches_ = 0;
  outcome::RelativeSpeed relative_, centres_;  // of facing pins, of centres of mass
  double truck_speed_ = 0.0;
};

}  // namespace train_derail::multibody
