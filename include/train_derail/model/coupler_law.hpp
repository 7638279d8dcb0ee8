/// \file
/// Coupler as a massless pin-ended bar: axial force (paper, figure 3), moment at the swing stop (figure 4),
/// lateral force from the bar's moment balance (eq. 14), reactions on both cars (eqs. 6-14 as corrected in
/// docs/model.md).
#pragma once

#include <algorithm>
#include <cmath>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

// A Law is an inputs::Coupler, or its numbers that are named here.

/// Axial force [N], positive in buff: zero inside the slack, K times the excess outside it.
template <class T, class Law>
T axial_force(const Law& c, const T& gap) {
  const double closed = c.length - 0.5 * c.slack;
  const double stretched = c.length + 0.5 * c.slack;
  const T buff = closed - gap, draft = stretched - gap;
  return c.stiffness * select(gap < closed, buff, select(gap > stretched, draft, T(0.0)));
}

/// Strain energy of axial_force [J].
inline double axial_energy(const inputs::Coupler& c, double gap) {
  const double excess = std::max(std::abs(gap - c.length) - 0.5 * c.slack, 0.0);
  return 0.5 * c.stiffness * excess * excess;
}

/// Moment [N m] on a car at one end of the bar, sign of the swing angle gamma = beta - theta [rad]:
/// zero within the limit, slope K_m beyond it, at most m_max.
template <class T, class Law>
T swing_moment(const Law& c, const T& gamma) {
  const T left = gamma - c.swing_limit, right = gamma + c.swing_limit;
  const T excess = select(gamma > c.swing_limit, left, select(gamma < -c.swing_limit, right, T(0.0)));
  const T moment = c.swing_stiffness * excess;
  const T most(c.swing_moment_max), least(-c.swing_moment_max);
  return select(moment > most, most, select(moment < least, least, moment));
}

/// Strain energy of swing_moment [J].
inline double swing_energy(const inputs::Coupler& c, double gamma) {
  const double excess = std::max(std::abs(gamma) - c.swing_limit, 0.0);
  if (c.swing_stiffness == 0.0) return 0.0;
  const double yield = c.swing_moment_max / c.swing_stiffness;
  if (excess <= yield) return 0.5 * c.swing_stiffness * excess * excess;
  return c.swing_moment_max * (excess - 0.5 * yield);
}

/// Forces of one coupler. "Lead" is car k (its rear pin), "trail" car k + 1 (its front pin).
template <class T>
struct CouplerLoad {
  T gap;           ///< G, pin to pin [m] (eq. 9)
  T ux, uy;        ///< unit vector from the trail car's front pin to the lead car's rear pin: (cos beta, sin beta)
  T axial;         ///< F, buff positive [N]
  T lateral;       ///< E [N] (eq. 14)
  T moment_lead;   ///< m on the lead car [N m]
  T moment_trail;  ///< m on the trail car [N m]
  T force_x;       ///< force on the lead car's rear pin [N]; the trail car's front pin feels the opposite
  T force_y;
};

/// The same with the swing angles, which the forces need only beyond the limit.
template <class T>
struct CouplerState : CouplerLoad<T> {
  T swing_lead;   ///< gamma at the lead car's rear pin [rad] (eq. 13)
  T swing_trail;  ///< gamma at the trail car's front pin [rad]
};

/// gamma [rad]: angle of the bar (ux, uy) against a car heading (c, s), wrapped to (-pi, pi]; 0 unless `condition`.
/// Angles::atan2 finds it.
template <class Angles, class Condition, class T>
T swing_angle(const Condition& condition, const T& ux, const T& uy, const T& c, const T& s) {
  if (!any(condition)) return T(0.0);
  return select(condition, T(Angles::atan2(T(c * uy - s * ux), T(c * ux + s * uy))), T(0.0));
}

/// Calls use(CouplerLoad<T>). Angles: as in swing_angle. (dx, dy): lead car's rear pin minus trail car's front pin [m];
/// (c, s): cosine and sine of the cars' headings; `cos_limit`: cosine of the swing limit. The gap must not be zero.
template <class T, class Angles, class Law, class Use>
void with_coupler_load(const Law& law, double cos_limit, const T& dx, const T& dy, const T& c_lead, const T& s_lead,
                       const T& c_trail, const T& s_trail, const Use& use) {
  const T gap_squared = dx * dx + dy * dy;
  const T inverse_gap = Roots<T>::inverse(gap_squared);
  const T gap = gap_squared * inverse_gap, ux = dx * inverse_gap, uy = dy * inverse_gap;
  const T axial = axial_force(law, gap);
  // The angles themselves are needed only beyond the limit, which is rare. Two calls of `use`: numbers that come from
  // two branches would go through memory.
  const auto lead_beyond = T(c_lead * ux + s_lead * uy) < T(cos_limit);
  const auto trail_beyond = T(c_trail * ux + s_trail * uy) < T(cos_limit);
  if (!any(lead_beyond || trail_beyond)) {
    const T none(0.0);
    use(CouplerLoad<T>{gap, ux, uy, axial, none, none, none, T(axial * ux), T(axial * uy)});
    return;
  }
  const T moment_lead = swing_moment(law, swing_angle<Angles>(lead_beyond, ux, uy, c_lead, s_lead));
  const T moment_trail = swing_moment(law, swing_angle<Angles>(trail_beyond, ux, uy, c_trail, s_trail));
  const T lateral = (moment_lead + moment_trail) * inverse_gap;
  use(CouplerLoad<T>{gap, ux, uy, axial, lateral, moment_lead, moment_trail, T(axial * ux + lateral * uy),
                     T(axial * uy - lateral * ux)});
}

template <class T, class Law>
CouplerLoad<T> coupler_load(const Law& law, double cos_limit, const T& dx, const T& dy, const T& c_lead,
                            const T& s_lead, const T& c_trail, const T& s_trail) {
  CouplerLoad<T> load;
  with_coupler_load<T, Trigonometry<T>>(law, cos_limit, dx, dy, c_lead, s_lead, c_trail, s_trail,
                                        [&load](const CouplerLoad<T>& b) { load = b; });
  return load;
}

template <class T>
CouplerState<T> coupler_state(const inputs::Coupler& law, const T& dx, const T& dy, const T& c_lead, const T& s_lead,
                              const T& c_trail, const T& s_trail) {
  const CouplerLoad<T> b = coupler_load<T>(law, std::cos(law.swing_limit), dx, dy, c_lead, s_lead, c_trail, s_trail);
  return {b, swing_angle<Trigonometry<T>>(true, b.ux, b.uy, c_lead, s_lead),
          swing_angle<Trigonometry<T>>(true, b.ux, b.uy, c_trail, s_trail)};
}

}  // namespace train_derail::model
