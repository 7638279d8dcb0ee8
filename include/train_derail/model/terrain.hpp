/// \file
/// Height of the ground beside the track, and how cars lie on it and on their trucks.
#pragma once

#include <algorithm>
#include <cmath>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

/// Height of the ground and how it changes to the left of the track. T: a double, or a batch of them.
template <class T>
struct GroundHeight {
  T z;      ///< above the top of the rails [m]
  T slope;  ///< dz / d offset [-]
};

/// The ground across the track at one place of it.
struct CrossSection {
  double rail_height, ballast_height, ballast_half_width, ballast_slope, crown, bank_slope, bank_left, bank_right;

  /// Of a terrain where it has no section.
  explicit CrossSection(const inputs::Terrain& t)
      : rail_height(t.rail_height),
        ballast_height(t.ballast_height),
        ballast_half_width(t.ballast_half_width),
        ballast_slope(t.ballast_slope),
        crown(t.crown),
        bank_slope(t.bank_slope),
        bank_left(t.bank_left),
        bank_right(t.bank_right) {}
  /// Of one of its sections.
  CrossSection(const inputs::Terrain& t, const inputs::TerrainSection& s) : CrossSection(t) {
    ballast_height = s.ballast_height.value_or(ballast_height);
    ballast_half_width = s.ballast_half_width.value_or(ballast_half_width);
    ballast_slope = s.ballast_slope.value_or(ballast_slope);
    crown = s.crown.value_or(crown);
    bank_slope = s.bank_slope.value_or(bank_slope);
    bank_left = s.bank_left.value_or(bank_left);
    bank_right = s.bank_right.value_or(bank_right);
  }
  /// Adds `share` of the difference of two others.
  void add(double share, const CrossSection& a, const CrossSection& b) {
    for (double CrossSection::*m :
         {&CrossSection::ballast_height, &CrossSection::ballast_half_width, &CrossSection::ballast_slope,
          &CrossSection::crown, &CrossSection::bank_slope, &CrossSection::bank_left, &CrossSection::bank_right})
      this->*m += share * (a.*m - b.*m);
  }
};

/// At arc length s: each section's where it is, changing linearly over Terrain::transition about its ends.
inline CrossSection cross_section(const inputs::Terrain& t, double s) {
  const CrossSection elsewhere(t);
  CrossSection here = elsewhere;
  for (const inputs::TerrainSection& section : t.sections) {
    const auto ramp = [&](double end) { return std::clamp((s - end) / t.transition + 0.5, 0.0, 1.0); };
    const double share = ramp(section.start) - ramp(section.start + section.length);
    if (share > 0.0) here.add(share, CrossSection(t, section), elsewhere);
  }
  return here;
}

/// The ground `offset` to the left of the centre line [m]: a roadbed with a level crown, banks of one slope beside it,
/// level again below (above in a cut); on it the ballast. The higher of both is the ground.
template <class T>
GroundHeight<T> ground_height(const CrossSection& t, const T& offset) {
  const T zero(0.0), low(-t.rail_height - t.ballast_height);
  const auto right = offset < zero;
  const T side = select(right, T(-1.0), T(1.0)), away = side * offset;
  const T bank = select(right, T(t.bank_right), T(t.bank_left)), size = select(bank < zero, T(-bank), bank);
  const T beyond = away - t.crown, slope = select(bank < zero, T(-t.bank_slope), T(t.bank_slope));
  const auto on_bank = beyond > zero;
  const auto ends = beyond * t.bank_slope >= size;  // as it does at once where there is no bank
  GroundHeight<T> ground{select(on_bank, select(ends, T(low - bank), T(low - slope * beyond)), low),
                         select(on_bank, select(ends, zero, T(-side * slope)), zero)};
  if (t.ballast_height == 0.0) return ground;
  const T outside = away - t.ballast_half_width;
  const auto on_top = outside <= zero;
  const T ballast = select(on_top, T(-t.rail_height), T(-t.rail_height - t.ballast_slope * outside));
  const auto higher = ballast > ground.z;
  ground.z = select(higher, ballast, ground.z);
  ground.slope = select(on_top, zero, select(higher, T(-side * t.ballast_slope), ground.slope));
  return ground;
}

/// The ground is one plane.
inline bool level(const inputs::Terrain& t) {
  return t.sections.empty() && t.grid.rows.empty() && t.bank_left == 0.0 && t.bank_right == 0.0 &&
         t.ballast_height == 0.0;
}

/// No ground beside that of a grid is higher than this [m].
inline double highest_ground(const inputs::Terrain& t) {
  const auto highest = [](const CrossSection& c) {
    return -c.rail_height + std::max(0.0, -c.ballast_height - std::min(c.bank_left, c.bank_right));
  };
  double most = highest(CrossSection(t));
  for (const inputs::TerrainSection& s : t.sections) most = std::max(most, highest(CrossSection(t, s)));
  return most;
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
