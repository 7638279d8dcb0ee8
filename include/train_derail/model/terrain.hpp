/// \file
/// Height of the ground beside the track, and how cars lie on it and on their trucks.
#pragma once

#include <algorithm>
#include <cmath>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// Height of the ground and how it changes to the left of the track.
struct GroundHeight {
  double z;      ///< above the top of the rails [m]
  double slope;  ///< dz / d offset [-]
};

/// The ground `offset` to the left of the centre line [m]: a roadbed with a level crown, banks of one slope beside it,
/// level again below (above in a cut); on it the ballast. The higher of both is the ground.
inline GroundHeight ground_height(const inputs::Terrain& t, double offset) {
  const double side = offset < 0.0 ? -1.0 : 1.0, bank = offset < 0.0 ? t.bank_right : t.bank_left;
  const double beyond = std::abs(offset) - t.crown, slope = std::copysign(t.bank_slope, bank);
  GroundHeight ground{-t.rail_height - t.ballast_height, 0.0};
  if (bank != 0.0 && beyond > 0.0) {
    if (beyond * t.bank_slope >= std::abs(bank)) ground.z -= bank;
    else ground = {ground.z - slope * beyond, -side * slope};
  }
  const double outside = std::abs(offset) - t.ballast_half_width;
  if (t.ballast_height == 0.0) return ground;
  if (outside <= 0.0) return {std::max(-t.rail_height, ground.z), 0.0};
  const double ballast = -t.rail_height - t.ballast_slope * outside;
  return ballast > ground.z ? GroundHeight{ballast, -side * t.ballast_slope} : ground;
}

/// The ground is one plane.
inline bool level(const inputs::Terrain& t) {
  return t.bank_left == 0.0 && t.bank_right == 0.0 && t.ballast_height == 0.0;
}

/// No ground is higher than this [m].
inline double highest_ground(const inputs::Terrain& t) {
  return -t.rail_height + std::max(0.0, -t.ballast_height - std::min(t.bank_left, t.bank_right));
}

/// Damping of a side of a truck [N s/m].
inline double side_damping(const inputs::Suspension& s, double car_mass) {
  return 2.0 * s.damping_ratio * std::sqrt(s.stiffness * 0.25 * car_mass);
}

/// Damping of the ground under a point of a car [N s/m].
inline double ground_damping(const inputs::Terrain& t, double car_mass) {
  return 2.0 * t.body_damping_ratio * std::sqrt(t.body_stiffness * 0.25 * car_mass);
}

}  // namespace train_derail::model
