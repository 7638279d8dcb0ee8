// Loops over cars that only roll along the track (model/planar_rolling.hpp): B is a double or a batch of them
// (simd/batch.hpp). Their trucks follow the rails, so that couplers are bars along the train, forces across it are not
// needed, and what acts along it is the same under both trucks.
#pragma once

#include "model/busy_cars.hpp"
#include "model/kernels_impl.hpp"
#include "model/truck_parts.hpp"
#include "train_derail/model/draft_gear_law.hpp"

namespace train_derail::model {

/// Where the bar of a coupler is, and how fast it grows.
template <class B>
struct Bar {
  B gap, rate, ux, uy;
};

/// Coupler i. `velocity` gives the velocity column c of car k.
template <class B, bool straight, class Velocity>
Bar<B> bar(const ExtendedArrays& a, const double* state, std::ptrdiff_t i, const Velocity& velocity) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars, j = i + 1;
  const B li = L::load(a.half_length + i), lj = L::load(a.half_length + j);
  const B dx = L::load(state + X * n + i) - L::load(state + X * n + j);
  if constexpr (straight) return {dx - li - lj, velocity(VX, i) - velocity(VX, j), B(1.0), B(0.0)};
  else {
    const B ci = L::load(a.cosine + i), si = L::load(a.sine + i), cj = L::load(a.cosine + j), sj = L::load(a.sine + j);
    const B gx = dx - li * ci - lj * cj;
    const B gy = L::load(state + Y * n + i) - L::load(state + Y * n + j) - li * si - lj * sj;
    const B squared = gx * gx + gy * gy, inverse = Roots<B>::inverse(squared), ux = gx * inverse, uy = gy * inverse;
    const B turn_i = velocity(OMEGA, i) * li, turn_j = velocity(OMEGA, j) * lj;
    const B rx = velocity(VX, i) + turn_i * si - velocity(VX, j) + turn_j * sj;
    const B ry = velocity(VY, i) - turn_i * ci - velocity(VY, j) - turn_j * cj;
    return {squared * inverse, rx * ux + ry * uy, ux, uy};
  }
}

/// Couplers behind them; widens `peaks`.
template <class B, bool straight>
[[gnu::flatten]] void roll_couplers(const ExtendedArrays& a, const double* state, CouplerPeaks& peaks) {
  const std::ptrdiff_t n = a.cars;
  Tally<B> buff, draft;
  for_within<B>(*a.rolling, n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t, auto zero) {
    using K = decltype(zero);
    using L = Lanes<K>;
    const std::ptrdiff_t j = i + 1;
    const Bar<K> b =
        bar<K, straight>(a, state, i, [&](Coordinate c, std::ptrdiff_t k) { return L::load(state + c * n + k); });
    const K spring = coupler_spring_force<K>(*a.coupler, b.gap);
    const K damper = coupler_damper_force<K>(L::load(a.couplers.damping + i), spring, b.rate);
    const auto alive = L::load(a.couplers.alive + i) > K(0.5);
    const K axial = select(alive, K(spring + damper), K(0.0)), fx = axial * b.ux;
    L::store(axial, a.couplers.axial + i);
    L::store(select(alive, damper, K(0.0)), a.couplers.damper + i);
    L::store(fx, a.pin_x + j);
    if constexpr (!straight) {
      const K fy = axial * b.uy;
      L::store(fy, a.pin_y + j);
      // The car behind may be one that does not only roll.
      const K by_x = L::load(a.sine + j) * fx, by_y = L::load(a.cosine + j) * fy;
      L::store(L::load(a.half_length + j) * (by_x - by_y), a.moment_trail + j);
    }
    buff.template widen<K>(axial);
    draft.template widen<K>(-axial);
  });
  if (buff.max() > peaks.buff) peaks.buff = buff.max();
  if (draft.max() > peaks.draft) peaks.draft = draft.max();
}

/// Where the parts keep the resistance along the track of a car's front truck; that of the rear one is the same.
inline double* rolling_resistance(const ExtendedArrays& a, std::ptrdiff_t k) {
  return a.trucks.kept + TruckParts::first<TrackResistance>() * 2 * a.cars + k;
}

/// Sums of forces on them, from couplers that have been dealt with.
template <class B, bool straight>
[[gnu::flatten]] void roll_cars(const ExtendedArrays& a, const double* state) {
  const std::ptrdiff_t n = a.cars;
  for_within<B>(*a.rolling, n, [&](std::ptrdiff_t k, std::ptrdiff_t, auto zero) {
    using K = decltype(zero);
    using L = Lanes<K>;
    const K pull_x = L::load(a.pin_x + k + 1) - L::load(a.pin_x + k), vx = L::load(state + VX * n + k);
    const K load = L::load(a.trucks.load + k);
    const auto sum = [&](const K& pull, const K& speed) {
      const K truck = friction<K>(L::load(a.brake_share + k) * load, speed, K(0.0), a.regularization_speed).x;
      L::store(truck, rolling_resistance(a, k));
      return K(pull + 2.0 * (truck - a.grade * load));
    };
    if constexpr (straight) {
      L::store(sum(pull_x, vx), a.fx + k);
      L::store(K(0.0), a.fy + k);
    } else {
      const K c = L::load(a.cosine + k), s = L::load(a.sine + k);
      const K pull_y = L::load(a.pin_y + k + 1) - L::load(a.pin_y + k), vy = L::load(state + VY * n + k);
      const K along = sum(pull_x * c + pull_y * s, vx * c + vy * s);
      L::store(along * c, a.fx + k);
      L::store(along * s, a.fy + k);
    }
    L::store(K(0.0), a.moment + k);
  });
}

/// Work of those forces; see ExtendedKernels::work.
template <class B, bool straight>
[[gnu::flatten]] void roll_work(const ExtendedArrays& a, const double* before, const double* after, double h,
                                EnergyLedger& spent) {
  const std::ptrdiff_t n = a.cars;
  Tally<B> track, grade, damping;
  for_within<B>(*a.rolling, n, [&](std::ptrdiff_t k, std::ptrdiff_t done, auto zero) {
    using K = decltype(zero);
    using L = Lanes<K>;
    const auto mid = [&](Coordinate c, std::ptrdiff_t car) {
      return K(0.5 * (L::load(before + c * n + car) + L::load(after + c * n + car)));
    };
    K along = mid(VX, k);
    if constexpr (!straight) along = along * L::load(a.cosine + k) + mid(VY, k) * L::load(a.sine + k);
    const K by_track = -2.0 * L::load(rolling_resistance(a, k)) * along,
            by_grade = 2.0 * a.grade * L::load(a.trucks.load + k) * along;
    const K fresh = fresh_lanes<K>(done);
    track.template add<K>(fresh * by_track);
    grade.template add<K>(fresh * by_grade);
  });
  for_within<B>(*a.rolling, n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t done, auto zero) {
    using K = decltype(zero);
    using L = Lanes<K>;
    const Bar<K> b = bar<K, straight>(a, before, i, [&](Coordinate c, std::ptrdiff_t k) {
      return K(0.5 * (L::load(before + c * n + k) + L::load(after + c * n + k)));
    });
    damping.template add<K>(fresh_lanes<K>(done) * (-L::load(a.couplers.damper + i) * b.rate));
  });
  spent.work_on_track += h * track.sum();
  spent.work_grade += h * grade.sum();
  spent.work_coupler_damping += h * damping.sum();
}

}  // namespace train_derail::model
