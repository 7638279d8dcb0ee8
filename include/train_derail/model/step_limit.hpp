/// \file
/// How long a step of fixed length may be before the motion blows up, from masses, stiffnesses and damping alone: known
/// before the run.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// What one mechanism allows.
struct StepLimit {
  std::string key;        ///< the input that makes it stiff: "coupler.stiffness"
  double rate = 0.0;      ///< bound of the fastest angular frequency that it can give any car [rad/s]
  double damping = 0.0;   ///< bound of its damping, force over mass and speed [1/s]
  double step_max = 0.0;  ///< longest stable step [s]; infinite if it has neither
};

/// Of all mechanisms that the scenario has, the strictest first. Bounds are Gershgorin's, with couplers turned as far
/// as they can swing: on the safe side, for most trains by a factor below two. Stable steps of the semi-implicit method
/// hold h^2 rate^2 + 2 h damping < 4, those of the explicit Runge-Kutta methods h (rate + damping / 3) < 1.
std::vector<StepLimit> step_limits(const inputs::Scenario& scenario);

/// Throws inputs::InputError, which calls the scenario `source`, if solver.fixed_step is longer than step_limits()
/// allow.
void check_step(const inputs::Scenario& scenario, const std::string& source = "scenario");

}  // namespace train_derail::model
