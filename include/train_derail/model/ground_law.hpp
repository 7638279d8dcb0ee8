/// \file
/// Ground force at one truck centre (paper, eqs. 3-5): Coulomb friction mu W / 2 against the truck's velocity.
#pragma once

#include <cmath>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

template <class T>
struct GroundForce {
  T x, y;  ///< on the car [N]
};

/// `load` = mu W / 2 [N]; (u, v): velocity of the truck centre along x and y [m/s]; `v_eps` > 0 [m/s].
/// Regularised as -load * velocity / sqrt(speed^2 + v_eps^2): smooth at rest, 0.5 % below Coulomb at 10 v_eps.
/// In the reading `along_track` a car on the track feels friction(load, u, 0, v_eps): no lateral part.
template <class T>
GroundForce<T> friction(const T& load, const T& u, const T& v, double v_eps) {
  const T factor = -load * Roots<T>::inverse(u * u + v * v + v_eps * v_eps);
  return {T(factor * u), T(factor * v)};
}

/// Friction coefficient of a truck off the rails (law by_slip): a car that follows its own axis on the bed of the track
/// drags little, one that slides across it or lies beside the track much. mu = mu_0 + (mu_1 - mu_0) max(S(|v_lat| / (r
/// |v|)), C((|y| - half gauge) / far_distance)), S: smoothstep, C: clamped to [0, 1]. `speed_squared` of the truck
/// [m^2/s^2] and its velocity across the car's axis [m/s]; `offset` of the truck from the centre line [m].
template <class T>
T slip_friction(const inputs::Ground& g, const T& speed_squared, const T& across, const T& offset) {
  constexpr double kHalfGauge = 0.5 * 1.435;  // m, standard gauge
  const auto clamped = [](const T& x) { return select(x < T(0.0), T(0.0), select(x > T(1.0), T(1.0), x)); };
  const auto size = [](const T& x) { return select(x < T(0.0), T(-x), x); };
  const double per_slip = 1.0 / g.slip_ratio, per_distance = 1.0 / g.far_distance;
  const T slip =
      select(speed_squared > T(0.0), clamped(size(across) * Roots<T>::inverse(speed_squared) * per_slip), T(0.0));
  const T far = clamped((size(offset) - kHalfGauge) * per_distance), smooth = slip * slip * (3.0 - 2.0 * slip);
  return g.in_line_friction + (g.broadside_friction - g.in_line_friction) * select(smooth > far, smooth, far);
}

/// Weight that friction off the rails is a share of [N], for a car of weight W [N]: W_ref (W / W_ref)^load_exponent.
/// With an exponent of 1 it is W.
inline double friction_weight(const inputs::Ground& g, double weight) {
  return g.load_exponent == 1.0 ? weight : g.reference_weight * std::pow(weight / g.reference_weight, g.load_exponent);
}

/// Product of the factors of the patches that a place lies on: arc length `s` along the track, `offset` from its centre
/// line, left positive [m].
inline double patch_factor(const std::vector<inputs::GroundPatch>& patches, double s, double offset) {
  double factor = 1.0;
  for (const inputs::GroundPatch& p : patches) {
    if (s >= p.x_from && s < p.x_to && offset >= p.y_from && offset < p.y_to) factor *= p.factor;
  }
  return factor;
}

}  // namespace train_derail::model
