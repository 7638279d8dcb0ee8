// What the engine's motion means as an outcome: definitions of outcome.hpp, applied to poses and velocities alone.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include "train_derail/model/train.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::multibody {

/// Length of a coupler and how fast it grows.
struct Gap {
  double length, rate;  // m, m/s
};

class Observer {
 public:
  Observer(std::vector<model::Car> train, const inputs::Scenario& scenario);

  /// Every state that the integrator hands out, in the order of time.
  void follow(double t, const std::vector<Gap>& gaps);
  /// A state of the grid outcome.sample_interval.
  void sample(double t, const std::vector<CarMotion>& motion);

  /// Of the last sample.
  bool at_rest() const { return truck_speed_ < stop_speed_; }

  /// Counts, speeds and pile-up of a train that stands as `motion` says; `past` says who has passed the point of
  /// derailment.
  void report(const std::vector<CarMotion>& motion, const std::vector<char>& past, outcome::Outcome& o) const;

  /// Shortest and longest that any coupler has been, from 1; 0: not shorter (longer) than at first.
  struct Extreme {
    double length;
    int coupler = 0;
    double time = 0.0;
  };
  const Extreme& shortest() const { return shortest_; }
  const Extreme& longest() const { return longest_; }

 private:
  void consider(int coupler, double length, double t);
  void touches(double t, const std::vector<CarMotion>& motion);

  const std::vector<model::Car> train_;
  const double threshold_, stop_speed_;
  double time_ = 0.0;
  std::vector<Gap> gaps_;
  Extreme shortest_, longest_;
  std::vector<char> off_track_;
  std::set<std::pair<std::size_t, std::size_t>> touching_;
  outcome::Closing closing_;
  int touches_ = 0;
  outcome::RelativeSpeed relative_, centres_;  // of car ends, of centres of mass
  double truck_speed_ = 0.0;
};

}  // namespace train_derail::multibody
