#include "multibody/spatial_bar.hpp"

#include <algorithm>
#include <cmath>

namespace train_derail::multibody {

using SimTK::Rotation;
using SimTK::Stage;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

/// Energy of a stop at that angle.
double energy(double angle, double limit, double stiffness, double most) {
  const double beyond = std::abs(angle) - limit;
  if (beyond <= 0.0 || stiffness == 0.0) return 0.0;
  const double elastic = std::min(beyond, most / stiffness);
  return 0.5 * stiffness * elastic * elastic + (beyond > elastic ? most * (beyond - elastic) : 0.0);
}

}  // namespace

SpatialBar::SpatialBar(const inputs::Coupler& law, const inputs::CouplerHold& hold,
                       const SimTK::GeneralForceSubsystem& forces, double damping, bool roll_stop, const CarBody& ahead,
                       const Vec3& rear_pin, const CarBody& behind, const Vec3& front_pin)
    : law_(law),
      hold_(hold),
      forces_(forces),
      damping_(damping),
      roll_stop_(roll_stop),
      ahead_(ahead),
      behind_(behind),
      rear_pin_(rear_pin),
      front_pin_(front_pin) {}

void SpatialBar::realizeTopology(State& state) const {
  broken_ = forces_.allocateDiscreteVariable(state, Stage::Dynamics, new SimTK::Value<bool>(false));
}

bool SpatialBar::broken(const State& state) const {
  return SimTK::Value<bool>::downcast(forces_.getDiscreteVariable(state, broken_)).get();
}

void SpatialBar::part(State& state) const {
  SimTK::Value<bool>::updDowncast(forces_.updDiscreteVariable(state, broken_)).upd() = true;
}

void SpatialBar::calcForce(const State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<Vec3>&,
                           SimTK::Vector&) const {
  if (broken(state)) return;
  const auto apply = [&](const Downhill& s, double factor) {
    ahead_.now(state).applyForceToBodyPoint(state, Vec3(0.0), factor * s.force, forces);
    ahead_.now(state).applyBodyTorque(state, factor * s.on_ahead, forces);
    behind_.now(state).applyForceToBodyPoint(state, Vec3(0.0), -factor * s.force, forces);
    behind_.now(state).applyBodyTorque(state, factor * s.on_behind, forces);
  };
  const Stretch now = stretch(state);
  apply(now.shortening, -buff(state, now));
  apply(stops(ahead_.now(state).getBodyTransform(state), behind_.now(state).getBodyTransform(state)), 1.0);
}

double SpatialBar::holds(const State& state) const {
  const Transform &ahead = ahead_.now(state).getBodyTransform(state),
                  &behind = behind_.now(state).getBodyTransform(state);
  const Vec3 between = ahead * rear_pin_ - behind * front_pin_;
  double moments = 0.0, swing = 0.0, rise = 0.0;
  for (const Transform* body : {&ahead, &behind}) {
    const Vec3 seen = ~body->R() * between;
    const double yaw = std::atan2(seen[1], seen[0]), beyond = std::abs(yaw) - law_.swing_limit;
    const double moment = std::min(law_.swing_stiffness * std::max(beyond, 0.0), law_.swing_moment_max);
    moments += yaw > 0.0 ? moment : -moment;
    swing = std::max(swing, std::abs(yaw));
    rise += 0.5 * seen[2];
  }
  const double twist = law_.roll_stiffness * std::max(roll(ahead, behind) - hold_.roll_limit, 0.0);
  const double pulled = -buff(state);
  const Vec3 both = ahead.R().z() + behind.R().z(), up = both / std::max(both.norm(), 1e-3);
  const double shares[] = {pulled / law_.break_draft,
                           swing / law_.break_swing,
                           std::abs(moments) / law_.break_moment,
                           std::abs(rise) / hold_.slip_height,
                           std::abs(SimTK::dot(stops(ahead, behind).force, up)) / hold_.vertical_hold,
                           twist / law_.break_twist};
  return 1.0 - *std::max_element(std::begin(shares), std::end(shares));
}

double SpatialBar::on_edges(const Transform& ahead, const Transform& behind) const {
  const Vec3 between = ahead * rear_pin_ - behind * front_pin_;
  const double pins = between.norm();
  double tilted = 0.0;
  for (const Transform* body : {&ahead, &behind}) {
    constexpr double kBears = 0.005;
    const double tilt = SimTK::dot(body->R().z(), between) / pins;
    tilted += std::hypot(tilt, kBears) - kBears;
  }
  return pins - std::min(0.5 * law_.butt_height * tilted, law_.slack);
}

