// Two ensembles, outcome by outcome.
#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "train_derail/multibody/two_sample.hpp"

namespace train_derail::test {

/// Least p over all outcomes and both tests (distance, precedence), corrected for their number.
template <std::size_t N>
double least_p(const std::array<std::vector<double>, N>& a, const std::array<std::vector<double>, N>& b) {
  std::vector<double> p;
  for (std::size_t q = 0; q < N; ++q) {
    const multibody::TwoSample test = multibody::compare(a[q], b[q], 9999);
    p.insert(p.end(), {test.p_distance, test.p_precedence});
  }
  const std::vector<double> corrected = multibody::holm(p);
  return *std::min_element(corrected.begin(), corrected.end());
}

}  // namespace train_derail::test
