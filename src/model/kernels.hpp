// The loops over all cars that cost the time, several cars side by side. One set for each instruction set, the fitting
// one chosen at run time; each .cpp is compiled for its own set, so nothing here may be an inline function that another
// file shares.
#pragma once

#include <cstddef>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// Arrays with one entry a car, unless said otherwise.
struct CarArrays {
  std::ptrdiff_t cars;
  const inputs::Coupler* coupler;
  double cos_limit;             // of the coupler's swing
  double regularization_speed;  // m/s
  const double *half_length, *half_spacing;
  const double* load;                                             // mu W / 2 as latched [N]
  const double* lateral;                                          // 1 where friction acts sideways, else 0
  const double* past_pod;                                         // 1 past the point of derailment, else 0
  const double *inverse_mass, *inverse_mass_y, *inverse_inertia;  // zero where rails hold the car
  double *cosine, *sine;                                          // scratch
  double *force_x, *force_y, *moment_lead, *moment_trail;         // scratch, cars + 1 entries: [i + 1] is coupler i
};

/// Layout of states as in state_layout.hpp.
struct KernelSet {
  const char* instruction_set;
  std::ptrdiff_t lanes;                                                      // needs at least lanes + 1 cars
  bool (*right_hand_side)(const CarArrays&, const double* y, double* dydt);  // false if dydt is not finite
  void (*headings)(std::ptrdiff_t n, const double* theta, double* cosine, double* sine);
  void (*gaps)(const CarArrays&, const double* y, double* gap, double* rate);  // of every coupler [m, m/s]
};

extern const KernelSet kPlain, kSse2, kAvx2, kAvx512;

}  // namespace train_derail::model
