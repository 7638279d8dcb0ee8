/// \file
/// The multibody engine in three dimensions. It was written from the equations, not from src/model, so that the two do
/// not share mistakes: Simbody moves the bodies, stops of couplers are the slope of their energy found by differences,
/// and friction is a differential equation.
#include "multibody/spatial_engine.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <Simbody.h>

#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::multibody {

namespace {

using SimTK::MobilizedBody;
using SimTK::Real;
using SimTK::Rotation;
using SimTK::Stage;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;

using BodyForces = SimTK::Vector_<SimTK::SpatialVec>;

/// Where a truck is.
enum class Stand : char { on_rails, off_rails, lost };

/// Ground beside a straight track at y: its height, and the way up that the slope of its energy points to.
struct GroundAt {
  double height;
  Vec3 up;  // not of length 1
};
GroundAt roadbed_at(const inputs::Terrain& t, double y) {
  const double drop = y > 0.0 ? t.bank_left : t.bank_right, outside = std::abs(y) - t.crown;
  const double slope = drop < 0.0 ? -t.bank_slope : t.bank_slope;
  const double crown = -(t.rail_height + t.ballast_height);
  if (outside <= 0.0 || drop == 0.0) return {crown, Vec3(0.0, 0.0, 1.0)};
  if (outside * t.bank_slope >= std::abs(drop)) return {crown - drop, Vec3(0.0, 0.0, 1.0)};
  // Falling by `slope` away from the track.
  return {crown - slope * outside, Vec3(0.0, y > 0.0 ? slope : -slope, 1.0)};
}
GroundAt ground_at(const inputs::Terrain& t, double y) {
  const GroundAt roadbed = roadbed_at(t, y);
  if (t.ballast_height <= 0.0) return roadbed;
  const double down = t.ballast_slope * (std::abs(y) - t.ballast_half_width);
  if (down <= 0.0) return {std::max(-t.rail_height, roadbed.height), Vec3(0.0, 0.0, 1.0)};
  if (-t.rail_height - down <= roadbed.height) return roadbed;
  return {-t.rail_height - down, Vec3(0.0, y > 0.0 ? t.ballast_slope : -t.ballast_slope, 1.0)};
}

double critical_damping(double stiffness, double mass) { return 2.0 * std::sqrt(stiffness * mass); }

/// Everything between a car and the ground: springs and dampers under both sides of its trucks, rails sideways, and
/// corners of its body.
class Support final : public SimTK::Force::Custom::Implementation {
 public:
  Support(const inputs::Scenario& s, const model::Car& car, const MobilizedBody& body,
          const SimTK::GeneralForceSubsystem& forces, const SpatialEngineOptions& o)
      : scenario_(s),
        body_(body),
        forces_(forces),
        settle_time_(o.settle_time),
        lever_sign_(o.fault == SpatialFault::centre_below_rail ? -1.0 : 1.0),
        rail_damping_(s.rails.damping_ratio * critical_damping(s.rails.stiffness, 0.5 * car.mass)),
        ground_damping_(s.terrain.body_damping_ratio * critical_damping(s.terrain.body_stiffness, 0.25 * car.mass)) {
    const inputs::Suspension& spring = s.suspension;
    for (const int truck : {0, 1}) {
      const Vec3 middle((truck == 0 ? 0.5 : -0.5) * car.truck_spacing, 0.0, -car.centre_height);
      trucks_.push_back(middle);
      for (const double side : {1.0, -1.0}) {
        points_.push_back({truck, middle + Vec3(0.0, side * spring.half_base, 0.0), spring.stiffness,
                           spring.damping_ratio * critical_damping(spring.stiffness, 0.25 * car.mass),
                           0.25 * car.mass * inputs::kStandardGravity / spring.stiffness});
      }
    }
    for (const double x : {-0.5, 0.0, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        for (const double z : {car.floor_height, car.roof_height}) {
          const Vec3 corner(x * car.length, y * car.width, z - car.centre_height);
          points_.push_back({kBody, corner, s.terrain.body_stiffness, ground_damping_, 0.0});
        }
      }
    }
  }

  /// An error of a strain counts a hundredth of one of a place: it is forgotten within settle_time.
  void set_weights(State& state) const { state.updZWeights(forces_.getMySubsystemIndex()) = 0.01; }

