// Templates of the loops: B is a double or a batch of them (model/batch.hpp).
#pragma once

#include <cmath>

#include "model/extended_kernels.hpp"
#include "model/kernels_impl.hpp"
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
  for_blocks<L::count>(n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    const std::ptrdiff_t j = i + 1;
    const B ci = L::load(a.cosine + i), si = L::load(a.sine + i), cj = L::load(a.cosine + j), sj = L::load(a.sine + j);
    // From the centres to the pins.
    const B li = L::load(a.half_length + i), lj = L::load(a.half_length + j);
    const B ax = -li * ci, ay = -li * si, bx = lj * cj, by = lj * sj;
    const B dx = column(X, i) + ax - column(X, j) - bx, dy = column(Y, i) + ay - column(Y, j) - by;
    const auto b = coupler_load<B>(*a.law, a.cos_limit, dx, dy, ci, si, cj, sj);
    const B spring = coupler_spring_force<B>(*a.law, b.gap);
    const B rx = column(VX, i) - column(OMEGA, i) * ay - column(VX, j) + column(OMEGA, j) * by;
    const B ry = column(VY, i) + column(OMEGA, i) * ax - column(VY, j) - column(OMEGA, j) * bx;
    const B damper = coupler_damper_force<B>(L::load(a.damping + i), spring, rx * b.ux + ry * b.uy);
    const auto alive = L::load(a.alive + i) > B(0.5);
    const auto kept = [&](const B& value) { return select(alive, value, B(0.0)); };
    const B axial = kept(spring + damper);
    const B fx = axial * b.ux + kept(b.lateral * b.uy), fy = axial * b.uy - kept(b.lateral * b.ux);
    L::store(kept(b.ux), a.ux + i);
    L::store(kept(b.uy), a.uy + i);
    L::store(axial, a.axial + i);
    L::store(kept(damper), a.damper + i);
    const B lead = b.ux * ci + b.uy * si, trail = b.ux * cj + b.uy * sj;
    const B least = select(alive, select(lead < trail, lead, trail), B(1.0)),
            moments = kept(b.moment_lead + b.moment_trail);
    L::store(least, a.cos_swing + i);
    L::store(moments, a.end_moment + i);
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

/// Directions along the rails and to their left at some trucks.
template <class B, bool straight>
struct RailFrame {
  B tx, ty;
  RailFrame(const ExtendedArrays& a, std::ptrdiff_t truck) {
    if constexpr (!straight) {
      tx = Lanes<B>::load(a.tangent_x + truck);
      ty = Lanes<B>::load(a.tangent_y + truck);
    }
  }
  B along(const B& x, const B& y) const {
    if constexpr (straight) return x;
    else return x * tx + y * ty;
  }
  B across(const B& x, const B& y) const {
    if constexpr (straight) return y;
    else return y * tx - x * ty;
  }
  B x(const B& along, const B& across) const {
    if constexpr (straight) return along;
    else return along * tx - across * ty;
  }
  B y(const B& along, const B& across) const {
    if constexpr (straight) return across;
    else return along * ty + across * tx;
  }
};

template <class B, bool straight>
[[gnu::flatten]] CouplerPeaks forces_on(const ExtendedArrays& a, const double* state) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  const CouplerPeaks peaks = couple<B>(a, state);
  const double v_eps = a.ground->regularization_speed;
  const bool isotropic = a.ground->on_track_law == inputs::OnTrackLaw::isotropic;
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B c = L::load(a.cosine + k), s = L::load(a.sine + k), w = L::load(state + OMEGA * n + k);
    const B vx = L::load(state + VX * n + k), vy = L::load(state + VY * n + k);
    // Coupler k - 1 pulls at the front of car k, coupler k at its rear; the ends of the train have none (zeros).
    B fx = L::load(a.pin_x + k + 1) - L::load(a.pin_x + k);
    B fy = L::load(a.pin_y + k + 1) - L::load(a.pin_y + k);
    B moment = L::load(a.moment_lead + k + 1) + L::load(a.moment_trail + k);
    for (const std::ptrdiff_t end : {std::ptrdiff_t{0}, n}) {
      const std::ptrdiff_t i = end + k;
      const B arm = end == 0 ? L::load(a.half_spacing + k) : B(-L::load(a.half_spacing + k));
      const B rx = arm * c, ry = arm * s, u = vx - w * ry, v = vy + w * rx;
      const B load = L::load(a.load + i);
      const auto on_track = L::load(a.on_track + i) > B(0.5);

      const RailFrame<B, straight> rail(a, i);
      const B ut = rail.along(u, v), vn = rail.across(u, v);
      B lateral(0.0), brake(0.0);
      if (a.rails_on) {
        lateral = rail_force<B>(*a.rails, L::load(a.rail_damping + i), L::load(a.offset + i), vn);
        brake = friction<B>(L::load(a.along + k) * load, ut, B(0.0), v_eps).x;
      } else {
        const auto f = friction<B>(L::load(a.along + k) * load, ut, isotropic ? vn : B(0.0), v_eps);
        brake = f.x;
        lateral = f.y;
      }

      B mu(a.ground->off_track_friction);
      if (a.by_slip) mu = slip_friction<B>(*a.ground, u * u + v * v, v * c - u * s, L::load(a.offset + i));
      const auto g = friction<B>(mu * L::load(a.patch + i) * load, u, v, v_eps);

      brake = select(on_track, brake, B(0.0));
      lateral = select(on_track, lateral, B(0.0));
      const B tfx = select(on_track, rail.x(brake, lateral), g.x), tfy = select(on_track, rail.y(brake, lateral), g.y);
      L::store(brake, a.brake + i);
      L::store(lateral, a.lateral + i);
      L::store(tfx, a.truck_x + i);
      L::store(tfy, a.truck_y + i);
      const B slope = -a.grade * load, gx = tfx + rail.x(slope, B(0.0)), gy = tfy + rail.y(slope, B(0.0));
      fx = fx + gx;
      fy = fy + gy;
      moment = moment + rx * gy - ry * gx;
    }
    L::store(fx, a.fx + k);
    L::store(fy, a.fy + k);
    L::store(moment, a.moment + k);
  });
  return peaks;
}

