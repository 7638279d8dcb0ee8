/// \file
/// Rotations of rigid bodies.
#pragma once

#include <cmath>

#include <Eigen/Geometry>

namespace train_derail::model {

/// The rotation about `turn` by its length [rad].
inline Eigen::Quaterniond rotation_by(const Eigen::Vector3d& turn) {
  // Half the angle, squared; sin(x) / x and cos(x) by their series, exact to the last digit up to x = 0.1.
  const double s = 0.25 * turn.squaredNorm();
  double ratio = 1.0 - s / 6.0 * (1.0 - s / 20.0 * (1.0 - s / 42.0 * (1.0 - s / 72.0)));
  double cosine = 1.0 - s / 2.0 * (1.0 - s / 12.0 * (1.0 - s / 30.0 * (1.0 - s / 56.0 * (1.0 - s / 90.0))));
  if (!(s < 0.01)) {
    const double half = std::sqrt(s);
    ratio = std::sin(half) / half;
    cosine = std::cos(half);
  }
  const Eigen::Vector3d v = 0.5 * ratio * turn;
  return {cosine, v.x(), v.y(), v.z()};
}

/// Body rates at the end of a step of length h [s] that begins with `rates`, under `impulse` (torque times h, along the
/// body's axes [N m s]): Euler's equations such that without torque the angular momentum in space stays what it was,
/// but for rounding, if the body is turned by rotation_by(h * result) in the step.
inline Eigen::Vector3d turned_rates(const Eigen::Vector3d& inertia, const Eigen::Vector3d& rates,
                                    const Eigen::Vector3d& impulse, double h) {
  const Eigen::Vector3d momentum = inertia.cwiseProduct(rates) + impulse, inverse = inertia.cwiseInverse();
  Eigen::Vector3d result = inverse.cwiseProduct(momentum);
  result += h * inverse.cwiseProduct(momentum.cross(result));
  // The momentum seen from the body turns back as the body turns. Each round is exact to one more order of h.
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d before = result;
    result = inverse.cwiseProduct(rotation_by(-h * result) * momentum);
    if ((result - before).squaredNorm() <= 1e-30 * result.squaredNorm()) break;
  }
  return result;
}

}  // namespace train_derail::model