  void realizeTopology(State& state) const override {
    stands_ = forces_.allocateDiscreteVariable(state, Stage::Dynamics, new SimTK::Value<Stands>(Stands()));
    const SimTK::Vector none(static_cast<int>(3 * points_.size()), 0.0);
    strains_ = forces_.allocateZ(state, none);
    strain_rates_ = forces_.allocateCacheEntry(state, Stage::Dynamics, new SimTK::Value<SimTK::Vector>(none));
  }

  Stand stand(const State& state, std::size_t truck) const { return stands(state).of[truck]; }
  void set_stand(State& state, std::size_t truck, Stand stand) const {
    SimTK::Value<Stands>::updDowncast(forces_.updDiscreteVariable(state, stands_)).upd().of[truck] = stand;
  }

  void calcForce(const State& state, BodyForces& forces, SimTK::Vector_<Vec3>&, SimTK::Vector&) const override {
    const Moving car = moving(state);
    const Stands& stand = stands(state);
    const Real* strain = &forces_.getZ(state)[strains_];
    Real* rate = &SimTK::Value<SimTK::Vector>::updDowncast(forces_.updCacheEntry(state, strain_rates_)).upd()[0];
    SimTK::SpatialVec sum(Vec3(0.0), Vec3(0.0));
    for (const Point& p : points_) {
      const Touch t = touch(car, stand, p, Vec3(strain[0], strain[1], strain[2]));
      for (int c = 0; c < 3; ++c) rate[c] = t.strain_rate[c];
      strain += 3;
      rate += 3;
      pull_at(sum, car, p.station, p.truck, t.force);
    }
    for (std::size_t i = 0; i < trucks_.size(); ++i) {
      if (stand.of[i] != Stand::on_rails) continue;
      const double held =
          -scenario_.rails.stiffness * car.place(trucks_[i])[1] - rail_damping_ * car.velocity(trucks_[i])[1];
      pull_at(sum, car, trucks_[i], static_cast<int>(i), Vec3(0.0, held, 0.0));
    }
    forces[body_.getMobilizedBodyIndex()] += sum;
  }
  Real calcPotentialEnergy(const State&) const override { return 0.0; }

  void realizeAcceleration(const State& state) const override {
    const SimTK::Vector& rate =
        SimTK::Value<SimTK::Vector>::downcast(forces_.getCacheEntry(state, strain_rates_)).get();
    forces_.updZDot(state)(strains_, rate.size()) = rate;
  }

  /// Positive while a truck off the rails stays with its body.
  double holds_on(const State& state, std::size_t truck) const {
    const Moving car = moving(state);
    double most = car.frame.R().z()[2] - std::cos(scenario_.suspension.part_angle);
    for (const Point& p : points_)
      if (p.truck == static_cast<int>(truck)) most = std::max(most, pressing(car, p, false).push);
    return most;
  }
  double along_track(const State& state, std::size_t truck) const { return moving(state).place(trucks_[truck])[0]; }

 private:
  static constexpr int kBody = -1;
  struct Point {
    int truck;  // or kBody
    Vec3 station;
    double stiffness, damping;
    double reach;  // how far below the station it is without load [m]
  };
  struct Stands {
    std::array<Stand, 2> of{Stand::on_rails, Stand::on_rails};
  };
  friend std::ostream& operator<<(std::ostream& out, const Stands& s) {
    return out << static_cast<int>(s.of[0]) << ' ' << static_cast<int>(s.of[1]);
  }

  struct Moving {
    const Transform& frame;
    const SimTK::SpatialVec& rates;
    Vec3 arm(const Vec3& station) const { return frame.R() * station; }
    Vec3 place(const Vec3& station) const { return frame.p() + arm(station); }
    Vec3 velocity(const Vec3& station) const { return rates[1] + SimTK::cross(rates[0], arm(station)); }
  };
  Moving moving(const State& state) const { return {body_.getBodyTransform(state), body_.getBodyVelocity(state)}; }
  const Stands& stands(const State& state) const {
    return SimTK::Value<Stands>::downcast(forces_.getDiscreteVariable(state, stands_)).get();
  }

  void pull_at(SimTK::SpatialVec& sum, const Moving& car, Vec3 station, int truck, const Vec3& force) const {
    if (truck != kBody) station[2] *= lever_sign_;
    sum[0] += SimTK::cross(car.arm(station), force);
    sum[1] += force;
  }

