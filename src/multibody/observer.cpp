#include "multibody/observer.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "train_derail/outcome/pile_up.hpp"

namespace train_derail::multibody {

namespace {

Vector2 axis(const PlanMotion& c) { return {std::cos(c.theta), std::sin(c.theta)}; }

Vector2 velocity(const PlanMotion& c, const Vector2& point) {
  return {c.vx - c.omega * (point.y() - c.y), c.vy + c.omega * (point.x() - c.x)};
}

Eigen::Vector3d centre_velocity(const PlanMotion& c) {
  return c.body ? c.body->velocity : Eigen::Vector3d(c.vx, c.vy, 0.0);
}

model::Footprint footprint(const model::Car& car, const PlanMotion& c) {
  return {{c.x, c.y}, axis(c), 0.5 * car.length, 0.5 * car.width};
}

}  // namespace

Observer::Observer(std::vector<model::Car> train, const inputs::Scenario& scenario)
    : train_(std::move(train)),
      threshold_(scenario.outcome.off_track_threshold),
      stop_speed_(scenario.stop.speed),
      coupler_height_(scenario.coupler.height),
      bodies_press_(scenario.contact.law != inputs::ContactLaw::none),
      shortest_{inputs::kInfinity},
      longest_{-inputs::kInfinity},
      off_track_(train_.size(), 0),
      parted_(train_.size() - 1, 0) {}

Observer::PointMotion Observer::point(std::size_t k, const PlanMotion& motion, double ahead, double height) const {
  if (!motion.body) {
    const Vector2 place = Vector2(motion.x, motion.y) + ahead * axis(motion), moves = velocity(motion, place);
    return {{place.x(), place.y(), 0.0}, {moves.x(), moves.y(), 0.0}};
  }
  const Eigen::Vector3d arm = motion.body->axes * Eigen::Vector3d(ahead, 0.0, height - train_[k].centre_height);
  return {motion.body->centre + arm, motion.body->velocity + motion.body->rotation.cross(arm)};
}

void Observer::consider(int coupler, double length, double t) {
  if (length < shortest_.length) shortest_ = {length, coupler, t};
  if (length > longest_.length) longest_ = {length, coupler, t};
}

void Observer::follow(double t, const std::vector<Gap>& gaps) {
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    consider(static_cast<int>(i) + 1, gaps[i].length, t);
    const double h = t - time_;
    if (gaps_.empty() || h <= 0.0 || gaps_[i].rate * gaps[i].rate >= 0.0) continue;
    // The rate has changed its sign within the step, so an extreme lies there. The rate of Hermite's cubic at s in [0,
    // 1] is r0 + 2 (3 d - 2 r0 - r1) s + 3 (r0 + r1 - 2 d) s^2, where d is the mean rate. Its zero is found by
    // bisection, since it changes its sign once.
    const double r0 = gaps_[i].rate, r1 = gaps[i].rate, d = (gaps[i].length - gaps_[i].length) / h;
    const double b = 3.0 * d - 2.0 * r0 - r1, c = r0 + r1 - 2.0 * d;
    double low = 0.0, high = 1.0;
    for (int n = 0; n < 50; ++n) {
      const double s = 0.5 * (low + high);
      ((r0 + s * (2.0 * b + s * 3.0 * c)) * r0 > 0.0 ? low : high) = s;
    }
    consider(static_cast<int>(i) + 1, gaps_[i].length + h * low * (r0 + low * (b + low * c)), time_ + low * h);
  }
  gaps_ = gaps;
  time_ = t;
}

void Observer::sample(double t, const std::vector<PlanMotion>& motion) {
  truck_speed_ = 0.0;
  for (std::size_t k = 0; k < train_.size(); ++k) {
    for (const double ahead : {0.5 * train_[k].truck_spacing, -0.5 * train_[k].truck_spacing}) {
      const PointMotion truck = point(k, motion[k], ahead, 0.0);
      truck_speed_ = std::max(truck_speed_, truck.velocity.norm());
      if (std::abs(truck.place.y()) > threshold_) off_track_[k] = 1;
    }
    if (k == 0 || parted_[k - 1] != 0) continue;
    const PointMotion lead = point(k - 1, motion[k - 1], -0.5 * train_[k - 1].length, coupler_height_),
                      trail = point(k, motion[k], 0.5 * train_[k].length, coupler_height_);
    const double speed = (lead.velocity - trail.velocity).norm();
    if (speed > relative_.speed) relative_ = {speed, static_cast<int>(k), t};
    const double centres = (centre_velocity(motion[k - 1]) - centre_velocity(motion[k])).norm();
    if (centres > centres_.speed) centres_ = {centres, static_cast<int>(k), t};
  }
  if (!bodies_press_) find_touches(t, motion);
}

void Observer::note(const outcome::FirstTouch& touch) {
  ++touches_;
  if (touch.speed > closing_.speed) closing_ = touch;
}

void Observer::find_touches(double t, const std::vector<PlanMotion>& motion) {
  std::set<std::pair<std::size_t, std::size_t>> now;
  for (std::size_t a = 0; a < train_.size(); ++a) {
    for (std::size_t b = a + 1; b < train_.size(); ++b) {
      const double reach = 0.5 * (train_[a].length + train_[b].length + train_[a].width + train_[b].width);
      if (std::hypot(motion[a].x - motion[b].x, motion[a].y - motion[b].y) > reach) continue;
      const auto contact = model::touch(footprint(train_[a], motion[a]), footprint(train_[b], motion[b]));
      if (!contact) continue;
      now.emplace(a, b);
      if (touching_.count({a, b}) > 0) continue;
      const Vector2 approach = velocity(motion[b], contact->point) - velocity(motion[a], contact->point);
      note({approach.norm(), approach.dot(contact->normal), static_cast<int>(a) + 1, static_cast<int>(b) + 1, t,
            contact->point.x(), contact->point.y()});
    }
  }
  touching_ = std::move(now);
}

std::vector<model::Footprint> Observer::footprints(const std::vector<PlanMotion>& motion) const {
  std::vector<model::Footprint> result;
  for (std::size_t k = 0; k < train_.size(); ++k) result.push_back(footprint(train_[k], motion[k]));
  return result;
}

void Observer::report(const std::vector<model::Footprint>& footprints, const Fates& fates, outcome::Outcome& o) const {
  const auto count = [](const std::vector<char>& of) { return static_cast<int>(std::count(of.begin(), of.end(), 1)); };
  o.cars = static_cast<int>(train_.size());
  o.cars_past_pod = count(fates.past);
  o.cars_derailed = count(fates.derailed);
  o.cars_off_track = count(off_track_);
  o.closing_speed_max = closing_;
  o.touches = touches_;
  o.relative_speed_max = relative_;
  o.centre_speed_max = centres_;
  std::vector<bool> counted;
  for (std::size_t k = 0; k < train_.size(); ++k) counted.push_back(counts(fates, k));
  o.pile_up = outcome::pile_up(footprints, counted, [](std::size_t, const Vector2& point) {
    return model::TrackPlace{point.x(), point.y(), Vector2::UnitX()};
  });
}

}  // namespace train_derail::multibody
