#include "train_derail/model/spatial_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "model/air_brakes.hpp"
#include "model/box_contact.hpp"
#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "model/rotation.hpp"
#include "model/terrain.hpp"
#include "simd/instruction_sets.hpp"
#include "train_derail/inputs/extent.hpp"
#include "train_derail/model/contact_law.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/extended_model.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"
#include "train_derail/model/track.hpp"

namespace train_derail::model {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Versions<ExtendedKernels> kVersions TRAIN_DERAIL_VERSIONS(kExtended);

/// Columns of a state.
enum Column { SX, SY, SZ, TURN_X, TURN_Y, TURN_Z, SVX, SVY, SVZ, ROLL_RATE, PITCH_RATE, YAW_RATE, QX, QY, QZ, QW };

/// Where what a force does is put in the ledger; what is stored comes from the state.
enum Account {
  STORED,
  ON_TRACK,
  RAILS,
  OFF_TRACK,
  TRUCK_DAMPING,
  COUPLER_DAMPING,
  BODY_GROUND,
  IMPACT_NORMAL,
  IMPACT_FRICTION,
  kAccounts
};

struct Wrench {
  Vector3d force = Vector3d::Zero();   // N
  Vector3d torque = Vector3d::Zero();  // about the centre of mass, world frame [N m]
  void add(const Vector3d& f, const Vector3d& arm) {
    force += f;
    torque += arm.cross(f);
  }
};

/// A car that does not change.
struct Body {
  double mass, weight;
  Vector3d inertia;  // about roll, pitch, yaw axes
  double half_length, half_spacing, half_width;
  Vector3d box_centre, box_half;  // of the body, from the centre of mass
  double centre_height;
  double spring, spring_damping, sag;  // of a side of a truck; how far it is pressed at rest
  double rail_damping;
  double ground_damping;
  double radius;  // of a sphere around the body
};

double safe_acos(double c) { return std::acos(std::clamp(c, -1.0, 1.0)); }

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

constexpr double kMargin = 1.0;       // of pairs of bodies that are looked at, m
constexpr double kSameImpact = 0.25;  // s: touches of the same two cars closer together are one impact

struct Pair {
  int a, b;
  int axis = -1;
  double crushed = 0.0;
  int impact = -1;
  double seen = 0.0;
};

}  // namespace

struct SpatialModel::Parts {
  Parts(SpatialModel& owner, const inputs::Scenario& s)
      : model(owner),
        scenario(s),
        n(static_cast<std::size_t>(owner.car_count())),
        track(s, inputs::track_extent(s).from, inputs::track_extent(s).to),
        loops(*kVersions.choose(owner.car_count(), "")),
        brakes(s, owner.cars(), loops) {
    for (const Car& c : owner.cars()) {
      Body b;
      b.mass = c.mass;
      b.weight = c.weight;
      b.inertia = {c.roll_inertia, c.yaw_inertia, c.yaw_inertia};
      b.half_length = 0.5 * c.length;
      b.half_spacing = 0.5 * c.truck_spacing;
      b.half_width = 0.5 * c.width;
      b.centre_height = c.centre_height;
      b.box_centre = {0.0, 0.0, 0.5 * (c.floor_height + c.roof_height) - c.centre_height};
      b.box_half = {b.half_length, b.half_width, 0.5 * (c.roof_height - c.floor_height)};
      b.spring = s.suspension.stiffness;
      b.spring_damping = 2.0 * s.suspension.damping_ratio * std::sqrt(b.spring * 0.25 * c.mass);
      b.sag = 0.25 * c.weight / b.spring;
      b.rail_damping = rail_damping(s.rails, c.mass);
      b.ground_damping = 2.0 * s.terrain.body_damping_ratio * std::sqrt(s.terrain.body_stiffness * 0.25 * c.mass);
      b.radius = b.box_half.norm();
      bodies.push_back(b);
    }
    const std::size_t trucks = 2 * n;
    on_rails.assign(trucks, true);
    lost.assign(trucks, false);
    past.assign(n, false);
    first_cause.assign(n, Cause::none);
    for (auto* a : {&arc, &overloaded, &lateral, &lateral_before, &kick}) a->assign(trucks, 0.0);
    load.assign(2 * trucks, 0.0);
    for (auto& account : wrench) account.resize(n);
    now.resize(n);
    alive.assign(n > 0 ? n - 1 : 0, true);
    axial = ArrayX::Zero(owner.coupler_count());
    damping.resize(alive.size());
    for (std::size_t i = 0; i < alive.size(); ++i)
      damping[i] = coupler_damping(s.coupler, bodies[i].mass, bodies[i + 1].mass);
    stops.resize(alive.size());
    boost::random::mt19937_64 generator(static_cast<std::uint64_t>(s.initial.perturbation.seed) ^ 0x61c5e1ULL);
    boost::random::normal_distribution<double> normal;
    for (std::size_t k = 0; k < n; ++k) {
      for (const std::size_t truck : {k, n + k}) kick[truck] = s.initial.perturbation.kick * normal(generator);
    }
    for (std::size_t k = 0; k < n; ++k) by_x.push_back(static_cast<int>(k));
  }

  SpatialModel& model;
  const inputs::Scenario scenario;
  const std::size_t n;
  Track track;
  const ExtendedKernels& loops;
  AirBrakes brakes;
  Record record;
  std::vector<Body> bodies;

  // Trucks: the front trucks of all cars, then the rear ones; wheels: right and left of each truck.
  std::vector<char> on_rails, lost, past;
  std::vector<Cause> first_cause;
  std::vector<double> arc, overloaded, lateral, lateral_before, kick, load;
  std::size_t ordered = 0;

  // Couplers.
  std::vector<char> alive;
  ArrayX axial;
  std::vector<double> damping;
  struct Stops {
    double swing = 0.0, moment = 0.0, vertical = 0.0, twist = 0.0, height = 0.0;
  };
  std::vector<Stops> stops;  // what may break or slip, as found last

  // Forces of the step, by account.
  std::array<std::vector<Wrench>, kAccounts> wrench;
  std::vector<SpatialMotion> now;
  bool forces_found = false;