  struct Pressing {
    double push;  // along `up`; none below zero
    Vec3 up, velocity;
  };
  Pressing pressing(const Moving& car, const Point& p, bool on_rails) const {
    const Vec3 place = car.place(p.station), velocity = car.velocity(p.station);
    const GroundAt g = on_rails ? GroundAt{0.0, Vec3(0.0, 0.0, 1.0)} : ground_at(scenario_.terrain, place[1]);
    const double spring = p.stiffness * (p.reach + g.height - place[2]);
    // A wheel that has left the ground is not held back by its damper.
    return {spring > 0.0 ? spring - p.damping * SimTK::dot(velocity, g.up) : spring, g.up, velocity};
  }

  /// A point's force, and how fast friction strains the ground under it.
  struct Touch {
    Vec3 force, strain_rate;
  };
  Touch touch(const Moving& car, const Stands& stands, const Point& p, const Vec3& strain) const {
    const Stand stand = p.truck == kBody ? Stand::off_rails : stands.of[static_cast<std::size_t>(p.truck)];
    Touch t{Vec3(0.0), -strain / settle_time_};  // without a touch it is forgotten
    if (stand == Stand::lost) return t;
    const Pressing press = pressing(car, p, stand == Stand::on_rails);
    if (press.push <= 0.0) return t;
    t.force = press.push * press.up;
    if (stand == Stand::on_rails) return t;  // brakes are not part of this engine
    const double load = t.force.norm();
    const Vec3 normal = press.up / press.up.norm();
    const Vec3 slip = press.velocity - SimTK::dot(press.velocity, normal) * normal;
    const Vec3 along = strain - SimTK::dot(strain, normal) * normal;
    const double stiffness = scenario_.terrain.body_stiffness;
    const Vec3 pull = -stiffness * along - ground_damping_ * slip;
    const double most = friction(car, p, pull) * load, size = pull.norm();
    if (size <= most) {
      t.force += pull;
      t.strain_rate = slip - (strain - along) / settle_time_;
    } else {
      const Vec3 rub = most / size * pull;
      t.force += rub;
      t.strain_rate = (-rub / stiffness - strain) / settle_time_;
    }
    return t;
  }

  /// Coefficient of friction of a point that is pulled that way.
  double friction(const Moving& car, const Point& p, const Vec3& pull) const {
    if (p.truck == kBody) return scenario_.terrain.body_friction;
    const inputs::Ground& g = scenario_.ground;
    if (g.off_track_law == inputs::OffTrackLaw::coulomb) return g.off_track_friction;
    const auto share = [](double x) { return std::min(std::max(x, 0.0), 1.0); };
    const double across = std::abs(SimTK::dot(pull, car.frame.R().y().asVec3()));
    const double turned = pull.norm() > 0.0 ? share(across / pull.norm() / g.slip_ratio) : 0.0;
    const double aside = std::abs(car.place(trucks_[static_cast<std::size_t>(p.truck)])[1]);
    const double gauge = 1.435;  // m
    const double broadside =
        std::max(turned * turned * (3.0 - 2.0 * turned), share((aside - 0.5 * gauge) / g.far_distance));
    return g.in_line_friction + broadside * (g.broadside_friction - g.in_line_friction);
  }

  const inputs::Scenario& scenario_;
  const MobilizedBody body_;
  const SimTK::GeneralForceSubsystem& forces_;
  const double settle_time_, lever_sign_;  // -1: a mistake is put in
  const double rail_damping_, ground_damping_;
  std::vector<Point> points_;
  std::vector<Vec3> trucks_;  // middles at the top of the rails
  mutable SimTK::DiscreteVariableIndex stands_;
  mutable SimTK::ZIndex strains_;
  mutable SimTK::CacheEntryIndex strain_rates_;  // found with the forces
};

/// Draft gear, damper and stops of a coupler.
class SpatialBar final : public SimTK::Force::Custom::Implementation {
 public:
  SpatialBar(const inputs::Coupler& law, const inputs::CouplerHold& hold, const SimTK::GeneralForceSubsystem& forces,
             double damping, bool roll_stop, const MobilizedBody& ahead, const Vec3& rear_pin,
             const MobilizedBody& behind, const Vec3& front_pin)
      : law_(law),
        hold_(hold),
        forces_(forces),
        damping_(damping),
        roll_stop_(roll_stop),
        ahead_(ahead),
        behind_(behind),
        rear_pin_(rear_pin),
        front_pin_(front_pin) {}

