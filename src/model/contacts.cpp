#include "model/contacts.hpp"

#include <algorithm>
#include <cmath>

#include "model/pairs.hpp"
#include "train_derail/model/contact_law.hpp"

namespace train_derail::model {

namespace {

// Bounds are widened by it: pairs are looked for anew when a car has strayed that far from where it was going. Coupled
// cars that stand in line are no pairs then [m].
constexpr double kMargin = 0.5;
constexpr double kHorizon = 0.1;      // pairs are looked for anew after that time, too [s]
constexpr double kSameImpact = 0.25;  // s
constexpr double kLasting = 0.5;      // from then on bodies that touch lean on each other [s],
constexpr double kSlow = 0.3;         // while no point of either is faster [m/s]
constexpr double kBlur = 0.01;        // m, by which bodies are taken to be nearer than they are: kicks change speeds

Vector2 velocity_at(const CarColumns& q, int car, const Vector2& point) {
  return {q.vx[car] - q.omega[car] * (point.y() - q.y[car]), q.vy[car] + q.omega[car] * (point.x() - q.x[car])};
}

/// The face of a car that a push along `direction` (into the car) meets.
Face face_met(const Footprint& box, const Vector2& direction) {
  const double along = box.axis.dot(direction), across = box.side().dot(direction);
  if (std::abs(along) > std::abs(across)) return along < 0.0 ? Face::front : Face::rear;
  return across < 0.0 ? Face::left : Face::right;
}

}  // namespace

Contacts::Contacts(const inputs::Contact& law, const std::vector<Car>& cars, double regularization_speed,
                   const ExtendedKernels& loops, Record& record, PlanarRest& rest)
    : law_(law),
      regularization_speed_(regularization_speed),
      loops_(loops),
      record_(record),
      moved_(inputs::kInfinity),
      vx_then_(cars.size(), 0.0),
      vy_then_(cars.size(), 0.0),
      bounds_(cars.size()),
      rest_(rest) {
  for (const Car& c : cars) {
    boxes_.push_back({Vector2::Zero(), Vector2::UnitX(), 0.5 * c.length, 0.5 * c.width});
    radius_.push_back(std::hypot(0.5 * c.length, 0.5 * c.width));
    mass_.push_back(c.mass);
    by_x_.push_back(static_cast<int>(by_x_.size()));
  }
}

void Contacts::find_pairs(const CarColumns& q) {
  std::copy_n(q.vx, boxes_.size(), vx_then_.begin());
  std::copy_n(q.vy, boxes_.size(), vy_then_.begin());
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    const Footprint& f = boxes_[i];
    const double rx = f.reach({1.0, 0.0}) + kMargin, ry = f.reach({0.0, 1.0}) + kMargin;
    bounds_[i] = {f.centre.x() - rx, f.centre.x() + rx, f.centre.y() - ry, f.centre.y() + ry};
  }
  // Sweep along x, with what they may come nearer to each other by their velocities.
  const auto begin_of = [this](int i) { return bounds_[static_cast<std::size_t>(i)][0]; };
  sort_again(by_x_, begin_of);
  const auto [slowest, fastest] = std::minmax_element(vx_then_.begin(), vx_then_.end());
  const double most = kHorizon * (*fastest - *slowest);
  old_pairs_.swap(pairs_);
  pairs_.clear();
  for (std::size_t i = 0; i < by_x_.size(); ++i) {
    const auto k = static_cast<std::size_t>(by_x_[i]);
    const Eigen::Vector4d& p = bounds_[k];
    for (std::size_t j = i + 1; j < by_x_.size(); ++j) {
      const auto l = static_cast<std::size_t>(by_x_[j]);
      const Eigen::Vector4d& r = bounds_[l];
      if (r[0] > p[1] + most) break;
      const double x = kHorizon * std::abs(vx_then_[k] - vx_then_[l]),
                   y = kHorizon * std::abs(vy_then_[k] - vy_then_[l]);
      if (r[0] > p[1] + x || r[2] > p[3] + y || p[2] > r[3] + y) continue;
      const auto [a, b] = std::minmax(by_x_[i], by_x_[j]);
      pairs_.push_back({a, b});
    }
  }
  keep_known(pairs_, old_pairs_);
  free_leanings();
}

