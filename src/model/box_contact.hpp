/// \file
/// Contact of two car bodies in space: where one box presses on another. Geometry only, no forces.
#pragma once

#include <Eigen/Core>

#include "model/body_manifold.hpp"

namespace train_derail::model {

/// The body of a car.
struct Box {
  Eigen::Vector3d centre;  ///< m
  Eigen::Matrix3d axes;    ///< columns: unit vectors forward, left, up
  Eigen::Vector3d half;    ///< half of length, width, height [m]
};

/// Contact of two boxes, by separating axes; the face of one is clipped by the face of the other that it presses on
/// (Sutherland and Hodgman), crossed edges meet where they are closest.
///
/// `previous_axis` is BodyManifold::axis of the step before, -1 if there is none. A face is kept until the boxes
/// overlap less along another axis by more than 2 % and 1 cm: otherwise the normal of two cars that meet end on would
/// jump from face to face as they crush. Without a previous axis, faces come before edges by the same amount. Edges are
/// kept until a face is as good. Faces that lie within 18 degrees on each other and overlap least where their rims
/// cross press on all that they share: the depth is then up to 5 % more than the way out along the edges.
///
/// press(b, a) is press(a, b) bit by bit, but for the sign of the normal and the sides that `axis` names. Boxes that
/// overlap by less than 0.01 mm along edges that are parallel to one in a million may count as apart.
/// Source: Gottschalk, Lin, Manocha: OBBTree, SIGGRAPH 1996 (the axes).
BodyManifold press(const Box& a, const Box& b, int previous_axis = -1);

/// How far two boxes are apart at least [m]: the widest gap along an axis of either; 0 if there is none along these.
double gap(const Box& a, const Box& b);

}  // namespace train_derail::model