  void realizeTopology(State& state) const override {
    broken_ = forces_.allocateDiscreteVariable(state, Stage::Dynamics, new SimTK::Value<bool>(false));
  }
  bool broken(const State& state) const {
    return SimTK::Value<bool>::downcast(forces_.getDiscreteVariable(state, broken_)).get();
  }
  void part(State& state) const {
    SimTK::Value<bool>::updDowncast(forces_.updDiscreteVariable(state, broken_)).upd() = true;
  }

  void calcForce(const State& state, BodyForces& forces, SimTK::Vector_<Vec3>&, SimTK::Vector&) const override {
    if (broken(state)) return;
    const auto apply = [&](const Downhill& s, double factor) {
      ahead_.applyForceToBodyPoint(state, Vec3(0.0), factor * s.force, forces);
      ahead_.applyBodyTorque(state, factor * s.on_ahead, forces);
      behind_.applyForceToBodyPoint(state, Vec3(0.0), -factor * s.force, forces);
      behind_.applyBodyTorque(state, factor * s.on_behind, forces);
    };
    apply(shortening(state), -buff(state));
    apply(stops(ahead_.getBodyTransform(state), behind_.getBodyTransform(state)), 1.0);
  }

  /// Positive while nothing breaks the coupler: how far it is from its nearest limit, as a share of the limit.
  double holds(const State& state) const {
    const Transform &ahead = ahead_.getBodyTransform(state), &behind = behind_.getBodyTransform(state);
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
    const double shares[] = {pulled / law_.break_draft,
                             swing / law_.break_swing,
                             std::abs(moments) / law_.break_moment,
                             std::abs(rise) / hold_.slip_height,
                             std::abs(stops(ahead, behind).force[2]) / hold_.vertical_hold,
                             twist / law_.break_twist};
    return 1.0 - *std::max_element(std::begin(shares), std::end(shares));
  }
  Real calcPotentialEnergy(const State&) const override { return 0.0; }

 private:
  /// Length of the bar. One that is tilted stands on edges of its ends, as long as slack makes room for that.
  double length(const Transform& ahead, const Transform& behind) const {
    const Vec3 between = ahead * rear_pin_ - behind * front_pin_;
    const double pins = between.norm();
    double tilted = 0.0;
    for (const Transform* body : {&ahead, &behind}) {
      constexpr double kBears = 0.005;
      const double tilt = SimTK::dot(body->R().z(), between) / pins;
      tilted += std::hypot(tilt, kBears) - kBears;
    }
    const double shorter = pins - std::min(0.5 * law_.butt_height * tilted, law_.slack);
    return shorter < law_.length - 0.5 * law_.slack ? shorter : pins;
  }
  struct Downhill {
    Vec3 force{0.0}, on_ahead{0.0}, on_behind{0.0};  // force on the car ahead; moments
  };
  Downhill shortening(const State& state) const {
    return slope(ahead_.getBodyTransform(state), behind_.getBodyTransform(state),
                 [this](const Transform& a, const Transform& b) { return length(a, b); });
  }
  /// Buff positive.
  double buff(const State& state) const {
    const Downhill s = shortening(state);
    const auto &ahead = ahead_.getBodyVelocity(state), &behind = behind_.getBodyVelocity(state);
    const double rate = -SimTK::dot(s.force, ahead[1] - behind[1]) - SimTK::dot(s.on_ahead, ahead[0]) -
                        SimTK::dot(s.on_behind, behind[0]);
    return buff(length(ahead_.getBodyTransform(state), behind_.getBodyTransform(state)), rate);
  }
  /// Buff positive.
  double buff(double length, double rate) const {
    const double stretch = length - law_.length, beyond = std::abs(stretch) - 0.5 * law_.slack;
    if (beyond <= 0.0) return 0.0;
    const double gear = std::min(beyond, law_.draft_gear_travel), first = law_.draft_gear_stiffness * gear;
    const double spring = first + law_.stiffness * (beyond - gear), closing = stretch > 0.0 ? rate : -rate;
    // A damper alone never turns the force round.
    const double force = std::max(spring + damping_ * closing, 0.0);
    return stretch > 0.0 ? -force : force;
  }

