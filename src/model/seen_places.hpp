/// \file
/// How far cars of the spatial model have come since they were seen first.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "train_derail/files/archive.hpp"
#include "train_derail/model/spatial_model.hpp"

namespace train_derail::model {

/// Where cars were when they began to be still.
class SeenPlaces {
 public:
  explicit SeenPlaces(std::size_t cars) : centre_(cars, Eigen::Vector3d::Zero()), forward_(centre_), left_(centre_) {}

  void see(std::size_t car, const SpatialMotion& now) {
    centre_[car] = now.centre;
    forward_[car] = now.axes.col(0);
    left_[car] = now.axes.col(1);
  }
  /// No point within `radius` of the centre has come farther than that since then [m].
  double way(std::size_t car, const SpatialMotion& now, double radius) const {
    // By a small angle about any axis the two turn at least as far as a third one would.
    const double turned =
        std::sqrt((now.axes.col(0) - forward_[car]).squaredNorm() + (now.axes.col(1) - left_[car]).squaredNorm());
    return (now.centre - centre_[car]).norm() + radius * turned;
  }
  void walk(files::Archive& archive) {
    const auto walk_vectors = [&archive](const char* name, std::vector<Eigen::Vector3d>& vectors) {
      archive.list(name, vectors, [&](Eigen::Vector3d& v) { archive.column("at", v); });
    };
    walk_vectors("seen_centre", centre_);
    walk_vectors("seen_forward", forward_);
    walk_vectors("seen_left", left_);
  }

 private:
  std::vector<Eigen::Vector3d> centre_, forward_, left_;
};

}  // namespace train_derail::model
