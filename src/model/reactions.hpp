// What ground and couplers do to a car: eqs. (3)-(14) put together once for every kind of number.
#pragma once

#include "simd/blocks.hpp"
#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/ground_law.hpp"

namespace train_derail::model {

/// Force on a car [N] and moment about its centre [N m] from the ground under both trucks.
template <class T>
struct GroundReaction {
  T fx, fy, moment;
};

/// (c, s): cosine and sine of the heading; `lateral`: 1 where friction acts sideways as well, else 0.
/// Eqs. (3)-(5) and the ground terms of (10)-(12).
template <class T>
GroundReaction<T> ground_reaction(const T& load, const T& lateral, const T& half_spacing, double v_eps, const T& c,
                                  const T& s, const T& vx, const T& vy, const T& omega) {
  const T rim = half_spacing * omega;
  const GroundForce<T> front = friction<T>(load, T(vx - rim * s), T(lateral * (vy + rim * c)), v_eps);
  const GroundForce<T> rear = friction<T>(load, T(vx + rim * s), T(lateral * (vy - rim * c)), v_eps);
  return {T(front.x + rear.x), T(front.y + rear.y),
          T(half_spacing * (c * (front.y - rear.y) - s * (front.x - rear.x)))};
}

/// Force of the coupler on the lead car (the trail car feels the opposite) and moments about both centres.
template <class T>
struct CouplerReaction {
  T fx, fy, moment_lead, moment_trail;
};

/// Calls use(CouplerReaction<T>). (dx, dy): centre of the lead car minus centre of the trail car [m]; `half_...`: half
/// the length of either [m].
template <class T, class Law, class Use>
void with_coupler_reaction(const Law& law, double cos_limit, const T& half_lead, const T& half_trail, const T& dx,
                           const T& dy, const T& c_lead, const T& s_lead, const T& c_trail, const T& s_trail,
                           const Use& use) {
  const auto react = [&](const CouplerLoad<T>& b) {
    // Rear pin at -L/2, front pin at +L/2; opposite forces on opposite ends turn both cars the same way.
    use(CouplerReaction<T>{b.force_x, b.force_y,
                           T(b.moment_lead - half_lead * (c_lead * b.force_y - s_lead * b.force_x)),
                           T(b.moment_trail - half_trail * (c_trail * b.force_y - s_trail * b.force_x))});
  };
  with_coupler_load<T, UnitVectors<T>>(law, cos_limit, T(dx - half_lead * c_lead - half_trail * c_trail),
                                       T(dy - half_lead * s_lead - half_trail * s_trail), c_lead, s_lead, c_trail,
                                       s_trail, react);
}

}  // namespace train_derail::model
