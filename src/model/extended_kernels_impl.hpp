// Templates of the loops: B is a double or a batch of them (simd/batch.hpp).
#pragma once

#include <cmath>

#include "model/extended_kernels.hpp"
#include "model/kernels_impl.hpp"
#include "model/rolling_kernels_impl.hpp"
#include "model/truck_parts.hpp"
#include "train_derail/model/brake_law.hpp"
#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"

namespace train_derail::model {

template <class B>
[[gnu::flatten]] CouplerPeaks couple(const ExtendedArrays& a, const double* state) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  const auto column = [&](Coordinate c, std::ptrdiff_t i) { return L::load(state + c * n + i); };
  const auto greater = [](const B& p, const B& q) { return select(p > q, p, q); };
  B buff(0.0), draft(0.0), cos_swing(1.0), end_moment(0.0);
  for_busy<L::count>(*a.busy, n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    const std::ptrdiff_t j = i + 1;
    const B ci = L::load(a.cosine + i), si = L::load(a.sine + i), cj = L::load(a.cosine + j), sj = L::load(a.sine + j);
    // From the centres to the pins.
    const B li = L::load(a.half_length + i), lj = L::load(a.half_length + j);
    const B ax = -li * ci, ay = -li * si, bx = lj * cj, by = lj * sj;
    const B dx = column(X, i) + ax - column(X, j) - bx, dy = column(Y, i) + ay - column(Y, j) - by;
    const auto b = coupler_load<B>(*a.coupler, a.cos_limit, dx, dy, ci, si, cj, sj);
    const B spring = coupler_spring_force<B>(*a.coupler, b.gap);
    const B rx = column(VX, i) - column(OMEGA, i) * ay - column(VX, j) + column(OMEGA, j) * by;
    const B ry = column(VY, i) + column(OMEGA, i) * ax - column(VY, j) - column(OMEGA, j) * bx;
    const B damper = coupler_damper_force<B>(L::load(a.couplers.damping + i), spring, rx * b.ux + ry * b.uy);
    const auto alive = L::load(a.couplers.alive + i) > B(0.5);
    const auto kept = [&](const B& value) { return select(alive, value, B(0.0)); };
    const B axial = kept(spring + damper);
    const B fx = axial * b.ux + kept(b.lateral * b.uy), fy = axial * b.uy - kept(b.lateral * b.ux);
    L::store(kept(b.ux), a.couplers.ux + i);
    L::store(kept(b.uy), a.couplers.uy + i);
    L::store(axial, a.couplers.axial + i);
    L::store(kept(damper), a.couplers.damper + i);
    const B lead = b.ux * ci + b.uy * si, trail = b.ux * cj + b.uy * sj;
    const B least = select(alive, select(lead < trail, lead, trail), B(1.0)),
            moments = kept(b.moment_lead + b.moment_trail);
    L::store(least, a.couplers.cos_swing + i);
    L::store(moments, a.couplers.end_moment + i);
    buff = greater(axial, buff);
    draft = greater(-axial, draft);
    cos_swing = select(least < cos_swing, least, cos_swing);
    end_moment = greater(greater(moments, -moments), end_moment);
    L::store(fx, a.pin_x + j);
    L::store(fy, a.pin_y + j);
    L::store(ax * fy - ay * fx + kept(b.moment_lead), a.moment_lead + j);
    L::store(by * fx - bx * fy + kept(b.moment_trail), a.moment_trail + j);
  });
  return {L::max(buff), L::max(draft), -L::max(-cos_swing), L::max(end_moment)};
}

template <class B, bool straight>
[[gnu::flatten]] CouplerPeaks forces_on(const ExtendedArrays& a, const double* state) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  CouplerPeaks peaks = couple<B>(a, state);
  roll_couplers<B, straight>(a, state, peaks);
  for_busy<L::count>(*a.busy, n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B c = L::load(a.cosine + k), s = L::load(a.sine + k), w = L::load(state + OMEGA * n + k);
    const B vx = L::load(state + VX * n + k), vy = L::load(state + VY * n + k);
    // Coupler k - 1 pulls at the front of car k, coupler k at its rear; the ends of the train have none (zeros).
    B fx = L::load(a.pin_x + k + 1) - L::load(a.pin_x + k);
    B fy = L::load(a.pin_y + k + 1) - L::load(a.pin_y + k);
    B moment = L::load(a.moment_lead + k + 1) + L::load(a.moment_trail + k);
    for (const std::ptrdiff_t end : {std::ptrdiff_t{0}, n}) {
      const B arm = end == 0 ? L::load(a.half_spacing + k) : B(-L::load(a.half_spacing + k));
      const B rx = arm * c, ry = arm * s;
      const TruckView<B, straight> truck(a, k, end + k, c, s, vx, vy, w, rx, ry);
      const Pull<B> pull = TruckParts::pull(truck);
      fx = fx + pull.x;
      fy = fy + pull.y;
      moment = moment + rx * pull.y - ry * pull.x;
    }
    L::store(fx, a.fx + k);
    L::store(fy, a.fy + k);
    L::store(moment, a.moment + k);
  });
  roll_cars<B, straight>(a, state);
  return peaks;
}

