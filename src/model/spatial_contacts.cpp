#include "model/spatial_contacts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "model/pairs.hpp"
#include "train_derail/model/contact_law.hpp"

namespace train_derail::model {

using Eigen::Vector3d;

namespace {

constexpr double kMargin = 1.0;       // of pairs of bodies that are looked at, m
constexpr double kSameImpact = 0.25;  // s: touches of the same two cars closer together are one impact
constexpr double kLasting = 0.5;      // from then on bodies that touch lean on each other, s
constexpr double kBearable = 0.5;     // of a car's speed, that all bodies which lean on it may take away in one step

/// The head of a cylinder ends where it looks as much aside as along the car.
Face face_met(const Body& body, const SpatialMotion& car, const Vector3d& push) {
  const Vector3d own = car.axes.transpose() * push, size = own.cwiseAbs();
  const bool end =
      body.cylinder ? size.x() > std::hypot(size.y(), size.z()) : size.x() > size.y() && size.x() >= size.z();
  if (end) return own.x() < 0.0 ? Face::front : Face::rear;
  if (size.z() > size.y()) return own.z() < 0.0 ? Face::top : Face::bottom;
  return own.y() < 0.0 ? Face::left : Face::right;
}

/// Forces on one car that push another back, whose centre is `between` behind its own.
void push_apart(SpatialCars& cars, std::size_t car, std::size_t back, Account account, const Wrench& w,
                const Vector3d& between) {
  cars.push(car, account, w);
  cars.push(back, account, {-w.force, -w.torque - between.cross(w.force)});
}

/// What a force where bodies touch changes of a car's speed there, along the normal and across it [1/kg].
struct Response {
  double along = 0.0, across = 0.0;
};

Response response(const Body& body, const SpatialMotion& car, const BodyManifold& m) {
  const Three<double> normal = three(car.axes.transpose() * m.normal), inertia = three(body.inertia);
  Response r;
  for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) {
    const Three<double> arm = three(car.axes.transpose() * (m.point[i] - car.centre)), turn = arm.cross(normal);
    const Three<double> square = {arm.x * arm.x, arm.y * arm.y, arm.z * arm.z};
    const double along = turn.dot(turn.over(inertia));
    const double all =
        (square.y + square.z) / inertia.x + (square.x + square.z) / inertia.y + (square.x + square.y) / inertia.z;
    r.along += m.share[i] * along;
    r.across += m.share[i] * (all - along);
  }
  r.along += 1.0 / body.mass;
  r.across += 2.0 / body.mass;
  return r;
}

bool end_met(const Body& body, const SpatialMotion& car, const Vector3d& push) {
  const Face face = face_met(body, car, push);
  return face == Face::front || face == Face::rear;
}

}  // namespace

SpatialContacts::SpatialContacts(SpatialCars& cars, Record& record, Waker& waker)
    : cars_(cars), record_(record), waker_(waker), damped_(cars.n, 0.0), damped_before_(cars.n, 0.0) {
  for (std::size_t k = 0; k < cars.n; ++k) by_x_.push_back(static_cast<int>(k));
}

Box SpatialContacts::box(std::size_t k) const {
  const Body& b = cars_.bodies[k];
  const SpatialMotion& q = cars_.at(k);
  return {q.point(b.box_centre), q.axes, b.box_half};
}

Cylinder SpatialContacts::cylinder(std::size_t k) const {
  const Body& b = cars_.bodies[k];
  const SpatialMotion& q = cars_.at(k);
  return {q.point(b.box_centre), q.axes.col(0), b.shell_half(), b.shell_radius};
}

