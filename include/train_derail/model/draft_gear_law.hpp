// Axial force of a coupler with draft gears and damping, and when it breaks. Without them: axial_force of coupler_law.hpp.
// Draft gears travel about 3.25 in each; knuckles hold 400-650 kip, coupler bodies 700-900 kip (AAR M-211).
#pragma once

#include <algorithm>
#include <cmath>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// Spring force [N] at `excess` [m] beyond the slack, both >= 0: k_1 over the travel, then K.
inline double draft_gear_force(const inputs::Coupler& c, double excess) {
  const double gear = std::min(excess, c.draft_gear_travel);
  return c.draft_gear_stiffness * gear + c.stiffness * (excess - gear);
}

/// Energy stored in it [J].
inline double draft_gear_energy(const inputs::Coupler& c, double excess) {
  const double gear = std::min(excess, c.draft_gear_travel), solid = excess - gear;
  return 0.5 * c.draft_gear_stiffness * gear * gear + (c.draft_gear_stiffness * gear + 0.5 * c.stiffness * solid) * solid;
}

/// c = 2 zeta sqrt(k m) [N s/m] of the two cars (reduced mass m) on the first spring.
inline double coupler_damping(const inputs::Coupler& c, double mass_a, double mass_b) {
  const double stiffness = c.draft_gear_travel > 0.0 ? c.draft_gear_stiffness : c.stiffness;
  return 2.0 * c.damping_ratio * std::sqrt(stiffness * mass_a * mass_b / (mass_a + mass_b));
}

/// Damper force [N], sign of F (buff positive), at gap rate `rate` [m/s], given the spring force there: opposes the rate, and never
/// turns the sum of both round (a coupler that closes again must not pull).
inline double coupler_damper_force(double damping, double spring_force, double rate) {
  if (spring_force > 0.0) return std::max(-damping * rate, -spring_force);
  if (spring_force < 0.0) return std::min(-damping * rate, -spring_force);
  return 0.0;
}

}  // namespace train_derail::model
