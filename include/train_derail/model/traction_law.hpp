/// \file
/// Locomotives that go on as before a derailment that nobody has noticed yet: uphill and on the level with the same
/// power, downhill with the same holding force.
#pragma once

#include <algorithm>
#include <cmath>

namespace train_derail::model {

/// Force that holds a train of the weight [N] at its speed on a grade, uphill positive: (c + sin) W [N]. Negative where
/// it must be held back. `resistance`: c, rolling resistance over weight.
inline double held_force(double resistance, double grade, double weight) {
  return (resistance + grade / std::sqrt(1.0 + grade * grade)) * weight;
}

/// Force of a locomotive at the speed v [m/s], forward positive [N]. It gave `held` at the speed v_0, and gives at most
/// `most` to either side: a pull of the same power, held v_0 / v; a hold of the same force, while the train moves.
inline double traction_force(double held, double most, double v_0, double v) {
  if (held < 0.0) return v > 0.0 ? std::max(held, -most) : 0.0;
  const double power = held * v_0;
  if (!(power > 0.0)) return 0.0;
  return power < most * v ? power / v : most;
}

}  // namespace train_derail::model
