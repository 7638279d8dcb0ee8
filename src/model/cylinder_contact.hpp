/// \file
/// Contact of a cylinder with domed heads, the body of a tank car, with another one or with a box. Geometry only, no
/// forces.
///
/// The heads are half spheres. So a cylinder is all that lies within its radius of a piece of its axis, and contact
/// follows from closest points of these pieces: closed forms, with a normal that never jumps as the bodies move, unless
/// they overlap by more than a radius. Of a tank as long as from pin to pin that is nearer to a real one than flat
/// heads would be: its shell ends before the pins, in heads that bulge.
///
/// A library was tried: libccd 2.1, which FCL uses for cylinders too. It gives one point; as two of these bodies moved
/// by 0.01 mm that point jumped by up to 1.5 m for flat heads end on end and by 17 m side by side, and a pair took 3 to
/// 20 us (MPR and GJK), where this takes about 0.1 us. Piles would not come to rest.
#pragma once

#include <Eigen/Core>

#include "model/body_manifold.hpp"
#include "model/box_contact.hpp"

namespace train_derail::model {

struct Cylinder {
  Eigen::Vector3d centre;  ///< m
  Eigen::Vector3d along;   ///< unit vector
  double half;             ///< half the distance of the centres of its heads [m]
  double radius;           ///< m
};

/// Contact of two cylinders.
///
/// They press where they are deepest, by that depth, whether they touch in a point or along a line; so the force does
/// not jump when the one becomes the other. Where they lie along each other, it is shared between the two ends of the
/// stretch along which they are at least half as deep as there, in proportion to the depth at either. This stretch
/// shrinks to a point as they turn across each other.
///
/// `crushed`: what has yielded of the depth [m]; only what is deeper counts for the stretch and for the shares.
BodyContact press(const Cylinder& a, const Cylinder& b, double crushed);

/// Contact of a cylinder with a box, in the same way: the stretch is one of the cylinder's axis, and shrinks as it gets
/// up on its head. Once the axis itself is in the box, they press along the box's axis by which the cylinder comes free
/// soonest.
BodyContact press(const Cylinder& a, const Box& b, double crushed);

}  // namespace train_derail::model
