// Derailments in the order of their times.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "train_derail/model/incidents.hpp"

namespace train_derail::model {

/// Sorts by time what a step has added behind the first `ordered` derailments, and notes why a car has derailed first.
/// Returns whether there was anything; `ordered` is then the number of all.
inline bool order_new(std::vector<Derailment>& all, std::size_t& ordered, std::vector<Cause>& first_cause) {
  if (ordered == all.size()) return false;
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(ordered);
  std::stable_sort(begin, all.end(), [](const Derailment& a, const Derailment& b) { return a.time < b.time; });
  for (auto d = begin; d != all.end(); ++d) {
    Cause& cause = first_cause[static_cast<std::size_t>(d->car)];
    if (cause == Cause::none) cause = d->cause;
  }
  ordered = all.size();
  return true;
}

}  // namespace train_derail::model
