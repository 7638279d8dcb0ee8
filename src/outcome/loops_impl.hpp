/// \file
/// Templates of the loops: B is a double or a batch of them (simd/batch.hpp). No entry that is read is written in a
/// block that may overlap the one before, but where it stays the same the second time.
#pragma once

#include <limits>
#include <type_traits>

#include "outcome/loops.hpp"
#include "simd/blocks.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::outcome {

template <class B>
B square(const B& x) {
  return x * x;
}
template <class B>
B size_of(const B& x) {
  return select(x < B(0.0), B(-x), x);
}
template <class B>
B larger(const B& a, const B& b) {
  return select(a > b, a, b);
}

/// A point ahead of the centre by d moves with v + omega d (-sine, cosine), one behind it with the other sign.
template <class B>
[[gnu::flatten]] double truck_speed_squared_max(std::ptrdiff_t n, const MonitoredCars& c) {
  double most = 0.0;
  B wide(0.0);
  for_any<B>(n, [&](std::ptrdiff_t k, auto zero) {
    using V = decltype(zero);
    using L = Lanes<V>;
    const V arm = L::load(c.half_spacing + k) * L::load(c.omega + k);
    const V u = arm * L::load(c.sine + k), v = arm * L::load(c.cosine + k);
    const V vx = L::load(c.vx + k), vy = L::load(c.vy + k);
    const V faster = larger<V>(square<V>(vx - u) + square<V>(vy + v), square<V>(vx + u) + square<V>(vy - v));
    if constexpr (std::is_same_v<V, B>) wide = larger<B>(faster, wide);
    else most = larger<double>(faster, most);
  });
  return larger<double>(Lanes<B>::max(wide), most);
}

template <class B>
[[gnu::flatten]] void extend_astray(std::ptrdiff_t n, const MonitoredCars& c, double* astray) {
  for_any<B>(n, [&](std::ptrdiff_t k, auto zero) {
    using V = decltype(zero);
    using L = Lanes<V>;
    const V now = size_of<V>(L::load(c.y + k)) + L::load(c.half_spacing + k) * size_of<V>(L::load(c.sine + k));
    L::store(larger<V>(now, L::load(astray + k)), astray + k);
  });
}

template <class B>
[[gnu::flatten]] void neighbour_speeds(std::ptrdiff_t n, const MonitoredCars& c, double* pins, double* centres) {
  for_any<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using V = decltype(zero);
    using L = Lanes<V>;
    const std::ptrdiff_t j = i + 1;
    const V u = L::load(c.vx + i) - L::load(c.vx + j), v = L::load(c.vy + i) - L::load(c.vy + j);
    const V lead = L::load(c.half_length + i) * L::load(c.omega + i);
    const V trail = L::load(c.half_length + j) * L::load(c.omega + j);
    L::store(u * u + v * v, centres + i);
    L::store(square<V>(u + lead * L::load(c.sine + i) + trail * L::load(c.sine + j)) +
                 square<V>(v - lead * L::load(c.cosine + i) - trail * L::load(c.cosine + j)),
             pins + i);
  });
}

template <class B>
[[gnu::flatten]] double largest_of(std::ptrdiff_t n, const double* values) {
  double most = 0.0;
  B wide(0.0);
  for_any<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using V = decltype(zero);
    if constexpr (std::is_same_v<V, B>) wide = larger<B>(Lanes<V>::load(values + i), wide);
    else most = larger<double>(values[i], most);
  });
  return larger<double>(Lanes<B>::max(wide), most);
}

template <class B>
[[gnu::flatten]] void boxes(std::ptrdiff_t n, const MonitoredCars& car, double* rearmost, double* foremost,
                            double* half_breadth) {
  for_any<B>(n, [&](std::ptrdiff_t k, auto zero) {
    using V = decltype(zero);
    using L = Lanes<V>;
    const V c = size_of<V>(L::load(car.cosine + k)), s = size_of<V>(L::load(car.sine + k)), x = L::load(car.x + k);
    const V length = L::load(car.half_length + k), width = L::load(car.half_width + k);
    const V reach = length * c + width * s;
    L::store(x - reach, rearmost + k);
    L::store(x + reach, foremost + k);
    L::store(length * s + width * c, half_breadth + k);
  });
}

template <class B>
[[gnu::flatten]] void widen(std::ptrdiff_t n, const double* value, double t, const Extremes& e) {
  for_any<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using V = decltype(zero);
    using L = Lanes<V>;
    const V now = L::load(value + i), highest = L::load(e.highest + i), lowest = L::load(e.lowest + i);
    if (!any(now > highest) && !any(now < lowest)) return;  // as in most steps
    L::store(select(now > highest, V(t), L::load(e.highest_time + i)), e.highest_time + i);
    L::store(select(now > highest, now, highest), e.highest + i);
    L::store(select(now < lowest, V(t), L::load(e.lowest_time + i)), e.lowest_time + i);
    L::store(select(now < lowest, now, lowest), e.lowest + i);
  });
}

/// What the gaps at i cannot have left. A cubic leaves the range of its ends by no more than 4 / 27 of the step times
/// either rate.
template <class B, class V>
[[gnu::always_inline]] inline void reach_of(const GapStep& s, std::ptrdiff_t i, V& least, V& most) {
  using L = Lanes<V>;
  const V from = L::load(s.from + i), to = L::load(s.to + i);
  const V beyond = 4.0 / 27.0 * s.h * (size_of<V>(L::load(s.rate_from + i)) + size_of<V>(L::load(s.rate_to + i)));
  least = select(from < to, from, to) - beyond;
  most = larger<V>(from, to) + beyond;
}

template <class B>
[[gnu::flatten]] GapRange reach(std::ptrdiff_t n, const GapStep& s) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  GapRange range{infinite, -infinite};
  B lowest(infinite), highest(-infinite);
  for_any<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using V = decltype(zero);
    V least, most;
    reach_of<B>(s, i, least, most);
    if constexpr (std::is_same_v<V, B>) {
      lowest = select(least < lowest, least, lowest);
      highest = larger<B>(most, highest);
    } else {
      range = {least < range.least ? least : range.least, larger<double>(most, range.most)};
    }
  });
  return {-larger<double>(Lanes<B>::max(-lowest), -range.least), larger<double>(Lanes<B>::max(highest), range.most)};
}

template <class B>
[[gnu::flatten]] bool can_turn_beyond(std::ptrdiff_t n, const GapStep& s, const Extremes& e) {
  bool can = false;
  for_any<B>(n, [&](std::ptrdiff_t i, auto zero) {
    using V = decltype(zero);
    using L = Lanes<V>;
    const auto turns = L::load(s.rate_from + i) * L::load(s.rate_to + i) < zero;
    if (!any(turns)) return;
    V least, most;
    reach_of<B>(s, i, least, most);
    can = can || any(turns && (-least > L::load(e.highest + i) || -most < L::load(e.lowest + i)));
  });
  return can;
}

template <class B>
constexpr MonitorLoops make_loops(const char* instruction_set) {
  return {instruction_set,
          Lanes<B>::count,
          truck_speed_squared_max<B>,
          extend_astray<B>,
          neighbour_speeds<B>,
          largest_of<B>,
          boxes<B>,
          widen<B>,
          reach<B>,
          can_turn_beyond<B>};
}

}  // namespace train_derail::outcome
