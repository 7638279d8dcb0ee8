/// \file
/// Rotations of rigid bodies.
#pragma once

#include <cmath>

#include <Eigen/Geometry>

namespace train_derail::model {

/// The rotation about `turn` by its length [rad].
inline Eigen::Quaterniond rotation_by(const Eigen::Vector3d& turn) {
  const double half = 0.5 * turn.norm();
  // sin(x) / x without trouble at 0.
  const double ratio = half > 1.0e-4 ? std::sin(half) / half : 1.0 - half * half / 6.0;
  const Eigen::Vector3d v = 0.5 * ratio * turn;
  return {std::cos(half), v.x(), v.y(), v.z()};
}

/// Body rates at the end of a step of length h [s] that begins with `rates`, under `impulse` (torque times h, along the
/// body's axes [N m s]): Euler's equations such that without torque the angular momentum in space stays what it was, but
/// for rounding, if the body is turned by rotation_by(h * result) in the step.
inline Eigen::Vector3d turned_rates(const Eigen::Vector3d& inertia, const Eigen::Vector3d& rates,
                                    const Eigen::Vector3d& impulse, double h) {
  const Eigen::Vector3d momentum = inertia.cwiseProduct(rates) + impulse;
  Eigen::Vector3d result = momentum.cwiseQuotient(inertia);
  // The momentum seen from the body turns back as the body turns. Each round is exact to one more order of h.
  for (int i = 0; i < 4; ++i) result = (rotation_by(-h * result) * momentum).cwiseQuotient(inertia);
  return result;
}

}  // namespace train_derail::model
