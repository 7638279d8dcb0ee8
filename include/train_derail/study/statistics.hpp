/// \file
/// Statistics of samples: quantiles, prediction intervals, Sobol indices.
#pragma once

#include <atomic>
#include <string>
#include <vector>

namespace train_derail::study {

/// Mean, standard deviation and quantiles of a sample. NaN where the sample is too small.
struct Spread {
  std::size_t count = 0;  ///< size of the sample
  double mean = 0.0,      ///< mean
      sd = 0.0;           ///< standard deviation, with n - 1
  double q05 = 0.0,       ///< 5 % quantile
      q25 = 0.0,          ///< 25 % quantile
      median = 0.0,       ///< 50 % quantile
      q75 = 0.0,          ///< 75 % quantile
      q95 = 0.0;          ///< 95 % quantile
  double low = 0.0,       ///< lower end of the range that is shown, see is_quantile_range()
      high = 0.0;         ///< upper end
};

/// Returns whether the range that is shown of so many runs is from the 5 to the 95 % quantile. Of fewer than 20 runs
/// these lie between the outermost two and say no more than they do: then it is from the lowest to the highest.
constexpr bool is_quantile_range(std::size_t runs) { return runs >= 20; }
/// Returns what the range is: "5 to 95 %", "lowest to highest".
std::string range_kind(std::size_t runs);
/// Returns the same with the number of runs: "5 to 95 % of 200 runs", "lowest to highest of 7 runs".
std::string range_words(std::size_t runs);

/// Returns the quantile for the share `p` in [0, 1], by linear interpolation between the values (type 7 of Hyndman and
/// Fan 1996). `sorted` must be in rising order and not empty.
double quantile(const std::vector<double>& sorted, double p);
/// Returns the spread of a sample, in any order.
Spread spread(std::vector<double> sample);

/// A prediction interval that reaches from one value of a sorted sample of n to another.
struct PredictiveRanks {
  std::size_t low = 0,  ///< rank of the lower value, from 1
      high = 0;         ///< rank of the upper value, from 1
  double held = 0.0;    ///< probability that one more draw lies in the interval: (high - low) / (n + 1)
};
/// Returns the ranks of the interval that holds one more draw with probability `share`. One more draw falls with equal
/// probability into each of the n + 1 gaps between and beyond the n sorted values. So the interval ends at the ranks
/// (n + 1) (1 -+ share) / 2, rounded outwards and limited to 1 and n. It holds `share` or more if n is large enough (19
/// for 90 %), else (n - 1) / (n + 1). Interpolated quantiles lie further inside and hold less than their name says.
PredictiveRanks predictive_ranks(std::size_t n, double share);

/// An interval; both ends are NaN if there is no sample.
struct Interval {
  double low = 0.0,  ///< lower end
      high = 0.0;    ///< upper end
};
/// Returns the prediction interval of a sample for the probability `share`, see predictive_ranks().
Interval predictive_interval(std::vector<double> sample, double share);

/// Number of bootstrap samples for the intervals of Sobol indices.
inline constexpr int kBootstraps = 500;

/// Sensitivity of one output to one input: shares of the output's variance, with 95 % bootstrap intervals. Estimators:
/// first order by Saltelli et al. (2010), total by Jansen (1999).
struct SobolIndex {
  double first = 0.0,    ///< first-order index: share that is due to the input alone
      first_low = 0.0,   ///< lower end of its interval
      first_high = 0.0;  ///< upper end of its interval
  double total = 0.0,    ///< total index: share in which the input takes part
      total_low = 0.0,   ///< lower end of its interval
      total_high = 0.0;  ///< upper end of its interval
};

/// Returns the indices of all inputs for one output. `a` and `b` are the outputs at the sample points A and B; `ab[i]`
/// are the outputs at A with input i taken from B. All must have the same length. Throws Stopped (study.hpp) once
/// `stop` is set.
std::vector<SobolIndex> sobol_indices(const std::vector<double>& a, const std::vector<double>& b,
                                      const std::vector<std::vector<double>>& ab, int bootstraps = kBootstraps,
                                      const std::atomic<bool>* stop = nullptr);

}  // namespace train_derail::study
