/// \file
/// How loops over columns of numbers are written once for one number at a time and for several side by side.
#pragma once

#include <cstddef>

#include "train_derail/simd/lanes.hpp"

namespace train_derail {

/// How a B is read, written and taken apart.
template <class B>
struct Lanes;

template <>
struct Lanes<double> {
  static constexpr std::ptrdiff_t count = 1;
  static double load(const double* p) { return *p; }
  static void store(double b, double* p) { *p = b; }
  static double sum(double b) { return b; }
  static double max(double b) { return b; }
  /// a b + c, rounded once where the processor can.
  static double multiply_add(double a, double b, double c) { return a * b + c; }
  /// table[b], b rounded down; b >= 0.
  static double look_up(const double* table, double b) { return table[static_cast<std::ptrdiff_t>(b)]; }
  /// 1 / b, to single precision.
  static double single_inverse(double b) { return 1.0F / static_cast<float>(b); }
  /// What b >= 0 has beyond a whole number.
  static double fraction(double b) { return b - static_cast<double>(static_cast<std::ptrdiff_t>(b)); }
};

/// Functions of a direction (cosine, sine): those of any vector; src/simd/batch.hpp has cheaper ones for batches.
template <class T>
struct UnitVectors {
  static T atan2(const T& sine, const T& cosine) { return Trigonometry<T>::atan2(sine, cosine); }
};

/// Calls body(first, done) for blocks of `width` entries that cover [0, n); the last block may overlap the one before:
/// its first `done` entries have been dealt with.
template <std::ptrdiff_t width, class Body>
void for_blocks(std::ptrdiff_t n, const Body& body) {
  std::ptrdiff_t i = 0;
  for (; i + width <= n; i += width) body(i, std::ptrdiff_t{0});
  if (i < n) body(n - width, width - (n - i));
}

/// for_blocks for any n: body(first, zero of the lane type), blocks of one where there is no room for a whole block.
template <class B, class Body>
[[gnu::always_inline]] inline void for_any(std::ptrdiff_t n, const Body& body) {
  if (n >= Lanes<B>::count) for_blocks<Lanes<B>::count>(n, [&](std::ptrdiff_t i, std::ptrdiff_t) { body(i, B(0.0)); });
  else
    for (std::ptrdiff_t i = 0; i < n; ++i) body(i, 0.0);
}

/// Calls body(first, zero of the lane type) for blocks that cover [0, n) without touching any entry twice.
template <class B, class Body>
[[gnu::always_inline]] inline void for_each_once(std::ptrdiff_t n, const Body& body) {
  std::ptrdiff_t i = 0;
  for (; i + Lanes<B>::count <= n; i += Lanes<B>::count) body(i, B(0.0));
  for (; i < n; ++i) body(i, 0.0);
}

}  // namespace train_derail
