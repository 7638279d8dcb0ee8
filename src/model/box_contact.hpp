/// \file
/// Contact of two car bodies in space: where one box presses on another. Geometry only, no forces.
#pragma once

#include <array>

#include <Eigen/Core>

namespace train_derail::model {

/// The body of a car.
struct Box {
  Eigen::Vector3d centre;  ///< m
  Eigen::Matrix3d axes;    ///< columns: unit vectors forward, left, up
  Eigen::Vector3d half;    ///< half of length, width, height [m]
};

/// Where two boxes press on each other. Forces should not simply grow with the number of points: an edge that passes a
/// corner of the other box adds one, or takes one away, and what they touch on has hardly changed.
struct BoxManifold {
  int count = 0;           ///< of the points; 0 if the boxes are apart, and then nothing below but `axis` is set
  Eigen::Vector3d normal;  ///< unit vector from b into a: a moved along it comes free
  std::array<Eigen::Vector3d, 8> point;  ///< midway between the two surfaces along the normal, in order around it [m]
  std::array<double, 8> depth;           ///< of the overlap at each point, along the normal, > 0 [m]
  /// What the normal is square to: 0-2 the faces of a (end, side, top), 3-5 those of b, 6 + 3 i + j the edges of a
  /// along its axis i and of b along its axis j; -1 if the boxes are apart.
  int axis = -1;
};

/// Contact of two boxes, by separating axes; the face of one is clipped by the face of the other that it presses on
/// (Sutherland and Hodgman), crossed edges meet where they are closest.
///
/// `previous_axis` is BoxManifold::axis of the step before, -1 if there is none. A face is kept until the boxes overlap
/// less along another axis by more than 2 % and 1 cm: otherwise the normal of two cars that meet end on would jump from
/// face to face as they crush. Without a previous axis, faces come before edges by the same amount. Edges are kept
/// until a face is as good. Faces that lie within 18 degrees on each other and overlap least where their rims cross
/// press on all that they share: the depth is then up to 5 % more than the way out along the edges.
///
/// press(b, a) is press(a, b) bit by bit, but for the sign of the normal and the sides that `axis` names. Boxes that
/// overlap by less than 0.01 mm along edges that are parallel to one in a million may count as apart.
/// Source: Gottschalk, Lin, Manocha: OBBTree, SIGGRAPH 1996 (the axes).
BoxManifold press(const Box& a, const Box& b, int previous_axis = -1);

/// How far two boxes are apart at least [m]: the widest gap along an axis of either; 0 if there is none along these.
double gap(const Box& a, const Box& b);

}  // namespace train_derail::model
