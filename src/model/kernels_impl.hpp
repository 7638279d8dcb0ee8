// Templates of the kernels: B is a double or a batch of them (simd/batch.hpp).
#pragma once

#include <cmath>

#include "model/kernels.hpp"
#include "model/reactions.hpp"
#include "simd/blocks.hpp"
#include "train_derail/model/state_layout.hpp"

namespace train_derail::model {

template <class B>
[[gnu::flatten]] void headings(std::ptrdiff_t n, const double* theta, double* cosine, double* sine) {
  using L = Lanes<B>;
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    B s, c;
    Trigonometry<B>::sine_cosine(L::load(theta + k), s, c);
    L::store(c, cosine + k);
    L::store(s, sine + k);
  });
}

/// What the laws need of inputs::Coupler, without its texts: a copy that stays in registers.
template <class B>
struct LawNumbers {
  explicit LawNumbers(const inputs::Coupler& c)
      : length(c.length),
        slack(c.slack),
        stiffness(c.stiffness),
        swing_limit(c.swing_limit),
        swing_stiffness(c.swing_stiffness),
        swing_moment_max(c.swing_moment_max) {}
  double length, slack, stiffness, swing_limit, swing_stiffness, swing_moment_max;
};

template <class B, bool whole>
[[gnu::flatten]] bool right_hand_side(const DerailmentArrays& arrays, const double* state, double* rate) {
  using L = Lanes<B>;
  // Copies, which no store through a pointer can change: they stay in registers.
  const DerailmentArrays a = arrays;
  const LawNumbers<B> coupler(*a.coupler);
  const std::ptrdiff_t n = a.cars;
  const double *x = state + X * n, *y = state + Y * n;
  const double *vx = state + VX * n, *vy = state + VY * n, *omega = state + OMEGA * n;

  headings<B>(n, state + THETA * n, a.cosine, a.sine);
  for_blocks<L::count>(n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    with_coupler_reaction<B>(coupler, a.cos_limit, L::load(a.half_length + i), L::load(a.half_length + i + 1),
                             L::load(x + i) - L::load(x + i + 1), L::load(y + i) - L::load(y + i + 1),
                             L::load(a.cosine + i), L::load(a.sine + i), L::load(a.cosine + i + 1),
                             L::load(a.sine + i + 1), [&](const CouplerReaction<B>& r) {
                               L::store(r.fx, a.pin_x + i + 1);
                               L::store(r.fy, a.pin_y + i + 1);
                               L::store(r.moment_lead, a.moment_lead + i + 1);
                               L::store(r.moment_trail, a.moment_trail + i + 1);
                             });
  });

  static constexpr double kLane[] = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
  static_assert(L::count <= 8);
  B power_all(0.0), power_off_track(0.0), all(0.0);  // powers are what the ground gives: negative
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t done) {
    const B u = L::load(vx + k), v = L::load(vy + k), w = L::load(omega + k);
    const auto g = ground_reaction<B>(L::load(a.load + k), L::load(a.lateral + k), L::load(a.half_spacing + k),
                                      a.regularization_speed, L::load(a.cosine + k), L::load(a.sine + k), u, v, w);
    B power = g.fx * u + g.fy * v + g.moment * w;
    if (done > 0) power = select(L::load(kLane) < B(static_cast<double>(done)), B(0.0), power);
    power_all = power_all + power;
    power_off_track = power_off_track + L::load(a.past_pod + k) * power;

    // Coupler k - 1 pulls at the front of car k, coupler k at its rear; the ends of the train have none (zeros).
    const B fx = g.fx + L::load(a.pin_x + k + 1) - L::load(a.pin_x + k);
    const B fy = g.fy + L::load(a.pin_y + k + 1) - L::load(a.pin_y + k);
    const B moment = g.moment + L::load(a.moment_lead + k + 1) + L::load(a.moment_trail + k);
    if constexpr (whole) {
      L::store(u, rate + X * n + k);
      L::store(v, rate + Y * n + k);
      L::store(w, rate + THETA * n + k);
    }
    const B alpha = moment * L::load(a.inverse_inertia + k);
    L::store(fx * L::load(a.inverse_mass + k), rate + VX * n + k);
    L::store(fy * L::load(a.inverse_mass_y + k), rate + VY * n + k);
    L::store(alpha, rate + OMEGA * n + k);
    all = all + alpha;
  });
  const double off_track = L::sum(power_off_track), ground = L::sum(power_all);
  rate[kCoordinates * n + WORK_ON_TRACK] = off_track - ground;
  rate[kCoordinates * n + WORK_OFF_TRACK] = -off_track;
  // A velocity that is not finite makes the friction so, and that its own power; a coupler's force that is not finite
  // makes its moments so.
  return std::isfinite(L::sum(all) + ground);
}

template <class B>
[[gnu::flatten]] void gaps(const PlanarArrays& a, const double* state, double* gap, double* rate) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  headings<B>(n, state + THETA * n, a.cosine, a.sine);
  const auto difference = [&](Coordinate c, std::ptrdiff_t i) {
    const double* column = state + c * n + i;
    return L::load(column) - L::load(column + 1);
  };
  for_blocks<L::count>(n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    const B lead = L::load(a.half_length + i), trail = L::load(a.half_length + i + 1);
    const B lead_x = lead * L::load(a.cosine + i), trail_x = trail * L::load(a.cosine + i + 1);
    const B lead_y = lead * L::load(a.sine + i), trail_y = trail * L::load(a.sine + i + 1);
    const B lead_omega = L::load(state + OMEGA * n + i), trail_omega = L::load(state + OMEGA * n + i + 1);
    const B dx = difference(X, i) - lead_x - trail_x, dy = difference(Y, i) - lead_y - trail_y;
    const B du = difference(VX, i) + lead_omega * lead_y + trail_omega * trail_y;
    const B dv = difference(VY, i) - lead_omega * lead_x - trail_omega * trail_x;
    const B squared = dx * dx + dy * dy, inverse = Roots<B>::inverse(squared);
    L::store(squared * inverse, gap + i);
    L::store((dx * du + dy * dv) * inverse, rate + i);
  });
}

template <class B>
[[gnu::flatten]] double foremost(const DerailmentArrays& a, const double* state) {
  using L = Lanes<B>;
  B most(-inputs::kInfinity);
  for_blocks<L::count>(a.cars, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B place = select(L::load(a.past_pod + k) > B(0.0), B(-inputs::kInfinity), L::load(state + X * a.cars + k));
    most = select(place > most, place, most);
  });
  return L::max(most);
}

template <class B>
constexpr PlanarKernels planar_kernels(const char* instruction_set) {
  return {instruction_set, Lanes<B>::count, headings<B>, gaps<B>};
}

template <class B>
constexpr DerailmentKernels derailment_kernels(const char* instruction_set) {
  return {planar_kernels<B>(instruction_set), right_hand_side<B, true>, right_hand_side<B, false>, foremost<B>};
}

}  // namespace train_derail::model