template <class B>
CouplerPeaks extended_forces(const ExtendedArrays& a, const double* state) {
  return a.straight ? forces_on<B, true>(a, state) : forces_on<B, false>(a, state);
}

template <class B, bool straight>
[[gnu::flatten]] void work_on(const ExtendedArrays& a, const double* before, const double* after, double h,
                              EnergyLedger& spent) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  // Velocities with which the forces of the step did their work.
  const auto mid = [&](Coordinate c, std::ptrdiff_t k) {
    return B(0.5) * (L::load(before + c * n + k) + L::load(after + c * n + k));
  };
  B taken[TruckParts::count];
  for (B& sum : taken) sum = B(0.0);
  for_busy<L::count>(*a.busy, n, [&](std::ptrdiff_t k, std::ptrdiff_t done) {
    const B fresh = fresh_lanes<B>(done);
    const B c = L::load(a.cosine + k), s = L::load(a.sine + k);
    const B vx = mid(VX, k), vy = mid(VY, k), w = mid(OMEGA, k);
    for (const std::ptrdiff_t end : {std::ptrdiff_t{0}, n}) {
      const B arm = end == 0 ? L::load(a.half_spacing + k) : B(-L::load(a.half_spacing + k));
      TruckParts::add_taken(TruckView<B, straight>(a, k, end + k, c, s, vx, vy, w, arm * c, arm * s), fresh, taken);
    }
  });
  TruckParts::account(h, taken, spent);
  B damping(0.0);
  for_busy<L::count>(*a.busy, n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t done) {
    const std::ptrdiff_t j = i + 1;
    const B fresh = fresh_lanes<B>(done);
    const B li = L::load(a.half_length + i), lj = L::load(a.half_length + j);
    const B rx =
        mid(VX, i) + mid(OMEGA, i) * li * L::load(a.sine + i) - mid(VX, j) + mid(OMEGA, j) * lj * L::load(a.sine + j);
    const B ry = mid(VY, i) - mid(OMEGA, i) * li * L::load(a.cosine + i) - mid(VY, j) -
                 mid(OMEGA, j) * lj * L::load(a.cosine + j);
    damping = damping - fresh * L::load(a.couplers.damper + i) *
                            (rx * L::load(a.couplers.ux + i) + ry * L::load(a.couplers.uy + i));
  });
  spent.work_coupler_damping += h * L::sum(damping);
  roll_work<B, straight>(a, before, after, h, spent);
}

template <class B>
void extended_work(const ExtendedArrays& a, const double* before, const double* after, double h, EnergyLedger& spent) {
  if (a.straight) work_on<B, true>(a, before, after, h, spent);
  else work_on<B, false>(a, before, after, h, spent);
}

template <class B>
[[gnu::flatten]] void accelerate(const ExtendedArrays& a, double* result) {
  const std::ptrdiff_t n = a.cars;
  for (const BusyCars* cars : {a.busy, a.rolling}) {
    for_within<B>(*cars, n, [&](std::ptrdiff_t k, std::ptrdiff_t, auto zero) {
      using L = Lanes<decltype(zero)>;
      L::store(L::load(a.fx + k) * L::load(a.inverse_mass + k), result + k);
      L::store(L::load(a.fy + k) * L::load(a.inverse_mass + k), result + n + k);
      L::store(L::load(a.moment + k) * L::load(a.inverse_inertia + k), result + 2 * n + k);
    });
  }
}

template <class B>
[[gnu::flatten]] void brake(std::ptrdiff_t cars, const inputs::Brakes& law, double t, const double* ratio,
                            const double* signal, double* share) {
  using L = Lanes<B>;
  for_blocks<L::count>(cars, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B built = brake_build_up<B>(law, t - L::load(signal + k));
    L::store(law.rolling_resistance + L::load(ratio + k) * built, share + k);
  });
}