void Contacts::free_leanings() {
  std::vector<bool> used(leaning_.size(), false);
  for (const Pair& pair : pairs_)
    if (pair.still >= 0) used[static_cast<std::size_t>(pair.still)] = true;
  free_.clear();
  for (std::size_t i = 0; i < used.size(); ++i)
    if (!used[i]) free_.push_back(static_cast<int>(i));
}

void Contacts::place(std::size_t car, const CarColumns& q) {
  boxes_[car].centre = {q.x[car], q.y[car]};
  boxes_[car].axis = {q.cosine[car], q.sine[car]};
}

void Contacts::sort_out(double t, const CarColumns& q) {
  if (sorted_ && changes_ == rest_.changes()) return;
  sorted_ = true;
  changes_ = rest_.changes();
  moving_.clear();
  still_.clear();
  for (std::size_t i = 0; i < pairs_.size(); ++i) {
    Pair& pair = pairs_[i];
    if (!rest_.lies(pair.a) || !rest_.lies(pair.b)) {
      if (pair.still >= 0) {
        pair.seen = t;  // it goes on from where it was
        free_.push_back(pair.still);
        pair.still = -1;
      }
      moving_.push_back(i);
      continue;
    }
    if (pair.still < 0) find_still(pair, q);
    if (!leaning_[static_cast<std::size_t>(pair.still)].on_a.isZero(0.0)) still_.push_back(i);
  }
}

void Contacts::find_still(Pair& pair, const CarColumns& q) {
  if (free_.empty()) {
    free_.push_back(static_cast<int>(leaning_.size()));
    leaning_.emplace_back();
  }
  pair.still = free_.back();
  free_.pop_back();
  Leaning& leaning = leaning_[static_cast<std::size_t>(pair.still)];
  leaning = {};
  const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
  place(a, q);
  place(b, q);
  const Manifold m = press(boxes_[a], boxes_[b]);
  for (int i = 0; i < m.count; ++i) {
    const Vector2 f = contact_force(law_, m.depth[i], 0.0, pair.crushed) / m.count * m.normal;
    const Vector2 ra = m.point[i] - boxes_[a].centre, rb = m.point[i] - boxes_[b].centre;
    leaning.on_a += Eigen::Vector3d(f.x(), f.y(), ra.x() * f.y() - ra.y() * f.x());
    leaning.on_b -= Eigen::Vector3d(f.x(), f.y(), rb.x() * f.y() - rb.y() * f.x());
  }
}

void Contacts::add_still(const Wrenches& loads) const {
  const auto add = [&](int car, const Eigen::Vector3d& f) {
    if (!rest_.touched(car)) return;
    loads.fx[car] += f.x();
    loads.fy[car] += f.y();
    loads.moment[car] += f.z();
  };
  for (const std::size_t i : still_) {
    const Leaning& leaning = leaning_[static_cast<std::size_t>(pairs_[i].still)];
    add(pairs_[i].a, leaning.on_a);
    add(pairs_[i].b, leaning.on_b);
  }
}

