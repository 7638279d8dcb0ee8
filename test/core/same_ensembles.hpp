// Two ensembles, outcome by outcome.
#pragma once

#include <algorithm>
#include <array>
#include <tuple>
#include <vector>

#include "train_derail/multibody/two_sample.hpp"
#include "train_derail/simulation/simulation.hpp"

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

/// Least p as above between runs of scenario(seed) as they are, and others that `without` has changed, `runs` each.
/// values(outcome): the outcomes to compare, an array.
template <class Scenario, class Without, class Values>
double least_p_without(int runs, const Scenario& scenario, const Without& without, const Values& values) {
  constexpr std::size_t kValues = std::tuple_size_v<decltype(values(outcome::Outcome()))>;
  std::array<std::vector<double>, kValues> as_is, changed;
  for (int i = 0; i < 2 * runs; ++i) {
    inputs::Scenario s = scenario();
    s.initial.perturbation.seed = i + 1;
    if (i % 2 == 1) without(s);
    simulation::Simulation sim(s);
    sim.run();
    const auto found = values(sim.outcome());
    for (std::size_t q = 0; q < kValues; ++q) (i % 2 == 1 ? changed : as_is)[q].push_back(found[q]);
  }
  return least_p(as_is, changed);
}

}  // namespace train_derail::test
