#pragma once

#include <string>
#include <vector>

namespace train_derail::study {

/// Of a sample; NaN where it is too small.
struct Spread {
  std::size_t count = 0;
  double mean = 0.0, sd = 0.0;
  double q05 = 0.0, q25 = 0.0, median = 0.0, q75 = 0.0, q95 = 0.0;
};

/// Quantile by linear interpolation of the order statistics (Hyndman and Fan's type 7). `sorted` must rise and not be empty.
double quantile(const std::vector<double>& sorted, double p);
Spread spread(std::vector<double> sample);

/// Variance-based sensitivity of one output to one input, with 95 % bootstrap intervals.
/// First order by Saltelli et al. (2010), total by Jansen (1999).
struct SobolIndex {
  double first = 0.0, first_low = 0.0, first_high = 0.0;
  double total = 0.0, total_low = 0.0, total_high = 0.0;
};

/// `a`, `b`: outputs at the sample points A and B; `ab[i]`: at A with input i taken from B. All of equal length.
std::vector<SobolIndex> sobol_indices(const std::vector<double>& a, const std::vector<double>& b,
                                      const std::vector<std::vector<double>>& ab, int bootstraps = 500);

}  // namespace train_derail::study
