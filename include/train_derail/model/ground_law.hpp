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
/// In the reading `along_track` a car on the track feels friction(load, u, 0, v_eps): no lateral part.
template <class T>
GroundForce<T> friction(const T& load, const T& u, const T& v, double v_eps) {
  using std::sqrt;
  const T factor = -load / sqrt(T(u * u + v * v + v_eps * v_eps));
  return {T(factor * u), T(factor * v)};
}

}  // namespace train_derail::model
