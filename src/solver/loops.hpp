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

inline constexpr int kPairStages = 7;  // of the pair of Dormand and Prince

/// An attempt at a step of that pair. The state holds `positions` numbers q, as many v = q', then `others`.
struct PairStep {
  std::ptrdiff_t positions, others;
  double h;                    ///< length of the step
  const double* y;             ///< state at its beginning
  const double* const* rates;  ///< dy/dt at the stages; that of q, which is v, is not read
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
  /// y = the state at which the rates of a stage, 2 to kPairStages, are wanted; the last one is the end of the step.
  void (*pair_stage)(int stage, const PairStep&, double* y);
  /// Sum of (error / (rtol |y| + atol))^2 over q, v and the first `controlled` of the others.
  double (*pair_error)(const PairStep&, std::ptrdiff_t controlled, double rtol, double atol);
};

inline constexpr int kTermsMax = 8;  // of a step of the Runge-Kutta pairs

extern const VectorLoops kLoopsPlain, kLoopsSse2, kLoopsAvx2, kLoopsAvx512;

/// The fastest that this processor can run.
const VectorLoops& loops();
/// All that this processor can run, fastest first.
std::vector<const VectorLoops*> usable_loops();

}  // namespace train_derail::solver
