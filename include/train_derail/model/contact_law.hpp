/// \file
/// Normal force between two car bodies: a spring while they close, weaker while they part, so that a central hit
/// returns the share e of its speed; above the crush force the bodies yield. Crush force of a tank head or an
/// underframe: 1-1.5e6 lbf.
#pragma once

#include <algorithm>
#include <cmath>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// F >= 0 [N] at overlap `depth` [m], growing at `rate` [m/s]. `crushed` [m]: part of the depth that has yielded in
/// this touch, kept by the caller, 0 at first. Loading k (d - d_c) up to crush_force; unloading e^2 of it: then the
/// impulse after over the impulse before is e (harmonic quarter waves of stiffness k and e^2 k), if nothing has
/// crushed.
inline double contact_force(const inputs::Contact& c, double depth, double rate, double& crushed) {
  if (rate > 0.0) crushed = std::max(crushed, depth - c.crush_force / c.stiffness);
  const double spring = c.stiffness * std::max(depth - crushed, 0.0);
  return rate > 0.0 ? spring : c.restitution * c.restitution * spring;
}

/// The same, but that the force does not jump where the bodies cease to close: it goes from loading to unloading within
/// `quiet` [m/s] on either side. One body may then lie on another at rest.
inline double quiet_contact_force(const inputs::Contact& c, double depth, double rate, double quiet, double& crushed) {
  if (rate > 0.0) crushed = std::max(crushed, depth - c.crush_force / c.stiffness);
  const double kept = c.restitution * c.restitution, way = rate / std::sqrt(rate * rate + quiet * quiet);
  return c.stiffness * std::max(depth - crushed, 0.0) * 0.5 * ((1.0 + kept) + (1.0 - kept) * way);
}

/// Change of quiet_contact_force() with the rate where this is 0, at a depth that has not yielded of `depth` [N s/m].
inline double quiet_damping(const inputs::Contact& c, double depth, double quiet) {
  return c.stiffness * depth * 0.5 * (1.0 - c.restitution * c.restitution) / quiet;
}

/// Damping of friction that has not begun to slide [N s/m], of two bodies with that reduced mass [kg] on Contact's
/// stiffness: three tenths of what is critical.
inline double friction_damping(const inputs::Contact& c, double reduced_mass) {
  return 0.6 * std::sqrt(c.stiffness * reduced_mass);
}

}  // namespace train_derail::model
