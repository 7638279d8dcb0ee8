// Several cars side by side: batches of xsimd for the instruction set that a kernel is compiled for. The type carries
// the set in its name, so that no inline function of one set can stand in for that of another.
#pragma once

#include <algorithm>
#include <cstddef>

#include <xsimd/xsimd.hpp>

#include "simd/blocks.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail {

template <class Set>
struct Lanes<xsimd::batch<double, Set>> {
  using B = xsimd::batch<double, Set>;
  static constexpr std::ptrdiff_t count = static_cast<std::ptrdiff_t>(B::size);
  static B load(const double* p) { return B::load_unaligned(p); }
  static void store(const B& b, double* p) { b.store_unaligned(p); }
  static double sum(const B& b) {
#if XSIMD_VERSION_MAJOR < 10
    return xsimd::hadd(b);
#else
    return xsimd::reduce_add(b);
#endif
  }
  static double max(const B& b) {
    double each[B::size];
    b.store_unaligned(each);
    return *std::max_element(each, each + B::size);
  }
  static B multiply_add(double a, const B& b, const B& c) { return xsimd::fma(B(a), b, c); }
  static B look_up(const double* table, const B& b) {
    double each[B::size];
    b.store_unaligned(each);
    for (double& place : each) place = table[static_cast<std::ptrdiff_t>(place)];
    return B::load_unaligned(each);
  }
  static B single_inverse(const B& b) {
    double each[B::size];
    b.store_unaligned(each);
    for (double& one : each) one = Lanes<double>::single_inverse(one);
    return B::load_unaligned(each);
  }
  static B fraction(const B& b) { return b - xsimd::trunc(b); }
};

template <class Set>
struct Trigonometry<xsimd::batch<double, Set>> {
  using B = xsimd::batch<double, Set>;
  static B atan2(const B& y, const B& x) { return xsimd::atan2(y, x); }
  static void sine_cosine(const B& angle, B& sine, B& cosine) {
    const auto both = xsimd::sincos(angle);
    sine = both.first;
    cosine = both.second;
  }
};

#ifdef __AVX512F__
/// The processor's estimate (relative error below 2^-14) and the series of (1 - e)^(-1/2): to a unit in the last place.
/// Square roots and divisions of eight numbers took a third of the right-hand side on an Intel Xeon
/// (docs/performance_history.md).
template <>
struct Roots<xsimd::batch<double, xsimd::avx512f>> {
  using B = xsimd::batch<double, xsimd::avx512f>;
  static B inverse(const B& x) {
    const B estimate(_mm512_rsqrt14_pd(static_cast<__m512d>(x)));
    const B e = 1.0 - x * estimate * estimate;
    return estimate + estimate * (e * (0.5 + e * (0.375 + e * 0.3125)));
  }
};
#endif
template <class Set>
struct Roots<xsimd::batch<double, Set>> {
  using B = xsimd::batch<double, Set>;
  static B inverse(const B& x) { return 1.0 / xsimd::sqrt(x); }
};

}  // namespace train_derail
