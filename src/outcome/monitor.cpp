#include "train_derail/outcome/monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "outcome/loops.hpp"
#include "train_derail/model/coupler_law.hpp"
#include "train_derail/outcome/pile_up.hpp"
#include "train_derail/outcome/posture.hpp"

namespace train_derail::outcome {

namespace {

/// Velocity of a point that moves with the car.
Vector2 velocity_at(const model::CarMotion& car, const Vector2& point) {
  const Vector2 arm = point - car.centre;
  return car.velocity + car.omega * Vector2(-arm.y(), arm.x());
}

/// Calls use(gap, share of the step) at the extremes within a step of length h of a gap that turns round in it: of the
/// cubic through the values and rates at both ends.
template <class Use>
void turning_points(double h, double gap_from, double rate_from, double gap_to, double rate_to, const Use& use) {
  const double a = h * rate_from, b = h * rate_to, d = gap_to - gap_from;
  const double c2 = 3.0 * d - 2.0 * a - b, c3 = a + b - 2.0 * d;  // gap_from + a s + c2 s^2 + c3 s^3
  const double root = std::sqrt(std::max(c2 * c2 - 3.0 * c3 * a, 0.0));
  const double q = -(c2 + std::copysign(root, c2));  // of 3 c3 s^2 + 2 c2 s + a = 0, without cancellation
  for (const double s : {q / (3.0 * c3), a / q}) {
    if (s > 0.0 && s < 1.0) use(gap_from + s * (a + s * (c2 + s * c3)), s);
  }
}

}  // namespace

Monitor::Monitor(const model::TrainModel& model, const inputs::OutcomeRules& rules, double t,
                 const model::StateVector& y)
    : model_(model),
      loops_(loops()),
      rules_(rules),
      step_time_(t),
      extremes_{{inputs::kInfinity, -1, t}, {-inputs::kInfinity, -1, t}},
      half_length_(model.car_count()),
      half_width_(model.car_count()),
      half_spacing_(model.car_count()) {
  astray_.setZero(model.car_count());
  poses_.setConstant(4, model.car_count(), std::numeric_limits<double>::quiet_NaN());
  for (auto* array : {&rearmost_, &foremost_, &half_breadth_}) array->resize(model.car_count());
  for (auto* array : {&pins_squared_, &centres_squared_}) array->resize(model.coupler_count());
  for (Eigen::Index k = 0; k < model.car_count(); ++k) {
    const model::Car& car = model.cars()[static_cast<std::size_t>(k)];
    half_length_[k] = 0.5 * car.length;
    half_width_[k] = 0.5 * car.width;
    half_spacing_[k] = 0.5 * car.truck_spacing;
    by_x_.push_back(k);
  }
  const model::EnergyLedger first = model_.energy(y.data());
  height_initial_ = first.height;
  energy_initial_ = first.total() - first.height;
  model_.gaps(y.data(), gap_, rate_);
  for (auto* array : {&highest_, &highest_time_, &lowest_, &lowest_time_}) array->resize(model.coupler_count());
  forget_peaks();
  for (Eigen::Index i = 0; i < gap_.size(); ++i) extremes_.consider(i, gap_[i], t);
}

GapStep Monitor::gap_step(double t, const ArrayX& gap, const ArrayX& rate) const {
  return {t - step_time_, gap_.data(), rate_.data(), gap.data(), rate.data()};
}

Extremes Monitor::recent() { return {highest_.data(), highest_time_.data(), lowest_.data(), lowest_time_.data()}; }

void Monitor::GapExtremes::consider(Eigen::Index coupler, double gap, double time) {
  if (gap < closest.gap) closest = {gap, coupler, time};
  if (gap > widest.gap) widest = {gap, coupler, time};
}

void Monitor::extend(GapExtremes& extremes, double t, const ArrayX& gap, const ArrayX& rate) const {
  const double h = t - step_time_;
  if (h <= 0.0 || gap_.size() == 0) return;
  const GapRange range = loops_.reach(gap_.size(), gap_step(t, gap, rate));
  if (range.least >= extremes.closest.gap && range.most <= extremes.widest.gap) return;  // as in most steps
  for (Eigen::Index i = 0; i < gap_.size(); ++i) {
    extremes.consider(i, gap[i], t);
    if (rate_[i] * rate[i] >= 0.0) continue;
    turning_points(h, gap_[i], rate_[i], gap[i], rate[i],
                   [&](double turned, double share) { extremes.consider(i, turned, step_time_ + share * h); });
  }
}

void Monitor::forget_peaks() {
  highest_.setConstant(-inputs::kInfinity);
  lowest_.setConstant(inputs::kInfinity);
  highest_time_.setZero();
  lowest_time_.setZero();
}

void Monitor::consider_recent(Eigen::Index i, double value, double t) {
  loops_.widen(1, &value, t, {&highest_[i], &highest_time_[i], &lowest_[i], &lowest_time_[i]});
}

void Monitor::extend_recent(double t, const ArrayX& values) { loops_.widen(values.size(), values.data(), t, recent()); }

double Monitor::recent_force(double value) const {
  if (std::isinf(value)) return 0.0;
  return model_.incidents() != nullptr ? value : model::axial_force(model_.coupler_law(), -value);
}

PeakForce Monitor::buff_peak(Eigen::Index i, double t, double now) const {
  PeakForce peak{std::max(0.0, recent_force(highest_[i])), static_cast<int>(i) + 1, highest_time_[i]};
  if (now > peak.force) peak = {now, peak.coupler, t};
  return peak;
}

PeakForce Monitor::draft_peak(Eigen::Index i, double t, double now) const {
  PeakForce peak{std::max(0.0, -recent_force(lowest_[i])), static_cast<int>(i) + 1, lowest_time_[i]};
  if (-now > peak.force) peak = {-now, peak.coupler, t};
  return peak;
}

void Monitor::step(double t, const double* y) {
  if (gap_.size() == 0) return;
  if (const model::Incidents* incidents = model_.incidents()) {  // it keeps the peaks of the run itself
    extend_recent(t, *model_.axial_forces());
    for (; broken_seen_ < incidents->broken.size(); ++broken_seen_) {
      const model::BrokenCoupler& b = incidents->broken[broken_seen_];
      consider_recent(b.coupler, b.axial_force, b.time);
    }
    return;
  }
  model_.gaps(y, new_gap_, new_rate_);
  extend(extremes_, t, new_gap_, new_rate_);
  extend_recent(t, -new_gap_);
  const GapStep step = gap_step(t, new_gap_, new_rate_);
  if (step.h > 0.0 && loops_.can_turn_beyond(gap_.size(), step, recent())) {
    for (Eigen::Index i = 0; i < gap_.size(); ++i) {
      if (rate_[i] * new_rate_[i] >= 0.0) continue;
      turning_points(step.h, gap_[i], rate_[i], new_gap_[i], new_rate_[i],
                     [&](double turned, double share) { consider_recent(i, -turned, step_time_ + share * step.h); });
    }
  }
  gap_.swap(new_gap_);
  rate_.swap(new_rate_);
  step_time_ = t;
}

model::Footprint Monitor::footprint(Eigen::Index car, const model::CarMotion& motion) const {
  return {motion.centre, motion.axis, half_length_[car], half_width_[car]};
}

model::CarMotion Monitor::motion(const model::PlanColumns& q, Eigen::Index car) const {
  return {{q.x[car], q.y[car]}, {cosine_[car], sine_[car]}, {q.vx[car], q.vy[car]}, q.omega[car]};
}

MonitoredCars Monitor::columns(const model::PlanColumns& q) const {
  return {q.x,  q.y,     sine_.data(),        cosine_.data(),     q.vx,
          q.vy, q.omega, half_length_.data(), half_width_.data(), half_spacing_.data()};
}

double Monitor::truck_speed_max_behind(Eigen::Index head, const double* y) const {
  double fastest = 0.0;
  if (const auto space = model_.in_space(y)) {
    for (Eigen::Index k = head; k < model_.car_count(); ++k)
      fastest = std::max(fastest, std::sqrt(space->truck_speed_squared[k]));
    return fastest;
  }
  const model::PlanColumns q = model_.plan(y);
  for (Eigen::Index k = head; k < model_.car_count(); ++k) {
    const model::CarMotion car = motion(q, k);
    for (const double arm : {half_spacing_[k], -half_spacing_[k]})
      fastest = std::max(fastest, car.point(arm).velocity.norm());
  }
  return fastest;
}

void Monitor::sample(double t, const double* y) {
  const Eigen::Index n = model_.car_count();
  model_.headings(y, cosine_, sine_);
  const model::PlanColumns q = model_.plan(y);

  const std::optional<model::SpaceColumns> space = model_.in_space(y);
  truck_speed_max_ = std::sqrt(space ? loops_.largest_of(n, space->truck_speed_squared)
                                     : loops_.truck_speed_squared_max(n, columns(q)));
  MonitoredCars trucks = columns(q);
  // A car that leans has its centre of mass beside its trucks.
  if (space) {
    trucks.x = space->x;
    trucks.y = space->y;
    trucks.cosine = space->ahead_x;
    trucks.sine = space->ahead_y;
  }
  if (model_.straight_track()) {
    loops_.extend_astray(n, trucks, astray_.data());
  } else {
    for (Eigen::Index k = 0; k < n; ++k) {
      // Where a track bends, places cost: a car that lies where it lay has been looked at.
      const Eigen::Array4d pose(trucks.x[k], trucks.y[k], trucks.cosine[k], trucks.sine[k]);
      if ((pose == poses_.col(k)).all()) continue;
      poses_.col(k) = pose;
      const Vector2 middle(trucks.x[k], trucks.y[k]), ahead(trucks.cosine[k], trucks.sine[k]);
      for (const double arm : {half_spacing_[k], -half_spacing_[k]})
        astray_[k] = std::max(astray_[k], std::abs(model_.track_place(k, middle + arm * ahead).offset));
    }
  }
  if (n > 1) sample_speeds(t, q, space);
  const model::Incidents* incidents = model_.incidents();
  if (incidents == nullptr || incidents->impacts.empty()) {
    sample_touches(t, q);
    return;
  }
  for (; impacts_seen_ < incidents->impacts.size(); ++impacts_seen_) {
    const model::Impact& i = incidents->impacts[impacts_seen_];
    note({i.closing_speed, i.closing_speed_normal, static_cast<int>(i.car_a) + 1, static_cast<int>(i.car_b) + 1, i.time,
          i.x, i.y});
  }
}

void Monitor::sample_speeds(double t, const model::PlanColumns& q, const std::optional<model::SpaceColumns>& space) {
  const Eigen::Index n = model_.car_count();
  if (space) {
    std::copy_n(space->pins_squared, n - 1, pins_squared_.data());
    std::copy_n(space->centres_squared, n - 1, centres_squared_.data());
  } else {
    loops_.neighbour_speeds(n - 1, columns(q), pins_squared_.data(), centres_squared_.data());
  }
  // Cars whose coupler has broken have nothing to do with each other any more.
  if (const model::Incidents* incidents = model_.incidents()) {
    for (const model::BrokenCoupler& b : incidents->broken)
      pins_squared_[b.coupler] = centres_squared_[b.coupler] = 0.0;
  }
  const auto consider = [&](const ArrayX& squared, RelativeSpeed& largest) {
    if (loops_.largest_of(squared.size(), squared.data()) <= largest.speed * largest.speed) return;
    Eigen::Index coupler = 0;
    const double speed = std::sqrt(squared.maxCoeff(&coupler));
    if (speed > largest.speed) largest = {speed, static_cast<int>(coupler) + 1, t};
  };
  consider(pins_squared_, relative_);
  consider(centres_squared_, centres_);
}

void Monitor::note(const FirstTouch& touch) {
  touches_.push_back(touch);
  if (touch.speed > closing_.speed) closing_ = touch;
}

void Monitor::sample_touches(double t, const model::PlanColumns& q) {
  const Eigen::Index n = model_.car_count();
  loops_.boxes(n, columns(q), rearmost_.data(), foremost_.data(), half_breadth_.data());
  // Sweep along x; the order hardly changes from sample to sample.
  for (std::size_t i = 1; i < by_x_.size(); ++i) {
    const Eigen::Index k = by_x_[i];
    std::size_t j = i;
    for (; j > 0 && rearmost_[by_x_[j - 1]] > rearmost_[k]; --j) by_x_[j] = by_x_[j - 1];
    by_x_[j] = k;
  }
  std::vector<std::pair<Eigen::Index, Eigen::Index>> now;
  for (std::size_t i = 0; i < by_x_.size(); ++i) {
    const double end = foremost_[by_x_[i]];
    for (std::size_t j = i + 1; j < by_x_.size() && rearmost_[by_x_[j]] <= end; ++j) {
      const auto [a, b] = std::minmax(by_x_[i], by_x_[j]);
      if (std::abs(q.y[a] - q.y[b]) > half_breadth_[a] + half_breadth_[b]) continue;
      const model::CarMotion car_a = motion(q, a), car_b = motion(q, b);
      const auto contact = model::touch(footprint(a, car_a), footprint(b, car_b));
      if (!contact) continue;
      now.emplace_back(a, b);
      if (std::binary_search(touching_.begin(), touching_.end(), now.back())) continue;
      const Vector2 v = velocity_at(car_a, contact->point) - velocity_at(car_b, contact->point);
      note({v.norm(), -v.dot(contact->normal), static_cast<int>(a) + 1, static_cast<int>(b) + 1, t, contact->point.x(),
            contact->point.y()});
    }
  }
  std::sort(now.begin(), now.end());
  touching_.swap(now);
}

void Monitor::report_pile_up(const double* y, Outcome& o) const {
  std::vector<model::Footprint> footprints;
  std::vector<bool> counted;
  std::vector<Standing> standing;
  for (Eigen::Index k = 0; k < model_.car_count(); ++k) {
    footprints.push_back(model_.footprint(y, k));
    counted.push_back(model_.derailed(k) || off_track(k));
    if (!counted.back()) continue;
    if (const auto attitude = model_.attitude(y, k)) standing.push_back({footprints.back(), *attitude});
  }
  o.pile_up = outcome::pile_up(footprints, counted, [this](std::size_t car, const Vector2& point) {
    return model_.track_place(static_cast<Eigen::Index>(car), point);
  });
  o.posture = posture(standing);
}

double Monitor::lateral_reach(const double* y, Eigen::Index car) const {
  const model::Footprint f = model_.footprint(y, car);
  double reach = 0.0;
  for (const Vector2& corner : f.corners()) {
    reach = std::max(reach, std::abs(model_.track_place(car, corner).offset));
  }
  return reach;
}

void Monitor::report_incidents(const model::Incidents& incidents, Outcome& o) const {
  std::set<Eigen::Index> seen;
  for (const model::Derailment& d : incidents.derailments) {
    if (!seen.insert(d.car).second) continue;
    switch (d.cause) {
      case model::Cause::pod: ++o.derailed_by.pod; break;
      case model::Cause::lateral: ++o.derailed_by.lateral; break;
      case model::Cause::torn_track: ++o.derailed_by.torn_track; break;
      case model::Cause::bad_track: ++o.derailed_by.bad_track; break;
      case model::Cause::defect: ++o.derailed_by.defect; break;
      case model::Cause::none: break;
    }
  }
  for (const model::TieRun& run : incidents.tie_runs) {
    ++o.on_ties.trucks;
    o.on_ties.distance_max = std::max(o.on_ties.distance_max, run.distance);
    o.on_ties.obstacles += run.obstacles;
    o.on_ties.thrown_off += run.end == model::TieRun::End::none ? 0 : 1;
  }
  o.couplers_broken = static_cast<int>(incidents.broken.size());
  for (const model::Impact& i : incidents.impacts) {
    if (i.closing_speed_normal < kImpactSpeedMin) continue;
    ++o.impacts.count;
    o.impacts.closing_speed_normal_max = std::max(o.impacts.closing_speed_normal_max, i.closing_speed_normal);
    o.impacts.peak_force = std::max(o.impacts.peak_force, i.peak_force);
    o.impacts.impulse_max = std::max(o.impacts.impulse_max, i.impulse);
  }
  o.blockage_force = incidents.blockage_time > 0.0 ? incidents.blockage_impulse / incidents.blockage_time : 0.0;
  const auto peak = [](const model::Peak& p) {
    return p.coupler < 0 ? PeakForce{} : PeakForce{p.force, static_cast<int>(p.coupler) + 1, p.time};
  };
  o.coupler_buff_peak = peak(incidents.buff);
  o.coupler_draft_peak = peak(incidents.draft);
}

void Monitor::report_peaks(double t, const double* y, Outcome& o) const {
  const auto peak = [this](const GapExtreme& e, double sign) {
    const double force = e.coupler < 0 ? 0.0 : sign * model::axial_force(model_.coupler_law(), e.gap);
    return force > 0.0 ? PeakForce{force, static_cast<int>(e.coupler) + 1, e.time} : PeakForce{};
  };
  GapExtremes extremes = extremes_;
  ArrayX gap, rate;
  model_.gaps(y, gap, rate);
  extend(extremes, t, gap, rate);
  o.coupler_buff_peak = peak(extremes.closest, 1.0);
  o.coupler_draft_peak = peak(extremes.widest, -1.0);
}

double Monitor::energy_residual(const model::EnergyLedger& now) const {
  const double risen = now.height - height_initial_;
  // A train that starts at rest gets what it has from the slope.
  const double scale =
      energy_initial_ > 0.0 ? energy_initial_ : now.kinetic() + std::abs(now.work_grade) + std::abs(risen);
  return scale > 0.0 ? std::abs(now.total() - height_initial_ - energy_initial_) / scale : 0.0;
}

void Monitor::report(double t, const double* y, Outcome& o) const {
  o.cars = static_cast<int>(model_.car_count());
  o.cars_past_pod = o.cars_off_track = o.cars_derailed = 0;
  for (Eigen::Index k = 0; k < model_.car_count(); ++k) {
    o.cars_past_pod += model_.past_pod(k) ? 1 : 0;
    o.cars_derailed += model_.derailed(k) ? 1 : 0;
    o.cars_off_track += off_track(k) ? 1 : 0;
  }
  report_pile_up(y, o);
  o.closing_speed_max = closing_;
  o.touches = static_cast<int>(touches_.size());
  o.relative_speed_max = relative_;
  o.centre_speed_max = centres_;
  if (const model::Incidents* incidents = model_.incidents()) report_incidents(*incidents, o);
  else report_peaks(t, y, o);
  o.stop_time = t;
  o.energy = model_.energy(y);
  o.energy_initial = energy_initial_;
  o.energy_residual = energy_residual(o.energy);
  o.energy.height -= height_initial_;
}

namespace {

void walk_closing(files::Archive& archive, FirstTouch& c) {
  archive.value("speed", c.speed);
  archive.value("speed_normal", c.speed_normal);
  archive.value("car_a", c.car_a);
  archive.value("car_b", c.car_b);
  archive.value("time", c.time);
  archive.value("x", c.x);
  archive.value("y", c.y);
}

void walk_relative_speed(files::Archive& archive, RelativeSpeed& r) {
  archive.value("speed", r.speed);
  archive.value("coupler", r.coupler);
  archive.value("time", r.time);
}

}  // namespace

void Monitor::walk(files::Archive& archive) {
  const auto extreme = [&archive](const char* name, GapExtreme& e) {
    archive.group(name, [&] {
      archive.value("gap", e.gap);
      archive.value("coupler", e.coupler);
      archive.value("time", e.time);
    });
  };
  archive.value("energy_initial", energy_initial_);
  archive.value("height_initial", height_initial_);
  archive.value("step_time", step_time_);
  archive.column("gap", gap_);
  archive.column("rate", rate_);
  extreme("closest", extremes_.closest);
  extreme("widest", extremes_.widest);
  archive.column("highest", highest_);
  archive.column("highest_time", highest_time_);
  archive.column("lowest", lowest_);
  archive.column("lowest_time", lowest_time_);
  archive.value("broken_seen", broken_seen_);
  archive.column("astray", astray_);
  archive.list("by_x", by_x_, [&](Eigen::Index& car) { archive.value("car", car); });
  archive.list("touching", touching_, [&](std::pair<Eigen::Index, Eigen::Index>& pair) {
    archive.value("car_a", pair.first);
    archive.value("car_b", pair.second);
  });
  archive.group("closing", [&] { walk_closing(archive, closing_); });
  archive.list("touches", touches_, [&](FirstTouch& c) { walk_closing(archive, c); });
  archive.value("impacts_seen", impacts_seen_);
  archive.group("relative", [&] { walk_relative_speed(archive, relative_); });
  archive.group("centres", [&] { walk_relative_speed(archive, centres_); });
  archive.value("truck_speed_max", truck_speed_max_);
}

}  // namespace train_derail::outcome