  /// Energy of a stop at that angle.
  static double energy(double angle, double limit, double stiffness, double most) {
    const double beyond = std::abs(angle) - limit;
    if (beyond <= 0.0 || stiffness == 0.0) return 0.0;
    const double elastic = std::min(beyond, most / stiffness);
    return 0.5 * stiffness * elastic * elastic + (beyond > elastic ? most * (beyond - elastic) : 0.0);
  }
  double stop_energy(const Transform& ahead, const Transform& behind) const {
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
  /// Roll of one car in the other: the angle between what is left of their left sides when seen along the bar.
  double roll(const Transform& ahead, const Transform& behind) const {
    const Vec3 between = ahead * rear_pin_ - behind * front_pin_, along = between / between.norm();
    const auto flat = [&along](const Transform& body) {
      const Vec3 left = body.R().y().asVec3();
      return Vec3(left - SimTK::dot(left, along) * along);
    };
    const Vec3 a = flat(ahead), b = flat(behind);
    return std::atan2(SimTK::cross(a, b).norm(), SimTK::dot(a, b));
  }

  /// Forces are the slope of the energy downhill.
  Downhill stops(const Transform& ahead, const Transform& behind) const {
    if (stop_energy(ahead, behind) == 0.0) return {};
    return slope(ahead, behind, [this](const Transform& a, const Transform& b) { return stop_energy(a, b); });
  }
  /// By central differences.
  template <class Function>
  static Downhill slope(const Transform& ahead, const Transform& behind, const Function& of) {
    Downhill s;
    constexpr double kShift = 1e-5;  // m, rad
    const auto turned = [](const Transform& body, int axis, double angle) {
      return Transform(Rotation(angle, SimTK::CoordinateAxis(axis)) * body.R(), body.p());
    };
    for (int c = 0; c < 3; ++c) {
      const auto fall = [](double forth, double back) { return (back - forth) / (2.0 * kShift); };
      Vec3 shift(0.0);
      shift[c] = kShift;
      s.force[c] = fall(of(Transform(ahead.R(), ahead.p() + shift), behind),
                        of(Transform(ahead.R(), ahead.p() - shift), behind));
      s.on_ahead[c] = fall(of(turned(ahead, c, kShift), behind), of(turned(ahead, c, -kShift), behind));
      s.on_behind[c] = fall(of(ahead, turned(behind, c, kShift)), of(ahead, turned(behind, c, -kShift)));
    }
    return s;
  }

  const inputs::Coupler law_;
  const inputs::CouplerHold hold_;
  const SimTK::GeneralForceSubsystem& forces_;
  const double damping_;
  const bool roll_stop_;
  const MobilizedBody ahead_, behind_;
  const Vec3 rear_pin_, front_pin_;
  mutable SimTK::DiscreteVariableIndex broken_;
};

/// A mistake that is put in: twice the gyroscopic moment, so that with the right one that Simbody has its sign is
/// wrong.
class WrongGyroscope final : public SimTK::Force::Custom::Implementation {
 public:
  explicit WrongGyroscope(std::vector<MobilizedBody> bodies) : bodies_(std::move(bodies)) {}
  void calcForce(const State& state, BodyForces& forces, SimTK::Vector_<Vec3>&, SimTK::Vector&) const override {
    for (const MobilizedBody& body : bodies_) {
      const Rotation& axes = body.getBodyRotation(state);
      const Vec3 rates = ~axes * body.getBodyAngularVelocity(state);
      const Vec3 spin = body.getBodyMassProperties(state).getInertia() * rates;
      body.applyBodyTorque(state, axes * (2.0 * SimTK::cross(rates, spin)), forces);
    }
  }
  Real calcPotentialEnergy(const State&) const override { return 0.0; }

 private:
  const std::vector<MobilizedBody> bodies_;
};

/// Event: a truck comes to the point of derailment, or hangs from a body that has rolled and carries nothing.
class TruckLeaves final : public SimTK::TriggeredEventHandler {
 public:
  TruckLeaves(const Support& support, std::size_t truck, Stand from, Stand to)
      : TriggeredEventHandler(Stage::Velocity), support_(support), truck_(truck), from_(from), to_(to) {
    getTriggerInfo().setTriggerOnRisingSignTransition(false).setRequiredLocalizationTimeWindow(1e-6);
  }
  Real getValue(const State& state) const override {
    if (support_.stand(state, truck_) != from_) return 1.0;
    return from_ == Stand::on_rails ? -support_.along_track(state, truck_) : support_.holds_on(state, truck_);
  }
  void handleEvent(State& state, Real, bool&) const override { support_.set_stand(state, truck_, to_); }

