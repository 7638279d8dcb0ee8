/// \file
/// How loops over columns of numbers are written once for one number at a time and for several side by side.
#pragma once

#include <cstddef>

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

/// Calls body(first, done) for blocks of `width` entries that cover [0, n); the last block may overlap the one before:
/// its first `done` entries have been dealt with.
template <std::ptrdiff_t width, class Body>
void for_blocks(std::ptrdiff_t n, const Body& body) {
  std::ptrdiff_t i = 0;
  for (; i + width <= n; i += width) body(i, std::ptrdiff_t{0});
  if (i < n) body(n - width, width - (n - i));
}

}  // namespace train_derail