  // Bodies that touch.
  std::vector<int> by_x;
  std::vector<Pair> pairs, old_pairs;
  double moved = inputs::kInfinity;

  std::size_t truck_of(std::size_t car, bool front) const { return front ? car : n + car; }
  std::size_t car_of(std::size_t truck) const { return truck < n ? truck : truck - n; }
  double arm_of(std::size_t truck) const {
    const Body& b = bodies[car_of(truck)];
    return truck < n ? b.half_spacing : -b.half_spacing;
  }

  void load_motions(const double* y) {
    for (std::size_t k = 0; k < n; ++k) now[k] = model.motion(y, static_cast<Eigen::Index>(k));
  }
  void clear() {
    for (auto& account : wrench) std::fill(account.begin(), account.end(), Wrench{});
  }

  /// Ground under a point: height and the upward vector (not of length 1) along which it pushes.
  struct Under {
    double z;
    Vector3d up;
  };
  Under ground_under(const Vector3d& p, double s_near) const {
    if (track.straight()) {
      const GroundHeight g = ground_height(scenario.terrain, p.y());
      return {g.z, {0.0, -g.slope, 1.0}};
    }
    const double s = track.foot({p.x(), p.y()}, s_near);
    const Track::Node node = track.at(s);
    const double offset =
        (p.y() - node.point.y()) * node.tangent.x() - (p.x() - node.point.x()) * node.tangent.y();
    const GroundHeight g = ground_height(scenario.terrain, offset);
    return {g.z, {g.slope * node.tangent.y(), -g.slope * node.tangent.x(), 1.0}};
  }

  Vector3d wheel(std::size_t truck, bool left) const {
    const Body& b = bodies[car_of(truck)];
    const double half_base = scenario.suspension.half_base;
    return now[car_of(truck)].point({arm_of(truck), left ? half_base : -half_base, -b.centre_height});
  }

  /// How far the spring under a wheel is pressed.
  double pressed(std::size_t truck, const Vector3d& place, Under& under) const {
    under = on_rails[truck] ? Under{0.0, Vector3d::UnitZ()} : ground_under(place, arc[truck]);
    return bodies[car_of(truck)].sag - (place.z() - under.z);
  }

  void truck_forces(std::size_t truck, double brake_share) {
    const std::size_t car = car_of(truck);
    load[2 * truck] = load[2 * truck + 1] = 0.0;
    lateral[truck] = 0.0;
    if (lost[truck]) return;
    const Body& b = bodies[car];
    const SpatialMotion& q = now[car];
    Vector2 tangent = Vector2::UnitX();
    double alignment = track.alignment(arc[truck]);
    Vector2 centre_line(arc[truck], 0.0);
    if (!track.straight()) {
      const Track::Node node = track.at(arc[truck]);
      tangent = node.tangent;
      centre_line = node.point;
    }
    const Vector3d along(tangent.x(), tangent.y(), 0.0), across(-tangent.y(), tangent.x(), 0.0);
    const Vector3d middle = q.point({arm_of(truck), 0.0, -b.centre_height});
    const Vector3d velocity = q.velocity_at(middle);
    const double offset = (Vector2(middle.x(), middle.y()) - centre_line).dot(Vector2(across.x(), across.y()));
    double mu = scenario.ground.off_track_friction;
    if (!on_rails[truck]) {
      if (scenario.ground.off_track_law == inputs::OffTrackLaw::by_slip)
        mu = slip_friction<double>(scenario.ground, velocity.squaredNorm(), velocity.dot(q.axes.col(1)), offset);
      mu *= patch_factor(scenario.ground.patches, arc[truck], offset);
    }
    for (const bool left : {false, true}) {
      const Vector3d place = wheel(truck, left), arm = place - q.centre;
      Under under{};
      const double depth = pressed(truck, place, under);
      const Vector3d v = q.velocity_at(place);
      const double spring = std::max(b.spring * depth, 0.0);
      const double total = depth > 0.0 ? std::max(spring - b.spring_damping * v.dot(under.up), 0.0) : 0.0;
      wrench[STORED][car].add(spring * under.up, arm);
      wrench[TRUCK_DAMPING][car].add((total - spring) * under.up, arm);
      const double carried = total * under.up.norm();
      load[2 * truck + (left ? 1 : 0)] = carried;
      if (carried == 0.0) continue;
      if (on_rails[truck]) {
        const auto f = friction<double>(brake_share * carried, v.dot(along), 0.0, scenario.ground.regularization_speed);
        wrench[ON_TRACK][car].add(f.x * along, arm);
      } else {
        const Vector3d normal = under.up.normalized(), slip = v - v.dot(normal) * normal;
        const double v_eps = scenario.ground.regularization_speed;
        const double force = mu * carried / std::sqrt(slip.squaredNorm() + v_eps * v_eps);
        wrench[OFF_TRACK][car].add(-force * slip, arm);
      }
    }
    if (!on_rails[truck]) return;
    // At the top of the rails, sideways.
    const double held = rail_force<double>(scenario.rails, b.rail_damping, offset - alignment, velocity.dot(across));
    lateral[truck] = held;
    wrench[RAILS][car].add(held * across, middle - q.centre);
  }

