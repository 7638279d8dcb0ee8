// Functions for the wide kernels: of an angle by xsimd. The one place with the processor's own types.
#pragma once

#include <experimental/simd>

#include <immintrin.h>
#include <xsimd/xsimd.hpp>

#include "train_derail/model/lanes.hpp"

namespace train_derail::model {

using Wide = std::experimental::native_simd<double>;

template <>
struct Trigonometry<Wide> {
#ifdef __AVX512F__
  using Batch = xsimd::batch<double, xsimd::avx512f>;
#else
  using Batch = xsimd::batch<double, xsimd::fma3<xsimd::avx2>>;
#endif
  using Register = Batch::register_type;

  static Wide atan2(const Wide& y, const Wide& x) {
    return Wide(static_cast<Register>(xsimd::atan2(Batch(static_cast<Register>(y)), Batch(static_cast<Register>(x)))));
  }
  static void sine_cosine(const Wide& angle, Wide& sine, Wide& cosine) {
    const auto both = xsimd::sincos(Batch(static_cast<Register>(angle)));
    sine = Wide(static_cast<Register>(both.first));
    cosine = Wide(static_cast<Register>(both.second));
  }
};

#ifdef __AVX512F__
/// The processor's estimate (relative error below 2^-14) and the series of (1 - e)^(-1/2): to a unit in the last place.
/// Square roots and divisions of eight numbers took a third of the right-hand side on an Intel Xeon
/// (docs/performance.md).
template <>
struct Roots<Wide> {
  static Wide inverse(const Wide& x) {
    const Wide estimate(_mm512_rsqrt14_pd(static_cast<__m512d>(x)));
    const Wide e = 1.0 - x * estimate * estimate;
    return estimate + estimate * (e * (0.5 + e * (0.375 + e * 0.3125)));
  }
};
#endif

}  // namespace train_derail::model
