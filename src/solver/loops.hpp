/// \file
/// Arithmetic of the solvers on whole vectors, several numbers side by side.
#pragma once

#include <cstddef>
#include <vector>

namespace train_derail::solver {

/// A summand of a linear combination.
struct Term {
  double factor;
  const double* data;
};

/// One version of the loops, for one instruction set.
struct VectorLoops {
  const char* instruction_set;
  std::ptrdiff_t lanes;
  /// z = sum of factor * data over `count` terms, 1 to kTermsMax; z may be one of the data.
  void (*add_up)(int count, const Term* terms, double* z, std::ptrdiff_t n);
  /// Sum of (x w)^2.
  double (*weighted_square_sum)(const double* x, const double* w, std::ptrdiff_t n);
  double (*sum)(const double* x, std::ptrdiff_t n);
  /// w = 1 / (rtol |y| + atol), to single precision.
  void (*weights)(double rtol, double atol, const double* y, double* w, std::ptrdiff_t n);
  /// v = v_before + h a, q = q_before + h v.
  void (*move)(std::ptrdiff_t n, double h, const double* a, const double* v_before, const double* q_before, double* v,
               double* q);
};

inline constexpr int kTermsMax = 8;  // of a step of the Runge-Kutta pairs

extern const VectorLoops kLoopsPlain, kLoopsSse2, kLoopsAvx2, kLoopsAvx512;

/// The fastest that this processor can run.
const VectorLoops& loops();
/// All that this processor can run, fastest first.
std::vector<const VectorLoops*> usable_loops();

}  // namespace train_derail::solver
