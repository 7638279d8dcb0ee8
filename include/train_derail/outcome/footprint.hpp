// Footprints of cars on the ground: oriented rectangles, and whether two of them touch.
#pragma once

#include <optional>

#include <Eigen/Core>

namespace train_derail::outcome {

struct Footprint {
  Eigen::Vector2d centre;  // m
  Eigen::Vector2d axis;    // unit vector, forward
  double half_length, half_width;  // m

  Eigen::Vector2d side() const { return {-axis.y(), axis.x()}; }
  /// Half the extent along a unit vector.
  double reach(const Eigen::Vector2d& direction) const {
    return half_length * std::abs(axis.dot(direction)) + half_width * std::abs(side().dot(direction));
  }
};

struct Touch {
  Eigen::Vector2d point;   // where the deepest corner (or the middle of an edge) of one lies in the other [m]
  Eigen::Vector2d normal;  // unit vector from b to a, along which they overlap least
  double depth;            // of the overlap, >= 0 [m]
};

/// Separating-axis test; nothing if there is a gap.
std::optional<Touch> touch(const Footprint& a, const Footprint& b);

}  // namespace train_derail::outcome