template <class B>
[[gnu::flatten]] double fastest_point(std::ptrdiff_t cars, const double* vx, const double* vy, const double* omega,
                                      const double* vx_known, const double* vy_known, const double* radius) {
  using L = Lanes<B>;
  const auto size = [](const B& x) { return select(x < B(0.0), B(-x), x); };
  B fastest(0.0);
  for_blocks<L::count>(cars, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B along = size(L::load(vx + k) - L::load(vx_known + k)),
            across = size(L::load(vy + k) - L::load(vy_known + k));
    const B speed = along + across + L::load(radius + k) * size(L::load(omega + k));
    fastest = select(speed > fastest, speed, fastest);
  });
  return L::max(fastest);
}

/// Of one block. Not shared between instruction sets, as a function that is not inlined would be.
template <class B>
[[gnu::flatten]] static void turn_at(const ExtendedArrays& a, const double* before, const double* after,
                                     std::ptrdiff_t k) {
  using L = Lanes<B>;
  static constexpr double kSmall = 0.05;  // rad, below which the series are exact to rounding
  const B d = L::load(after + THETA * a.cars + k) - L::load(before + THETA * a.cars + k), d2 = d * d;
  B c = 1.0 + d2 * (-0.5 + d2 * (1.0 / 24.0 + d2 * (-1.0 / 720.0 + d2 * (1.0 / 40320.0))));
  B s = d * (1.0 + d2 * (-1.0 / 6.0 + d2 * (1.0 / 120.0 + d2 * (-1.0 / 5040.0))));
  if (any(d2 > B(kSmall * kSmall))) Trigonometry<B>::sine_cosine(d, s, c);
  const B c0 = L::load(a.cosine + k), s0 = L::load(a.sine + k);
  const B c1 = c0 * c - s0 * s, s1 = s0 * c + c0 * s;
  const B unit = 1.5 - 0.5 * (c1 * c1 + s1 * s1);  // rounding must not pile up
  L::store(c1 * unit, a.cosine + k);
  L::store(s1 * unit, a.sine + k);
}

template <class B>
[[gnu::flatten]] void turn(const ExtendedArrays& a, const double* before, const double* after) {
  for_each_busy<B>(*a.busy, a.cars, [&](std::ptrdiff_t k, auto zero) {  // not twice: a turn is not idempotent
    turn_at<decltype(zero)>(a, before, after, k);
  });
  if (a.straight) return;
  for_each_busy<B>(*a.rolling, a.cars,
                   [&](std::ptrdiff_t k, auto zero) { turn_at<decltype(zero)>(a, before, after, k); });
}

template <class B>
[[gnu::flatten]] void places(const ExtendedArrays& a, const double* state, double* px, double* py) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  for_busy<L::count>(*a.busy, n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B x = L::load(state + X * n + k), y = L::load(state + Y * n + k), d = L::load(a.half_spacing + k);
    const B rx = d * L::load(a.cosine + k), ry = d * L::load(a.sine + k);
    L::store(x + rx, px + k);
    L::store(y + ry, py + k);
    L::store(x - rx, px + n + k);
    L::store(y - ry, py + n + k);
  });
}

template <class B>
[[gnu::flatten]] bool overload(const BusyCars& trucks, const inputs::Rails& rails, double h, const double* before,
                               const double* now, const double* load, double* overloaded) {
  Tally<B> longest;
  for_each_busy<B>(trucks, [&](std::ptrdiff_t i, auto zero) {  // not twice: it counts
    using K = decltype(zero);
    using L = Lanes<K>;
    const K time =
        overloaded_time<K>(rails, L::load(before + i), L::load(now + i), L::load(load + i), h, L::load(overloaded + i));
    L::store(time, overloaded + i);
    longest.template widen<K>(time);
  });
  return longest.max() > rails.derail_time;
}

template <class B>
[[gnu::flatten]] OnBadTrack on_bad_track(const BusyCars& trucks, const double* held, const double* before,
                                         const double* now, double from, double to) {
  using L = Lanes<B>;
  const B zero(0.0);
  B passes(0.0), torn(0.0);
  for_busy<L::count>(trucks, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    const B is_held = L::load(held + i), was = L::load(before + i), is = L::load(now + i);
    passes = passes + select(was < zero, select(is >= zero, is_held, zero), zero);
    torn = torn + select(is >= B(from), select(is <= B(to), is_held, zero), zero);
  });
  return {L::sum(passes) > 0.0, L::sum(torn) > 0.0};
}

