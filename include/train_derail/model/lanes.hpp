// The force laws are written once, for one double, for a number with its derivatives (Eigen::AutoDiffScalar) and for
// several cars side by side (std::experimental::simd, the parallelism TS of the standard library).
#pragma once

#include <cmath>
#include <type_traits>

namespace train_derail::model {

/// `condition` ? a : b, lane by lane.
template <class Condition, class T>
T select(const Condition& condition, const T& a, const T& b) {
  if constexpr (std::is_same_v<Condition, bool>) {
    return condition ? a : b;
  } else {
    T result = b;
    where(condition, result) = a;
    return result;
  }
}

template <class Condition>
bool any(const Condition& condition) {
  if constexpr (std::is_same_v<Condition, bool>) {
    return condition;
  } else {
    return any_of(condition);
  }
}

/// Functions of an angle: those of the standard library, or of whoever specialises this for his batches.
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

/// Of positive numbers; again to be specialised for batches.
template <class T>
struct Roots {
  static T inverse(const T& x) {
    using std::sqrt;
    return 1.0 / sqrt(x);
  }
};

/// atan2(y, x) where `condition` holds, elsewhere 0.
template <class Condition, class T>
T atan2_where(const Condition& condition, const T& y, const T& x) {
  if (!any(condition)) return T(0.0);
  return select(condition, T(Trigonometry<T>::atan2(y, x)), T(0.0));
}

}  // namespace train_derail::model
