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
  /// Within pi / 4, as headings mostly are, the polynomials of xsimd (of Cephes, S. L. Moshier 1989) without the
  /// looking for quadrants: bit for bit the same.
  static void sine_cosine(const B& angle, B& sine, B& cosine) {
    if (!xsimd::any(xsimd::abs(angle) > B(0.78539816339744830962))) {
      const B z = angle * angle;
      const auto polynomial = [&z](double first, auto... coefficients) {
        B sum(first);
        ((sum = sum * z + coefficients), ...);
        return sum;
      };
      const B s = polynomial(0x1.5d8fd1fcf0ec1p-33, -0x1.ae5e5a9291691p-26, 0x1.71de3567d4896p-19,
                             -0x1.a01a019bfdf03p-13, 0x1.111111110f7d0p-7, -0x1.5555555555548p-3);
      const B c = polynomial(0x1.8ff831ad9b219p-37, -0x1.1eea7c1e514d4p-29, 0x1.27e4f8e06d9a5p-22,
                             -0x1.a01a019ddbcd9p-16, 0x1.6c16c16c15d47p-10, -0x1.5555555555551p-5, 0.5);
      sine = xsimd::fma(s * z, angle, angle);
      cosine = 1.0 - c * z;
      return;
    }
    const auto both = xsimd::sincos(angle);
    sine = both.first;
    cosine = both.second;
  }
};

/// Twice the arc tangent of tan(angle / 2), |angle| <= pi / 2, or that of its supplement: one division, where four cost
/// a fifth of the right-hand side (docs/performance_history.md). The polynomial is the Chebyshev fit of atan(sqrt(z)) /
/// sqrt(z) on [0, 1], 1e-16 off; the angle is off by a few units in the last place.
template <class Set>
struct UnitVectors<xsimd::batch<double, Set>> {
  using B = xsimd::batch<double, Set>;
  static B atan2(const B& sine, const B& cosine) {
    const B zero(0.0);
    const auto behind = cosine < zero;
    const B tangent = xsimd::abs(sine) / (1.0 + xsimd::abs(cosine)), z = tangent * tangent, w = z * z;
    const auto polynomial = [&w](double first, auto... coefficients) {
      B sum(first);
      ((sum = sum * w + coefficients), ...);
      return sum;
    };
    const B even = polynomial(0.00021423810738603946, 0.003751138483965141, 0.01671959606350739, 0.03387126702700675,
                              0.04668745304848529, 0.058768281144872724, 0.07692198997458294, 0.11111110578002083,
                              0.1999999999964796, 1.0);
    const B odd = polynomial(-1.93423475928923e-05, -0.0011252544302234645, -0.00899108054265826, -0.02556862364437174,
                             -0.040811247503178855, -0.052374234719188166, -0.06665764910689723, -0.09090899793217341,
                             -0.14285714266926733, -0.333333333333307);
    const B acute = 2.0 * tangent * (even + z * odd), angle = select(behind, 3.14159265358979323846 - acute, acute);
    return select(sine < zero, -angle, angle);
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
