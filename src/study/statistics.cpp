#include "train_derail/study/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/format.h>
#include <boost/math/statistics/univariate_statistics.hpp>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_int_distribution.hpp>

#include "train_derail/study/study.hpp"

namespace train_derail::study {

namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

struct Estimate {
  double first, total;
};

Estimate estimate(const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& ab,
                  const std::vector<std::size_t>& pick) {
  const auto n = static_cast<double>(pick.size());
  double sum = 0.0, squares = 0.0, first = 0.0, total = 0.0;
  double mean = 0.0;
  for (const std::size_t j : pick) mean += a[j] + b[j];
  mean /= 2.0 * n;
  for (const std::size_t j : pick) {
    const double aj = a[j] - mean, bj = b[j] - mean, abj = ab[j] - mean;
    sum += aj + bj;
    squares += aj * aj + bj * bj;
    first += bj * (abj - aj);
    total += (aj - abj) * (aj - abj);
  }
  const double variance = squares / (2.0 * n) - (sum / (2.0 * n)) * (sum / (2.0 * n));
  return {first / n / variance, 0.5 * total / n / variance};
}

}  // namespace

double quantile(const std::vector<double>& sorted, double p) {
  const double place = p * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (place - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

Spread spread(std::vector<double> sample) {
  Spread s;
  s.count = sample.size();
  if (sample.empty()) return {0, kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone, kNone};
  std::sort(sample.begin(), sample.end());
  s.mean = boost::math::statistics::mean(sample);
  s.sd = sample.size() > 1 ? std::sqrt(boost::math::statistics::sample_variance(sample)) : kNone;
  s.q05 = quantile(sample, 0.05);
  s.q25 = quantile(sample, 0.25);
  s.median = quantile(sample, 0.5);
  s.q75 = quantile(sample, 0.75);
  s.q95 = quantile(sample, 0.95);
  const bool quantiles = is_quantile_range(s.count);
  s.low = quantiles ? s.q05 : sample.front();
  s.high = quantiles ? s.q95 : sample.back();
  return s;
}

std::string range_kind(std::size_t runs) { return is_quantile_range(runs) ? "5 to 95 %" : "lowest to highest"; }

std::string range_words(std::size_t runs) {
  return fmt::format("{} of {} {}", range_kind(runs), runs, runs == 1 ? "run" : "runs");
}

PredictiveRanks predictive_ranks(std::size_t n, double share) {
  if (n == 0) return {0, 0, kNone};
  const double all = static_cast<double>(n) + 1.0, beyond = 0.5 * (1.0 - share) * all;
  constexpr double kRounding = 1e-9;  // so that 20 * 0.05 gives rank 1 in spite of rounding
  const auto low = static_cast<std::size_t>(std::max(std::floor(beyond + kRounding), 1.0));
  const std::size_t high = n + 1 - low;
  return {low, high, static_cast<double>(high - low) / all};
}

Interval predictive_interval(std::vector<double> sample, double share) {
  if (sample.empty()) return {kNone, kNone};
  const PredictiveRanks ranks = predictive_ranks(sample.size(), share);
  std::sort(sample.begin(), sample.end());
  return {sample[ranks.low - 1], sample[ranks.high - 1]};
}

std::vector<SobolIndex> sobol_indices(const std::vector<double>& a, const std::vector<double>& b,
                                      const std::vector<std::vector<double>>& ab, int bootstraps,
                                      const std::atomic<bool>* stop) {
  std::vector<std::size_t> all(a.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<SobolIndex> indices;
  for (const std::vector<double>& y : ab) {
    const Estimate now = estimate(a, b, y, all);
    std::vector<double> first, total;
    boost::random::mt19937_64 generator(12345);  // a fixed seed: the same intervals each time
    boost::random::uniform_int_distribution<std::size_t> any(0, a.size() - 1);
    std::vector<std::size_t> pick(a.size());
    for (int i = 0; i < bootstraps; ++i) {
      if (stop != nullptr && *stop) throw Stopped();
      for (std::size_t& j : pick) j = any(generator);
      const Estimate e = estimate(a, b, y, pick);
      first.push_back(e.first);
      total.push_back(e.total);
    }
    std::sort(first.begin(), first.end());
    std::sort(total.begin(), total.end());
    indices.push_back({now.first, quantile(first, 0.025), quantile(first, 0.975), now.total, quantile(total, 0.025),
                       quantile(total, 0.975)});
  }
  return indices;
}

}  // namespace train_derail::study
