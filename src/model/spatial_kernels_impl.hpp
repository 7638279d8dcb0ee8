// Templates of the kernels: B is a double or a batch of them (simd/batch.hpp).
#pragma once

#include <cmath>

#include "model/coupler_butts.hpp"
#include "model/ground_point.hpp"
#include "model/rail_frame.hpp"
#include "model/rotation.hpp"
#include "model/spatial_kernels.hpp"
#include "simd/blocks.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/tie_law.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

/// Directions of the cars.
template <class B>
struct Frame {
  Three<B> forward, left, up;
  static Frame load(const double* axes, std::ptrdiff_t k, std::ptrdiff_t n) {
    return {Three<B>::load(axes + k, n), Three<B>::load(axes + 3 * n + k, n), Three<B>::load(axes + 6 * n + k, n)};
  }
  /// From the cars' axes into the world.
  Three<B> world(const Three<B>& own) const { return forward * own.x + left * own.y + up * own.z; }
  Three<B> own(const Three<B>& v) const { return {forward.dot(v), left.dot(v), up.dot(v)}; }
};

/// Axes from a unit quaternion.
template <class B>
Frame<B> frame_of(const Turn<B>& q) {
  const B x = q.v.x + q.v.x, y = q.v.y + q.v.y, z = q.v.z + q.v.z;
  const B wx = x * q.w, wy = y * q.w, wz = z * q.w;
  const B xx = x * q.v.x, xy = y * q.v.x, xz = z * q.v.x, yy = y * q.v.y, yz = z * q.v.y, zz = z * q.v.z;
  return {
      {1.0 - (yy + zz), xy + wz, xz - wy}, {xy - wz, 1.0 - (xx + zz), yz + wx}, {xz + wy, yz - wx, 1.0 - (xx + yy)}};
}

template <class B>
void look_at(const SpatialArrays& a, const double* y, std::ptrdiff_t k) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  const Frame<B> f = frame_of<B>({Three<B>::load(y + QX * n + k, n), L::load(y + QW * n + k)});
  f.forward.store(a.axes + k, n);
  f.left.store(a.axes + 3 * n + k, n);
  f.up.store(a.axes + 6 * n + k, n);
  f.world(Three<B>::load(y + ROLL_RATE * n + k, n)).store(a.rotation + k, n);
}

template <class B>
[[gnu::flatten]] void look(const SpatialArrays& a, const double* y) {
  for_blocks<Lanes<B>::count>(a.cars, [&](std::ptrdiff_t k, std::ptrdiff_t) { look_at<B>(a, y, k); });
}

template <class B>
void turn_at(const SpatialArrays& a, double* y, std::ptrdiff_t k) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  const Turn<B> by = turn_by<B>(Three<B>::load(y + TURN_X * n + k, n));
  const Turn<B> q{Three<B>::load(y + QX * n + k, n), L::load(y + QW * n + k)};
  const Three<B> inertia = Three<B>::load(a.inertia + k, n);
  turned_back(Three<B>::load(a.spin + k, n), by).over(inertia).store(y + ROLL_RATE * n + k, n);
  Three<B> v = by.v * q.w + q.v * by.w + q.v.cross(by.v);
  B w = q.w * by.w - q.v.dot(by.v);
  // Of length 1 but for rounding, hence one round of Newton's.
  const B unit = 1.5 - 0.5 * (v.dot(v) + w * w);
  (v * unit).store(y + QX * n + k, n);
  L::store(w * unit, y + QW * n + k);
  Three<B>{B(0.0), B(0.0), B(0.0)}.store(y + TURN_X * n + k, n);
  look_at<B>(a, y, k);
}

template <class B>
[[gnu::flatten]] void turn_cars(const SpatialArrays& a, double* y) {
  std::ptrdiff_t k = 0;
  for (; k + Lanes<B>::count <= a.cars; k += Lanes<B>::count) turn_at<B>(a, y, k);
  for (; k < a.cars; ++k) turn_at<double>(a, y, k);  // no block twice: a turn is not idempotent
}