SpatialBar::Stretch SpatialBar::stretch(const State& state) const {
  const Transform &ahead = ahead_.now(state).getBodyTransform(state),
                  &behind = behind_.now(state).getBodyTransform(state);
  const auto pins = [this](const Transform& a, const Transform& b) { return (a * rear_pin_ - b * front_pin_).norm(); };
  const auto edges = [this](const Transform& a, const Transform& b) { return on_edges(a, b); };
  // Where faces begin to press the length jumps, its slope must not.
  const double pressed = edges(ahead, behind);
  if (pressed < law_.length - 0.5 * law_.slack) return {pressed, slope(ahead, behind, edges)};
  return {pins(ahead, behind), slope(ahead, behind, pins)};
}

double SpatialBar::buff(const State& state) const { return buff(state, stretch(state)); }

double SpatialBar::buff(const State& state, const Stretch& s) const {
  const auto &ahead = ahead_.now(state).getBodyVelocity(state), &behind = behind_.now(state).getBodyVelocity(state);
  const double rate = -SimTK::dot(s.shortening.force, ahead[1] - behind[1]) -
                      SimTK::dot(s.shortening.on_ahead, ahead[0]) - SimTK::dot(s.shortening.on_behind, behind[0]);
  return buff(s.length, rate);
}

double SpatialBar::buff(double length, double rate) const {
  const double stretch = length - law_.length, beyond = std::abs(stretch) - 0.5 * law_.slack;
  if (beyond <= 0.0) return 0.0;
  const double gear = std::min(beyond, law_.draft_gear_travel), first = law_.draft_gear_stiffness * gear;
  const double spring = first + law_.stiffness * (beyond - gear), closing = stretch > 0.0 ? rate : -rate;
  // A damper alone never turns the force round.
  const double force = std::max(spring + damping_ * closing, 0.0);
  return stretch > 0.0 ? -force : force;
}

double SpatialBar::stop_energy(const Transform& ahead, const Transform& behind) const {
  const Vec3 between = ahead * rear_pin_ - behind * front_pin_, along = between / between.norm();
  double sum = 0.0;
  for (const Transform* body : {&ahead, &behind}) {
    const Vec3 seen = ~body->R() * along;
    sum += energy(std::atan2(seen[1], seen[0]), law_.swing_limit, law_.swing_stiffness, law_.swing_moment_max);
    sum += energy(std::asin(seen[2]), hold_.pitch_limit, law_.pitch_stiffness, inputs::kInfinity);
  }
  if (!roll_stop_) return sum;
  return sum + energy(roll(ahead, behind), hold_.roll_limit, law_.roll_stiffness, inputs::kInfinity);
}

double SpatialBar::roll(const Transform& ahead, const Transform& behind) const {
  const Vec3 between = ahead * rear_pin_ - behind * front_pin_, along = between / between.norm();
  const auto flat = [&along](const Transform& body) {
    const Vec3 left = body.R().y().asVec3();
    return Vec3(left - SimTK::dot(left, along) * along);
  };
  const Vec3 a = flat(ahead), b = flat(behind);
  return std::atan2(SimTK::cross(a, b).norm(), SimTK::dot(a, b));
}

/// Forces are the slope of the energy downhill.
SpatialBar::Downhill SpatialBar::stops(const Transform& ahead, const Transform& behind) const {
  if (stop_energy(ahead, behind) == 0.0) return {};
  return slope(ahead, behind, [this](const Transform& a, const Transform& b) { return stop_energy(a, b); });
}

template <class Function>
SpatialBar::Downhill SpatialBar::slope(const Transform& ahead, const Transform& behind, const Function& of) {
  Downhill s;
  constexpr double kShift = 1e-5;  // m, rad
  const auto turned = [](const Transform& body, int axis, double angle) {
    return Transform(Rotation(angle, SimTK::CoordinateAxis(axis)) * body.R(), body.p());
  };
  for (int c = 0; c < 3; ++c) {
    const auto fall = [](double forth, double back) { return (back - forth) / (2.0 * kShift); };
    Vec3 shift(0.0);
    shift[c] = kShift;
    s.force[c] =
        fall(of(Transform(ahead.R(), ahead.p() + shift), behind), of(Transform(ahead.R(), ahead.p() - shift), behind));
    s.on_ahead[c] = fall(of(turned(ahead, c, kShift), behind), of(turned(ahead, c, -kShift), behind));
    s.on_behind[c] = fall(of(ahead, turned(behind, c, kShift)), of(ahead, turned(behind, c, -kShift)));
  }
  return s;
}

}  // namespace train_derail::multibody
