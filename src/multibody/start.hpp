/// \file
/// How the engine starts a scenario.
#pragma once

#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::multibody {

/// Cars in line along the track, couplers at mid-slack.
struct Start {
  std::vector<double> x;  // centres of mass [m]
  double yaw_rate;        // of the first car [rad/s]
};

/// The scenario's start with its perturbation. Random numbers are of this engine's own, so that the ensembles of the
/// two programs share none.
Start drawn_start(const inputs::Scenario& scenario, const std::vector<model::Car>& train);

}  // namespace train_derail::multibody