template <class B>
CouplerPeaks extended_forces(const ExtendedArrays& a, const double* state) {
  return a.straight ? forces_on<B, true>(a, state) : forces_on<B, false>(a, state);
}

template <class B, bool straight>
[[gnu::flatten]] StepWork work_on(const ExtendedArrays& a, const double* before, const double* after, double h) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  static constexpr double kLane[] = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
  // Velocities with which the forces of the step did their work.
  const auto mid = [&](Coordinate c, std::ptrdiff_t k) {
    return B(0.5) * (L::load(before + c * n + k) + L::load(after + c * n + k));
  };
  B on_track(0.0), off_track(0.0), rails(0.0), damping(0.0), grade(0.0);
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t done) {
    const B fresh = select(L::load(kLane) < B(static_cast<double>(done)), B(0.0), B(1.0));
    const B c = L::load(a.cosine + k), s = L::load(a.sine + k);
    const B vx = mid(VX, k), vy = mid(VY, k), w = mid(OMEGA, k);
    for (const std::ptrdiff_t end : {std::ptrdiff_t{0}, n}) {
      const std::ptrdiff_t i = end + k;
      const B arm = end == 0 ? L::load(a.half_spacing + k) : B(-L::load(a.half_spacing + k));
      const B u = vx - w * arm * s, v = vy + w * arm * c;
      const RailFrame<B, straight> rail(a, i);
      const B ut = rail.along(u, v), vn = rail.across(u, v);
      const B brake = L::load(a.brake + i) * ut, lateral = L::load(a.lateral + i) * vn;
      const B all = L::load(a.truck_x + i) * u + L::load(a.truck_y + i) * v;
      const B held = L::load(a.on_track + i);
      on_track = on_track - fresh * held * (a.rails_on ? brake : all);
      if (a.rails_on) rails = rails - fresh * held * lateral;
      off_track = off_track - fresh * (1.0 - held) * all;
      grade = grade + fresh * a.grade * L::load(a.load + i) * ut;
    }
  });
  for_blocks<L::count>(n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t done) {
    const std::ptrdiff_t j = i + 1;
    const B fresh = select(L::load(kLane) < B(static_cast<double>(done)), B(0.0), B(1.0));
    const B li = L::load(a.half_length + i), lj = L::load(a.half_length + j);
    const B rx =
        mid(VX, i) + mid(OMEGA, i) * li * L::load(a.sine + i) - mid(VX, j) + mid(OMEGA, j) * lj * L::load(a.sine + j);
    const B ry = mid(VY, i) - mid(OMEGA, i) * li * L::load(a.cosine + i) - mid(VY, j) -
                 mid(OMEGA, j) * lj * L::load(a.cosine + j);
    damping = damping - fresh * L::load(a.damper + i) * (rx * L::load(a.ux + i) + ry * L::load(a.uy + i));
  });
  return {h * L::sum(on_track), h * L::sum(off_track), h * L::sum(rails), h * L::sum(damping), h * L::sum(grade)};
}

