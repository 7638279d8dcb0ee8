// Were two samples drawn from the same distribution? Tests that assume nothing about it and stay exact where values
// tie.
#pragma once

#include <cstddef>
#include <vector>

namespace train_derail::multibody {

struct TwoSample {
  double distance = 0.0;    // Kolmogorov-Smirnov: largest difference of the two distribution functions
  double precedence = 0.5;  // Mann-Whitney: share of pairs in which a < b, ties counted half
  double p_distance = 1.0;  // two-sided, by permutation: how often chance alone does as much
  double p_precedence = 1.0;
};

/// Neither sample may be empty. p-values by `permutations` random exchanges with a fixed seed: the same every time.
TwoSample compare(const std::vector<double>& a, const std::vector<double>& b, int permutations = 99'999);

/// Holm's correction: p-values that may each be held against the level of the whole family, in the order given.
std::vector<double> holm(const std::vector<double>& p);

/// Shift of two equal normal distributions, in standard deviations, that the Mann-Whitney test of two samples of `size`
/// finds at level `alpha` (two-sided) with probability `power` (Noether 1987). Infinite if no shift is enough.
double detectable_shift(std::size_t size, double alpha, double power);

/// Standard deviation within the samples; 0 for fewer than three values in all.
double pooled_deviation(const std::vector<double>& a, const std::vector<double>& b);

/// Difference of the means b - a, and half the width of its confidence interval (Welch).
struct MeanDifference {
  double value = 0.0, half_width = 0.0;
};
MeanDifference mean_difference(const std::vector<double>& a, const std::vector<double>& b, double confidence);

}  // namespace train_derail::multibody
