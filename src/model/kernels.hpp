// The loops over all cars that cost the time, several cars side by side. One set for each instruction set, the fitting
// one chosen at run time; each .cpp is compiled for its own set, so nothing here may be an inline function that another
// file shares.
#pragma once

#include <cstddef>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// Arrays that loops over the cars of a planar model need: one entry a car, unless said otherwise.
struct PlanarArrays {
  std::ptrdiff_t cars = 0;
  const inputs::Coupler* coupler = nullptr;
  double cos_limit = 1.0;                                        ///< of the coupler's swing
  double regularization_speed = 0.0;                             ///< m/s
  const double *half_length = nullptr, *half_spacing = nullptr;  ///< m
  const double *inverse_mass = nullptr, *inverse_inertia = nullptr;
  double *cosine = nullptr, *sine = nullptr;  ///< of the headings
  /// Force of coupler i on its lead car and moments on both cars, at [i + 1] of cars + 1 entries; the ends are zero.
  double *pin_x = nullptr, *pin_y = nullptr, *moment_lead = nullptr, *moment_trail = nullptr;
};

/// Of the paper's model.
struct DerailmentArrays : PlanarArrays {
  const double* load = nullptr;            ///< mu W / 2 as latched [N]
  const double* lateral = nullptr;         ///< 1 where friction acts sideways, else 0
  const double* past_pod = nullptr;        ///< 1 past the point of derailment, else 0
  const double* inverse_mass_y = nullptr;  ///< sideways; zero where rails hold the car
};

/// One version of the loops that all planar models have. Layout of states as in state_layout.hpp.
struct PlanarKernels {
  const char* instruction_set;
  std::ptrdiff_t lanes;  ///< needs at least lanes + 1 cars
  void (*headings)(std::ptrdiff_t n, const double* theta, double* cosine, double* sine);
  /// Gap of every coupler [m] and how fast it grows [m/s].
  void (*gaps)(const PlanarArrays&, const double* y, double* gap, double* rate);
};

/// One version of the loops of the paper's model.
struct DerailmentKernels : PlanarKernels {
  /// False if dydt is not finite.
  bool (*right_hand_side)(const DerailmentArrays&, const double* y, double* dydt);
  /// The same, but for the rates of the positions, which stand in y.
  bool (*accelerations)(const DerailmentArrays&, const double* y, double* dydt);
  /// Largest x of the cars that have not passed the point of derailment [m]; minus infinity if all have.
  double (*foremost)(const DerailmentArrays&, const double* y);
};

extern const DerailmentKernels kPlain, kSse2, kAvx2, kAvx512;

}  // namespace train_derail::model
