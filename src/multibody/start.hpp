/// \file
/// How the engine starts a scenario.
#pragma once

#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::multibody {

/// Cars in line along the track, couplers at mid-slack. The first car to derail is at 0.
struct Start {
  std::vector<double> x;    // centres of mass [m]
  double yaw_rate;          // of the first car to derail [rad/s]
  double crew_delay = 1.0;  // factor of brakes.emergency_time
  /// In space: sideways speeds of trucks that leave the rails at the point of derailment, front and rear one of each
  /// car [m/s].
  std::vector<double> kicks;
};

/// The scenario's start with its perturbation. Random numbers are of this engine's own, so that the ensembles of the
/// two programs share none.
Start drawn_start(const inputs::Scenario& scenario, const std::vector<model::Car>& train);

/// Lateral deviation of the rails from the centre line: independent draws every 20 ft, a cosine between them.
class Alignment {
 public:
  /// From `from` to `to`; beyond them it stays as it is there [m].
  Alignment(const inputs::Perturbation& p, double from, double to);
  double at(double place) const;

 private:
  const double from_;
  std::vector<double> deviations_;  // empty: none
};

}  // namespace train_derail::multibody
