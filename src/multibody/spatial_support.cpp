#include "multibody/spatial_support.hpp"

#include <algorithm>
#include <cmath>

namespace train_derail::multibody {

using SimTK::Real;
using SimTK::Stage;
using SimTK::State;
using SimTK::Vec3;

namespace {

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

}  // namespace

double critical_damping(double stiffness, double mass) { return 2.0 * std::sqrt(stiffness * mass); }

struct Support::Moving {
  const SimTK::Transform& frame;
  const SimTK::SpatialVec& rates;
  double damping;  // of the body on the ground, over that of the whole car: critical for less mass
  Vec3 arm(const Vec3& station) const { return frame.R() * station; }
  Vec3 place(const Vec3& station) const { return frame.p() + arm(station); }
  Vec3 velocity(const Vec3& station) const { return rates[1] + SimTK::cross(rates[0], arm(station)); }
};

Support::Support(const Common& common, std::size_t number, const model::Car& car, const CarBody& body)
    : Strained(common.forces),
      common_(common),
      scenario_(common.scenario),
      number_(number),
      body_(body),
      settle_time_(common.settle_time),
      lever_sign_(common.lever_sign),
      rail_damping_(scenario_.rails.damping_ratio * critical_damping(scenario_.rails.stiffness, 0.5 * car.mass)),
      ground_damping_(scenario_.terrain.body_damping_ratio *
                      critical_damping(scenario_.terrain.body_stiffness, 0.25 * car.mass)) {
  const inputs::Scenario& s = scenario_;
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
  const auto lies_on = [&](double height, double width) {
    for (const double x : {-0.5, 0.0, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Vec3 corner(x * car.length, y * width, height - car.centre_height);
        points_.push_back({kBody, corner, s.terrain.body_stiffness, ground_damping_, 0.0});
      }
    }
  };
  lies_on(car.floor_height, car.width);
  lies_on(car.roof_height, car.width);
  if (car.underframe_height < car.floor_height) lies_on(car.underframe_height, car.underframe_width);
}

void Support::realizeTopology(State& state) const {
  stands_ = forces_.allocateDiscreteVariable(state, Stage::Dynamics, new SimTK::Value<Stands>(Stands()));
  allocate(state, static_cast<int>(3 * points_.size()), static_cast<int>(3 * trucks_.size()));
}

void Support::set_stand(State& state, std::size_t truck, Stand stand) const {
  SimTK::Value<Stands>::updDowncast(forces_.updDiscreteVariable(state, stands_)).upd().of[truck] = stand;
}

void Support::calcForce(const State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<Vec3>&,
                        SimTK::Vector&) const {
  const Moving car = moving(state);
  const Stands& stand = stands(state);
  const Real* strain = numbers(state);
  Real* rate = rates(state);
  SimTK::SpatialVec sum(Vec3(0.0), Vec3(0.0));
  std::array<Load, 2> loads;  // of trucks
  for (const Point& p : points_) {
    const Touch t = touch(car, stand, p, Vec3(strain[0], strain[1], strain[2]));
    for (int c = 0; c < 3; ++c) rate[c] = t.strain_rate[c];
    strain += 3;
    rate += 3;
    pull_at(sum, car, p.station, p.truck, t.force);
    if (p.truck == kBody) continue;
    Load& load = loads[static_cast<std::size_t>(p.truck)];
    load.both += t.force[2];
    load.more_left += p.station[1] > 0.0 ? t.force[2] : -t.force[2];
  }
  const Real *overload = strain + trucks_.size(), *hung = overload + trucks_.size();
  Real *overload_rate = rate + trucks_.size(), *hung_rate = overload_rate + trucks_.size();
  for (std::size_t i = 0; i < trucks_.size(); ++i) {
    rate[i] = -strain[i] / settle_time_;
    overload_rate[i] = -overload[i] / settle_time_;
    hung_rate[i] = -hung[i] / settle_time_;
    if (stand.of[i] != Stand::on_rails) continue;
    const double lateral = held(car, i);
    const Drag along = drag(car.velocity(trucks_[i])[0], common_.pipe.share(state, number_) * loads[i].both, strain[i]);
    rate[i] = along.strain_rate;
    if (overloaded(lateral, loads[i])) overload_rate[i] = 1.0;
    if (hangs(car, i, loads[i])) hung_rate[i] = 1.0;
    pull_at(sum, car, trucks_[i], static_cast<int>(i), Vec3(along.force, lateral, 0.0));
  }
  forces[body_.now(state).getMobilizedBodyIndex()] += sum;
}

double Support::holds_on(const State& state, std::size_t truck) const {
  const Moving car = moving(state);
  double most = car.frame.R().z()[2] - std::cos(scenario_.suspension.part_angle);
  for (const Point& p : points_)
    if (p.truck == static_cast<int>(truck)) most = std::max(most, pressing(car, p, false).push);
  return most;
}

double Support::stays(const State& state, std::size_t truck) const {
  const double place = along_track(state, truck);
  if (common_.torn.torn(state, place)) return -1.0;
  const Real* since = numbers(state) + 3 * points_.size() + trucks_.size() + truck;
  const double left = scenario_.rails.derail_time - std::max(since[0], since[trucks_.size()]);
  return derails() ? std::min(left, -place) : left;
}

bool Support::at_the_end(const State& state, std::size_t truck) const {
  return derails() && along_track(state, truck) >= 0.0;
}

bool Support::derails() const { return number_ >= static_cast<std::size_t>(scenario_.initial.cars_ahead); }

double Support::held(const Moving& car, std::size_t truck) const {
  const Vec3 place = car.place(trucks_[truck]);
  const double aside = place[1] - common_.alignment.at(place[0]);
  return -scenario_.rails.stiffness * aside - rail_damping_ * car.velocity(trucks_[truck])[1];
}

/// Rails push a truck to the left by the flanges of its right wheels.
bool Support::overloaded(double lateral, const Load& load) const {
  if (scenario_.rails.derail_ratio == inputs::kInfinity) return false;
  const double flange = 0.5 * (lateral > 0.0 ? load.both - load.more_left : load.both + load.more_left);
  return std::abs(lateral) > scenario_.rails.derail_ratio * std::min(load.both, 2.0 * flange);
}

bool Support::hangs(const Moving& car, std::size_t truck, const Load& load) const {
  if (scenario_.rails.derail_ratio == inputs::kInfinity || load.both > std::abs(load.more_left)) return false;
  double highest = -inputs::kInfinity;
  for (const Point& p : points_)
    if (p.truck == static_cast<int>(truck)) highest = std::max(highest, car.place(p.station)[2] - p.reach);
  return highest > scenario_.rails.flange_height;
}

double Support::along_track(const State& state, std::size_t truck) const {
  return moving(state).place(trucks_[truck])[0];
}

Support::Moving Support::moving(const State& state) const {
  const SimTK::MobilizedBody& body = body_.now(state);
  return {body.getBodyTransform(state), body.getBodyVelocity(state), std::sqrt(body_.share(state))};
}

const Support::Stands& Support::stands(const State& state) const {
  return SimTK::Value<Stands>::downcast(forces_.getDiscreteVariable(state, stands_)).get();
}

void Support::pull_at(SimTK::SpatialVec& sum, const Moving& car, Vec3 station, int truck, const Vec3& force) const {
  if (truck != kBody) station[2] *= lever_sign_;
  sum[0] += SimTK::cross(car.arm(station), force);
  sum[1] += force;
}

Support::Pressing Support::pressing(const Moving& car, const Point& p, bool on_rails) const {
  const Vec3 place = car.place(p.station), velocity = car.velocity(p.station);
  const GroundAt g = on_rails ? GroundAt{0.0, Vec3(0.0, 0.0, 1.0)} : ground_at(scenario_.terrain, place[1]);
  const double spring = p.stiffness * (p.reach + g.height - place[2]);
  // A wheel that has left the ground is not held back by its damper.
  return {spring > 0.0 ? spring - car.damping * p.damping * SimTK::dot(velocity, g.up) : spring, g.up, velocity};
}

Support::Touch Support::touch(const Moving& car, const Stands& stands, const Point& p, const Vec3& strain) const {
  const Stand stand = p.truck == kBody ? Stand::off_rails : stands.of[static_cast<std::size_t>(p.truck)];
  Touch t{Vec3(0.0), -strain / settle_time_};  // without a touch it is forgotten
  if (stand == Stand::lost) return t;
  const Pressing press = pressing(car, p, stand == Stand::on_rails);
  if (press.push <= 0.0) return t;
  t.force = press.push * press.up;
  if (stand == Stand::on_rails) return t;  // see drag()
  const double load = t.force.norm();
  const Vec3 normal = press.up / press.up.norm();
  const Vec3 slip = press.velocity - SimTK::dot(press.velocity, normal) * normal;
  const Vec3 along = strain - SimTK::dot(strain, normal) * normal;
  const double stiffness = scenario_.terrain.body_stiffness;
  const Vec3 pull = -stiffness * along - car.damping * ground_damping_ * slip;
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

Support::Drag Support::drag(double speed, double most, double strain) const {
  const double stiffness = scenario_.terrain.body_stiffness;
  const double pull = -stiffness * strain - ground_damping_ * speed;
  if (std::abs(pull) <= most) return {pull, speed};
  const double rub = std::copysign(most, pull);
  return {rub, (-rub / stiffness - strain) / settle_time_};
}

double Support::friction(const Moving& car, const Point& p, const Vec3& pull) const {
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

}  // namespace train_derail::multibody