  void body_on_ground(std::size_t car) {
    const Body& b = bodies[car];
    const SpatialMotion& q = now[car];
    // Nothing of the body can reach the ground: the usual case.
    const Vector3d centre = q.point(b.box_centre);
    const Matrix3d& r = q.axes;
    const double lowest = centre.z() - std::abs(r(2, 0)) * b.box_half.x() - std::abs(r(2, 1)) * b.box_half.y() -
                          std::abs(r(2, 2)) * b.box_half.z();
    const double highest_ground = -scenario.terrain.rail_height -
                                  std::min({scenario.terrain.bank_left, scenario.terrain.bank_right, 0.0});
    if (lowest > highest_ground) return;
    for (const double x : {-1.0, 0.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        for (const double z : {-1.0, 1.0}) {
          const Vector3d place = q.point(b.box_centre + Vector3d(x, y, z).cwiseProduct(b.box_half));
          if (place.z() > highest_ground) continue;
          const Under under = ground_under(place, arc[car]);
          const double depth = under.z - place.z();
          if (depth <= 0.0) continue;
          const Vector3d v = q.velocity_at(place), arm = place - q.centre;
          const double spring = scenario.terrain.body_stiffness * depth;
          const double total = std::max(spring - b.ground_damping * v.dot(under.up), 0.0);
          wrench[STORED][car].add(spring * under.up, arm);
          wrench[BODY_GROUND][car].add((total - spring) * under.up, arm);
          const Vector3d normal = under.up.normalized(), slip = v - v.dot(normal) * normal;
          const double v_eps = scenario.ground.regularization_speed;
          const double force = scenario.terrain.body_friction * total * under.up.norm() /
                               std::sqrt(slip.squaredNorm() + v_eps * v_eps);
          wrench[OFF_TRACK][car].add(-force * slip, arm);
        }
      }
    }
  }

  Vector3d pin_height(std::size_t car, double along) const {
    return {along, 0.0, scenario.coupler.height - bodies[car].centre_height};
  }

  /// A bar between two pins, as seen from both cars.
  struct Bar {
    Vector3d lead_pin, trail_pin, u;  // u: from the trail car's pin to the lead car's
    double gap;
    double yaw[2], pitch[2];  // against lead and trail car
    double roll;              // of the trail car against the lead car
  };
  Bar bar(const SpatialMotion& lead, const SpatialMotion& trail, std::size_t i) const {
    Bar b;
    b.lead_pin = lead.point(pin_height(i, -bodies[i].half_length));
    b.trail_pin = trail.point(pin_height(i + 1, bodies[i + 1].half_length));
    const Vector3d d = b.lead_pin - b.trail_pin;
    b.gap = d.norm();
    b.u = d / b.gap;
    for (const int end : {0, 1}) {
      const Vector3d own = (end == 0 ? lead : trail).axes.transpose() * b.u;
      b.yaw[end] = std::atan2(own.y(), own.x());
      b.pitch[end] = std::asin(std::clamp(own.z(), -1.0, 1.0));
    }
    // Left sides of both cars, square to the bar.
    const Vector3d left_a = lead.axes.col(1) - lead.axes.col(1).dot(b.u) * b.u;
    const Vector3d left_b = trail.axes.col(1) - trail.axes.col(1).dot(b.u) * b.u;
    b.roll = std::atan2(left_a.cross(left_b).dot(b.u), left_a.dot(left_b));
    return b;
  }

  double stored_in(const Bar& b) const {
    const inputs::Coupler& law = scenario.coupler;
    double e = 0.0;
    for (const int end : {0, 1}) {
      e += stop_energy(b.yaw[end], law.swing_limit, law.swing_stiffness, law.swing_moment_max);
      e += stop_energy(b.pitch[end], law.pitch_limit, law.pitch_stiffness, inputs::kInfinity);
    }
    return e + stop_energy(b.roll, law.roll_limit, law.roll_stiffness, inputs::kInfinity);
  }
  double axial_stored_in(const Bar& b) const {
    const inputs::Coupler& law = scenario.coupler;
    if (law.draft_gear_travel == 0.0) return axial_energy(law, b.gap);
    return draft_gear_energy(law, std::max(std::abs(b.gap - law.length) - 0.5 * law.slack, 0.0));
  }

  void couple(std::size_t i) {
    axial[static_cast<Eigen::Index>(i)] = 0.0;
    stops[i] = {};
    if (!alive[i]) return;
    const inputs::Coupler& law = scenario.coupler;
    const SpatialMotion &lead = now[i], &trail = now[i + 1];
    const Bar b = bar(lead, trail, i);
    const double spring = coupler_spring_force<double>(law, b.gap);
    const double rate = (lead.velocity_at(b.lead_pin) - trail.velocity_at(b.trail_pin)).dot(b.u);
    const double damper = coupler_damper_force<double>(damping[i], spring, rate);
    axial[static_cast<Eigen::Index>(i)] = spring + damper;
    const Vector3d arm_lead = b.lead_pin - lead.centre, arm_trail = b.trail_pin - trail.centre;
    wrench[COUPLER_DAMPING][i].add(damper * b.u, arm_lead);
    wrench[COUPLER_DAMPING][i + 1].add(-damper * b.u, arm_trail);
    // Stops: each has an energy that depends on the bar's direction in a car. Its gradient turns the car, and pushes the
    // pins apart sideways.
    Vector3d shear = Vector3d::Zero();
    Stops& found = stops[i];
    double moments = 0.0;
    for (const int end : {0, 1}) {
      const SpatialMotion& car = end == 0 ? lead : trail;
      const double yaw = stop_moment(b.yaw[end], law.swing_limit, law.swing_stiffness, law.swing_moment_max);
      const double pitch = stop_moment(b.pitch[end], law.pitch_limit, law.pitch_stiffness, inputs::kInfinity);
      found.swing = std::max(found.swing, std::abs(b.yaw[end]));
      moments += yaw;
      if (yaw == 0.0 && pitch == 0.0) continue;
      const Vector3d own = car.axes.transpose() * b.u;
      const double flat = std::max(std::hypot(own.x(), own.y()), 1.0e-3);
      const Vector3d gradient =
          car.axes * Vector3d(-yaw * own.y() / (flat * flat), yaw * own.x() / (flat * flat), pitch / flat);
      const Vector3d moment = b.u.cross(gradient);
      wrench[STORED][end == 0 ? i : i + 1].torque += moment;
      shear -= (gradient - gradient.dot(b.u) * b.u) / b.gap;
    }
    found.moment = std::abs(moments);
    found.vertical = std::abs(shear.z());
    found.height = std::abs((b.lead_pin - b.trail_pin).dot(lead.axes.col(2) + trail.axes.col(2)) * 0.5);
    const double twist = stop_moment(b.roll, law.roll_limit, law.roll_stiffness, inputs::kInfinity);
    found.twist = std::abs(twist);
    wrench[STORED][i].torque += twist * b.u;
    wrench[STORED][i + 1].torque -= twist * b.u;
    const Vector3d on_lead = spring * b.u + shear;
    wrench[STORED][i].add(on_lead, arm_lead);
    wrench[STORED][i + 1].add(-on_lead, arm_trail);
  }