/// Where the two press on each other.
BodyContact SpatialContacts::meet(const Pair& pair) const {
  const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
  const bool round_a = cars_.bodies[a].cylinder, round_b = cars_.bodies[b].cylinder;
  if (round_a && round_b) return press(cylinder(a), cylinder(b), pair.crushed);
  if (round_a) return press(cylinder(a), box(b), pair.crushed);
  if (round_b) {
    BodyContact contact = press(cylinder(b), box(a), pair.crushed);
    contact.manifold.normal *= -1.0;
    return contact;
  }
  const Box box_a = box(a), box_b = box(b);
  BodyContact contact{press(box_a, box_b, pair.axis)};
  if (contact.manifold.count == 0) contact.gap = gap(box_a, box_b);
  return contact;
}

void SpatialContacts::find_pairs() {
  const double* radius = cars_.radius();
  const auto begin_of = [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    return cars_.state[SX * cars_.n + k] - radius[k];
  };
  sort_again(by_x_, begin_of);
  old_pairs_.swap(pairs_);
  pairs_.clear();
  for (std::size_t i = 0; i < by_x_.size(); ++i) {
    const auto a = static_cast<std::size_t>(by_x_[i]);
    for (std::size_t j = i + 1; j < by_x_.size(); ++j) {
      const auto b = static_cast<std::size_t>(by_x_[j]);
      const double reach = radius[a] + radius[b] + 2.0 * kMargin;
      if (begin_of(by_x_[j]) > cars_.state[SX * cars_.n + a] + radius[a] + 2.0 * kMargin) break;
      if ((cars_.centre(a) - cars_.centre(b)).squaredNorm() > reach * reach) continue;
      const auto [first, second] = std::minmax(by_x_[i], by_x_[j]);
      pairs_.push_back({first, second});
    }
  }
  keep_known(pairs_, old_pairs_);
}

void SpatialContacts::press_all(double t, double h) {
  if (cars_.scenario.contact.law == inputs::ContactLaw::none) return;
  if (moved_ > kMargin) {
    find_pairs();
    moved_ = 0.0;
  }
  // Half as much again for what speeds may grow within this step.
  moved_ += 1.5 * h * (cars_.fastest + cars_.spinning);
  damped_.swap(damped_before_);
  std::fill(damped_.begin(), damped_.end(), 0.0);
  const std::size_t n = cars_.n;
  const double *vx = cars_.state + SVX * n, *vy = vx + n, *vz = vy + n, *swirl = cars_.swirl.data();
  // Who wakes may wake others.
  for (bool all = false; !all;) {
    all = true;
    for (Pair& pair : pairs_) {
      const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
      const bool lie = cars_.rest.any() && cars_.rest.lies(a) && cars_.rest.lies(b);
      if (lie || pair.round == cars_.round) continue;
      pair.round = cars_.round;
      // As far as they were apart, less what they may have moved since then, they need not be looked at.
      const double parting = std::abs(vx[a] - vx[b]) + std::abs(vy[a] - vy[b]) + std::abs(vz[a] - vz[b]);
      pair.apart -= 1.05 * h * (parting + swirl[a] + swirl[b]);
      if (!(pair.apart > 0.0) && touch(t, h, pair)) all = false;
    }
  }
}

/// They have touched for so long that this is no blow.
bool SpatialContacts::leans(double t, const Pair& pair) const {
  return pair.impact >= 0 && !(t - pair.pressed > kSameImpact) && t - pair.since > kLasting;
}

/// Share of damping that steps of length h can carry: in a pile every car leans on several others, and each of them may
/// damp as much as one step can stop. Together they would throw the car back and forth for ever.
double SpatialContacts::bearable(double h, const Pair& pair, const BodyManifold& m, double damping,
                                 double rub_damping) {
  double share = 1.0;
  for (const int car : {pair.a, pair.b}) {
    const auto k = static_cast<std::size_t>(car);
    if (cars_.rest.lies(k)) continue;
    const Response r = response(cars_.bodies[k], cars_.at(k), m);
    const double here = damping * r.along + rub_damping * r.across;
    damped_[k] += here;
    share = std::min(share, kBearable / (h * std::max(here, damped_before_[k])));
  }
  return share;
}