template <class B>
StepWork extended_work(const ExtendedArrays& a, const double* before, const double* after, double h) {
  return a.straight ? work_on<B, true>(a, before, after, h) : work_on<B, false>(a, before, after, h);
}

template <class B>
void turn_at(const ExtendedArrays& a, const double* angle, std::ptrdiff_t k) {
  using L = Lanes<B>;
  static constexpr double kSmall = 0.05;  // rad, below which the series are exact to rounding
  const B d = L::load(angle + k), d2 = d * d;
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
[[gnu::flatten]] void turn(const ExtendedArrays& a, const double* angle) {
  std::ptrdiff_t k = 0;
  for (; k + Lanes<B>::count <= a.cars; k += Lanes<B>::count) turn_at<B>(a, angle, k);
  for (; k < a.cars; ++k) turn_at<double>(a, angle, k);  // no block twice: a turn is not idempotent
}

template <class B>
[[gnu::flatten]] void places(const ExtendedArrays& a, const double* state, double* px, double* py) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B x = L::load(state + X * n + k), y = L::load(state + Y * n + k), d = L::load(a.half_spacing + k);
    const B rx = d * L::load(a.cosine + k), ry = d * L::load(a.sine + k);
    L::store(x + rx, px + k);
    L::store(y + ry, py + k);
    L::store(x - rx, px + n + k);
    L::store(y - ry, py + n + k);
  });
}

template <class B>
[[gnu::flatten]] bool overload(const ExtendedArrays& a, double h, const double* before, double* overloaded) {
  using L = Lanes<B>;
  const std::ptrdiff_t trucks = 2 * a.cars;
  std::ptrdiff_t i = 0;
  B longest(0.0);
  for (; i + L::count <= trucks; i += L::count) {
    const B time = overloaded_time<B>(*a.rails, L::load(before + i), L::load(a.lateral + i), L::load(a.load + i), h,
                                      L::load(overloaded + i));
    L::store(time, overloaded + i);
    longest = select(time > longest, time, longest);
  }
  bool yields = L::max(longest) > a.rails->derail_time;
  for (; i < trucks; ++i) {  // not twice: it counts
    overloaded[i] = overloaded_time<double>(*a.rails, before[i], a.lateral[i], a.load[i], h, overloaded[i]);
    yields = yields || overloaded[i] > a.rails->derail_time;
  }
  return yields;
}

template <class B>
constexpr ExtendedKernels extended_kernels(const char* instruction_set) {
  return {instruction_set, Lanes<B>::count, extended_forces<B>, extended_work<B>,
          headings<B>,     turn<B>,         places<B>,          overload<B>};
}

}  // namespace train_derail::model