 private:
  const Support& support_;
  const std::size_t truck_;
  const Stand from_, to_;
};

/// Event: a coupler breaks or slips out.
class CouplerParts final : public SimTK::TriggeredEventHandler {
 public:
  explicit CouplerParts(const SpatialBar& bar) : TriggeredEventHandler(Stage::Velocity), bar_(bar) {
    getTriggerInfo().setTriggerOnRisingSignTransition(false).setRequiredLocalizationTimeWindow(1e-6);
  }
  Real getValue(const State& state) const override { return bar_.broken(state) ? 1.0 : bar_.holds(state); }
  void handleEvent(State& state, Real, bool&) const override { bar_.part(state); }

 private:
  const SpatialBar& bar_;
};

Vec3 from_eigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Eigen::Vector3d to_eigen(const Vec3& v) { return {v[0], v[1], v[2]}; }

inputs::Scenario checked(const inputs::Scenario& s) {
  inputs::validate(s);
  const auto refuse_if = [](bool has, const char* what) {
    if (has) throw std::invalid_argument(std::string("the multibody engine in three dimensions has no ") + what);
  };
  refuse_if(s.model != inputs::Model::spatial, "model but spatial");
  refuse_if(s.contact.law != inputs::ContactLaw::none, "contact of bodies");
  refuse_if(!s.track.curves.empty(), "curves: track.curves");
  refuse_if(s.track.grade != 0.0 || !s.track.grades.empty(), "grades: track.grade, track.grades");
  refuse_if(!s.terrain.sections.empty() || !s.terrain.grid.rows.empty(), "terrain.sections, terrain.grid");
  refuse_if(!s.ground.patches.empty(), "patches of ground");
  refuse_if(std::isfinite(s.rails.flange_height) && std::isfinite(s.rails.derail_ratio),
            "wheels that lift: rails.flange_height");
  refuse_if(s.initial.cars_ahead > 0, "cars ahead of the point of derailment");
  refuse_if(s.initial.perturbation.kick != 0.0 || s.initial.perturbation.alignment != 0.0, "perturbations");
  refuse_if(s.brakes.force != 0.0 || s.brakes.rolling_resistance != 0.0, "brakes");
  refuse_if(s.rails.derail_ratio < 100.0, "limit of L/V: rails.derail_ratio must be 100 or more");
  refuse_if(s.rails.torn_length > 0.0, "torn track");
  refuse_if(s.rails.load_exponent != 1.0 || s.ground.load_exponent != 1.0,
            "forces by weight: rails.load_exponent, ground.load_exponent");
  refuse_if(s.initial.mechanism != inputs::Mechanism::broken_rail, "start but broken_rail: initial.mechanism");
  refuse_if(s.ties.law != inputs::TieLaw::none, "trucks on the ties: ties.law");
  refuse_if(s.traction.law != inputs::TractionLaw::none, "traction");
  for (const inputs::CarBlock& block : s.consist)
    refuse_if(block.shape != inputs::BodyShape::box, "body but a box: shape of a block");
  return s;
}

class SimbodyInSpace final : public SpatialEngineRun {
 public:
  SimbodyInSpace(const inputs::Scenario& s, const std::vector<FreeMotion>& start, const SpatialEngineOptions& o)
      : scenario_(checked(s)),
        train_(model::expand(scenario_.consist)),
        matter_(system_),
        forces_(system_),
        integrator_(system_),
        stepper_(system_, integrator_) {
    if (train_.size() != start.size()) throw std::invalid_argument("a motion must be given for every car");
    forces_.setNumberOfThreads(1);
    build(o);
    State state = system_.realizeTopology();
    supports_.front()->set_weights(state);  // of all
    for (std::size_t k = 0; k < train_.size(); ++k) {
      const FreeMotion& m = start[k];
      const SimTK::Mat33 axes(from_eigen(m.axes.col(0)), from_eigen(m.axes.col(1)), from_eigen(m.axes.col(2)));
      bodies_[k].setQToFitTransform(state, Transform(Rotation(axes), from_eigen(m.centre)));
      bodies_[k].setUToFitVelocity(state, SimTK::SpatialVec(from_eigen(m.rotation), from_eigen(m.velocity)));
    }
    system_.realize(state, Stage::Velocity);
    for (const Support* support : supports_) {
      for (const std::size_t truck : {0U, 1U})
        if (support->along_track(state, truck) >= 0.0) support->set_stand(state, truck, Stand::off_rails);
    }
    for (const SpatialBar* bar : bars_) {
      system_.realize(state, Stage::Velocity);
      if (bar->holds(state) < 0.0) bar->part(state);
    }
    integrator_.setAccuracy(o.accuracy);
    stepper_.initialize(state);
  }

