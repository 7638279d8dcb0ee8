/// \file
/// Where the bodies of two cars, boxes, press on each other. Written from what docs/spatial_model.md says of it, not
/// from src/model.
#pragma once

#include <array>

#include <Simbody.h>

namespace train_derail::multibody {

struct Block {
  SimTK::Vec3 centre;
  SimTK::Rotation axes;
  SimTK::Vec3 half;  // of length, width, height

  /// How far it reaches from its centre along a unit vector.
  double reach(const SimTK::Vec3& direction) const;
};

/// What two blocks share. `axis`: 0 to 2 a face of the first, 3 to 5 of the second, from 6 on edges of both; -1: they
/// are apart.
struct Patch {
  int axis = -1;
  SimTK::Vec3 normal{0.0};  // from the second into the first
  int count = 0;
  std::array<SimTK::Vec3, 8> point;  // midway between the surfaces
  std::array<double, 8> depth{};
};

/// `before`: the axis of the moment before, which is kept until another one is clearly better.
Patch patch_of(const Block& a, const Block& b, int before);

}  // namespace train_derail::multibody
