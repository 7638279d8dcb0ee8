#include "train_derail/outcome/monitor.hpp"

#include <algorithm>
#include <cmath>

namespace train_derail::outcome {

using model::PointMotion;

namespace {

/// Velocity of a point that moves with the car.
Eigen::Vector2d velocity_at(const model::CarMotion& car, const Eigen::Vector2d& point) {
  const Eigen::Vector2d arm = point - car.centre;
  return car.velocity + car.omega * Eigen::Vector2d(-arm.y(), arm.x());
}

}  // namespace

Monitor::Monitor(const model::DerailmentModel& model, const inputs::OutcomeRules& rules, double t,
                 const model::StateVector& y)
    : model_(model),
      rules_(rules),
      energy_initial_(model.energy(y.data()).total()),
      step_time_(t),
      extremes_{{inputs::kInfinity, -1, t}, {-inputs::kInfinity, -1, t}},
      off_track_(static_cast<std::size_t>(model.car_count()), false),
      footprints_(static_cast<std::size_t>(model.car_count())) {
  for (Eigen::Index k = 0; k < model.car_count(); ++k) by_x_.push_back(k);
  model_.gaps(y.data(), gap_, rate_);
  for (Eigen::Index i = 0; i < gap_.size(); ++i) extremes_.consider(i, gap_[i], t);
}

void Monitor::GapExtremes::consider(Eigen::Index coupler, double gap, double time) {
  if (gap < closest.gap) closest = {gap, coupler, time};
  if (gap > widest.gap) widest = {gap, coupler, time};
}

void Monitor::extend(GapExtremes& extremes, double t, const Eigen::ArrayXd& gap, const Eigen::ArrayXd& rate) const {
  const double h = t - step_time_;
  if (h <= 0.0) return;
  for (Eigen::Index i = 0; i < gap_.size(); ++i) {
    extremes.consider(i, gap[i], t);
    if (rate_[i] * rate[i] >= 0.0) continue;
    // The gap turned round in between: extreme of the cubic through both ends' values and rates.
    const double a = h * rate_[i], b = h * rate[i], d = gap[i] - gap_[i];
    const double c2 = 3.0 * d - 2.0 * a - b, c3 = a + b - 2.0 * d;  // gap_ + a s + c2 s^2 + c3 s^3
    const double root = std::sqrt(std::max(c2 * c2 - 3.0 * c3 * a, 0.0));
    const double q = -(c2 + std::copysign(root, c2));  // of 3 c3 s^2 + 2 c2 s + a = 0, without cancellation
    for (const double s : {q / (3.0 * c3), a / q}) {
      if (s > 0.0 && s < 1.0) extremes.consider(i, gap_[i] + s * (a + s * (c2 + s * c3)), step_time_ + s * h);
    }
  }
}

void Monitor::step(double t, const double* y) {
  model_.gaps(y, new_gap_, new_rate_);
  extend(extremes_, t, new_gap_, new_rate_);
  gap_.swap(new_gap_);
  rate_.swap(new_rate_);
  step_time_ = t;
}

Footprint Monitor::footprint(Eigen::Index car, const model::CarMotion& motion) const {
  const model::Car& c = model_.cars()[static_cast<std::size_t>(car)];
  return {motion.centre, motion.axis, 0.5 * c.length, 0.5 * c.width};
}

void Monitor::sample(double t, const double* y) {
  cars_.clear();
  truck_speed_max_ = 0.0;
  for (Eigen::Index k = 0; k < model_.car_count(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    const model::Car& car = model_.cars()[i];
    const model::CarMotion& motion = cars_.emplace_back(model_.car_motion(y, k));
    footprints_[i] = footprint(k, motion);
    const PointMotion front = motion.point(0.5 * car.truck_spacing), rear = motion.point(-0.5 * car.truck_spacing);
    truck_speed_max_ = std::max({truck_speed_max_, front.velocity.norm(), rear.velocity.norm()});
    if (std::max(std::abs(front.position.y()), std::abs(rear.position.y())) > rules_.off_track_threshold) {
      off_track_[i] = true;
    }
    if (k == 0) continue;
    const model::CarMotion& lead = cars_[i - 1];
    const double speed =
        (lead.point(-0.5 * model_.cars()[i - 1].length).velocity - motion.point(0.5 * car.length).velocity).norm();
    if (speed > relative_.speed) relative_ = {speed, static_cast<int>(k), t};
    const double centres = (lead.velocity - motion.velocity).norm();
    if (centres > centres_.speed) centres_ = {centres, static_cast<int>(k), t};
  }
  sample_touches(t);
}

void Monitor::sample_touches(double t) {
  const auto at = [this](Eigen::Index k) -> const Footprint& { return footprints_[static_cast<std::size_t>(k)]; };
  // Sweep along x; the order hardly changes from sample to sample.
  const Eigen::Vector2d ex(1.0, 0.0), ey(0.0, 1.0);
  const auto rearmost = [&](Eigen::Index k) { return at(k).centre.x() - at(k).reach(ex); };
  for (std::size_t i = 1; i < by_x_.size(); ++i) {
    const Eigen::Index k = by_x_[i];
    std::size_t j = i;
    for (; j > 0 && rearmost(by_x_[j - 1]) > rearmost(k); --j) by_x_[j] = by_x_[j - 1];
    by_x_[j] = k;
  }
  std::vector<std::pair<Eigen::Index, Eigen::Index>> now;
  for (std::size_t i = 0; i < by_x_.size(); ++i) {
    const double end = at(by_x_[i]).centre.x() + at(by_x_[i]).reach(ex);
    for (std::size_t j = i + 1; j < by_x_.size() && rearmost(by_x_[j]) <= end; ++j) {
      const auto [a, b] = std::minmax(by_x_[i], by_x_[j]);
      if (std::abs(at(a).centre.y() - at(b).centre.y()) > at(a).reach(ey) + at(b).reach(ey)) continue;
      const auto contact = touch(at(a), at(b));
      if (!contact) continue;
      now.emplace_back(a, b);
      if (std::binary_search(touching_.begin(), touching_.end(), now.back())) continue;
      const auto velocity = [&](Eigen::Index k) {
        return velocity_at(cars_[static_cast<std::size_t>(k)], contact->point);
      };
      const Eigen::Vector2d v = velocity(a) - velocity(b);
      touches_.push_back({v.norm(), -v.dot(contact->normal), static_cast<int>(a) + 1, static_cast<int>(b) + 1, t,
                          contact->point.x(), contact->point.y()});
      if (touches_.back().speed > closing_.speed) closing_ = touches_.back();
    }
  }
  std::sort(now.begin(), now.end());
  touching_.swap(now);
}

void Monitor::report(double t, const double* y, Outcome& o) const {
  o.cars = static_cast<int>(model_.car_count());
  o.cars_past_pod = o.cars_off_track = 0;
  double x_min = inputs::kInfinity, x_max = -inputs::kInfinity, y_min = inputs::kInfinity, y_max = -inputs::kInfinity;
  for (Eigen::Index k = 0; k < model_.car_count(); ++k) {
    o.cars_past_pod += model_.derailed(k) ? 1 : 0;
    o.cars_off_track += off_track(k) ? 1 : 0;
    if (!model_.derailed(k) && !off_track(k)) continue;
    const Footprint f = footprint(k, model_.car_motion(y, k));
    const double rx = f.reach({1.0, 0.0}), ry = f.reach({0.0, 1.0});
    x_min = std::min(x_min, f.centre.x() - rx);
    x_max = std::max(x_max, f.centre.x() + rx);
    y_min = std::min(y_min, f.centre.y() - ry);
    y_max = std::max(y_max, f.centre.y() + ry);
  }
  o.pile_up = x_max > x_min ? PileUp{x_max - x_min, y_max - y_min} : PileUp{};
  o.closing_speed_max = closing_;
  o.touches = static_cast<int>(touches_.size());
  o.relative_speed_max = relative_;
  o.centre_speed_max = centres_;
  const auto peak = [this](const GapExtreme& e, double sign) {
    const double force = e.coupler < 0 ? 0.0 : sign * model::axial_force(model_.coupler_law(), e.gap);
    return force > 0.0 ? PeakForce{force, static_cast<int>(e.coupler) + 1, e.time} : PeakForce{};
  };
  GapExtremes extremes = extremes_;
  Eigen::ArrayXd gap, rate;
  model_.gaps(y, gap, rate);
  extend(extremes, t, gap, rate);
  o.coupler_buff_peak = peak(extremes.closest, 1.0);
  o.coupler_draft_peak = peak(extremes.widest, -1.0);
  o.stop_time = t;
  o.energy = model_.energy(y);
  o.energy_initial = energy_initial_;
  o.energy_residual = energy_initial_ > 0.0 ? std::abs(o.energy.total() - energy_initial_) / energy_initial_ : 0.0;
}

}  // namespace train_derail::outcome