  /// All forces but those between bodies, which depend on the length of the step.
  void find_forces(double t, const double* y) {
    load_motions(y);
    clear();
    brakes.prepare(t);
    for (std::size_t k = 0; k < n; ++k) {
      wrench[STORED][k].force.z() -= bodies[k].weight;
      for (const bool front : {true, false})
        truck_forces(truck_of(k, front), brakes.share()[static_cast<Eigen::Index>(k)]);
      body_on_ground(k);
    }
    for (std::size_t i = 0; i < alive.size(); ++i) couple(i);
    forces_found = true;
  }

  void find_pairs() {
    const auto begin_of = [this](int i) {
      const auto k = static_cast<std::size_t>(i);
      return now[k].centre.x() - bodies[k].radius;
    };
    for (std::size_t i = 1; i < by_x.size(); ++i) {
      const int k = by_x[i];
      std::size_t j = i;
      for (; j > 0 && begin_of(by_x[j - 1]) > begin_of(k); --j) by_x[j] = by_x[j - 1];
      by_x[j] = k;
    }
    old_pairs.swap(pairs);
    pairs.clear();
    for (std::size_t i = 0; i < by_x.size(); ++i) {
      const auto a = static_cast<std::size_t>(by_x[i]);
      for (std::size_t j = i + 1; j < by_x.size(); ++j) {
        const auto b = static_cast<std::size_t>(by_x[j]);
        const double reach = bodies[a].radius + bodies[b].radius + 2.0 * kMargin;
        if (begin_of(by_x[j]) > now[a].centre.x() + bodies[a].radius + 2.0 * kMargin) break;
        if ((now[a].centre - now[b].centre).squaredNorm() > reach * reach) continue;
        const auto [first, second] = std::minmax(by_x[i], by_x[j]);
        pairs.push_back({first, second});
      }
    }
    const auto less = [](const Pair& p, const Pair& r) { return p.a != r.a ? p.a < r.a : p.b < r.b; };
    std::sort(pairs.begin(), pairs.end(), less);
    auto old = old_pairs.begin();
    for (Pair& p : pairs) {
      while (old != old_pairs.end() && less(*old, p)) ++old;
      if (old != old_pairs.end() && old->a == p.a && old->b == p.b) p = *old;
    }
  }

  Box box(std::size_t k) const { return {now[k].point(bodies[k].box_centre), now[k].axes, bodies[k].box_half}; }

