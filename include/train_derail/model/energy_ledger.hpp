// Where the energy of a train is, and what became of it.
#pragma once

namespace train_derail::model {

/// Mechanical energy and work of the whole train [J]. Without error of integration, total() stays constant.
struct EnergyLedger {
  double kinetic_translation = 0.0;
  double kinetic_rotation = 0.0;
  double coupler_axial = 0.0;    // strain energy
  double coupler_swing = 0.0;    // strain energy
  double work_on_track = 0.0;    // dissipated by the ground under cars before the point of derailment
  double work_off_track = 0.0;   // ... past it

  double kinetic() const { return kinetic_translation + kinetic_rotation; }
  double total() const { return kinetic() + coupler_axial + coupler_swing + work_on_track + work_off_track; }
};

}  // namespace train_derail::model
