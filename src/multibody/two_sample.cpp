#include "train_derail/multibody/two_sample.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>

#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace train_derail::multibody {

namespace {

/// The two statistics as whole numbers, so that equal values are recognised as equal.
struct Counts {
  std::int64_t distance = 0;  // Kolmogorov-Smirnov distance, times the product of the sizes
  std::int64_t ranks = 0;     // twice the sum of the ranks of a
};

/// Computes both statistics. `of_a[i]`: whether the i-th smallest value of both samples belongs to a. `tied[i]`:
/// whether it equals the next value.
Counts counts_of(const std::vector<char>& of_a, const std::vector<char>& tied,
                 const std::vector<std::int64_t>& twice_rank, std::int64_t size_a, std::int64_t size_b) {
  Counts s;
  std::int64_t below = 0;  // difference of the two distribution functions, times the product of the sizes
  for (std::size_t i = 0; i < of_a.size(); ++i) {
    below += of_a[i] != 0 ? size_b : -size_a;
    if (of_a[i] != 0) s.ranks += twice_rank[i];
    if (tied[i] == 0) s.distance = std::max(s.distance, std::abs(below));
  }
  return s;
}

/// Returns the mean. It is exact if all values are equal, so that their variance is 0.
double mean(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double v : x) sum += v - x.front();
  return x.front() + sum / static_cast<double>(x.size());
}

double variance(const std::vector<double>& x) {
  const double m = mean(x);
  double sum = 0.0;
  for (const double v : x) sum += (v - m) * (v - m);
  return sum / static_cast<double>(x.size() - 1);
}

}  // namespace

TwoSample compare(const std::vector<double>& a, const std::vector<double>& b, int permutations) {
  std::vector<std::pair<double, char>> pooled;
  for (const double v : a) pooled.emplace_back(v, char(1));
  for (const double v : b) pooled.emplace_back(v, char(0));
  std::sort(pooled.begin(), pooled.end());
  const std::size_t n = pooled.size();
  const auto size_a = static_cast<std::int64_t>(a.size()), size_b = static_cast<std::int64_t>(b.size());
  std::vector<char> of_a(n), tied(n, 0);
  std::vector<std::int64_t> twice_rank(n);
  for (std::size_t i = 0, end = 0; i < n; i = end) {
    while (end < n && pooled[end].first == pooled[i].first) ++end;
    for (std::size_t j = i; j < end; ++j) {
      of_a[j] = pooled[j].second;
      tied[j] = j + 1 < end ? 1 : 0;
      twice_rank[j] = static_cast<std::int64_t>(i + end + 1);  // ranks from 1; equal values share their mean rank
    }
  }
  const Counts seen = counts_of(of_a, tied, twice_rank, size_a, size_b);
  const std::int64_t expected = size_a * (size_a + size_b + 1);

  TwoSample result;
  result.distance = static_cast<double>(seen.distance) / static_cast<double>(size_a * size_b);
  result.precedence =
      1.0 - static_cast<double>(seen.ranks - size_a * (size_a + 1)) / static_cast<double>(2 * size_a * size_b);
  std::mt19937_64 engine(1);
  int farther = 0, more_uneven = 0;
  for (int p = 0; p < permutations; ++p) {
    for (std::size_t i = n - 1; i > 0; --i) {  // shuffle by Fisher and Yates; the bias of the remainder is below 1e-16
      std::swap(of_a[i], of_a[engine() % (i + 1)]);
    }
    const Counts s = counts_of(of_a, tied, twice_rank, size_a, size_b);
    farther += s.distance >= seen.distance ? 1 : 0;
    more_uneven += std::abs(s.ranks - expected) >= std::abs(seen.ranks - expected) ? 1 : 0;
  }
  result.p_distance = (1.0 + farther) / (1.0 + permutations);
  result.p_precedence = (1.0 + more_uneven) / (1.0 + permutations);
  return result;
}

std::vector<double> holm(const std::vector<double>& p) {
  std::vector<std::size_t> order(p.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) { return p[i] < p[j]; });
  std::vector<double> adjusted(p.size());
  double least = 0.0;
  for (std::size_t rank = 0; rank < order.size(); ++rank) {
    least = std::max(least, std::min(1.0, static_cast<double>(p.size() - rank) * p[order[rank]]));
    adjusted[order[rank]] = least;
  }
  return adjusted;
}

double detectable_shift(std::size_t size, double alpha, double power) {
  const boost::math::normal normal;
  const double excess =
      (quantile(normal, 1.0 - 0.5 * alpha) + quantile(normal, power)) / std::sqrt(6.0 * static_cast<double>(size));
  return excess < 0.5 ? std::sqrt(2.0) * quantile(normal, 0.5 + excess) : std::numeric_limits<double>::infinity();
}

double pooled_deviation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto squares = [](const std::vector<double>& x) {
    return x.size() < 2 ? 0.0 : variance(x) * static_cast<double>(x.size() - 1);
  };
  return a.size() + b.size() > 2 ? std::sqrt((squares(a) + squares(b)) / static_cast<double>(a.size() + b.size() - 2))
                                 : 0.0;
}

MeanDifference mean_difference(const std::vector<double>& a, const std::vector<double>& b, double confidence) {
  MeanDifference result{mean(b) - mean(a), std::numeric_limits<double>::infinity()};
  if (a.size() < 2 || b.size() < 2) return result;
  const double va = variance(a) / static_cast<double>(a.size()), vb = variance(b) / static_cast<double>(b.size());
  if (va + vb == 0.0) return {result.value, 0.0};
  const double freedom = (va + vb) * (va + vb) /
                         (va * va / static_cast<double>(a.size() - 1) + vb * vb / static_cast<double>(b.size() - 1));
  result.half_width = quantile(boost::math::students_t(freedom), 0.5 + 0.5 * confidence) * std::sqrt(va + vb);
  return result;
}

}  // namespace train_derail::multibody
