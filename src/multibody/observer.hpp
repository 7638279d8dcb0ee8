/// \file
/// Makes an outcome of the engine's motion. It applies the definitions of outcome.hpp to poses and velocities only.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "train_derail/model/train.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::multibody {

/// Length of a coupler and its rate of growth.
struct Gap {
  double length, rate;  // [m], [m/s]
};

/// Keeps what the outcome needs of a motion.
class Observer {
 public:
  Observer(std::vector<model::Car> train, const inputs::Scenario& scenario);

  /// Must be called for every state of the integrator, in the order of time.
  void follow(double t, const std::vector<Gap>& gaps);
  /// Must be called for every state on the grid of outcome.sample_interval.
  void sample(double t, const std::vector<BodyMotion>& motion);

  /// Whether every truck centre was slower than stop.speed in the last sample.
  bool at_rest() const { return truck_speed_ < stop_speed_; }

  /// Writes counts, speeds and pile-up to the outcome. `motion` is the present motion; `past` says for each car whether
  /// it has passed the point of derailment.
  void report(const std::vector<BodyMotion>& motion, const std::vector<char>& past, outcome::Outcome& o) const;

  /// Couplers that have been shortest and longest, counted from 1; 0: none has been shorter (longer) than at the start.
  struct Extreme {
    double length;
    int coupler = 0;
    double time = 0.0;
  };
  const Extreme& shortest() const { return shortest_; }
  const Extreme& longest() const { return longest_; }

 private:
  void consider(int coupler, double length, double t);
  void touches(double t, const std::vector<BodyMotion>& motion);

  const std::vector<model::Car> train_;
  const double threshold_, stop_speed_;
  double time_ = 0.0;
  std::vector<Gap> gaps_;
  Extreme shortest_, longest_;
  std::vector<char> off_track_;
  std::set<std::pair<std::size_t, std::size_t>> touching_;
  outcome::FirstTouch closing_;
  int touches_ = 0;
  outcome::RelativeSpeed relative_, centres_;  // of facing pins, of centres of mass
  double truck_speed_ = 0.0;
};

}  // namespace train_derail::multibody
