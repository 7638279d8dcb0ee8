#include "model/spatial_ground.hpp"

#include <array>

namespace train_derail::model {

using Eigen::Vector3d;

namespace {

// Assumed: enough to come to rest within some seconds, too little to change how tanks come to lie.
constexpr double kRocking = 0.1;
constexpr Three<double> kNone{0.0, 0.0, 0.0};

}  // namespace

SpatialGround::SpatialGround(SpatialCars& cars, const SpatialBed& bed) : cars_(cars), bed_(bed) {
  sheared_.assign(kPoints * cars.n, kNone);
  sheared_next_ = sheared_;
  feet_.assign(kPoints * cars.n, 0.0);
  lies_.assign(cars.n, false);
  above_.assign(cars.n, 0.0);
  corner_.resize(kPoints * cars.n);
  for (std::size_t k = 0; k < cars.n; ++k) find_corners(k);
}

void SpatialGround::find_corners(std::size_t car) {
  for (std::size_t i = 0; i < kPoints; ++i) corner_[kPoints * car + i] = corner_of(cars_.bodies[car], i);
}

void SpatialGround::press_near(std::size_t car, double s) {
  const std::size_t n = cars_.n;
  const Body& b = cars_.bodies[car];
  const Vector3d rise(cars_.axes[2 * n + car], cars_.axes[5 * n + car], cars_.axes[8 * n + car]);
  const double middle = cars_.state[SZ * n + car];
  const double lowest = middle + b.lowest(rise);
  // Of all its points the first truck is no farther away than that.
  const double highest = bed_.highest_ground(s, 4.0 * b.radius);
  above_[car] = lowest - highest;
  if (lowest > highest) {
    if (!lies_[car]) return;
    std::fill_n(sheared_next_.begin() + static_cast<std::ptrdiff_t>(kPoints * car), kPoints, kNone);
    strained_.push_back(car);
    return;
  }
  const SpatialMotion& q = cars_.at(car);
  OnGround sum;
  if (b.cylinder) press_shell(sum, q, car, s);
  else press_edges(sum, q, car, s, highest);
  lie(car, sum);
  if (lies_[car]) strained_.push_back(car);
}

double SpatialGround::press_body_point(OnGround& sum, const SpatialMotion& q, std::size_t car, std::size_t point,
                                       const Vector3d& place, const Vector3d& up, double depth, double s) {
  const inputs::Terrain& terrain = cars_.scenario.terrain;
  const double damping = cars_.bodies[car].ground_damping, mu = terrain.body_friction * bed_.patch_factor(place, s);
  const Three<double> arm = three(place - q.centre), upward = three(up);
  const GroundPoint<double> p{
      upward,          bed_.level() ? 1.0 : 1.0 / up.norm(), three(q.velocity) + three(q.rotation).cross(arm),
      sheared_[point], terrain.body_stiffness * depth,       damping,
      damping};
  const GroundPush<double> found =
      push_of_ground(p, terrain.body_stiffness, cars_.step, [&](const Three<double>&) { return mu; });
  const Vector3d turning = vector(arm.cross(upward)), rub = vector(found.rub),
                 rub_turning = vector(arm.cross(found.rub));
  sheared_next_[point] = found.strain;
  sum.any = true;
  sum.all.force += found.push * up + rub;
  sum.all.torque += found.push * turning + rub_turning;
  sum.damping.force += (found.push - p.spring) * up;
  sum.damping.torque += (found.push - p.spring) * turning;
  sum.friction.force += rub;
  sum.friction.torque += rub_turning;
  return found.carried;
}

void SpatialGround::press_edges(OnGround& sum, const SpatialMotion& q, std::size_t car, double s, double highest) {
  const Body& b = cars_.bodies[car];
  const Vector3d rise = q.axes.row(2);
  const std::size_t first = kPoints * car, end = first + corners(b);
  std::fill_n(sheared_next_.begin() + static_cast<std::ptrdiff_t>(first), kPoints, kNone);
  for (std::size_t point = first; point < end; ++point) {
    const Vector3d& own = corner_[point];
    if (!(q.centre.z() + rise.dot(own) < highest)) continue;
    const Vector3d place = q.point(own);
    const Under under = ground_under(point, place, s);
    const double depth = under.z - place.z();
    if (depth > 0.0) press_body_point(sum, q, car, point, place, under.up, depth, s);
  }
}

/// As a cylinder rolls, other parts of its shell come to be on the ground, at the speed at which those that are there
/// leave.
void SpatialGround::press_shell(OnGround& sum, const SpatialMotion& q, std::size_t car, double s) {
  const Body& b = cars_.bodies[car];
  std::fill_n(sheared_next_.begin() + static_cast<std::ptrdiff_t>(ball_point(car, 0, 0)), kBalls * kBallPoints, kNone);
  std::array<double, kBalls> loads{};
  for (std::size_t i = 0; i < kBalls; ++i) {
    bed_.touches_of_ball(ball_of(b, q, i), b.shell_radius, s,
                         [&](const Vector3d& place, const Vector3d& up, double depth, std::size_t number) {
                           loads[i] += press_body_point(sum, q, car, ball_point(car, i, number), place, up, depth, s);
                         });
  }
  resist_rolling(sum, q, car, loads[0] + loads[1] + loads[2]);
  resist_rocking(sum, q, car, loads[0] + loads[2] > 0.0 ? 0.0 : loads[1]);
}

/// Under a cylinder that rolls the load moves ahead of the axis, at most by rolling_resistance times its radius; within
/// that it rocks about where it lies, and comes to rest. Otherwise a tank would roll on level ground for ever.
void SpatialGround::resist_rolling(OnGround& sum, const SpatialMotion& q, std::size_t car, double load) {
  const Body& b = cars_.bodies[car];
  double& ahead = sheared_next_[rolling_point(car)].x;
  ahead = 0.0;
  if (!(load > 0.0)) return;
  const double limit = cars_.scenario.terrain.rolling_resistance * b.shell_radius;
  const double rolls = b.shell_radius * q.body_rates.x();
  // Damped within about one of its swings.
  const double settling = std::sqrt(b.shell_radius / inputs::kStandardGravity);
  ahead = sheared_[rolling_point(car)].x + cars_.step * rolls;
  double arm = ahead + settling * rolls;
  if (std::abs(arm) > limit) ahead = arm = std::copysign(limit, arm);
  const Vector3d torque = -load * arm * q.axes.col(0);
  sum.all.torque += torque;
  sum.friction.torque += torque;
}

/// So it is where a cylinder rocks and turns about the one place that it lies on, such as the crest of the ballast, by
/// kRocking of that. Otherwise, balanced there as a pendulum, it would rock for minutes, and turn for ever.
void SpatialGround::resist_rocking(OnGround& sum, const SpatialMotion& q, std::size_t car, double load) {
  const Body& b = cars_.bodies[car];
  sheared_next_[rocking_point(car)] = kNone;
  if (!(load > 0.0)) return;
  const double limit = kRocking * cars_.scenario.terrain.rolling_resistance * b.shell_radius;
  const Vector3d axis = q.axes.col(0), turns = b.shell_radius * (q.rotation - q.body_rates.x() * axis);
  const double settling = std::sqrt(b.inertia.z() / (b.weight * b.shell_radius));
  const Vector3d before = vector(sheared_[rocking_point(car)]);
  Vector3d strain = before - before.dot(axis) * axis + cars_.step * turns;
  Vector3d arm = strain + settling * turns;
  const double length = arm.norm();
  if (length > limit) strain = arm = Vector3d(limit / length * arm);
  sheared_next_[rocking_point(car)] = three(strain);
  const Vector3d torque = -load * arm;
  sum.all.torque += torque;
  sum.friction.torque += torque;
}

void SpatialGround::lie(std::size_t car, const OnGround& sum) {
  if (!sum.any) return;
  cars_.add(car, sum.all.force, sum.all.torque);
  cars_.accounts.add(car, BODY_GROUND, sum.damping.force, sum.damping.torque);
  cars_.accounts.add(car, OFF_TRACK, sum.friction.force, sum.friction.torque);
  lies_[car] = true;
}

void SpatialGround::keep_strain() {
  for (const std::size_t k : strained_) {
    const auto first = static_cast<std::ptrdiff_t>(kPoints * k);
    std::copy_n(sheared_next_.begin() + first, kPoints, sheared_.begin() + first);
  }
  strained_.clear();
}

double SpatialGround::energy(std::size_t car, const SpatialMotion& q, double s) const {
  double squares = 0.0;
  const Body& b = cars_.bodies[car];
  if (b.cylinder) {
    for (std::size_t i = 0; i < kBalls; ++i) {
      bed_.touches_of_ball(
          ball_of(b, q, i), b.shell_radius, s,
          [&](const Vector3d&, const Vector3d&, double depth, std::size_t) { squares += depth * depth; });
    }
  } else {
    for (std::size_t i = 0; i < corners(b); ++i) {
      const Vector3d place = q.point(corner_of(b, i));
      const double depth = bed_.ground(place, s).z - place.z();
      if (depth > 0.0) squares += depth * depth;
    }
  }
  return 0.5 * cars_.scenario.terrain.body_stiffness * squares;
}

void SpatialGround::walk(files::Archive& archive) {
  archive.column("feet", feet_);
  archive.numbers("sheared", &sheared_.data()->x, static_cast<std::ptrdiff_t>(3 * sheared_.size()));
  if (!archive.restoring()) return;
  strained_.clear();
  std::fill(above_.begin(), above_.end(), 0.0);
  for (std::size_t k = 0; k < cars_.n; ++k) {
    const auto first = sheared_.begin() + static_cast<std::ptrdiff_t>(kPoints * k);
    lies_[k] = std::any_of(first, first + kPoints,
                           [](const Three<double>& v) { return v.x != 0.0 || v.y != 0.0 || v.z != 0.0; });
  }
}

}  // namespace train_derail::model
