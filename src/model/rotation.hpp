/// \file
/// Rotations of rigid bodies, of several side by side: B is a double or a batch of them (simd/batch.hpp).
#pragma once

#include <cmath>
#include <cstddef>

#include "simd/blocks.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

/// A vector of each of several cars.
template <class B>
struct Three {
  B x, y, z;
  static Three load(const double* p, std::ptrdiff_t n) {
    return {Lanes<B>::load(p), Lanes<B>::load(p + n), Lanes<B>::load(p + 2 * n)};
  }
  void store(double* p, std::ptrdiff_t n) const {
    Lanes<B>::store(x, p);
    Lanes<B>::store(y, p + n);
    Lanes<B>::store(z, p + 2 * n);
  }
  Three operator+(const Three& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Three operator-(const Three& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Three operator*(const B& s) const { return {x * s, y * s, z * s}; }
  Three times(const Three& o) const { return {x * o.x, y * o.y, z * o.z}; }
  Three over(const Three& o) const { return {x / o.x, y / o.y, z / o.z}; }
  B dot(const Three& o) const { return x * o.x + y * o.y + z * o.z; }
  Three cross(const Three& o) const { return {y * o.z - z * o.y, z * o.x - x * o.z, x * o.y - y * o.x}; }
};

/// A unit quaternion of each.
template <class B>
struct Turn {
  Three<B> v;
  B w;
};

/// The rotation about `turn` by its length [rad]: by series that are exact to the last digit up to 0.2 rad.
template <class B>
Turn<B> turn_by(const Three<B>& turn) {
  const B s = 0.25 * turn.dot(turn), s2 = s * s;
  B ratio = (1.0 - s * (1.0 / 6.0)) + s2 * ((1.0 / 120.0 - s * (1.0 / 5040.0)) + s2 * (1.0 / 362880.0));
  B cosine = (1.0 - s * 0.5) + s2 * ((1.0 / 24.0 - s * (1.0 / 720.0)) + s2 * (1.0 / 40320.0 - s * (1.0 / 3628800.0)));
  const auto far = s > B(0.01);
  if (any(far)) {
    using std::sqrt;
    const B half = sqrt(select(far, s, B(1.0)));
    B sine(0.0), c(0.0);
    Trigonometry<B>::sine_cosine(half, sine, c);
    ratio = select(far, B(sine / half), ratio);
    cosine = select(far, c, cosine);
  }
  return {turn * B(0.5 * ratio), cosine};
}

/// A body's angular momentum along its own axes, once it has been turned by `by`: in space it stays what it was.
template <class B>
Three<B> turned_back(const Three<B>& spin, const Turn<B>& by) {
  const Three<B> twice = spin.cross(by.v) * B(2.0);
  return spin + twice * by.w + twice.cross(by.v);
}

/// Body rates by which a body with angular momentum `spin` (along its own axes) is to be turned in a step of length h
/// [s]: those of its middle. Turned by turn_by(h * result), its momentum is turned_back(); so that in space it stays
/// what it was, but for rounding. Energy swings by the order of h^2 and does not drift.
template <class B>
Three<B> mean_rates(const Three<B>& inertia, const Three<B>& spin, double h) {
  const B one(1.0);
  const Three<B> inverse = Three<B>{one, one, one}.over(inertia), begin = spin.times(inverse);
  // Euler's equations by the midpoint rule; each round is exact to one more order of h.
  Three<B> result = begin + spin.cross(begin).times(inverse) * B(0.5 * h);
  for (int i = 0; i < 2 && any(result.dot(result) * (h * h) > B(1e-10)); ++i)
    result = begin + inertia.times(result).cross(result).times(inverse) * B(0.5 * h);
  return result;
}

}  // namespace train_derail::model
