/// \file
/// Lateral force of the rails on a truck, and when it leaves them: a spring and a dashpot towards the alignment, and a
/// limit of lateral over vertical load (L/V). AAR thresholds 1.0 (new cars) and 0.82 (wheel climb in curves); Nadal's
/// formula gives 0.8-1.6.
#pragma once

#include <cmath>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simd/lanes.hpp"

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

/// For how long the limit of L/V has been exceeded without a break [s], after a step of length h [s] in which the
/// lateral force of a truck has gone from `from` to `to` [N], linearly, under `load` (its share of W) [N]; `before`:
/// the same after the step before. If the force falls below the limit within the step, up to that moment. Beyond
/// derail_time the truck leaves the rails.
template <class T>
T overloaded_time(const inputs::Rails& r, const T& from, const T& to, const T& load, double h, const T& before) {
  using std::abs;
  const T limit = r.derail_ratio * load, first = abs(from) - limit, last = abs(to) - limit;
  const auto stays = last > T(0.0);
  return select(first > T(0.0), T(before + select(stays, T(h), T(h * first / (first - last)))),
                select(stays, T(h * last / (last - first)), T(0.0)));
}

/// Load [N] that the limit of the lateral force is derail_ratio times of, for a truck that bears `load` [N], under a
/// car of the weight W [N]: load (W / W_ref)^(load_exponent - 1). Fasteners and rails have strength of their own, so
/// that a light truck leaves the rails at a larger L/V. With an exponent of 1 it is `load`.
inline double holding_load(const inputs::Rails& r, double load, double weight) {
  return r.load_exponent == 1.0 ? load : load * std::pow(weight / r.reference_weight, r.load_exponent - 1.0);
}

/// When within that step, whose end is at time t [s], the limit had been exceeded for derail_time; `reached`: the
/// step's overloaded_time.
inline double derail_moment(const inputs::Rails& r, double from, double to, double load, double t, double h,
                            double reached) {
  const double limit = r.derail_ratio * load, first = std::abs(from) - limit, last = std::abs(to) - limit;
  const double end = last > 0.0 ? t : t - h * last / (last - first);
  return end - (reached - r.derail_time);
}

}  // namespace train_derail::model
