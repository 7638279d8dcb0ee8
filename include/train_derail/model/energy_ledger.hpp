// Where the energy of a train is, and what became of it.
#pragma once

namespace train_derail::model {

/// Mechanical energy and work of the whole train [J]. Without error of integration, total() stays constant.
struct EnergyLedger {
  double kinetic_translation = 0.0;
  double kinetic_rotation = 0.0;
  double coupler_axial = 0.0;   // strain energy
  double coupler_swing = 0.0;   // strain energy
  double work_on_track = 0.0;   // dissipated along the track by cars on it: friction, or brakes and rolling resistance
  double work_off_track = 0.0;  // dissipated by the ground under what has left it
  // Of the parts beyond the paper; work is what the mechanism has taken from the train.
  double work_rails = 0.0;  // lateral: damping, what a yielding rail keeps, less what alignment gives
  double work_coupler_damping = 0.0;
  double work_coupler_break = 0.0;  // strain energy of couplers that broke
  double work_impact_normal = 0.0;  // crushing, and what restitution does not give back
  double work_impact_friction = 0.0;
  double work_grade = 0.0;  // lifted
  double work_kicks = 0.0;  // given by kicks at the point of derailment, hence negative

  double kinetic() const { return kinetic_translation + kinetic_rotation; }
  double total() const {
    return kinetic() + coupler_axial + coupler_swing + work_on_track + work_off_track + work_rails +
           work_coupler_damping + work_coupler_break + work_impact_normal + work_impact_friction + work_grade +
           work_kicks;
  }
};

}  // namespace train_derail::model