void Contacts::add(double t, double h, const CarColumns& q, const Wrenches& loads) {
  pushes_.clear();
  if (moved_ > kMargin || age_ + h > kHorizon) {
    for (std::size_t i = 0; i < boxes_.size(); ++i) place(i, q);
    find_pairs(q);
    moved_ = age_ = 0.0;
    sorted_ = false;
  }
  // Half as much again for what speeds may grow within this step.
  moved_ += 1.5 * h *
            loops_.fastest_point(static_cast<std::ptrdiff_t>(boxes_.size()), q.vx, q.vy, q.omega, vx_then_.data(),
                                 vy_then_.data(), radius_.data());
  age_ += h;
  sort_out(t, q);
  for (const std::size_t i : moving_) {
    Pair& pair = pairs_[i];
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    // As far as they were apart, less what they may have come nearer since then, they need not be looked at.
    pair.apart -= h * (std::abs(q.vx[a] - q.vx[b]) + std::abs(q.vy[a] - q.vy[b]) + radius_[a] * std::abs(q.omega[a]) +
                       radius_[b] * std::abs(q.omega[b]));
    if (!(pair.apart > 0.0)) press_pair(t, h, pair, q, loads);
  }
  if (!still_.empty()) add_still(loads);
}

double Contacts::leaning_force(double depth, double rate, double speed_per_force, double& crushed) const {
  const double full = contact_force(law_, depth, rate, crushed);
  if (!(rate > 0.0)) return full;
  const double held = law_.restitution * law_.restitution;
  const double quiet = std::max(regularization_speed_, full * speed_per_force);  // no finer than one step can follow
  return full * (held + (1.0 - held) * rate / std::sqrt(rate * rate + quiet * quiet));
}

void Contacts::press_pair(double t, double h, Pair& pair, const CarColumns& q, const Wrenches& loads) {
  const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
  place(a, q);
  place(b, q);
  const Manifold m = press(boxes_[a], boxes_[b]);
  pair.apart = m.count > 0 ? 0.0 : gap(boxes_[a], boxes_[b]) - kBlur;
  if (m.count == 0) {
    pair.crushed = 0.0;
    return;
  }
  for (const int car : {pair.a, pair.b}) {
    if (rest_.lies(car)) rest_.touch(car, loads);
  }
  double force = 0.0;
  Vector2 first_velocity = Vector2::Zero();
  // A force that jumps where bodies cease to close would keep for ever in tremor those that lean on each other.
  const bool known = pair.impact >= 0 && !(t - pair.seen > kSameImpact);
  const auto slow = [&](std::size_t car) {
    return std::abs(q.vx[car]) + std::abs(q.vy[car]) + radius_[car] * std::abs(q.omega[car]) < kSlow;
  };
  const bool lasts = known && slow(a) && slow(b) &&
                     t - record_.incidents.impacts[static_cast<std::size_t>(pair.impact)].time > kLasting;
  const double share = 1.0 / m.count, reduced_mass = mass_[a] * mass_[b] / (mass_[a] + mass_[b]);
  for (int i = 0; i < m.count; ++i) {
    const Vector2& p = m.point[i];
    const Vector2 v = velocity_at(q, pair.a, p) - velocity_at(q, pair.b, p);
    const double closing = -v.dot(m.normal);
    if (i == 0 || closing > -first_velocity.dot(m.normal)) first_velocity = v;
    const double push = share * (lasts ? leaning_force(m.depth[i], closing, h / (0.25 * reduced_mass), pair.crushed)
                                       : contact_force(law_, m.depth[i], closing, pair.crushed));
    if (push <= 0.0) continue;
    force += push;
    double& overlap = record_.incidents.overlap_max;
    overlap = std::max(overlap, m.depth[i] - pair.crushed);
    const Vector2 slip = v + closing * m.normal;
    // No finer than one step can follow.
    const double v_eps = std::max(regularization_speed_, law_.friction * push * h / (0.25 * reduced_mass));
    const Vector2 friction = -law_.friction * push / std::sqrt(slip.squaredNorm() + v_eps * v_eps) * slip;
    const Vector2 normal = push * m.normal, f = normal + friction;
    const Vector2 ra = p - boxes_[a].centre, rb = p - boxes_[b].centre;
    loads.fx[pair.a] += f.x();
    loads.fy[pair.a] += f.y();
    loads.moment[pair.a] += ra.x() * f.y() - ra.y() * f.x();
    loads.fx[pair.b] -= f.x();
    loads.fy[pair.b] -= f.y();
    loads.moment[pair.b] -= rb.x() * f.y() - rb.y() * f.x();
    pushes_.push_back({pair.a, pair.b, p, normal, friction});
  }
  note(t, h, pair, m, first_velocity, force);
}

