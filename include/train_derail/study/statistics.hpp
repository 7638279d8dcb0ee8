#pragma once

#include <atomic>
#include <string>
#include <vector>

namespace train_derail::study {

/// Of a sample; NaN where it is too small.
struct Spread {
  std::size_t count = 0;
  double mean = 0.0, sd = 0.0;
  double q05 = 0.0, q25 = 0.0, median = 0.0, q75 = 0.0, q95 = 0.0;
};

/// Quantile by linear interpolation of the order statistics (Hyndman and Fan's type 7). `sorted` must rise and not be
/// empty.
double quantile(const std::vector<double>& sorted, double p);
Spread spread(std::vector<double> sample);

/// Between two members of a sample of n, sorted: the low_rank-th and the high_rank-th.
struct PredictiveRanks {
  std::size_t low = 0, high = 0;  // from 1
  double held = 0.0;              // share of the intervals that hold one more draw: (high - low) / (n + 1)
};
/// One more draw is as likely to fall into any of the n + 1 gaps between and beyond n members drawn with it. So the
/// interval that is to hold the middle `share` ends at ranks (n + 1) (1 -+ share) / 2, outwards, at most 1 and n: it
/// holds `share` or more where n is enough (19 for 90 %), else (n - 1) / (n + 1). Quantiles that interpolate lie
/// further in: they hold less than their name says.
PredictiveRanks predictive_ranks(std::size_t n, double share);

struct Interval {
  double low = 0.0, high = 0.0;  // NaN if there is no sample
};
Interval predictive_interval(std::vector<double> sample, double share);

inline constexpr int kBootstraps = 500;

/// Variance-based sensitivity of one output to one input, with 95 % bootstrap intervals.
/// First order by Saltelli et al. (2010), total by Jansen (1999).
struct SobolIndex {
  double first = 0.0, first_low = 0.0, first_high = 0.0;
  double total = 0.0, total_low = 0.0, total_high = 0.0;
};

/// Throws Stopped (study.hpp). `a`, `b`: outputs at the sample points A and B; `ab[i]`: at A with input i taken from B.
/// All of equal length.
std::vector<SobolIndex> sobol_indices(const std::vector<double>& a, const std::vector<double>& b,
                                      const std::vector<std::vector<double>>& ab, int bootstraps = kBootstraps,
                                      const std::atomic<bool>* stop = nullptr);

}  // namespace train_derail::study
