/// \file
/// Footprints of cars on the ground: oriented rectangles, where they lie by the track, and whether two of them touch.
#pragma once

#include <array>
#include <cmath>
#include <optional>

#include "train_derail/eigen_types.hpp"

namespace train_derail::model {

/// A car seen from above: a rectangle.
struct Footprint {
  Vector2 centre;                  ///< m
  Vector2 axis;                    ///< unit vector, forward
  double half_length, half_width;  ///< m

  Vector2 side() const { return {-axis.y(), axis.x()}; }
  std::array<Vector2, 4> corners() const {
    const Vector2 l = half_length * axis, w = half_width * side();
    return {centre + l + w, centre + l - w, centre - l - w, centre - l + w};
  }
  /// Half the extent along a unit vector.
  double reach(const Vector2& direction) const {
    return half_length * std::abs(axis.dot(direction)) + half_width * std::abs(side().dot(direction));
  }
};

/// Where a point of a car lies by the track.
struct TrackPlace {
  double s;         ///< arc length of the foot of its perpendicular on the centre line [m]
  double offset;    ///< distance from the centre line, left positive [m]
  Vector2 tangent;  ///< of the centre line at the foot, unit vector
};

/// How two footprints overlap.
struct Touch {
  Vector2 point;   ///< where the deepest corner (or the middle of an edge) of one lies in the other [m]
  Vector2 normal;  ///< unit vector from b to a, along which they overlap least
  double depth;    ///< of the overlap, >= 0 [m]
};

/// Separating-axis test; nothing if there is a gap.
std::optional<Touch> touch(const Footprint& a, const Footprint& b);

/// Where two footprints press on each other: one point (a corner in a side) or two (side against side).
struct Manifold {
  Vector2 normal;  ///< unit vector from b to a
  bool face_of_a;  ///< the side that is pressed is one of a (of b if not); `normal` is square to it
  int count = 0;
  Vector2 point[2];  ///< m
  double depth[2];   ///< > 0 [m]
};

/// Touch, and the edge of the one clipped by the sides of the face of the other that it presses on; count 0 if there is
/// a gap.
Manifold press(const Footprint& a, const Footprint& b);

/// A distance that the footprints are apart by at least [m]; 0 if they touch.
double gap(const Footprint& a, const Footprint& b);

}  // namespace train_derail::model
