/// \file
/// Axial force of a coupler with draft gears and damping, and when it breaks. Without them: axial_force of
/// coupler_law.hpp. Draft gears travel about 3.25 in each; knuckles hold 400-650 kip, coupler bodies 700-900 kip (AAR
/// M-211).
#pragma once

#include <algorithm>
#include <cmath>

#include "train_derail/model/coupler_law.hpp"

namespace train_derail::model {

/// Energy [J] stored at `excess` [m] >= 0 beyond the slack: k_1 over the travel, then K.
inline double draft_gear_energy(const inputs::Coupler& c, double excess) {
  const double gear = std::min(excess, c.draft_gear_travel), solid = excess - gear;
  return 0.5 * c.draft_gear_stiffness * gear * gear +
         (c.draft_gear_stiffness * gear + 0.5 * c.stiffness * solid) * solid;
}

/// Excess beyond the slack [m] at which the springs bear `force` >= 0 [N].
inline double draft_gear_excess(const inputs::Coupler& c, double force) {
  if (c.draft_gear_travel == 0.0) return force / c.stiffness;
  const double gear = c.draft_gear_stiffness * c.draft_gear_travel;
  return force <= gear ? force / c.draft_gear_stiffness : c.draft_gear_travel + (force - gear) / c.stiffness;
}

/// c = 2 zeta sqrt(k m) [N s/m] of the two cars (reduced mass m) on the first spring.
inline double coupler_damping(const inputs::Coupler& c, double mass_a, double mass_b) {
  const double stiffness = c.draft_gear_travel > 0.0 ? c.draft_gear_stiffness : c.stiffness;
  return 2.0 * c.damping_ratio * std::sqrt(stiffness * mass_a * mass_b / (mass_a + mass_b));
}

/// Spring force [N] at a gap [m], buff positive; without draft gear axial_force of coupler_law.hpp.
template <class T>
T coupler_spring_force(const inputs::Coupler& c, const T& gap) {
  if (c.draft_gear_travel == 0.0) return axial_force<T>(c, gap);
  const T far = gap - c.length, beyond = select(far < T(0.0), T(-far), far) - 0.5 * c.slack;
  const T excess = select(beyond > T(0.0), beyond, T(0.0));
  const T gear = select(excess < T(c.draft_gear_travel), excess, T(c.draft_gear_travel));
  const T force = c.draft_gear_stiffness * gear + c.stiffness * (excess - gear);
  return select(far < T(0.0), force, T(-force));
}

/// Damper force [N], sign of F (buff positive), at gap rate `rate` [m/s], given the spring force there: opposes the
/// rate, and never turns the sum of both round (a coupler that closes again must not pull). None in the slack.
template <class T>
T coupler_damper_force(const T& damping, const T& spring_force, const T& rate) {
  const T damper = -damping * rate, back = -spring_force;
  return select(spring_force > T(0.0), select(damper > back, damper, back),
                select(spring_force < T(0.0), select(damper < back, damper, back), T(0.0)));
}

}  // namespace train_derail::model