/// True if it has woken a car.
bool SpatialContacts::touch(double t, double h, Pair& pair) {
  const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
  const BodyContact contact = meet(pair);
  const BodyManifold& m = contact.manifold;
  pair.axis = m.axis;
  pair.apart = m.count > 0 ? 0.0 : contact.gap - 1e-3;
  if (m.count == 0) {
    pair.crushed = 0.0;
    pair.sheared.setZero();
    return wakes(pair, Vector3d::Zero());
  }
  // Bodies that have crushed each other may part before they are clear of each other: that is no new impact.
  if (pair.impact >= 0 && !(t - pair.overlapped > kSameImpact)) pair.overlapped = t;
  inputs::Contact law = cars_.scenario.contact;
  const SpatialMotion &q = cars_.at(a), &r = cars_.at(b);
  if (law.side_crush_force < law.crush_force &&
      !(end_met(cars_.bodies[a], q, m.normal) && end_met(cars_.bodies[b], r, -m.normal)))
    law.crush_force = law.side_crush_force;
  double quiet = cars_.scenario.ground.regularization_speed;
  const auto points = static_cast<std::size_t>(m.count);
  const double reduced = cars_.bodies[a].mass * cars_.bodies[b].mass / (cars_.bodies[a].mass + cars_.bodies[b].mass);
  double rub_damping = friction_damping(law, reduced);
  if (leans(t, pair)) {
    double depth = 0.0;
    // What speeds change in ten steps of free fall: slower than that, a car that lies on another would hop as the force
    // changes between loading and unloading. A blow does not ask for it, and would depend on the step.
    quiet = std::max(quiet, 10.0 * inputs::kStandardGravity * h);
    for (std::size_t i = 0; i < points; ++i) depth += m.share[i] * std::max(m.depth[i] - pair.crushed, 0.0);
    const double share = bearable(h, pair, m, quiet_damping(law, depth, quiet), rub_damping);
    quiet /= share;
    rub_damping *= share;
  }
  // Numbers of their own, not Eigen's vectors: these go through memory after a cross product.
  using Vector = Three<double>;
  const Vector3d between = q.centre - r.centre;
  const Vector centre = three(q.centre), along = three(m.normal), turns = three(q.rotation - r.rotation);
  const Vector moves = three(q.velocity - r.velocity - r.rotation.cross(between));
  std::array<Vector, 8> arm, slip;
  std::array<double, 8> pushes;
  Vector first_velocity{}, mean_slip{}, mean_arm{};
  double force = 0.0, fastest = 0.0, crushed = pair.crushed;
  for (std::size_t i = 0; i < points; ++i) {
    arm[i] = three(m.point[i]) - centre;
    const Vector v = moves + turns.cross(arm[i]);
    const double closing = -v.dot(along);
    if (i == 0 || closing > fastest) {
      first_velocity = v;
      fastest = closing;
    }
    double own = pair.crushed;  // of all points alike, in whatever order they are found
    pushes[i] = m.share[i] * quiet_contact_force(law, m.depth[i], closing, quiet, own);
    crushed = std::max(crushed, own);
    slip[i] = v + along * closing;
    force += pushes[i];
    mean_slip = mean_slip + slip[i] * pushes[i];
    mean_arm = mean_arm + arm[i] * pushes[i];
    double& overlap = record_.incidents.overlap_max;
    overlap = std::max(overlap, m.depth[i] - own);
  }
  pair.crushed = crushed;
  if (!(force > 0.0)) {
    pair.sheared.setZero();
    return wakes(pair, Vector3d::Zero());
  }
  // Friction strains the bodies until they slide, as on the ground.
  pair.sheared -= pair.sheared.dot(m.normal) * m.normal;
  pair.sheared += h / force * vector(mean_slip);
  const double strained = law.stiffness * pair.sheared.norm(), most = law.friction * force;
  if (strained > most) pair.sheared *= most / strained;
  const bool woken = wakes(pair, force * m.normal - law.stiffness * pair.sheared);
  const Vector held = three(law.stiffness * pair.sheared);
  Vector rubbing{}, turning{};
  for (std::size_t i = 0; i < points; ++i) {
    const Vector rub = (held + slip[i] * rub_damping) * (-pushes[i] / force);
    const double square = rub.dot(rub), limit = law.friction * pushes[i];
    const Vector most_of_it = square > limit * limit ? rub * (limit / std::sqrt(square)) : rub;
    rubbing = rubbing + most_of_it;
    turning = turning + arm[i].cross(most_of_it);
  }
  push_apart(cars_, a, b, IMPACT_NORMAL, {force * m.normal, vector(mean_arm.cross(along))}, between);
  push_apart(cars_, a, b, IMPACT_FRICTION, {vector(rubbing), vector(turning)}, between);
  note(t, h, pair, m, vector(first_velocity), force);
  return woken;
}

