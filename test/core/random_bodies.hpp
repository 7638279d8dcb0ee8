// Random bodies for tests of contact.
#pragma once

#include <Eigen/Geometry>

#include "fixtures.hpp"

namespace train_derail::test {

inline Eigen::Matrix3d random_axes(Random& random) {
  Eigen::Quaterniond q(1.0, 0.0, 0.0, 0.0);
  do {
    for (int i = 0; i < 4; ++i) q.coeffs()[i] = random.uniform(-1.0, 1.0);
  } while (q.norm() > 1.0 || q.norm() < 0.1);
  return q.normalized().toRotationMatrix();
}

inline Eigen::Vector3d random_vector(Random& random, double size) {
  return {random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)};
}

}  // namespace train_derail::test
