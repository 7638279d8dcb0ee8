// Cars that may touch, found by a sweep along one axis.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace train_derail::model {

/// Sorts cars by `begin_of(car)`. Their order hardly changes between two calls, and then this costs a look at each.
template <class BeginOf>
void sort_again(std::vector<int>& cars, BeginOf begin_of) {
  for (std::size_t i = 1; i < cars.size(); ++i) {
    const int k = cars[i];
    std::size_t j = i;
    for (; j > 0 && begin_of(cars[j - 1]) > begin_of(k); --j) cars[j] = cars[j - 1];
    cars[j] = k;
  }
}

/// Sorts pairs by their cars a and b; one that was among the old ones, which are sorted, goes on with what that one
/// kept.
template <class Pair>
void keep_known(std::vector<Pair>& pairs, const std::vector<Pair>& old_pairs) {
  const auto less = [](const Pair& p, const Pair& r) { return p.a != r.a ? p.a < r.a : p.b < r.b; };
  std::sort(pairs.begin(), pairs.end(), less);
  auto old = old_pairs.begin();
  for (Pair& p : pairs) {
    while (old != old_pairs.end() && less(*old, p)) ++old;
    if (old != old_pairs.end() && old->a == p.a && old->b == p.b) p = *old;
  }
}

}  // namespace train_derail::model
