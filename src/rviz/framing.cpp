#include "rviz/framing.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

namespace train_derail::rviz_panel {

namespace {

/// Slopes of the two planes through the camera, to either side of its axis, between which a box is to be.
struct Slopes {
  double low, high;

  /// `before`, `after`: the margins, as shares of the picture; `share`: of what they leave.
  Slopes(double before, double after, double share, double tangent) {
    const double middle = before - after, half = share * (1.0 - before - after);
    low = (middle - half) * tangent;
    high = (middle + half) * tangent;
  }
};

/// Where a camera may be, along its axis and along one of the two across it, for all points to be between two planes.
/// A point at (x, depth) is, if low * (depth - z) <= x - place <= high * (depth - z).
struct Reach {
  double above, below;  // of low and of high
  Slopes slopes;

  template <class Row>
  Reach(const Row& x, const Row& depth, const Slopes& s)
      : above((x - s.high * depth).maxCoeff()), below((x - s.low * depth).minCoeff()), slopes(s) {}

  /// Farthest along the axis.
  double farthest() const { return (below - above) / (slopes.high - slopes.low); }
  /// Then, across it: in the middle.
  double place(double z) const { return 0.5 * (above + slopes.high * z + below + slopes.low * z); }
};

Eigen::Matrix3d axes_of(double yaw, double pitch) {
  const Eigen::Vector3d back(std::cos(pitch) * std::cos(yaw), std::cos(pitch) * std::sin(yaw), std::sin(pitch));
  const Eigen::Vector3d right(-std::sin(yaw), std::cos(yaw), 0.0);
  Eigen::Matrix3d axes;
  axes << right, back.cross(right), back;
  return axes;
}

}  // namespace

Box heap_box(const Eigen::Vector3d& middle, double heading, double length, double width) {
  return {middle, heading, std::max(length, kHeapLengthLeast), width, kCarHeight};
}

Box between(const Box& a, const Box& b, double share) {
  const auto mix = [share](const auto& from, const auto& to) { return from + share * (to - from); };
  const double turn = std::remainder(b.heading - a.heading, 2.0 * M_PI);
  return {mix(a.middle, b.middle).eval(), a.heading + share * turn, mix(a.length, b.length), mix(a.width, b.width),
          mix(a.height, b.height)};
}

Eigen::Matrix<double, 3, 8> corners(const Box& box) {
  Eigen::Matrix<double, 3, 8> all;
  for (int i = 0; i < 8; ++i) {
    all.col(i) << (i & 1 ? 0.5 : -0.5) * box.length, (i & 2 ? 0.5 : -0.5) * box.width, i & 4 ? box.height : 0.0;
  }
  return (Eigen::AngleAxisd(box.heading, Eigen::Vector3d::UnitZ()).toRotationMatrix() * all).colwise() + box.middle;
}

Camera frame(const Box& box, const Direction& direction, const Picture& picture) {
  const double tangent = std::tan(0.5 * picture.field_of_view);
  const Margins& m = picture.margins;
  Camera camera{axes_of(box.heading + direction.yaw, direction.pitch), Eigen::Vector3d::Zero(), 0.0};
  // Along the camera's axes, from the middle of the box; depth away from the camera.
  const Eigen::Array<double, 3, 8> seen = (camera.axes.transpose() * (corners(box).colwise() - box.middle)).array();
  const Eigen::Array<double, 1, 8> x = seen.row(0), y = seen.row(1), depth = -seen.row(2);
  const Reach across(x, depth, Slopes(m.left, m.right, picture.width_share, tangent * picture.aspect));
  const Reach up(y, depth, Slopes(m.bottom, m.top, picture.height_share, tangent));
  const double z = std::min(across.farthest(), up.farthest());
  camera.distance = -z;
  camera.focus = box.middle + camera.axes * Eigen::Vector3d(across.place(z), up.place(z), 0.0);
  return camera;
}

Eigen::Vector2d project(const Camera& camera, const Picture& picture, const Eigen::Vector3d& point) {
  const Eigen::Vector3d seen = camera.axes.transpose() * (point - camera.position());
  const double tangent = std::tan(0.5 * picture.field_of_view);
  return Eigen::Vector2d(seen.x() / (tangent * picture.aspect), seen.y() / tangent) / -seen.z();
}

}  // namespace train_derail::rviz_panel
