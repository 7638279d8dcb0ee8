// The force laws are written once, for one double, for a number with its derivatives (Eigen::AutoDiffScalar) and for
// several cars side by side (std::experimental::simd, the parallelism TS of the standard library).
#pragma once

#include <cmath>
#include <cstddef>
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

/// atan2(y, x) where `condition` holds, elsewhere 0. A batch goes lane by lane: few lanes hold.
template <class Condition, class T>
T atan2_where(const Condition& condition, const T& y, const T& x) {
  using std::atan2;
  if constexpr (std::is_same_v<Condition, bool>) {
    return condition ? T(atan2(y, x)) : T(0.0);
  } else {
    T angle(0.0);
    for (std::size_t i = 0; i < T::size(); ++i) {
      if (condition[i]) angle[i] = atan2(double(y[i]), double(x[i]));
    }
    return angle;
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

}  // namespace train_derail::model
