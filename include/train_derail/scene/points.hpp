/// \file
/// Triangles of pictures.
#pragma once

#include <vector>

namespace train_derail::scene {

/// A point of a picture [m].
struct Point {
  double x = 0.0;  ///< forward [m]
  double y = 0.0;  ///< left [m]
  double z = 0.0;  ///< up [m]
};

/// Corners of triangles, three after three, counter-clockwise as seen from outside.
using Points = std::vector<Point>;

/// Returns the point of these coordinates [m].
constexpr Point make_point(double x, double y, double z) { return {x, y, z}; }

/// Adds two triangles to `points`. The corners a, b, c, d are counter-clockwise as seen from outside.
inline void add_quad(Points& points, const Point& a, const Point& b, const Point& c, const Point& d) {
  points.insert(points.end(), {a, b, c, a, c, d});
}

}  // namespace train_derail::scene
