// Lateral force of the rails on a truck, and when it leaves them: a spring and a dashpot towards the alignment, and a limit of
// lateral over vertical load (L/V). AAR thresholds 1.0 (new cars) and 0.82 (wheel climb in curves); Nadal's formula gives 0.8-1.6.
#pragma once

#include <cmath>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/lanes.hpp"

namespace train_derail::model {

/// c_r = 2 zeta sqrt(k_r M / 2) [N s/m]: half a car on one truck's rails.
inline double rail_damping(const inputs::Rails& r, double car_mass) {
  return 2.0 * r.damping_ratio * std::sqrt(r.stiffness * 0.5 * car_mass);
}

/// F = -k_r e - c_r de/dt [N], left positive; e: offset of the truck from the alignment, left positive [m].
template <class T>
T rail_force(const inputs::Rails& r, const T& damping, const T& offset, const T& rate) {
  return -r.stiffness * offset - damping * rate;
}

/// For how long the limit has been exceeded without a break [s], at the end of a step of length h [s] in which the truck has borne
/// `force` [N] under `load` (its share of W) [N]; `before`: at its beginning. Beyond derail_time the truck leaves the rails.
template <class T>
T overloaded_time(const inputs::Rails& r, const T& force, const T& load, double h, const T& before) {
  using std::abs;
  return select(abs(force) > r.derail_ratio * load, T(before + h), T(0.0));
}

}  // namespace train_derail::model