  void contacts(double t, double h) {
    if (scenario.contact.law == inputs::ContactLaw::none) return;
    if (moved > kMargin) {
      find_pairs();
      moved = 0.0;
    }
    double fastest = 0.0;
    for (std::size_t k = 0; k < n; ++k)
      fastest = std::max(fastest, now[k].velocity.norm() + bodies[k].radius * now[k].rotation.norm());
    // Half as much again for what speeds may grow within this step.
    moved += 1.5 * h * fastest;
    for (Pair& pair : pairs) {
      const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
      const BoxManifold m = press(box(a), box(b), pair.axis);
      pair.axis = m.count > 0 ? m.axis : -1;
      if (m.count == 0) {
        pair.crushed = 0.0;
        continue;
      }
      double force = 0.0;
      Vector3d first_velocity = Vector3d::Zero();
      const double share = 1.0 / m.count;
      const double reduced = bodies[a].mass * bodies[b].mass / (bodies[a].mass + bodies[b].mass);
      for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) {
        const Vector3d& p = m.point[i];
        const Vector3d v = now[a].velocity_at(p) - now[b].velocity_at(p);
        const double closing = -v.dot(m.normal);
        if (i == 0 || closing > -first_velocity.dot(m.normal)) first_velocity = v;
        const double push = share * contact_force(scenario.contact, m.depth[i], closing, pair.crushed);
        if (push <= 0.0) continue;
        force += push;
        double& overlap = record.incidents.overlap_max;
        overlap = std::max(overlap, m.depth[i] - pair.crushed);
        const Vector3d slip = v + closing * m.normal;
        // No finer than one step can follow.
        const double v_eps = std::max(scenario.ground.regularization_speed,
                                      scenario.contact.friction * push * h / (0.25 * reduced));
        const Vector3d rub = -scenario.contact.friction * push / std::sqrt(slip.squaredNorm() + v_eps * v_eps) * slip;
        const Vector3d normal = push * m.normal;
        wrench[IMPACT_NORMAL][a].add(normal, p - now[a].centre);
        wrench[IMPACT_NORMAL][b].add(-normal, p - now[b].centre);
        wrench[IMPACT_FRICTION][a].add(rub, p - now[a].centre);
        wrench[IMPACT_FRICTION][b].add(-rub, p - now[b].centre);
      }
      note(t, h, pair, m, first_velocity, force);
    }
  }

  static Face face_met(const SpatialMotion& car, const Vector3d& push) {
    const double along = car.axes.col(0).dot(push), across = car.axes.col(1).dot(push);
    if (std::abs(along) > std::abs(across)) return along < 0.0 ? Face::front : Face::rear;
    return across < 0.0 ? Face::left : Face::right;
  }

  void note(double t, double h, Pair& pair, const BoxManifold& m, const Vector3d& velocity, double force) {
    std::vector<Impact>& impacts = record.incidents.impacts;
    const SpatialMotion &a = now[static_cast<std::size_t>(pair.a)], &b = now[static_cast<std::size_t>(pair.b)];
    if (pair.impact < 0 || t - pair.seen > kSameImpact) {
      pair.impact = static_cast<int>(impacts.size());
      const Vector3d& p = m.point[0];
      impacts.push_back({t, t, pair.a, pair.b, face_met(a, m.normal), face_met(b, -m.normal),
                         (p - a.centre).dot(a.axes.col(0)), (p - b.centre).dot(b.axes.col(0)), p.x(), p.y(),
                         velocity.norm(), -velocity.dot(m.normal), 0.0, 0.0});
    }
    pair.seen = t;
    Impact& impact = impacts[static_cast<std::size_t>(pair.impact)];
    impact.end = t + h;
    impact.impulse += force * h;
    impact.peak_force = std::max(impact.peak_force, force);
  }

  double suspension_energy() const {
    double e = 0.0;
    for (std::size_t truck = 0; truck < 2 * n; ++truck) e += suspension_energy(truck);
    return e;
  }
  double suspension_energy(std::size_t truck) const {
    if (lost[truck]) return 0.0;
    double e = 0.0;
    for (const bool left : {false, true}) {
      Under under{};
      const double depth = std::max(pressed(truck, wheel(truck, left), under), 0.0);
      e += 0.5 * bodies[car_of(truck)].spring * depth * depth;
    }
    return e;
  }
  double ground_energy() const {
    double e = 0.0;
    for (std::size_t car = 0; car < n; ++car) {
      const Body& b = bodies[car];
      for (const double x : {-1.0, 0.0, 1.0}) {
        for (const double y : {-1.0, 1.0}) {
          for (const double z : {-1.0, 1.0}) {
            const Vector3d place = now[car].point(b.box_centre + Vector3d(x, y, z).cwiseProduct(b.box_half));
            const double depth = ground_under(place, arc[car]).z - place.z();
            if (depth > 0.0) e += 0.5 * scenario.terrain.body_stiffness * depth * depth;
          }
        }
      }
    }
    return e;
  }

  /// Work of the last step's forces, by account, with the mean of the velocities before and after.
  void account(double h, const double* before, const double* after) {
    std::array<double, kAccounts> taken{};
    for (std::size_t k = 0; k < n; ++k) {
      const auto car = static_cast<Eigen::Index>(k);
      const SpatialMotion was = model.motion(before, car), is = model.motion(after, car);
      const Vector3d v = 0.5 * (was.velocity + is.velocity);
      const Vector3d w = was.axes * (0.5 * (was.body_rates + is.body_rates));
      for (std::size_t a = 1; a < kAccounts; ++a)
        taken[a] -= h * (wrench[a][k].force.dot(v) + wrench[a][k].torque.dot(w));
    }
    EnergyLedger& spent = record.spent;
    spent.work_on_track += taken[ON_TRACK];
    spent.work_rails += taken[RAILS];
    spent.work_off_track += taken[OFF_TRACK];
    spent.work_truck_damping += taken[TRUCK_DAMPING];
    spent.work_coupler_damping += taken[COUPLER_DAMPING];
    spent.work_body_ground += taken[BODY_GROUND];
    spent.work_impact_normal += taken[IMPACT_NORMAL];
    spent.work_impact_friction += taken[IMPACT_FRICTION];
  }

  void locate() {
    for (std::size_t truck = 0; truck < 2 * n; ++truck) {
      const Vector3d p = now[car_of(truck)].point({arm_of(truck), 0.0, -bodies[car_of(truck)].centre_height});
      arc[truck] = track.straight() ? p.x() : track.foot({p.x(), p.y()}, arc[truck]);
    }
  }

  void leave(double t, std::size_t truck, Cause cause, double* y) {
    const double before = suspension_energy(truck);
    on_rails[truck] = false;
    overloaded[truck] = 0.0;
    // What the springs held up falls from the rails to the ground.
    record.spent.work_rails += before - suspension_energy(truck);
    const std::size_t car = car_of(truck);
    const Vector3d p = now[car].point({arm_of(truck), 0.0, -bodies[car].centre_height});
    record.incidents.derailments.push_back({t, static_cast<Eigen::Index>(car), truck < n, cause, p.x(), p.y()});
    track.tear(arc[truck]);
    if (cause == Cause::pod && kick[truck] != 0.0 && y != nullptr) push_sideways(truck, y);
  }

  /// An impulse at the truck, in the plane, across the car, that changes the truck's velocity by the kick.
  void push_sideways(std::size_t truck, double* y) {
    const std::size_t car = car_of(truck);
    const Body& b = bodies[car];
    const double arm = arm_of(truck);
    const double impulse = kick[truck] / (1.0 / b.mass + arm * arm / b.inertia.z());
    const auto k = static_cast<Eigen::Index>(car), count = static_cast<Eigen::Index>(n);
    const Vector3d across = now[car].axes.col(1);
    const auto kinetic = [&] {
      const SpatialMotion q = model.motion(y, k);
      return 0.5 * b.mass * q.velocity.squaredNorm() + 0.5 * q.body_rates.dot(b.inertia.cwiseProduct(q.body_rates));
    };
    const double before = kinetic();
    y[SVX * count + k] += impulse / b.mass * across.x();
    y[SVY * count + k] += impulse / b.mass * across.y();
    y[SVZ * count + k] += impulse / b.mass * across.z();
    y[YAW_RATE * count + k] += impulse * arm / b.inertia.z();
    record.spent.work_kicks -= kinetic() - before;
  }

  void pass(double t, double h, double* y, const std::vector<double>& arc_before) {
    const auto ahead = static_cast<std::size_t>(scenario.initial.cars_ahead);
    for (std::size_t k = ahead; k < n; ++k) past[k] = past[k] || now[k].centre.x() >= 0.0;
    for (std::size_t truck = 0; truck < 2 * n; ++truck) {
      if (!on_rails[truck]) continue;
      const double from = arc_before[truck], s = arc[truck];
      if (car_of(truck) >= ahead && from < 0.0 && s >= 0.0) leave(t + h - h * s / (s - from), truck, Cause::pod, y);
      else if (track.torn(s)) leave(t + h, truck, Cause::torn_track, y);
    }
  }

  bool give_way(double t, double h) {
    bool any = false;
    for (std::size_t truck = 0; truck < 2 * n; ++truck) {
      const double carried = load[2 * truck] + load[2 * truck + 1];
      if (on_rails[truck]) {
        overloaded[truck] = overloaded_time<double>(scenario.rails, lateral_before[truck], lateral[truck], carried, h,
                                                    overloaded[truck]);
        if (overloaded[truck] > scenario.rails.derail_time) {
          leave(t, truck, Cause::lateral, nullptr);
          any = true;
        }
      } else if (!lost[truck] && carried == 0.0) {
        const double up = now[car_of(truck)].axes(2, 2);
        if (safe_acos(up) > scenario.suspension.part_angle) {
          record.spent.work_truck_damping += suspension_energy(truck);
          lost[truck] = true;
          any = true;
        }
      }
    }
    const inputs::Coupler& law = scenario.coupler;
    for (std::size_t i = 0; i < alive.size(); ++i) {
      if (!alive[i]) continue;
      const double force = axial[static_cast<Eigen::Index>(i)];
      const Stops& s = stops[i];
      BrokenCoupler::By by = BrokenCoupler::By::draft;
      if (-force > law.break_draft) by = BrokenCoupler::By::draft;
      else if (s.swing > law.break_swing) by = BrokenCoupler::By::swing;
      else if (s.moment > law.break_moment) by = BrokenCoupler::By::moment;
      else if (s.height > law.slip_height) by = BrokenCoupler::By::slip;
      else if (s.vertical > law.vertical_hold) by = BrokenCoupler::By::vertical;
      else if (s.twist > law.break_twist) by = BrokenCoupler::By::twist;
      else continue;
      const Bar b = bar(now[i], now[i + 1], i);
      record.spent.work_coupler_break += stored_in(b) + axial_stored_in(b);
      alive[i] = false;
      const double at_limit = std::max(force, -law.break_draft);
      record.incidents.broken.push_back({t, static_cast<Eigen::Index>(i), by, at_limit});
      brakes.vent(t, static_cast<Eigen::Index>(i));
      note_peak(t, i, at_limit);
      any = true;
    }
    return any;
  }

  void note_peak(double t, std::size_t i, double force) {
    Incidents& in = record.incidents;
    if (force > in.buff.force) in.buff = {force, static_cast<Eigen::Index>(i), t};
    if (-force > in.draft.force) in.draft = {-force, static_cast<Eigen::Index>(i), t};
  }

  void note_blockage(double h) {
    const auto ahead = static_cast<std::size_t>(scenario.initial.cars_ahead);
    std::size_t standing = n;
    while (standing > ahead && !off(standing - 1)) --standing;
    if (standing == n || standing == 0 || !off(standing - 1) || !alive[standing - 1]) return;
    const double force = std::max(axial[static_cast<Eigen::Index>(standing - 1)], 0.0);
    record.incidents.blockage_impulse += h * force;
    record.incidents.blockage_time += h;
    record.incidents.blockage_peak = std::max(record.incidents.blockage_peak, force);
  }

  bool off(std::size_t car) const { return !on_rails[car] || !on_rails[n + car]; }

  void order_derailments() {
    std::vector<Derailment>& all = record.incidents.derailments;
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(ordered);
    std::stable_sort(begin, all.end(), [](const Derailment& a, const Derailment& b) { return a.time < b.time; });
    for (auto d = begin; d != all.end(); ++d) {
      Cause& cause = first_cause[static_cast<std::size_t>(d->car)];
      if (cause == Cause::none) cause = d->cause;
    }
    ordered = all.size();
  }
};