template <class B>
[[gnu::flatten]] CouplerExtremes couple_cars(const SpatialArrays& arrays, const double* y) {
  using L = Lanes<B>;
  const SpatialArrays a = arrays;
  const inputs::Coupler law = *a.coupler;
  const std::ptrdiff_t n = a.cars, m = n + 1;
  const auto size = [](const B& x) { return select(x < B(0.0), B(-x), x); };
  const auto more = [](const B& x, const B& y) { return select(x > y, x, y); };
  B buff(0.0), draft(0.0), rise(0.0);
  for_blocks<L::count>(n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    const std::ptrdiff_t j = i + 1;
    const Frame<B> lead = Frame<B>::load(a.axes, i, n), trail = Frame<B>::load(a.axes, j, n);
    const Three<B> arm_lead =
        lead.up * B(law.height - L::load(a.centre_height + i)) - lead.forward * L::load(a.half_length + i);
    const Three<B> arm_trail =
        trail.up * B(law.height - L::load(a.centre_height + j)) + trail.forward * L::load(a.half_length + j);
    const Three<B> d = (Three<B>::load(y + SX * n + i, n) - Three<B>::load(y + SX * n + j, n)) + (arm_lead - arm_trail);
    const B square = d.dot(d), inverse = Roots<B>::inverse(square), pins = square * inverse;
    const Three<B> along = d * inverse, in_lead = lead.own(along), in_trail = trail.own(along);
    // Whose length acts, changes with the places of the pins by u, and as the cars turn by the vectors about them.
    const Butts<B> butts = press_butts<B>(law, pins, in_lead.z, in_trail.z);
    const Three<B> tilts = lead.up * butts.lead + trail.up * butts.trail;
    const Three<B> u = along - (tilts - along * tilts.dot(along)) * inverse;
    const Three<B> about_lead = arm_lead.cross(u) - lead.up.cross(along) * butts.lead;
    const Three<B> about_trail = arm_trail.cross(u) + trail.up.cross(along) * butts.trail;
    const B rate = u.dot(Three<B>::load(y + SVX * n + i, n) - Three<B>::load(y + SVX * n + j, n)) +
                   about_lead.dot(Three<B>::load(a.rotation + i, n)) -
                   about_trail.dot(Three<B>::load(a.rotation + j, n));
    const B alive = L::load(a.alive + i);
    const B spring = coupler_spring_force<B>(law, butts.gap);
    const B damper = alive * coupler_damper_force<B>(L::load(a.damping + i), spring, rate);
    const B axial = alive * spring + damper;
    L::store(axial, a.axial + i);
    L::store(axial, a.pin_axial + j);
    L::store(damper, a.pin_damper + j);
    u.store(a.bar + j, m);
    about_lead.store(a.about_lead + j, m);
    about_trail.store(a.about_trail + j, m);
    // Stops, looked for without an arc tangent.
    const auto near = [&](const Three<B>& own) {
      return select(own.x > B(0.0), B(1.0), B(0.0)) * select(size(own.y) <= a.tan_swing * own.x, B(1.0), B(0.0)) *
             select(size(own.z) <= B(a.sin_pitch), B(1.0), B(0.0));
    };
    B close = near(in_lead) * near(in_trail);
    if (a.cos_roll > 0.0) {
      const B along = in_lead.y * in_trail.y, dot = lead.left.dot(trail.left) - along;
      const B limit = a.cos_roll * a.cos_roll * (1.0 - in_lead.y * in_lead.y) * (1.0 - in_trail.y * in_trail.y);
      close = close * select(dot > B(0.0), B(1.0), B(0.0)) * select(dot * dot >= limit, B(1.0), B(0.0));
    } else if (a.cos_roll > -1.0) {
      close = B(0.0);
    }
    L::store(alive * (1.0 - close), a.far + i);
    const B higher = 0.5 * pins * (in_lead.z + in_trail.z);
    L::store(higher, a.rise + i);
    buff = more(axial, buff);
    draft = more(B(-axial), draft);
    rise = more(size(higher), rise);
  });
  return {L::max(buff), L::max(draft), L::max(rise)};
}

