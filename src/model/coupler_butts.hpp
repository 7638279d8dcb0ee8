/// \file
/// Couplers that press on faces in buff: what keeps a train level that is pushed harder than its springs could hold.
#pragma once

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

inline constexpr double kButtBears = 0.005;  ///< tilt at which a butt has come to bear on its edge, nearly: assumed

/// How stiff butts make a coupler that carries `buff` [N] against the tilt of a car, while it is level [N m].
inline double butt_stiffness(const inputs::Coupler& law, double buff) {
  return 0.5 * buff * law.butt_height / kButtBears;
}

/// Between two pins in buff, a coupler and a car press on the faces of a butt. As the bar tilts against the car it
/// rolls over an edge of them: it is longer by half their height times the tilt, so that the force resists the tilt.
/// That takes up slack, no more: in draft nothing of it is left, and at its end the energy has no jump.
template <class T>
struct Butts {
  T gap;          ///< as long as the bar acts [m]
  T lead, trail;  ///< change of that length with the heights of the bar along it, at either end, taken negative [m]
};

/// `pins`: their distance [m]; `lead`, `trail`: the unit vector between them along the up axis of either car.
template <class T>
Butts<T> press_butts(const inputs::Coupler& law, const T& pins, const T& lead, const T& trail) {
  const double half = 0.5 * law.butt_height, closed = law.length - 0.5 * law.slack;
  const T square_lead = lead * lead + kButtBears * kButtBears, square_trail = trail * trail + kButtBears * kButtBears;
  const T per_lead = Roots<T>::inverse(square_lead), per_trail = Roots<T>::inverse(square_trail);
  const T longer = half * (square_lead * per_lead + square_trail * per_trail - 2.0 * kButtBears);
  const T none(0.0), play(law.slack), taken = select(longer < play, longer, play), pressed = pins - taken;
  const T in_buff = select(pressed < T(closed), T(1.0), none);
  const T rolls = half * select(longer < play, in_buff, none);
  return {pins - in_buff * taken, rolls * lead * per_lead, rolls * trail * per_trail};
}

}  // namespace train_derail::model
