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
inline GroundHeight ground_height(const CrossSection& t, double offset) {
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