/// Heights of the rails under some trucks: a plane that is twisted along the track. A point that moves gains height
/// over it by its own height less slope and tilt times what it moves along and across.
template <class B, bool straight, bool flat>
struct RailPlane {
  RailFrame<B, straight> rail;
  B height, slope, tilt, twist, per_along, per_across;
  RailPlane(const SpatialArrays& a, std::ptrdiff_t truck) : rail(a, truck) {
    if constexpr (!flat) {
      using L = Lanes<B>;
      const B offset = L::load(a.offset + truck), change = L::load(a.rail_twist + truck);
      tilt = L::load(a.rail_tilt + truck);
      height = L::load(a.rail_height + truck) + tilt * offset;
      slope = L::load(a.rail_slope + truck) + change * offset;
      twist = change * a.half_base;
      per_along = Roots<B>::inverse(slope * slope + 1.0);
      per_across = Roots<B>::inverse(tilt * tilt + 1.0);
    }
  }
  /// Along unit vectors in the plane of the rails.
  B along(const Three<B>& v) const {
    if constexpr (flat) return rail.along(v.x, v.y);
    else return (rail.along(v.x, v.y) + slope * v.z) * per_along;
  }
  B across(const Three<B>& v) const {
    if constexpr (flat) return rail.across(v.x, v.y);
    else return (rail.across(v.x, v.y) + tilt * v.z) * per_across;
  }
  /// What a truck centre and its left wheels against it gain in height as they move.
  B gain(const Three<B>& v) const {
    if constexpr (flat) return v.z;
    else return v.z - slope * rail.along(v.x, v.y) - tilt * rail.across(v.x, v.y);
  }
  B rock(const Three<B>& side, const Three<B>& rotation, const Three<B>& velocity) const {
    if constexpr (flat) return rotation.x * side.y - rotation.y * side.x;
    else return gain(rotation.cross(side)) - twist * rail.along(velocity.x, velocity.y);
  }
  /// Normal force over its vertical part.
  B steepness() const {
    const B square = slope * slope + tilt * tilt + 1.0;
    return square * Roots<B>::inverse(square);
  }
  /// A force of the rails: along, across and its vertical part, all along unit vectors but the last.
  Three<B> force(const B& forward, const B& sideways, const B& up, const B& leaning) const {
    if constexpr (flat) {
      const Plan<B> level = rail.world(forward, sideways);
      return {level.x, level.y, up};
    } else {
      const B f = forward * per_along, s = sideways * per_across;
      const B level_along = f - slope * up - twist * leaning, level_across = s - tilt * up;
      const Plan<B> level = rail.world(level_along, level_across);
      return {level.x, level.y, up + f * slope + s * tilt};
    }
  }
};

/// Height of the ground under wheels at (x, y), and along what it pushes.
template <class B>
struct Ground {
  B z, per_length;
  Three<B> up;
  Ground(const SpatialArrays& a, std::ptrdiff_t wheel, const B& y) {
    const B one(1.0);
    if (a.level_ground) {
      z = B(-a.section->rail_height);
      up = {B(0.0), B(0.0), one};
      per_length = one;
      return;
    }
    if (a.section != nullptr) {
      const GroundHeight<B> g = ground_height<B>(*a.section, y);
      z = g.z;
      up = {B(0.0), -g.slope, one};
    } else {
      const Three<B> given = Three<B>::load(a.under + wheel, 4 * a.cars);
      z = given.x;
      up = {given.y, given.z, one};
    }
    per_length = Roots<B>::inverse(up.dot(up));
  }
};

/// Cars that are looked at side by side: how they move, and what acts on them.
template <class B>
struct Block {
  Frame<B> frame;
  Three<B> velocity, rotation, force, torque;
};