void Contacts::note(double t, double h, Pair& pair, const Manifold& m, const Vector2& velocity, double force) {
  std::vector<Impact>& impacts = record_.incidents.impacts;
  const Footprint &a = boxes_[static_cast<std::size_t>(pair.a)], &b = boxes_[static_cast<std::size_t>(pair.b)];
  if (pair.impact < 0 || t - pair.seen > kSameImpact) {
    pair.impact = static_cast<int>(impacts.size());
    const Vector2& p = m.point[0];
    impacts.push_back({t, t, pair.a, pair.b, face_met(a, m.normal), face_met(b, -m.normal), (p - a.centre).dot(a.axis),
                       (p - b.centre).dot(b.axis), p.x(), p.y(), 0.0, velocity.norm(), -velocity.dot(m.normal), 0.0,
                       0.0});
  }
  pair.seen = t;
  Impact& impact = impacts[static_cast<std::size_t>(pair.impact)];
  impact.end = t + h;
  impact.impulse += force * h;
  impact.peak_force = std::max(impact.peak_force, force);
}

void Contacts::mark_near(const CarColumns& q, const std::vector<bool>& asked, std::vector<bool>& near) {
  for (Pair& pair : pairs_) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    if (!asked[a] && !asked[b]) continue;
    if (pair.apart < kNear) {
      place(a, q);
      place(b, q);
      pair.apart = gap(boxes_[a], boxes_[b]) - kBlur;
    }
    if (!(pair.apart < kNear)) continue;
    near[a] = near[a] || asked[a];
    near[b] = near[b] || asked[b];
  }
}

bool Contacts::touches(const BusyCars& cars) const {
  const auto among = [&](int car) {
    return std::any_of(cars.ranges, cars.ranges + cars.count,
                       [car](const CarRange& r) { return car >= r.from && car < r.to; });
  };
  return std::any_of(pushes_.begin(), pushes_.end(), [&](const Push& p) { return among(p.a) || among(p.b); });
}

void Contacts::account(double h, const CarColumns& before, const CarColumns& after) {
  double crushing = 0.0, friction = 0.0;
  for (const Push& p : pushes_) {
    // Arms of the beginning of the step, where the forces acted.
    const auto velocity = [&](int car) {
      const Vector2 r = p.point - Vector2(before.x[car], before.y[car]);
      const double omega = 0.5 * (before.omega[car] + after.omega[car]);
      return Vector2(0.5 * (before.vx[car] + after.vx[car]) - omega * r.y(),
                     0.5 * (before.vy[car] + after.vy[car]) + omega * r.x());
    };
    const Vector2 v = velocity(p.a) - velocity(p.b);
    crushing -= h * p.normal.dot(v);
    friction -= h * p.friction.dot(v);
  }
  record_.spent.work_impact_normal += crushing;
  record_.spent.work_impact_friction += friction;
}

void Contacts::walk(files::Archive& archive) {
  archive.value("moved", moved_);
  archive.value("age", age_);
  archive.column("vx_then", vx_then_);
  archive.column("vy_then", vy_then_);
  archive.list("by_x", by_x_, [&](int& car) { archive.value("car", car); });
  archive.list("pairs", pairs_, [&](Pair& p) {
    archive.value("a", p.a);
    archive.value("b", p.b);
    archive.value("crushed", p.crushed);
    archive.value("apart", p.apart);
    archive.value("impact", p.impact);
    archive.value("seen", p.seen);
  });
}

}  // namespace train_derail::model
