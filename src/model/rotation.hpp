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

/// Body rates by which a body with that angular momentum (along its own axes) is to be turned in a step of length h
/// [s]: those of its middle. After the step they are rates_of(inertia, momentum, rotation_by(h * result)), so that in
/// space the momentum stays what it was, but for rounding; energy swings by the order of h^2 and does not drift.
inline Eigen::Vector3d mean_rates(const Eigen::Vector3d& inertia, const Eigen::Vector3d& momentum, double h) {
  const Eigen::Vector3d inverse = inertia.cwiseInverse(), begin = inverse.cwiseProduct(momentum);
  // Euler's equations by the midpoint rule; each round is exact to one more order of h.
  Eigen::Vector3d result = begin + 0.5 * h * inverse.cwiseProduct(momentum.cross(begin));
  for (int i = 0; i < 2; ++i)
    result = begin + 0.5 * h * inverse.cwiseProduct(inertia.cwiseProduct(result).cross(result));
  return result;
}

/// Body rates of a body that has been turned by `turn` since its angular momentum along its own axes was that.
inline Eigen::Vector3d rates_of(const Eigen::Vector3d& inertia, const Eigen::Vector3d& momentum,
                                const Eigen::Quaterniond& turn) {
  return (turn.conjugate() * momentum).cwiseQuotient(inertia);
}

}  // namespace train_derail::model