SpatialModel::SpatialModel(const inputs::Scenario& scenario)
    : TrainModel(scenario), parts_(std::make_unique<Parts>(*this, scenario)) {}

SpatialModel::~SpatialModel() = default;

SpatialMotion SpatialModel::motion(const double* y, Eigen::Index car) const {
  const Eigen::Index n = car_count();
  const auto at = [&](Column c) { return y[c * n + car]; };
  SpatialMotion m;
  m.centre = {at(SX), at(SY), at(SZ)};
  // Between two steps a state is interpolated.
  m.axes = Eigen::Quaterniond(at(QW), at(QX), at(QY), at(QZ)).normalized().toRotationMatrix();
  m.velocity = {at(SVX), at(SVY), at(SVZ)};
  m.body_rates = {at(ROLL_RATE), at(PITCH_RATE), at(YAW_RATE)};
  m.rotation = m.axes * m.body_rates;
  return m;
}

StateVector SpatialModel::initial_state() const {
  const Eigen::Index n = car_count();
  // As in the plane, at the height of rest.
  const ExtendedModel plane(parts_->scenario);
  const StateVector flat = plane.initial_state();
  StateVector y = StateVector::Zero(size());
  for (Eigen::Index k = 0; k < n; ++k) {
    const CarMotion car = plane.car_motion(flat.data(), k);
    const double theta = std::atan2(car.axis.y(), car.axis.x());
    y[SX * n + k] = car.centre.x();
    y[SY * n + k] = car.centre.y();
    y[SZ * n + k] = at(k).centre_height;
    y[SVX * n + k] = car.velocity.x();
    y[SVY * n + k] = car.velocity.y();
    y[YAW_RATE * n + k] = car.omega;
    y[QZ * n + k] = std::sin(0.5 * theta);
    y[QW * n + k] = std::cos(0.5 * theta);
  }
  return y;
}

void SpatialModel::start(const double* y) {
  Parts& p = *parts_;
  p.load_motions(y);
  for (std::size_t truck = 0; truck < 2 * p.n; ++truck) {
    const std::size_t car = p.car_of(truck);
    const Vector3d place = p.now[car].point({p.arm_of(truck), 0.0, -p.bodies[car].centre_height});
    p.arc[truck] = p.track.nearest({place.x(), place.y()});
  }
  const auto ahead = static_cast<std::size_t>(p.scenario.initial.cars_ahead);
  for (std::size_t k = ahead; k < p.n; ++k) p.past[k] = p.now[k].centre.x() >= 0.0;
  for (std::size_t truck = 0; truck < 2 * p.n; ++truck) {
    if (p.car_of(truck) >= ahead && p.arc[truck] >= 0.0) p.leave(0.0, truck, Cause::pod, nullptr);
  }
  p.order_derailments();
  p.find_forces(0.0, y);
  for (std::size_t i = 0; i < p.alive.size(); ++i) p.note_peak(0.0, i, p.axial[static_cast<Eigen::Index>(i)]);
}

