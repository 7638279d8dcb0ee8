// Loops over columns with one entry a car or a truck, of those that are busy.
#pragma once

#include <limits>
#include <type_traits>

#include "model/extended_kernels.hpp"
#include "simd/blocks.hpp"

namespace train_derail::model {

/// for_blocks() over the first `n` entries of columns with one entry a car, of cars that are busy.
template <std::ptrdiff_t width, class Body>
void for_busy(const BusyCars& busy, std::ptrdiff_t n, const Body& body) {
  for (const CarRange* r = busy.ranges; r != busy.ranges + busy.count; ++r) {
    const std::ptrdiff_t to = r->to < n ? r->to : n;
    std::ptrdiff_t i = r->from;
    for (; i + width <= to; i += width) body(i, std::ptrdiff_t{0});
    if (i < to) body(to - width, width - (to - i));
  }
}

template <std::ptrdiff_t width, class Body>
void for_busy(const BusyCars& busy, const Body& body) {
  for_busy<width>(busy, std::numeric_limits<std::ptrdiff_t>::max(), body);
}

/// 0 for entries of a block that have been dealt with, 1 for the others.
template <class B>
B fresh_lanes(std::ptrdiff_t done) {
  static constexpr double kLane[] = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
  return select(Lanes<B>::load(kLane) < B(static_cast<double>(done)), B(0.0), B(1.0));
}

/// Something that a loop over blocks and single numbers sums up or widens, with a B and with a double.
template <class B>
struct Tally {
  B of_blocks = B(0.0);
  double of_single = 0.0;

  /// The one for a K, which is B or double.
  template <class K>
  K& of() {
    if constexpr (std::is_same_v<K, B>) return of_blocks;
    else return of_single;
  }
  template <class K>
  void add(const K& value) {
    of<K>() = of<K>() + value;
  }
  template <class K>
  void widen(const K& value) {
    of<K>() = select(value > of<K>(), value, of<K>());
  }
  double sum() const { return Lanes<B>::sum(of_blocks) + of_single; }
  double max() const {
    const double blocks = Lanes<B>::max(of_blocks);
    return of_single > blocks ? of_single : blocks;
  }
};

/// The same as for_busy() for body(i, done, zero of the number to use), where a range that has no room for a block must
/// not be left: numbers one at a time then.
template <class B, class Body>
[[gnu::always_inline]] inline void for_within(const BusyCars& busy, std::ptrdiff_t n, const Body& body) {
  constexpr std::ptrdiff_t width = Lanes<B>::count;
  for (const CarRange* r = busy.ranges; r != busy.ranges + busy.count; ++r) {
    const std::ptrdiff_t to = r->to < n ? r->to : n;
    std::ptrdiff_t i = r->from;
    for (; i + width <= to; i += width) body(i, std::ptrdiff_t{0}, B(0.0));
    if (i < to && i > r->from) body(to - width, width - (to - i), B(0.0));
    else
      for (; i < to; ++i) body(i, std::ptrdiff_t{0}, 0.0);
  }
}

/// The same, without touching any entry twice: calls body(i, zero of the number to use).
template <class B, class Body>
[[gnu::always_inline]] inline void for_each_busy(const BusyCars& busy, std::ptrdiff_t n, const Body& body) {
  for (const CarRange* r = busy.ranges; r != busy.ranges + busy.count; ++r) {
    const std::ptrdiff_t to = r->to < n ? r->to : n;
    std::ptrdiff_t i = r->from;
    for (; i + Lanes<B>::count <= to; i += Lanes<B>::count) body(i, B(0.0));
    for (; i < to; ++i) body(i, 0.0);
  }
}

template <class B, class Body>
[[gnu::always_inline]] inline void for_each_busy(const BusyCars& busy, const Body& body) {
  for_each_busy<B>(busy, std::numeric_limits<std::ptrdiff_t>::max(), body);
}

}  // namespace train_derail::model
