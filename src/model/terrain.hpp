/// \file
/// Height of the ground beside the track.
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

/// The ground `offset` to the left of the centre line [m]: a level crown, banks of one slope beside it, level again below
/// (above in a cut).
inline GroundHeight ground_height(const inputs::Terrain& t, double offset) {
  const double side = offset < 0.0 ? -1.0 : 1.0, bank = offset < 0.0 ? t.bank_right : t.bank_left;
  const double beyond = std::abs(offset) - t.crown, slope = std::copysign(t.bank_slope, bank);
  if (bank == 0.0 || beyond <= 0.0) return {-t.rail_height, 0.0};
  if (beyond * t.bank_slope >= std::abs(bank)) return {-t.rail_height - bank, 0.0};
  return {-t.rail_height - slope * beyond, -side * slope};
}

}  // namespace train_derail::model