/// What takes energy from cars whose trucks stand on the ground.
template <class B>
struct Taken {
  Three<B> force{B(0.0), B(0.0), B(0.0)}, torque = force;
  void add(const Three<B>& f, const Three<B>& arm) {
    force = force + f;
    torque = torque + arm.cross(f);
  }
  void store(double* p, std::ptrdiff_t n) const {
    force.store(p, n);
    torque.store(p + 3 * n, n);
  }
  static Taken load(const double* p, std::ptrdiff_t n) {
    Taken t;
    t.force = Three<B>::load(p, n);
    t.torque = Three<B>::load(p + 3 * n, n);
    return t;
  }
  B power(const Three<B>& velocity, const Three<B>& rotation) const {
    return force.dot(velocity) + torque.dot(rotation);
  }
};

/// Friction coefficient of trucks off the rails. Which way a truck slides, or would: one that stands has no other
/// direction than that of the force.
template <class B>
B truck_friction(const SpatialArrays& a, std::ptrdiff_t truck, const Three<B>& rub, const Three<B>& left) {
  const B grip = Lanes<B>::load(a.grip + truck);
  if (a.ground->off_track_law != inputs::OffTrackLaw::by_slip) return grip * a.ground->off_track_friction;
  return grip * slip_friction<B>(*a.ground, rub.dot(rub), rub.dot(left), Lanes<B>::load(a.offset + truck));
}

/// Wheels of one side of trucks, `arm` from the centres of their cars.
template <class B>
void press_wheels(const SpatialArrays& a, const double* y, std::ptrdiff_t k, std::ptrdiff_t truck, bool left,
                  const Three<B>& arm, Block<B>& cars, Taken<B>& damped, Taken<B>& rubbed) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars, trucks = 2 * n;
  const B zero(0.0);
  const auto grounded = L::load(a.grounded + truck) > B(0.5);
  const Ground<B> ground(a, (left ? trucks : 0) + truck, L::load(y + SY * n + k) + arm.y);
  const B depth = L::load(a.sag + k) - (L::load(y + SZ * n + k) + arm.z - ground.z);
  const auto pressed = grounded && depth > zero;
  const std::ptrdiff_t strains = (left ? 3 * trucks : 0) + truck;
  const Three<B> strain = Three<B>::load(a.sheared + strains, trucks);
  const auto keep = [&](const B& next, const B& before) {
    return select(pressed, next, select(grounded, zero, before));
  };
  if (!any(pressed)) {
    Three<B>{keep(zero, strain.x), keep(zero, strain.y), keep(zero, strain.z)}.store(a.sheared_next + strains, trucks);
    return;
  }
  const GroundPoint<B> point{ground.up,
                             ground.per_length,
                             cars.velocity + cars.rotation.cross(arm),
                             strain,
                             select(pressed, B(a.spring * depth), zero),
                             select(pressed, L::load(a.spring_damping + k), zero),
                             L::load(a.brake_damping + k)};
  const GroundPush<B> found = push_of_ground(point, a.brake_stiffness, a.step, [&](const Three<B>& rub) {
    return truck_friction<B>(a, truck, rub, cars.frame.left);
  });
  Three<B>{keep(found.strain.x, strain.x), keep(found.strain.y, strain.y), keep(found.strain.z, strain.z)}.store(
      a.sheared_next + strains, trucks);
  L::store(L::load(a.load + truck) + found.carried, a.load + truck);
  const B leaning = L::load(a.leaning + truck);
  L::store(left ? B(leaning + found.carried) : B(leaning - found.carried), a.leaning + truck);
  const Three<B> all = ground.up * found.push + found.rub;
  cars.force = cars.force + all;
  cars.torque = cars.torque + arm.cross(all);
  damped.add(ground.up * (found.push - point.spring), arm);
  rubbed.add(found.rub, arm);
}

/// Trucks that stand on the ground beside the rails, of cars from k on.
template <class B>
void press_trucks(const SpatialArrays& a, const double* y, std::ptrdiff_t k, Block<B>& cars) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  const bool front = any(L::load(a.grounded + k) > B(0.5)), rear = any(L::load(a.grounded + n + k) > B(0.5));
  if (!front && !rear) return;
  const Three<B> down = cars.frame.up * L::load(a.centre_height + k), side = cars.frame.left * B(a.half_base);
  const Three<B> ahead = cars.frame.forward * L::load(a.half_spacing + k);
  Taken<B> damped, rubbed;
  for (const std::ptrdiff_t end : {std::ptrdiff_t{0}, n}) {
    if (!(end == 0 ? front : rear)) continue;
    const Three<B> arm = end == 0 ? ahead - down : (ahead + down) * B(-1.0);
    press_wheels<B>(a, y, k, end + k, false, arm - side, cars, damped, rubbed);
    press_wheels<B>(a, y, k, end + k, true, arm + side, cars, damped, rubbed);
  }
  damped.store(a.pushed_damped + k, n);
  rubbed.store(a.rubbed + k, n);
}

