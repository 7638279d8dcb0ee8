/// \file
/// Statistical tests whether two samples come from the same distribution. They assume nothing about the distribution,
/// and stay exact if values are equal.
#pragma once

#include <cstddef>
#include <vector>

namespace train_derail::multibody {

/// Result of the two tests. A p-value is the probability that chance alone gives a statistic as extreme as this.
struct TwoSample {
  double distance = 0.0;      ///< Kolmogorov-Smirnov: largest difference of the two distribution functions
  double precedence = 0.5;    ///< Mann-Whitney: share of pairs with a < b, equal values counted half
  double p_distance = 1.0;    ///< p-value of `distance`
  double p_precedence = 1.0;  ///< p-value of `precedence`, two-sided
};

/// Compares two samples, neither of which may be empty. The p-values come from `permutations` random exchanges between
/// the samples, with a fixed seed, so that they are the same every time.
TwoSample compare(const std::vector<double>& a, const std::vector<double>& b, int permutations = 99'999);

/// Returns the p-values of several tests after Holm's correction, in the same order. Each may be compared with the
/// level of all tests together.
std::vector<double> holm(const std::vector<double>& p);

/// Returns the shift between two normal distributions, in standard deviations, that the Mann-Whitney test finds with
/// the probability `power` (Noether 1987), for two samples of `size` each and the two-sided level `alpha`. Infinite if
/// no shift is enough.
double detectable_shift(std::size_t size, double alpha, double power);

/// Returns the standard deviation within the samples, each about its own mean; 0 for fewer than three values in all.
double pooled_deviation(const std::vector<double>& a, const std::vector<double>& b);

/// Difference of two means.
struct MeanDifference {
  double value = 0.0,    ///< mean of b - mean of a
      half_width = 0.0;  ///< half the width of its confidence interval
};
/// Returns the difference of the means with its confidence interval (Welch), for the probability `confidence`.
MeanDifference mean_difference(const std::vector<double>& a, const std::vector<double>& b, double confidence);

}  // namespace train_derail::multibody