void SpatialModel::accelerations(double t, double h, const double* y, double* result) {
  Parts& p = *parts_;
  if (!p.forces_found) p.find_forces(t, y);
  p.forces_found = false;
  p.contacts(t, h);
  const Eigen::Index n = car_count();
  for (std::size_t k = 0; k < p.n; ++k) {
    Wrench sum;
    for (const auto& account : p.wrench) {
      sum.force += account[k].force;
      sum.torque += account[k].torque;
    }
    const Body& b = p.bodies[k];
    const SpatialMotion& q = p.now[k];
    const Vector3d a = sum.force / b.mass;
    const Vector3d rates = turned_rates(b.inertia, q.body_rates, h * (q.axes.transpose() * sum.torque), h);
    const Vector3d turning = (rates - q.body_rates) / h;
    for (Eigen::Index c = 0; c < 3; ++c) {
      result[c * n + static_cast<Eigen::Index>(k)] = a[c];
      result[(c + 3) * n + static_cast<Eigen::Index>(k)] = turning[c];
    }
  }
}

void SpatialModel::settle(double t, double h, const double* before, double* y) {
  Parts& p = *parts_;
  const Eigen::Index n = car_count();
  for (Eigen::Index k = 0; k < n; ++k) {
    const auto at = [&](Column c) -> double& { return y[c * n + k]; };
    const Eigen::Quaterniond turned = (Eigen::Quaterniond(at(QW), at(QX), at(QY), at(QZ)) *
                                       rotation_by({at(TURN_X), at(TURN_Y), at(TURN_Z)}))
                                          .normalized();
    at(QX) = turned.x();
    at(QY) = turned.y();
    at(QZ) = turned.z();
    at(QW) = turned.w();
    at(TURN_X) = at(TURN_Y) = at(TURN_Z) = 0.0;
  }
  p.account(h, before, y);
  p.note_blockage(h);
  p.load_motions(y);
  const std::vector<double> arc_before = p.arc;
  p.locate();
  p.pass(t, h, y, arc_before);
  p.lateral_before = p.lateral;
  p.find_forces(t + h, y);
  if (p.give_way(t + h, h)) p.find_forces(t + h, y);
  for (std::size_t i = 0; i < p.alive.size(); ++i) p.note_peak(t + h, i, p.axial[static_cast<Eigen::Index>(i)]);
  p.order_derailments();
}

Observation SpatialModel::observe(const double* y) const {
  const Parts& p = *parts_;
  Observation seen;
  seen.cars.resize(p.n);
  std::vector<SpatialMotion> cars(p.n);
  for (std::size_t k = 0; k < p.n; ++k) {
    const auto car = static_cast<Eigen::Index>(k);
    cars[k] = motion(y, car);
    const SpatialMotion& q = cars[k];
    CarObservation& o = seen.cars[k];
    const Eigen::Quaterniond turn(q.axes);
    o.x = q.centre.x();
    o.y = q.centre.y();
    o.z = q.centre.z() - p.bodies[k].centre_height;
    o.qx = turn.x();
    o.qy = turn.y();
    o.qz = turn.z();
    o.qw = turn.w();
    o.theta = std::atan2(q.axes(1, 0), q.axes(0, 0));
    o.vx = q.velocity.x();
    o.vy = q.velocity.y();
    o.vz = q.velocity.z();
    o.wx = q.rotation.x();
    o.wy = q.rotation.y();
    o.omega = q.rotation.z();
    for (const bool front : {true, false}) {
      const std::size_t truck = p.truck_of(k, front);
      const Vector3d place = q.point({p.arm_of(truck), 0.0, -p.bodies[k].centre_height});
      const TrackPlace by_track = track_place(car, {place.x(), place.y()});
      (front ? o.front_truck : o.rear_truck) = {by_track.s, by_track.offset, place.z(),
                                                p.load[2 * truck] + p.load[2 * truck + 1]};
    }
    o.past_pod = past_pod(car);
    o.derailed = derailed(car);
    o.cause = cause(car);
  }
  seen.couplers.resize(p.alive.size());
  for (std::size_t i = 0; i < p.alive.size(); ++i) {
    const Parts::Bar b = p.bar(cars[i], cars[i + 1], i);
    CouplerObservation& o = seen.couplers[i];
    o.gap = b.gap;
    o.angle = std::atan2(b.u.y(), b.u.x());
    o.swing_lead = b.yaw[0];
    o.swing_trail = b.yaw[1];
    o.pitch_lead = b.pitch[0];
    o.pitch_trail = b.pitch[1];
    o.broken = !p.alive[i];
    if (o.broken) continue;
    const inputs::Coupler& law = p.scenario.coupler;
    const double spring = coupler_spring_force<double>(law, b.gap);
    const double rate = (cars[i].velocity_at(b.lead_pin) - cars[i + 1].velocity_at(b.trail_pin)).dot(b.u);
    o.axial_force = spring + coupler_damper_force<double>(p.damping[i], spring, rate);
    const auto moment = [&](int end) {
      return stop_moment(b.yaw[end], law.swing_limit, law.swing_stiffness, law.swing_moment_max);
    };
    o.moment_lead = moment(0);
    o.moment_trail = moment(1);
    o.lateral_force = (o.moment_lead + o.moment_trail) / b.gap;
    const double up = stop_moment(b.pitch[0], law.pitch_limit, law.pitch_stiffness, inputs::kInfinity) +
                      stop_moment(b.pitch[1], law.pitch_limit, law.pitch_stiffness, inputs::kInfinity);
    o.vertical_force = -up / b.gap;
  }
  return seen;
}