/// The same for those whose sums are known without it.
template <class B>
void add_ground(const SpatialArrays& a, const double* y, std::ptrdiff_t k) {
  const std::ptrdiff_t n = a.cars;
  Block<B> cars{Frame<B>::load(a.axes, k, n), Three<B>::load(y + SVX * n + k, n), Three<B>::load(a.rotation + k, n),
                Three<B>::load(a.force + k, n), Three<B>::load(a.torque + k, n)};
  press_trucks<B>(a, y, k, cars);
  cars.force.store(a.force + k, n);
  cars.torque.store(a.torque + k, n);
}

/// Trucks on the rails or the ties, of cars from k on; `truck` is the first of them.
template <class B, bool straight, bool flat>
void guide_trucks(const SpatialArrays& a, const inputs::Rails& rails, const double* y, std::ptrdiff_t k,
                  std::ptrdiff_t truck, const RailPlane<B, straight, flat>& plane, const Three<B>& arm,
                  const Three<B>& side, Block<B>& cars) {
  using L = Lanes<B>;
  const B zero(0.0);
  const auto positive = [&](const B& x) { return select(x > zero, x, zero); };
  const Three<B> velocity = cars.velocity + cars.rotation.cross(arm);
  const B rise = plane.gain(velocity), rock = plane.rock(side, cars.rotation, velocity), lean = plane.gain(side);
  const auto on = L::load(a.on_rails + truck) > B(0.5);
  B press = L::load(a.sag + k) - (L::load(y + SZ * a.cars + k) + arm.z);
  if constexpr (!flat) press = press + plane.height;
  const B right = positive(a.spring * (press + lean)), left = positive(a.spring * (press - lean));
  const B c = L::load(a.spring_damping + k);
  const auto damped = [&](const B& spring, const B& rate) {
    return select(spring > zero, positive(spring - c * rate), zero);
  };
  const B total_right = damped(right, rise - rock), total_left = damped(left, rise + rock);
  const B carried = select(on, B(total_right + total_left), zero);
  const B leaning = select(on, B(total_left - total_right), zero);
  B normal = carried, heavier = leaning;
  if constexpr (!flat) {
    normal = normal * plane.steepness();
    heavier = heavier * plane.steepness();
  }
  L::store(L::load(a.load_held + truck) + normal, a.load + truck);
  L::store(L::load(a.leaning_held + truck) + heavier, a.leaning + truck);
  L::store(select(on, B(carried - (right + left)), zero), a.damper + truck);
  L::store(select(on, B(leaning - (left - right)), zero), a.rocker + truck);
  // Brakes hold a train that stands: what they are strained gives way at their limit. So does the drag of ties.
  const auto guided = L::load(a.guided + truck) > B(0.5);
  const B share = L::load(a.brake_share + k);
  const B drag = a.ties != nullptr ? select(guided, B(a.ties->drag), share) : share;
  const B limit = drag * normal, speed = plane.along(velocity);
  const B strain = L::load(a.braked + truck) + a.step * speed;
  const B pull = -a.brake_stiffness * strain - L::load(a.brake_damping + k) * speed;
  const B above = select(pull < -limit, B(-limit), pull), brake = select(above > limit, limit, above);
  const auto slides = pull != brake;
  L::store(select(on, select(slides, B(brake * (-1.0 / a.brake_stiffness)), strain), zero), a.braked_next + truck);
  // At the top of the rails, sideways.
  const B offset = L::load(a.offset + truck), across = plane.across(velocity);
  B held = rail_force<B>(rails, L::load(a.rail_damping + k), offset, across);
  if (a.ties != nullptr) {
    const B from_drift = offset - L::load(a.drift + truck);
    held = select(guided, tie_force<B>(*a.ties, L::load(a.tie_damping + truck), from_drift, across, normal), held);
  }
  const B lateral = select(on, held, zero);
  L::store(brake, a.brake + truck);
  L::store(lateral, a.lateral + truck);
  const Three<B> pulled = plane.force(brake, lateral, carried, leaning);
  cars.force = cars.force + pulled;
  cars.torque = cars.torque + arm.cross(pulled);
  if constexpr (flat) {
    cars.torque.x = cars.torque.x + side.y * leaning;
    cars.torque.y = cars.torque.y - side.x * leaning;
  } else {
    cars.torque = cars.torque + side.cross(plane.force(zero, zero, leaning, carried));
  }
}