/// Bins of a table that places s lie in, kept within [0, last]; also if s is not a number.
template <class B>
B bin_of(const TrackTable& table, const B& s) {
  const B b = table.bin(s), inside = select(b > B(0.0), b, B(0.0));
  return select(inside > B(table.last), B(table.last), inside);
}

template <class B>
[[gnu::flatten]] void locate(std::ptrdiff_t cars, const BusyCars& busy, const TrackLine& line, const double* px,
                             const double* py, const double* before, const TruckPlaces& found) {
  using L = Lanes<B>;
  // Newton's method: what is left after a pass is that pass times offset / radius.
  static constexpr double kFarAhead = 1e-4;  // m
  static constexpr int kPasses = 20;
  const double per_bin = 1.0 / line.bin;
  const auto size = [](const B& x) { return select(x < B(0.0), B(-x), x); };
  const auto at = [&](std::ptrdiff_t i) {
    const B x = L::load(px + i), y = L::load(py + i);
    B s = L::load(before + i), ahead(0.0), offset(0.0), tx(1.0), ty(0.0);
    for (int pass = 0; pass < kPasses; ++pass) {
      const B place = (s - B(line.from)) * B(per_bin), inside = select(place > B(0.0), place, B(0.0));
      const B kept = select(inside > B(line.last), B(line.last), inside), share = L::fraction(kept);
      const B first = B(4.0) * (kept - share);
      const auto node = [&](int column) { return L::look_up(line.nodes + column, first); };
      const B ax = node(0), ay = node(1), atx = node(2), aty = node(3);
      const B dtx = node(6) - atx, dty = node(7) - aty;
      const B ux = atx + share * dtx, uy = aty + share * dty, unit = Roots<B>::inverse(ux * ux + uy * uy);
      tx = ux * unit;
      ty = uy * unit;
      // Between two nodes an arc bulges from its chord, against the way it turns.
      const B bulge = B(-0.5 * line.bin) * share * (B(1.0) - share);
      const B beyond = s - (B(line.from) + kept * B(line.bin));
      const B rx = x - (ax + share * (node(4) - ax) + bulge * dtx + beyond * tx);
      const B ry = y - (ay + share * (node(5) - ay) + bulge * dty + beyond * ty);
      ahead = rx * tx + ry * ty;
      offset = ry * tx - rx * ty;
      s = s + ahead;
      if (!any(size(ahead) > B(kFarAhead))) break;
    }
    L::store(s, found.arc + i);
    L::store(offset, found.offset + i);
    L::store(tx, found.tangent_x + i);
    L::store(ty, found.tangent_y + i);
  };
  for_busy<L::count>(busy, cars, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    at(k);
    at(cars + k);
  });
}

template <class B>
[[gnu::flatten]] void subtract_alignment(const BusyCars& trucks, const TrackTable& table, const double* s,
                                         const double* held, double* offset) {
  for_each_busy<B>(trucks, [&](std::ptrdiff_t i, auto lanes) {  // not twice: it subtracts
    using One = decltype(lanes);
    using K = Lanes<One>;
    if (!any(K::load(held + i) > One(0.0))) return;
    const One bin = bin_of<One>(table, K::load(s + i));
    const One first = K::look_up(table.values, bin), next = K::look_up(table.values + 1, bin);
    K::store(K::load(offset + i) - K::load(held + i) * (first + K::fraction(bin) * (next - first)), offset + i);
  });
}

template <class B>
[[gnu::flatten]] bool any_torn(const BusyCars& trucks, const TrackTable& torn, const double* s, const double* held) {
  using L = Lanes<B>;
  const B zero(0.0);
  B sum(0.0);
  for_busy<L::count>(trucks, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    if (!any(L::load(held + i) > zero)) return;
    const B place = L::load(s + i), bin = torn.bin(place);
    const B value = L::load(held + i) * L::look_up(torn.values, bin_of<B>(torn, place));
    sum = sum + select(bin >= zero, select(bin < B(torn.last + 1.0), value, zero), zero);
  });
  return L::sum(sum) > 0.0;
}

template <class B>
constexpr ExtendedKernels extended_kernels(const char* instruction_set) {
  return {planar_kernels<B>(instruction_set),
          extended_forces<B>,
          extended_work<B>,
          accelerate<B>,
          brake<B>,
          fastest_point<B>,
          turn<B>,
          places<B>,
          overload<B>,
          on_bad_track<B>,
          locate<B>,
          subtract_alignment<B>,
          any_torn<B>};
}

}  // namespace train_derail::model
