// Loops of the extended model over cars, couplers and trucks, several side by side; see kernels.hpp.
#pragma once

#include <cstddef>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// Arrays have one entry a car, a coupler ("coupler", cars - 1 of them) or a truck ("truck": the front trucks of all
/// cars, then the rear ones).
struct ExtendedArrays {
  std::ptrdiff_t cars;
  const inputs::Coupler* law;
  const inputs::Ground* ground;
  const inputs::Rails* rails;
  double cos_limit;  // of the coupler's swing
  double grade;      // sine of the slope
  bool rails_on, by_slip, straight;
  const double *half_length, *half_spacing;
  const double* inverse_mass;
  const double* inverse_inertia;
  // What the last step has left: latches and places.
  const double* alive;                  // coupler: 1, or 0 if broken
  const double* damping;                // coupler [N s/m]
  const double* on_track;               // truck: 1 on the rails (or before the point of derailment), else 0
  const double* offset;                 // truck: from the alignment if on rails, else from the centre line [m]
  const double *tangent_x, *tangent_y;  // truck: of the track
  const double* load;                   // truck: W / 2 [N]
  const double* rail_damping;           // truck [N s/m]
  const double* along;                  // car: brake force over load on the track [-]
  const double* patch;                  // truck: factor of off-track friction [-]
  double *cosine, *sine;                // of the headings at the beginning of the step
  // Forces of the step.
  double *axial, *damper, *ux, *uy, *cos_swing, *end_moment;  // coupler
  double *pin_x, *pin_y, *moment_lead, *moment_trail;         // cars + 1 entries: [i + 1] is coupler i
  double *truck_x, *truck_y, *brake, *lateral;  // truck: ground or rails; of it along and across the rails [N]
  double *fx, *fy, *moment;                     // car
};

/// Work of a step by mechanism [J].
struct StepWork {
  double on_track = 0.0, off_track = 0.0, rails = 0.0, damping = 0.0, grade = 0.0;
};

/// Of all couplers in a step.
struct CouplerPeaks {
  double buff = 0.0, draft = 0.0;  // N
  double cos_swing = 1.0;          // least
  double end_moment = 0.0;         // largest size of the sum of both [N m]
};

struct ExtendedKernels {
  const char* instruction_set;
  std::ptrdiff_t lanes;  // needs at least lanes + 1 cars
  CouplerPeaks (*forces)(const ExtendedArrays&, const double* y);
  /// `before`, `after`: states at the ends of a step of length h whose forces are in the arrays.
  StepWork (*work)(const ExtendedArrays&, const double* before, const double* after, double h);
  void (*headings)(std::ptrdiff_t n, const double* theta, double* cosine, double* sine);
  /// Turns cosine and sine by `angle` (one a car, small) [rad].
  void (*turn)(const ExtendedArrays&, const double* angle);
  /// Places of the trucks: px, py, one a truck [m].
  void (*places)(const ExtendedArrays&, const double* y, double* px, double* py);
  /// Counts up `overloaded` (truck [s]) as in overloaded_time, from the lateral forces `before` (truck) to those in the
  /// arrays; whether any truck has been overloaded for too long.
  bool (*overload)(const ExtendedArrays&, double h, const double* before, double* overloaded);
};

extern const ExtendedKernels kExtendedPlain, kExtendedSse2, kExtendedAvx2, kExtendedAvx512;

}  // namespace train_derail::model