/// The same where none of them is on the rails.
template <class B>
void leave_trucks(const SpatialArrays& a, std::ptrdiff_t truck) {
  using L = Lanes<B>;
  for (double* column : {a.damper, a.rocker, a.brake, a.lateral, a.braked_next}) L::store(B(0.0), column + truck);
  L::store(L::load(a.load_held + truck), a.load + truck);
  L::store(L::load(a.leaning_held + truck), a.leaning + truck);
}

template <class B, bool straight, bool flat>
[[gnu::flatten]] void forces_on(const SpatialArrays& arrays, const double* y) {
  using L = Lanes<B>;
  const SpatialArrays a = arrays;
  const inputs::Rails rails = *a.rails;
  const std::ptrdiff_t n = a.cars, m = n + 1;
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B weight = L::load(a.weight + k);
    // Coupler k - 1 pulls at the front of car k, coupler k at its rear; the ends of the train have none (zeros).
    const B behind = L::load(a.pin_axial + k + 1), ahead = L::load(a.pin_axial + k);
    Block<B> cars{Frame<B>::load(a.axes, k, n), Three<B>::load(y + SVX * n + k, n), Three<B>::load(a.rotation + k, n),
                  Three<B>::load(a.bar + k + 1, m) * behind - Three<B>::load(a.bar + k, m) * ahead,
                  Three<B>::load(a.about_lead + k + 1, m) * behind - Three<B>::load(a.about_trail + k, m) * ahead};
    cars.force.z = cars.force.z - weight;
    const Three<B> down = cars.frame.up * L::load(a.centre_height + k), side = cars.frame.left * B(a.half_base);
    for (const std::ptrdiff_t end : {std::ptrdiff_t{0}, n}) {
      const std::ptrdiff_t truck = end + k;
      const B half = L::load(a.half_spacing + k);
      const Three<B> arm = cars.frame.forward * (end == 0 ? half : B(-half)) - down;
      const RailPlane<B, straight, flat> plane(a, truck);
      if (any(L::load(a.on_rails + truck) > B(0.5))) guide_trucks(a, rails, y, k, truck, plane, arm, side, cars);
      else leave_trucks<B>(a, truck);
      const Plan<B> uphill = plane.rail.world((-0.5 * a.grade) * weight, B(0.0));
      cars.force.x = cars.force.x + uphill.x;
      cars.force.y = cars.force.y + uphill.y;
    }
    press_trucks<B>(a, y, k, cars);
    cars.force.store(a.force + k, n);
    cars.torque.store(a.torque + k, n);
  });
}

template <class B>
void spatial_forces(const SpatialArrays& a, const double* y) {
  if (!a.flat) forces_on<B, false, false>(a, y);
  else if (a.straight) forces_on<B, true, true>(a, y);
  else forces_on<B, false, true>(a, y);
}