PlanColumns SpatialModel::plan(const double* y) const {
  const Eigen::Index n = car_count();
  yaw_rate_.resize(n);
  for (Eigen::Index k = 0; k < n; ++k) yaw_rate_[k] = motion(y, k).rotation.z();
  return {y + SX * n, y + SY * n, y + SVX * n, y + SVY * n, yaw_rate_.data()};
}

CarMotion SpatialModel::car_motion(const double* y, Eigen::Index car) const {
  const SpatialMotion q = motion(y, car);
  const Vector2 flat(q.axes(0, 0), q.axes(1, 0));
  const double length = flat.norm();
  return {{q.centre.x(), q.centre.y()},
          length > 0.0 ? Vector2(flat / length) : Vector2::UnitX(),
          {q.velocity.x(), q.velocity.y()},
          q.rotation.z()};
}

void SpatialModel::find_headings(const double* y, double* cosine, double* sine) const {
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    const CarMotion q = car_motion(y, k);
    cosine[k] = q.axis.x();
    sine[k] = q.axis.y();
  }
}

void SpatialModel::find_gaps(const double* y, double* gap, double* rate) const {
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    const SpatialMotion lead = motion(y, i), trail = motion(y, i + 1);
    const Parts::Bar b = parts_->bar(lead, trail, static_cast<std::size_t>(i));
    gap[i] = b.gap;
    rate[i] = (lead.velocity_at(b.lead_pin) - trail.velocity_at(b.trail_pin)).dot(b.u);
  }
}

bool SpatialModel::derailed(Eigen::Index car) const { return parts_->off(static_cast<std::size_t>(car)); }
bool SpatialModel::past_pod(Eigen::Index car) const { return parts_->past[static_cast<std::size_t>(car)] != 0; }
Cause SpatialModel::cause(Eigen::Index car) const { return parts_->first_cause[static_cast<std::size_t>(car)]; }
bool SpatialModel::straight_track() const { return parts_->track.straight(); }
const Incidents* SpatialModel::incidents() const { return &parts_->record.incidents; }
const ArrayX* SpatialModel::axial_forces() const { return &parts_->axial; }

TrackPlace SpatialModel::track_place(Eigen::Index car, const Vector2& point) const {
  if (straight_track()) return TrainModel::track_place(car, point);
  const double s = parts_->track.foot(point, parts_->arc[static_cast<std::size_t>(car)]);
  const Track::Node n = parts_->track.at(s);
  return {s, (point - n.point).dot(Vector2(-n.tangent.y(), n.tangent.x())), n.tangent};
}

Eigen::Vector4d SpatialModel::wheel_loads(Eigen::Index car) const {
  const Parts& p = *parts_;
  const auto k = static_cast<std::size_t>(car);
  return {p.load[2 * k], p.load[2 * k + 1], p.load[2 * (p.n + k)], p.load[2 * (p.n + k) + 1]};
}

bool SpatialModel::truck_lost(Eigen::Index car, bool front) const {
  return parts_->lost[parts_->truck_of(static_cast<std::size_t>(car), front)] != 0;
}

EnergyLedger SpatialModel::energy(const double* y) const {
  Parts& p = *parts_;
  EnergyLedger e = p.record.spent;
  const std::vector<SpatialMotion> kept = p.now;
  p.load_motions(y);
  for (std::size_t k = 0; k < p.n; ++k) {
    const SpatialMotion& q = p.now[k];
    const Body& b = p.bodies[k];
    e.kinetic_translation += 0.5 * b.mass * q.velocity.squaredNorm();
    e.kinetic_rotation += 0.5 * q.body_rates.dot(b.inertia.cwiseProduct(q.body_rates));
    e.height += b.weight * (q.centre.z() - b.centre_height);
  }
  e.suspension = p.suspension_energy() + p.ground_energy();
  for (std::size_t i = 0; i < p.alive.size(); ++i) {
    if (!p.alive[i]) continue;
    const Parts::Bar b = p.bar(p.now[i], p.now[i + 1], i);
    e.coupler_axial += p.axial_stored_in(b);
    e.coupler_swing += p.stored_in(b);
  }
  p.now = kept;
  return e;
}

SpatialMomentum SpatialModel::momentum(const double* y) const {
  SpatialMomentum sum;
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    const SpatialMotion q = motion(y, k);
    const Body& b = parts_->bodies[static_cast<std::size_t>(k)];
    sum.linear += b.mass * q.velocity;
    sum.angular += b.mass * q.centre.cross(q.velocity) + q.axes * b.inertia.cwiseProduct(q.body_rates);
  }
  return sum;
}

void SpatialModel::walk(double t, const double* y, files::Archive& archive) {
  Parts& p = *parts_;
  const auto numbers = [&](const char* name, std::vector<double>& values) {
    archive.list(name, values, [&](double& v) { archive.value("v", v); });
  };
  const auto flags = [&](const char* name, std::vector<char>& values) {
    archive.list(name, values, [&](char& v) {
      int number = v;
      archive.value("v", number);
      v = static_cast<char>(number);
    });
  };
  archive.group("record", [&] { p.record.walk(archive); });
  archive.group("brakes", [&] { p.brakes.walk(archive); });
  flags("on_rails", p.on_rails);
  flags("lost", p.lost);
  flags("past", p.past);
  flags("alive", p.alive);
  archive.list("first_cause", p.first_cause, [&](Cause& c) { archive.value("cause", c); });
  numbers("arc", p.arc);
  numbers("overloaded", p.overloaded);
  archive.value("ordered", p.ordered);
  archive.group("track", [&] { p.track.walk(archive); });
  archive.value("moved", p.moved);
  archive.list("by_x", p.by_x, [&](int& car) { archive.value("car", car); });
  archive.list("pairs", p.pairs, [&](Pair& pair) {
    archive.value("a", pair.a);
    archive.value("b", pair.b);
    archive.value("axis", pair.axis);
    archive.value("crushed", pair.crushed);
    archive.value("impact", pair.impact);
    archive.value("seen", pair.seen);
  });
  if (archive.restoring()) p.find_forces(t, y);
}

}  // namespace train_derail::model
