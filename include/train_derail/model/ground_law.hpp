// Ground force at one truck centre (paper, eqs. 3-5): Coulomb friction mu W / 2 against the truck's velocity.
#pragma once

#include <cmath>

namespace train_derail::model {

template <class T>
struct GroundForce {
  T x, y;  // on the car [N]
};

/// `load` = mu W / 2 [N]; (u, v): velocity of the truck centre along x and y [m/s]; `v_eps` > 0 [m/s].
/// Regularised as -load * velocity / sqrt(speed^2 + v_eps^2): smooth at rest, 0.5 % below Coulomb at 10 v_eps.
template <class T>
GroundForce<T> friction(double load, const T& u, const T& v, double v_eps) {
  using std::sqrt;
  const T factor = -load / sqrt(T(u * u + v * v + v_eps * v_eps));
  return {T(factor * u), T(factor * v)};
}

/// The reading `along_track`: the force has no lateral part and opposes the velocity along x alone.
template <class T>
GroundForce<T> friction_along_track(double load, const T& u, double v_eps) {
  using std::sqrt;
  return {T(-load * u / sqrt(T(u * u + v_eps * v_eps))), T(0.0)};
}

}  // namespace train_derail::model