template <class B, bool straight, bool flat>
[[gnu::flatten]] void work_on(const SpatialArrays& arrays, const double* before, const double* after, double h,
                              EnergyLedger& spent) {
  using L = Lanes<B>;
  const SpatialArrays a = arrays;
  const std::ptrdiff_t n = a.cars, m = n + 1;
  static constexpr double kLane[] = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0};
  const auto both = [&](SpatialColumn c, std::ptrdiff_t k) {
    return Three<B>::load(before + c * n + k, n) + Three<B>::load(after + c * n + k, n);
  };
  B brakes(0.0), rails(0.0), ties(0.0), dampers(0.0), rubbing(0.0), grade(0.0), couplers(0.0);
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t done) {
    const B fresh = select(L::load(kLane) < B(static_cast<double>(done)), B(0.0), B(1.0));
    const Frame<B> f = Frame<B>::load(a.axes_before, k, n);
    const Three<B> v = both(SVX, k), w = f.world(both(ROLL_RATE, k));
    w.store(a.mean_rotation + k, n);
    const Three<B> down = f.up * L::load(a.centre_height + k), side = f.left * B(a.half_base);
    bool grounded = false;
    for (const std::ptrdiff_t end : {std::ptrdiff_t{0}, n}) {
      const std::ptrdiff_t truck = end + k;
      const RailPlane<B, straight, flat> plane(a, truck);
      grade = grade + fresh * L::load(a.weight + k) * plane.rail.along(v.x, v.y);
      grounded = grounded || any(L::load(a.grounded + truck) > B(0.5));
      const B on = fresh * L::load(a.on_rails + truck);
      if (!any(on > B(0.5))) continue;
      const B half = L::load(a.half_spacing + k);
      const Three<B> velocity = v + w.cross(f.forward * (end == 0 ? half : B(-half)) - down);
      const B rise = plane.gain(velocity), rock = plane.rock(side, w, velocity);
      const B along = on * L::load(a.brake + truck) * plane.along(velocity);
      const B across = on * L::load(a.lateral + truck) * plane.across(velocity);
      const B guided = L::load(a.guided + truck), held = 1.0 - guided;
      brakes = brakes + held * along;
      rails = rails + held * across;
      ties = ties + guided * (along + across);
      dampers = dampers + on * (L::load(a.damper + truck) * rise + L::load(a.rocker + truck) * rock);
    }
    if (!grounded) return;
    dampers = dampers + fresh * Taken<B>::load(a.pushed_damped + k, n).power(v, w);
    rubbing = rubbing + fresh * Taken<B>::load(a.rubbed + k, n).power(v, w);
  });
  for_blocks<L::count>(n - 1, [&](std::ptrdiff_t i, std::ptrdiff_t done) {
    const std::ptrdiff_t j = i + 1;
    const B fresh = select(L::load(kLane) < B(static_cast<double>(done)), B(0.0), B(1.0));
    const B rate = Three<B>::load(a.bar + j, m).dot(both(SVX, i) - both(SVX, j)) +
                   Three<B>::load(a.about_lead + j, m).dot(Three<B>::load(a.mean_rotation + i, n)) -
                   Three<B>::load(a.about_trail + j, m).dot(Three<B>::load(a.mean_rotation + j, n));
    couplers = couplers + fresh * L::load(a.pin_damper + j) * rate;
  });
  const double half = 0.5 * h;
  spent.work_on_track -= half * L::sum(brakes);
  spent.work_rails -= half * L::sum(rails);
  spent.work_ties -= half * L::sum(ties);
  spent.work_off_track -= half * L::sum(rubbing);
  spent.work_truck_damping -= half * L::sum(dampers);
  spent.work_grade += half * 0.5 * a.grade * L::sum(grade);
  spent.work_coupler_damping -= half * L::sum(couplers);
}

template <class B>
void spatial_work(const SpatialArrays& a, const double* before, const double* after, double h, EnergyLedger& spent) {
  if (!a.flat) work_on<B, false, false>(a, before, after, h, spent);
  else if (a.straight) work_on<B, true, true>(a, before, after, h, spent);
  else work_on<B, false, true>(a, before, after, h, spent);
}

