/// \file
/// Where the bodies of two cars press on each other in space, whatever their shapes. Geometry only, no forces.
#pragma once

#include <array>

#include <Eigen/Core>

namespace train_derail::model {

/// Forces should not simply grow with the number of points: an edge that passes a corner of a box adds one, or takes
/// one away, and what they touch on has hardly changed.
struct BodyManifold {
  int count = 0;           ///< of the points; 0 if the bodies are apart, and then nothing below but `axis` is set
  Eigen::Vector3d normal;  ///< unit vector from b into a: a moved along it comes free
  std::array<Eigen::Vector3d, 8> point;  ///< midway between the two surfaces along the normal, in order around it [m]
  std::array<double, 8> depth;           ///< of the overlap that counts for each point, along the normal, > 0 [m]
  std::array<double, 8> share;           ///< of the force that each point has at its depth; they sum up to 1
  /// Between boxes what the normal is square to: 0-2 the faces of a (end, side, top), 3-5 those of b, 6 + 3 i + j the
  /// edges of a along its axis i and of b along its axis j. 0 if a cylinder is touched. -1 if the bodies are apart.
  int axis = -1;
};

/// Contact, and how far the bodies are apart at least [m]: 0 if they touch.
struct BodyContact {
  BodyManifold manifold;
  double gap = 0.0;
};

}  // namespace train_derail::model