  void advance(double t) override {
    while (time() < t) stepper_.stepTo(t);
  }
  double time() const override { return stepper_.getTime(); }
  std::vector<FreeMotion> cars() const override {
    const State& state = stepper_.getState();
    system_.realize(state, Stage::Velocity);
    std::vector<FreeMotion> result;
    for (const MobilizedBody& body : bodies_) {
      FreeMotion& m = result.emplace_back();
      m.centre = to_eigen(body.getBodyOriginLocation(state));
      for (int c = 0; c < 3; ++c) m.axes.col(c) = to_eigen(body.getBodyRotation(state).col(c).asVec3());
      m.velocity = to_eigen(body.getBodyOriginVelocity(state));
      m.rotation = to_eigen(body.getBodyAngularVelocity(state));
    }
    return result;
  }

 private:
  void build(const SpatialEngineOptions& o) {
    SimTK::Force::Gravity(forces_, matter_, Vec3(0.0, 0.0, -inputs::kStandardGravity));
    for (const model::Car& car : train_) {
      // As of a bar: the same about the lateral and the vertical axis.
      const SimTK::MassProperties mass(car.mass, Vec3(0.0),
                                       SimTK::Inertia(car.roll_inertia, car.yaw_inertia, car.yaw_inertia));
      const MobilizedBody& body = bodies_.emplace_back(matter_.updGround(), SimTK::Body::Rigid(mass));
      auto support = std::make_unique<Support>(scenario_, car, body, forces_, o);
      supports_.push_back(support.get());
      SimTK::Force::Custom(forces_, support.release());
      for (const std::size_t truck : {0U, 1U}) {
        system_.addEventHandler(new TruckLeaves(*supports_.back(), truck, Stand::on_rails, Stand::off_rails));
        system_.addEventHandler(new TruckLeaves(*supports_.back(), truck, Stand::off_rails, Stand::lost));
      }
    }
    const inputs::Coupler& law = scenario_.coupler;
    const double first_stiffness = law.draft_gear_travel > 0.0 ? law.draft_gear_stiffness : law.stiffness;
    for (std::size_t k = 1; k < train_.size(); ++k) {
      const model::Car &a = train_[k - 1], &b = train_[k];
      const Vec3 rear(-0.5 * a.length, 0.0, law.height - a.centre_height),
          front(0.5 * b.length, 0.0, law.height - b.centre_height);
      const double both = a.mass * b.mass / (a.mass + b.mass);
      auto bar =
          std::make_unique<SpatialBar>(law, inputs::coupler_hold(law, a.coupler_type, b.coupler_type), forces_,
                                       law.damping_ratio * critical_damping(first_stiffness, both),
                                       o.fault != SpatialFault::no_roll_stop, bodies_[k - 1], rear, bodies_[k], front);
      bars_.push_back(bar.get());
      system_.addEventHandler(new CouplerParts(*bar));
      SimTK::Force::Custom(forces_, bar.release());
    }
    if (o.fault == SpatialFault::gyroscopic_sign)
      SimTK::Force::Custom(forces_, new WrongGyroscope({bodies_.begin(), bodies_.end()}));
  }

  const inputs::Scenario scenario_;
  const std::vector<model::Car> train_;
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  std::vector<MobilizedBody::Free> bodies_;
  std::vector<const Support*> supports_;  // the force subsystem owns these
  std::vector<const SpatialBar*> bars_;
  SimTK::RungeKuttaMersonIntegrator integrator_;
  SimTK::TimeStepper stepper_;
};

}  // namespace

}  // namespace train_derail::multibody

extern "C" train_derail::multibody::SpatialEngineRun* train_derail_start_spatial_engine(
    const train_derail::inputs::Scenario& scenario, const std::vector<train_derail::multibody::FreeMotion>& start,
    const train_derail::multibody::SpatialEngineOptions& options) {
  return new train_derail::multibody::SimbodyInSpace(scenario, start, options);
}
