// The force laws are written once: for one double, for a number with its derivatives (Eigen::AutoDiffScalar) and for
// several cars side by side (a batch of xsimd, which brings its own select() and any()).
#pragma once

#include <cmath>

namespace train_derail {

/// `condition` ? a : b; of batches lane by lane.
template <class T>
T select(bool condition, const T& a, const T& b) {
  return condition ? a : b;
}

/// Whether the condition holds, of batches in any lane.
inline bool any(bool condition) { return condition; }

/// Functions of an angle: those of the standard library; src/simd/batch.hpp has them for batches.
template <class T>
struct Trigonometry {
  static T atan2(const T& y, const T& x) {
    using std::atan2;
    return atan2(y, x);
  }
  static void sine_cosine(const T& angle, T& sine, T& cosine) {
    using std::cos;
    using std::sin;
    sine = sin(angle);
    cosine = cos(angle);
  }
};

/// Inverse square root of positive numbers; src/simd/batch.hpp has it for batches.
template <class T>
struct Roots {
  static T inverse(const T& x) {
    using std::sqrt;
    return 1.0 / sqrt(x);
  }
};

}  // namespace train_derail