template <class B>
[[gnu::flatten]] void accelerate_cars(const SpatialArrays& arrays, const double* y, double h, double* result) {
  using L = Lanes<B>;
  const SpatialArrays a = arrays;
  const std::ptrdiff_t n = a.cars;
  const double per_step = 1.0 / h;
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    (Three<B>::load(a.force + k, n) * L::load(a.inverse_mass + k)).store(result + k, n);
    const Frame<B> f = Frame<B>::load(a.axes, k, n);
    const Three<B> inertia = Three<B>::load(a.inertia + k, n), rates = Three<B>::load(y + ROLL_RATE * n + k, n);
    const Three<B> spin = inertia.times(rates) + f.own(Three<B>::load(a.torque + k, n)) * B(h);
    spin.store(a.spin + k, n);
    const Three<B> mean = mean_rates(inertia, spin, h);
    ((mean - rates) * B(per_step)).store(result + 3 * n + k, n);
  });
}

template <class B>
[[gnu::flatten]] void truck_places(const SpatialArrays& a, const double* y, double* px, double* py) {
  using L = Lanes<B>;
  const std::ptrdiff_t n = a.cars;
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const B half = L::load(a.half_spacing + k), height = L::load(a.centre_height + k);
    for (const std::ptrdiff_t c : {std::ptrdiff_t{0}, std::ptrdiff_t{1}}) {
      const B middle = L::load(y + (SX + c) * n + k) - L::load(a.axes + (6 + c) * n + k) * height;
      const B ahead = L::load(a.axes + c * n + k) * half;
      double* p = (c == 0 ? px : py) + k;
      L::store(middle + ahead, p);
      L::store(middle - ahead, p + n);
    }
  });
}

template <class B>
[[gnu::flatten]] bool holding(const SpatialArrays& a, double* load) {
  using L = Lanes<B>;
  const B zero(0.0);
  B lifted(0.0);
  for_blocks<L::count>(2 * a.cars, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    const B carried = L::load(a.load + i), leaning = L::load(a.leaning + i);
    const B lighter = select(L::load(a.lateral + i) > zero, leaning, B(-leaning));
    const B size = select(leaning < zero, B(-leaning), leaning);
    L::store(carried - select(lighter > zero, lighter, zero), load + i);
    lifted = lifted + select(carried > size, zero, L::load(a.on_rails + i));
  });
  return L::sum(lifted) > 0.0;
}

template <class B>
[[gnu::flatten]] bool may_leave(const SpatialArrays& a, const LeavingPlaces& places) {
  using L = Lanes<B>;
  const B zero(0.0), from(places.torn_from), to(places.torn_to);
  B leaving(0.0);
  for_blocks<L::count>(2 * a.cars, [&](std::ptrdiff_t i, std::ptrdiff_t) {
    const B on = L::load(a.on_rails + i), now = L::load(places.now + i), bad = L::load(places.bad + i);
    leaving = leaving + select(L::load(places.before + i) < bad, select(now >= bad, on, zero), zero) +
              select(now >= from, select(now <= to, on, zero), zero);
  });
  return L::sum(leaving) > 0.0;
}

template <class B>
[[gnu::flatten]] double swirls(const SpatialArrays& a, const double* y, const double* radius, double* swirl,
                               double& largest) {
  using L = Lanes<B>;
  using std::sqrt;
  const std::ptrdiff_t n = a.cars;
  B fastest(0.0), spinning(0.0);
  for_blocks<L::count>(n, [&](std::ptrdiff_t k, std::ptrdiff_t) {
    const Three<B> v = Three<B>::load(y + SVX * n + k, n), w = Three<B>::load(y + ROLL_RATE * n + k, n);
    const B speed = v.dot(v), turning = L::load(radius + k) * sqrt(w.dot(w));
    L::store(turning, swirl + k);
    fastest = select(speed > fastest, speed, fastest);
    spinning = select(turning > spinning, turning, spinning);
  });
  largest = L::max(spinning);
  return std::sqrt(L::max(fastest));
}

template <class B>
constexpr SpatialKernels spatial_kernels(const char* instruction_set) {
  return {instruction_set, Lanes<B>::count,    look<B>,         turn_cars<B>, couple_cars<B>, spatial_forces<B>,
          spatial_work<B>, accelerate_cars<B>, truck_places<B>, holding<B>,   may_leave<B>,   swirls<B>};
}

}  // namespace train_derail::model
