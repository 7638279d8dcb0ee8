// Where a camera stands so that a box is wholly inside the free part of a picture, as large as it may be. Knows neither
// ROS nor RViz.
#pragma once

#include <Eigen/Core>

namespace train_derail::rviz_panel {

/// Parts of a picture that texts may cover, as shares of its width and height. Overlay and cameras share them.
struct Margins {
  double left, right, top, bottom;
};
inline constexpr Margins kMargins{0.02, 0.02, 0.14, 0.20};

/// What is to be seen: a box that stands on the ground.
struct Box {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of its base, world frame [m]
  double heading = 0.0;                              ///< of its length against +x [rad]
  double length = 0.0, width = 0.0, height = 0.0;    ///< [m]
};

/// Height of a heap of cars: one that lies on another's side is lower than that [m].
inline constexpr double kCarHeight = 4.5;
/// A shorter heap is shown as one of this length: the first cars are then large, but what is around them is seen [m].
inline constexpr double kHeapLengthLeast = 45.0;

/// Returns the box around a heap of cars.
Box heap_box(const Eigen::Vector3d& middle, double heading, double length, double width);

/// Returns a box between two; share 0: the first, 1: the second. Headings go the short way round.
Box between(const Box& a, const Box& b, double share);

/// From where a camera looks at a box.
struct Direction {
  double yaw;    ///< of the camera as seen from the box, against the box's heading [rad]
  double pitch;  ///< above the horizon, from -pi/2 to pi/2 [rad]
};

/// A picture: its shape, and what a camera sees.
struct Picture {
  double field_of_view;        ///< from its lower to its upper edge [rad]
  double aspect;               ///< width over height
  Margins margins = kMargins;  ///< to be kept free
  double width_share = 0.80;   ///< part of the free width that a box may take
  double height_share = 0.94;  ///< part of the free height
};

/// Where a camera is.
struct Camera {
  Eigen::Matrix3d axes;   ///< columns: to the right, up, backwards; world frame
  Eigen::Vector3d focus;  ///< what it turns about and looks at [m]
  double distance;        ///< from there [m]

  Eigen::Vector3d position() const { return focus + distance * axes.col(2); }
};

/// Returns the nearest camera that looks from that direction and has all of the box inside. The box touches either both
/// sides of the width or both of the height that it may take, and is in the middle of the other.
Camera frame(const Box& box, const Direction& direction, const Picture& picture);

/// Returns the corners of a box, one a column.
Eigen::Matrix<double, 3, 8> corners(const Box& box);

/// Returns where a point is in a picture: from (-1, -1), left and below, to (1, 1).
Eigen::Vector2d project(const Camera& camera, const Picture& picture, const Eigen::Vector3d& point);

}  // namespace train_derail::rviz_panel
