/// \file
/// A truck that is off the rails, but still between or beside them: it runs on the ties. Along the track they drag on
/// it. Sideways rails, ties and ballast hold it by a spring up to a limit; where more is needed it drifts. Full-scale
/// tests of wagons on the ties: Diana et al. 2021 (docs/running_on_ties.md).
#pragma once

#include <cmath>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

/// c_t = 2 zeta sqrt(k_t M / 2) [N s/m]: half a car on one truck's ties.
inline double tie_damping(const inputs::Ties& t, double car_mass) {
  return 2.0 * t.damping_ratio * std::sqrt(t.stiffness * 0.5 * car_mass);
}

/// Lateral force [N], left positive: -k_t e - c_t de/dt, but no more than lateral_ratio times `load` (of the truck, N)
/// to either side. `offset`: e, of the truck from where it has drifted to, left positive [m].
template <class T>
T tie_force(const inputs::Ties& t, const T& damping, const T& offset, const T& rate, const T& load) {
  const T limit = t.lateral_ratio * load, least = -limit, held = -t.stiffness * offset - damping * rate;
  return select(held > limit, limit, select(held < least, least, held));
}

/// Where a truck has drifted to [m], left positive: it follows the truck's `offset` from the centre line as soon as the
/// spring between the two would bear more than the limit. `drift`: the same before.
inline double tie_drift(const inputs::Ties& t, double offset, double drift, double load) {
  const double reach = t.lateral_ratio * load / t.stiffness;
  return offset > drift + reach ? offset - reach : offset < drift - reach ? offset + reach : drift;
}

/// What an obstacle that throws a truck off with probability p adds to the hazard that the truck has met: -ln(1 - p),
/// infinite for p = 1. A truck whose endurance is exponential with mean 1 is thrown off where the sum passes it.
inline double obstacle_hazard(double probability) { return -std::log1p(-probability); }

/// Obstacles a length of track on which a train has the speed v [m/s]: rate (v / reference_speed)^-k [1/m].
inline double obstacle_rate(const inputs::Obstacles& o, double v) {
  return o.rate == 0.0 || o.speed_exponent == 0.0 ? o.rate
                                                  : o.rate * std::pow(v / o.reference_speed, -o.speed_exponent);
}

}  // namespace train_derail::model