/// Wakes a car that lies if the force between it and its neighbour is no longer what it was; true if it has.
bool SpatialContacts::wakes(Pair& pair, const Vector3d& force) {
  const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
  if (!cars_.rest.lies(a) && !cars_.rest.lies(b)) return false;
  const std::size_t car = cars_.rest.lies(a) ? a : b;
  waker_.wake_if_pushed(car, pair.held.change(force));
  return !cars_.rest.lies(car);
}

void SpatialContacts::note(double t, double h, Pair& pair, const BodyManifold& m, const Vector3d& velocity,
                           double force) {
  std::vector<Impact>& impacts = record_.incidents.impacts;
  if (pair.impact < 0 || t - pair.pressed > kSameImpact) pair.since = t;
  const SpatialMotion &a = cars_.at(static_cast<std::size_t>(pair.a)), &b = cars_.at(static_cast<std::size_t>(pair.b));
  if (pair.impact < 0 || t - pair.overlapped > kSameImpact) {
    pair.impact = static_cast<int>(impacts.size());
    const Vector3d& p = m.point[0];
    const Body &body_a = cars_.bodies[static_cast<std::size_t>(pair.a)],
               &body_b = cars_.bodies[static_cast<std::size_t>(pair.b)];
    impacts.push_back({t, t, pair.a, pair.b, face_met(body_a, a, m.normal), face_met(body_b, b, -m.normal),
                       (p - a.centre).dot(a.axes.col(0)), (p - b.centre).dot(b.axes.col(0)), p.x(), p.y(), p.z(),
                       velocity.norm(), -velocity.dot(m.normal), 0.0, 0.0});
  }
  pair.overlapped = pair.pressed = t;
  Impact& impact = impacts[static_cast<std::size_t>(pair.impact)];
  impact.end = t + h;
  impact.impulse += force * h;
  impact.peak_force = std::max(impact.peak_force, force);
}

void SpatialContacts::hold(std::size_t car) {
  for (Pair& p : pairs_)
    if (p.has(car)) p.hold();
}

void SpatialContacts::resume(std::size_t car) {
  for (Pair& p : pairs_)
    if (p.has(car)) p.overlapped = p.pressed = cars_.now;
}

void SpatialContacts::walk(files::Archive& archive) {
  archive.value("moved", moved_);
  archive.column("damped", damped_);
  archive.list("by_x", by_x_, [&](int& car) { archive.value("car", car); });
  archive.list("pairs", pairs_, [&](Pair& pair) {
    archive.value("a", pair.a);
    archive.value("b", pair.b);
    archive.value("axis", pair.axis);
    archive.value("crushed", pair.crushed);
    archive.column("sheared", pair.sheared);
    archive.value("impact", pair.impact);
    archive.group("held", [&] { pair.held.walk(archive); });
    archive.value("overlapped", pair.overlapped);
    archive.value("pressed", pair.pressed);
    archive.value("since", pair.since);
  });
}

}  // namespace train_derail::model
