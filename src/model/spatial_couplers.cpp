#include "model/spatial_couplers.hpp"

#include <array>

#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/draft_gear_law.hpp"

namespace train_derail::model {

using Eigen::Vector3d;

namespace {

/// Energy of a stop that begins at `limit`, at most a moment `max`.
double stop_energy(double angle, double limit, double stiffness, double max) {
  const double beyond = std::max(std::abs(angle) - limit, 0.0), linear = max / stiffness;
  if (!(stiffness > 0.0)) return 0.0;
  if (beyond <= linear) return 0.5 * stiffness * beyond * beyond;
  return max * (beyond - 0.5 * linear);
}
double stop_moment(double angle, double limit, double stiffness, double max) {
  const double beyond = std::abs(angle) - limit;
  return beyond > 0.0 ? std::copysign(std::min(stiffness * beyond, max), angle) : 0.0;
}

}  // namespace

SpatialCouplers::SpatialCouplers(SpatialCars& cars, const std::vector<Car>& train, AirBrakes& brakes, Record& record,
                                 Waker& waker)
    : cars_(cars), brakes_(brakes), record_(record), waker_(waker) {
  const std::size_t n = cars.n;
  for (auto* a : {&bars_, &about_lead_, &about_trail_}) a->assign(3 * (n + 1), 0.0);
  for (auto* a : {&pin_axial_, &pin_damper_}) a->assign(n + 1, 0.0);
  alive_.assign(n > 0 ? n - 1 : 0, 1.0);
  far_.assign(alive_.size(), 0.0);
  rise_.assign(alive_.size(), 0.0);
  axial_ = ArrayX::Zero(static_cast<Eigen::Index>(alive_.size()));
  damping_.resize(alive_.size());
  for (std::size_t i = 0; i < alive_.size(); ++i)
    damping_[i] = coupler_damping(cars.scenario.coupler, cars.bodies[i].mass, cars.bodies[i + 1].mass);
  stops_.resize(alive_.size());
  engaged_.assign(alive_.size(), 0);
  held_.resize(alive_.size());
  for (std::size_t i = 0; i < alive_.size(); ++i) {
    const auto type = [&](std::size_t car) -> const std::string& { return train[car].coupler_type; };
    // Types are looked up by words; in a train the next pair is mostly like the one before.
    const bool as_before = i > 0 && type(i) == type(i - 1) && type(i + 1) == type(i);
    holds_.push_back(as_before ? holds_.back() : inputs::coupler_hold(cars.scenario.coupler, type(i), type(i + 1)));
  }
  show();
}

void SpatialCouplers::show() {
  SpatialArrays& a = cars_.arrays;
  const inputs::Coupler& law = cars_.scenario.coupler;
  const double swing = std::min(law.swing_limit, law.break_swing);
  a.coupler = &law;
  a.tan_swing = swing < 0.5 * M_PI ? std::tan(swing) : inputs::kInfinity;
  double pitch = inputs::kInfinity, roll = inputs::kInfinity;
  for (const inputs::CouplerHold& h : holds_) {
    least_slip_ = std::min(least_slip_, h.slip_height);
    pitch = std::min(pitch, h.pitch_limit);
    roll = std::min(roll, h.roll_limit);
  }
  a.sin_pitch = pitch < 0.5 * M_PI ? std::sin(pitch) : 1.0;
  a.cos_roll = roll < M_PI ? std::cos(roll) : -1.0;
  a.alive = alive_.data();
  a.damping = damping_.data();
  a.axial = axial_.data();
  a.pin_axial = pin_axial_.data();
  a.pin_damper = pin_damper_.data();
  a.bar = bars_.data();
  a.about_lead = about_lead_.data();
  a.about_trail = about_trail_.data();
  a.far = far_.data();
  a.rise = rise_.data();
}

Bar SpatialCouplers::bar(const SpatialMotion& lead, const SpatialMotion& trail, std::size_t i) const {
  const std::vector<Body>& bodies = cars_.bodies;
  Bar b;
  const double height = cars_.scenario.coupler.height;
  b.arm_lead = lead.axes * Vector3d(-bodies[i].half_length, 0.0, height - bodies[i].centre_height);
  b.arm_trail = trail.axes * Vector3d(bodies[i + 1].half_length, 0.0, height - bodies[i + 1].centre_height);
  const Vector3d d = (lead.centre - trail.centre) + (b.arm_lead - b.arm_trail);
  b.gap = d.norm();
  b.u = d / b.gap;
  b.own[0] = lead.axes.transpose() * b.u;
  b.own[1] = trail.axes.transpose() * b.u;
  b.butts = press_butts<double>(cars_.scenario.coupler, b.gap, b.own[0].z(), b.own[1].z());
  return b;
}

/// Roll of the trail car against the lead car about the bar: between their left sides, seen along it.
double SpatialCouplers::roll(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b) {
  const Vector3d left_a = lead.axes.col(1) - b.own[0].y() * b.u, left_b = trail.axes.col(1) - b.own[1].y() * b.u;
  return std::atan2(left_a.cross(left_b).dot(b.u), left_a.dot(left_b));
}

/// False if no stop can be engaged and no swing be near its limit: found without an arc tangent.
bool SpatialCouplers::turned_far(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b) const {
  for (const Vector3d& own : b.own) {
    if (!(own.x() > 0.0 && std::abs(own.y()) <= cars_.arrays.tan_swing * own.x() &&
          std::abs(own.z()) <= cars_.arrays.sin_pitch))
      return true;
  }
  const double a = b.own[0].y(), c = b.own[1].y();
  const double dot = lead.axes.col(1).dot(trail.axes.col(1)) - a * c;
  const double cos_roll = cars_.arrays.cos_roll;
  if (cos_roll <= 0.0) return cos_roll > -1.0;
  return !(dot > 0.0 && dot * dot >= cos_roll * cos_roll * (1.0 - a * a) * (1.0 - c * c));
}

double SpatialCouplers::stop_energy_of(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b,
                                       std::size_t i) const {
  const inputs::Coupler& law = cars_.scenario.coupler;
  if (!turned_far(lead, trail, b)) return 0.0;
  double e = 0.0;
  for (const int end : {0, 1}) {
    e += stop_energy(b.yaw(end), law.swing_limit, law.swing_stiffness, law.swing_moment_max);
    e += stop_energy(b.pitch(end), holds_[i].pitch_limit, law.pitch_stiffness, inputs::kInfinity);
  }
  return e + stop_energy(roll(lead, trail, b), holds_[i].roll_limit, law.roll_stiffness, inputs::kInfinity);
}

double SpatialCouplers::axial_energy_of(const Bar& b) const {
  const inputs::Coupler& law = cars_.scenario.coupler;
  if (law.draft_gear_travel == 0.0) return axial_energy(law, b.butts.gap);
  return draft_gear_energy(law, std::max(std::abs(b.butts.gap - law.length) - 0.5 * law.slack, 0.0));
}

void SpatialCouplers::couple_all() {
  const Rest& rest = cars_.rest;
  for (std::size_t i = 0; i < alive_.size(); ++i) {
    // The usual case: neither a stop nor a car that lies beside one that does not.
    if (far_[i] == 0.0 && engaged_[i] == 0 && !(rest.any() && rest.lies(i) != rest.lies(i + 1))) continue;
    couple(i);
  }
}

void SpatialCouplers::couple(std::size_t i) {
  Stops& found = stops_[i];
  const bool lead = cars_.rest.lies(i), trail = cars_.rest.lies(i + 1);
  if ((lead && trail) || found.round == cars_.round) return;
  if (engaged_[i] != 0) found = {};
  engaged_[i] = 0;
  found.round = cars_.round;
  if (far_[i] > 0.0) engage_stops(i, bar(cars_.at(i), cars_.at(i + 1), i));
  if (!lead && !trail) return;
  const double change = held_[i].change({axial_[static_cast<Eigen::Index>(i)], found.effort, 0.0});
  waker_.wake_if_pushed(lead ? i : i + 1, change);
}

/// Each stop has an energy that depends on directions of the bar and of the cars. Its gradient turns the cars, and
/// pushes the pins apart sideways.
void SpatialCouplers::engage_stops(std::size_t i, const Bar& b) {
  const inputs::Coupler& law = cars_.scenario.coupler;
  const std::array<const SpatialMotion*, 2> both{&cars_.at(i), &cars_.at(i + 1)};
  Stops& found = stops_[i];
  engaged_[i] = 1;
  Vector3d gradient = Vector3d::Zero();  // of the energy against u
  double moments = 0.0;
  for (const int end : {0, 1}) {
    const double swing = b.yaw(end);
    const double yaw = stop_moment(swing, law.swing_limit, law.swing_stiffness, law.swing_moment_max);
    const double pitch = stop_moment(b.pitch(end), holds_[i].pitch_limit, law.pitch_stiffness, inputs::kInfinity);
    found.swing = std::max(found.swing, std::abs(swing));
    moments += yaw;
    found.effort += (std::abs(yaw) + std::abs(pitch)) / cars_.bodies[i].half_length;
    if (yaw == 0.0 && pitch == 0.0) continue;
    const Vector3d& own = b.own[end];
    const double flat = std::max(std::hypot(own.x(), own.y()), 1.0e-3);
    const Vector3d here = both[static_cast<std::size_t>(end)]->axes *
                          Vector3d(-yaw * own.y() / (flat * flat), yaw * own.x() / (flat * flat), pitch / flat);
    cars_.add(i + static_cast<std::size_t>(end), Vector3d::Zero(), b.u.cross(here));
    gradient += here;
  }
  found.moment = std::abs(moments);
  const double twist =
      stop_moment(roll(*both[0], *both[1], b), holds_[i].roll_limit, law.roll_stiffness, inputs::kInfinity);
  found.twist = std::abs(twist);
  found.effort += found.twist / cars_.bodies[i].half_length;
  for (const int end : {0, 1}) {
    if (twist == 0.0) break;
    const double along = b.own[end].y(), sign = end == 0 ? 1.0 : -1.0;
    Vector3d left = both[static_cast<std::size_t>(end)]->axes.col(1) - along * b.u;
    const double size = std::max(left.norm(), 0.1);
    left /= size;
    cars_.add(i + static_cast<std::size_t>(end), Vector3d::Zero(), sign * twist * (b.u - along / size * left));
    gradient += sign * twist * along / size * b.u.cross(left);
  }
  const Vector3d shear = (gradient.dot(b.u) * b.u - gradient) / b.gap;
  // Shelves go with the cars: up is midway between theirs.
  const Vector3d up = both[0]->axes.col(2) + both[1]->axes.col(2);
  found.vertical = std::abs(shear.dot(up)) / std::max(up.norm(), 1e-3);
  found.effort += shear.norm();
  cars_.push(i, shear, b.arm_lead);
  cars_.push(i + 1, -shear, b.arm_trail);
}

bool SpatialCouplers::break_coupler(double t, std::size_t i) {
  if (alive_[i] == 0.0) return false;
  using By = BrokenCoupler::By;
  const inputs::Coupler& law = cars_.scenario.coupler;
  const double force = axial_[static_cast<Eigen::Index>(i)];
  const Stops& s = stops_[i];
  By by = By::draft;
  if (-force > law.break_draft) by = By::draft;
  else if (s.swing > law.break_swing) by = By::swing;
  else if (s.moment > law.break_moment) by = By::moment;
  else if (std::abs(rise_[i]) > holds_[i].slip_height) by = By::slip;
  else if (s.vertical > holds_[i].vertical_hold) by = By::vertical;
  else if (s.twist > law.break_twist) by = By::twist;
  else return false;
  const Bar b = bar(cars_.at(i), cars_.at(i + 1), i);
  record_.spent.work_coupler_break += stop_energy_of(cars_.at(i), cars_.at(i + 1), b, i) + axial_energy_of(b);
  alive_[i] = 0.0;
  const double at_limit = std::max(force, -law.break_draft);
  record_.incidents.broken.push_back({t, static_cast<Eigen::Index>(i), by, at_limit});
  brakes_.vent(t, static_cast<Eigen::Index>(i));
  note_peak(t, i, at_limit);
  return true;
}

void SpatialCouplers::note_peaks(double t) {
  const Incidents& in = record_.incidents;
  if (peaks_.buff <= in.buff.force && peaks_.draft <= in.draft.force) return;
  for (std::size_t i = 0; i < alive_.size(); ++i) note_peak(t, i, axial_[static_cast<Eigen::Index>(i)]);
}

void SpatialCouplers::note_peak(double t, std::size_t i, double force) {
  Incidents& in = record_.incidents;
  if (force > in.buff.force) in.buff = {force, static_cast<Eigen::Index>(i), t};
  if (-force > in.draft.force) in.draft = {-force, static_cast<Eigen::Index>(i), t};
}

void SpatialCouplers::hold(std::size_t i) {
  if (i < held_.size()) held_[i].known = false;
}

bool SpatialCouplers::give_way(double t) {
  bool any = false;
  const double most = cars_.scenario.coupler.break_draft;
  const bool all_bear = peaks_.draft <= most && peaks_.rise <= least_slip_;
  for (std::size_t i = 0; i < alive_.size(); ++i) {
    const bool bears = all_bear || (-axial_[static_cast<Eigen::Index>(i)] <= most && std::abs(rise_[i]) <= least_slip_);
    if (!(bears && engaged_[i] == 0) && break_coupler(t, i)) any = true;
  }
  return any;
}

CouplerObservation SpatialCouplers::observe(const SpatialMotion& lead, const SpatialMotion& trail,
                                            std::size_t i) const {
  const Bar b = bar(lead, trail, i);
  CouplerObservation o;
  o.gap = b.gap;
  o.angle = std::atan2(b.u.y(), b.u.x());
  o.swing_lead = b.yaw(0);
  o.swing_trail = b.yaw(1);
  o.pitch_lead = b.pitch(0);
  o.pitch_trail = b.pitch(1);
  o.broken = broken(i);
  if (o.broken) return o;
  const inputs::Coupler& law = cars_.scenario.coupler;
  const double spring = coupler_spring_force<double>(law, b.butts.gap);
  o.axial_force = spring + coupler_damper_force<double>(damping_[i], spring, b.rate(lead, trail));
  const auto moment = [&](int end) {
    return stop_moment(b.yaw(end), law.swing_limit, law.swing_stiffness, law.swing_moment_max);
  };
  o.moment_lead = moment(0);
  o.moment_trail = moment(1);
  o.lateral_force = (o.moment_lead + o.moment_trail) / b.gap;
  const double up = o.axial_force * (b.butts.lead + b.butts.trail) +
                    stop_moment(b.pitch(0), holds_[i].pitch_limit, law.pitch_stiffness, inputs::kInfinity) +
                    stop_moment(b.pitch(1), holds_[i].pitch_limit, law.pitch_stiffness, inputs::kInfinity);
  o.vertical_force = -up / b.gap;
  return o;
}

void SpatialCouplers::walk(files::Archive& archive) {
  archive.column("alive", alive_);
  archive.list("held", held_, [&](Held& h) { h.walk(archive); });
}

}  // namespace train_derail::model
