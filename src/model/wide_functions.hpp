// Functions for the wide kernels: of an angle by SLEEF, to 3.5 units in the last place. The one place with the processor's own types.
#pragma once

#include <experimental/simd>

#include <immintrin.h>
#include <sleef.h>

#include "train_derail/model/lanes.hpp"

namespace train_derail::model {

using Wide = std::experimental::native_simd<double>;

template <>
struct Trigonometry<Wide> {
#ifdef __AVX512F__
  using Register = __m512d;
  static constexpr auto sleef_atan2 = Sleef_atan2d8_u35avx512f;
  static constexpr auto sleef_sincos = Sleef_sincosd8_u35avx512f;
#else
  using Register = __m256d;
  static constexpr auto sleef_atan2 = Sleef_atan2d4_u35avx2;
  static constexpr auto sleef_sincos = Sleef_sincosd4_u35avx2;
#endif

  static Wide atan2(const Wide& y, const Wide& x) {
    return Wide(sleef_atan2(static_cast<Register>(y), static_cast<Register>(x)));
  }
  static void sine_cosine(const Wide& angle, Wide& sine, Wide& cosine) {
    const auto both = sleef_sincos(static_cast<Register>(angle));
    sine = Wide(both.x);
    cosine = Wide(both.y);
  }
};

#ifdef __AVX512F__
/// The processor's estimate (relative error below 2^-14) and the series of (1 - e)^(-1/2): to a unit in the last place. Square roots
/// and divisions of eight numbers keep Intel's processors busy for three times as long as all other arithmetic of the kernels.
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
