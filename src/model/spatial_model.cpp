#include "train_derail/model/spatial_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "model/air_brakes.hpp"
#include "model/box_contact.hpp"
#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "model/rest.hpp"
#include "model/spatial_kernels.hpp"
#include "simd/instruction_sets.hpp"
#include "train_derail/inputs/extent.hpp"
#include "train_derail/model/contact_law.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/extended_model.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/model/track_profile.hpp"

namespace train_derail::model {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr Versions<ExtendedKernels> kVersions TRAIN_DERAIL_VERSIONS(kExtended);
constexpr Versions<SpatialKernels> kSpatialVersions TRAIN_DERAIL_VERSIONS(kSpatial);

/// Where what a force takes is put in the ledger. What is stored comes from the state.
enum Account { OFF_TRACK, TRUCK_DAMPING, BODY_GROUND, IMPACT_NORMAL, IMPACT_FRICTION, kAccounts };
constexpr std::array<double EnergyLedger::*, kAccounts> kTaken{
    &EnergyLedger::work_off_track, &EnergyLedger::work_truck_damping, &EnergyLedger::work_body_ground,
    &EnergyLedger::work_impact_normal, &EnergyLedger::work_impact_friction};

struct Wrench {
  Vector3d force, torque;  // N; about the centre of mass, world frame [N m]
};

/// What acts on a car in a step and is not of the rails or a coupler, by account.
struct Accounts {
  unsigned used;  // those that are not empty
  std::array<Wrench, kAccounts> of;

  void add(Account a, const Vector3d& force, const Vector3d& torque) {
    Wrench& w = of[a];
    if ((used & 1U << a) != 0) {
      w.force += force;
      w.torque += torque;
    } else {
      w = {force, torque};
      used |= 1U << a;
    }
  }
};

/// A car that does not change.
struct Body {
  double mass, weight;
  Vector3d inertia;  // about roll, pitch, yaw axes
  double half_length, half_spacing;
  Vector3d box_centre, box_half;  // of the body, from the centre of mass
  double centre_height;
  double spring, spring_damping, sag;  // of a side of a truck; how far it is pressed at rest
  double ground_damping;
};

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
/// Points of a car that may lie on the ground: four sides of trucks, then edges of the body.
constexpr std::size_t kWheels = 4, kCorners = 12, kPoints = kWheels + kCorners;

struct Pair {
  int a, b;
  int axis = -1;
  double crushed = 0.0;
  Vector3d sheared = Vector3d::Zero();  // how far friction has been strained
  double apart = 0.0;                   // at least [m]
  int impact = -1;
  double seen = 0.0;
  Held held = {};  // where one of the two lies still
  std::int64_t round = 0;

  /// One of the two comes to rest. From cars that are apart any force is new to it.
  void hold() {
    held = {};
    held.known = axis < 0;
  }
};

}  // namespace

struct SpatialModel::Parts {
  Parts(SpatialModel& owner, const inputs::Scenario& s, const std::string& instruction_set)
      : scenario(s),
        n(static_cast<std::size_t>(owner.car_count())),
        step(s.solver.fixed_step.value_or(0.0)),
        level(model::level(s.terrain) && s.track.grades.empty()),
        highest_ground(model::highest_ground(s.terrain)),
        cos_part(s.suspension.part_angle < M_PI ? std::cos(s.suspension.part_angle) : -2.0),
        track(s, inputs::track_extent(s).from, inputs::track_extent(s).to),
        profile(s),
        loops(*kVersions.choose(owner.car_count(), instruction_set)),
        wide(*kSpatialVersions.choose(owner.car_count(), instruction_set)),
        brakes(s, owner.cars(), loops),
        rest(n) {
    for (const Car& c : owner.cars()) {
      Body b;
      b.mass = c.mass;
      b.weight = c.weight;
      b.inertia = {c.roll_inertia, c.yaw_inertia, c.yaw_inertia};
      b.half_length = 0.5 * c.length;
      b.half_spacing = 0.5 * c.truck_spacing;
      b.centre_height = c.centre_height;
      b.box_centre = {0.0, 0.0, 0.5 * (c.floor_height + c.roof_height) - c.centre_height};
      b.box_half = {b.half_length, 0.5 * c.width, 0.5 * (c.roof_height - c.floor_height)};
      b.spring = s.suspension.stiffness;
      b.spring_damping = side_damping(s.suspension, c.mass);
      b.sag = 0.25 * c.weight / b.spring;
      b.ground_damping = ground_damping(s.terrain, c.mass);
      radius.push_back(b.box_half.norm() + b.box_centre.norm());
      bodies.push_back(b);
      rail_dampings.push_back(rail_damping(s.rails, c.mass));
    }
    const std::size_t trucks = 2 * n;
    lost.assign(trucks, false);
    past.assign(n, false);
    first_cause.assign(n, Cause::none);
    for (auto* a : {&arc, &offset, &overloaded, &lateral, &lateral_before, &kick, &braked, &braked_next, &load,
                    &leaning, &brake, &damper, &rocker, &place_x, &place_y, &load_held, &leaning_held})
      a->assign(trucks, 0.0);
    on_rails.assign(trucks, 1.0);
    tangent_x.assign(trucks, 1.0);
    tangent_y.assign(trucks, 0.0);
    if (!profile.flat())
      for (auto* a : {&rail_height, &rail_slope, &rail_tilt, &rail_twist}) a->assign(trucks, 0.0);
    for (auto* a : {&axes, &axes_before}) a->assign(9 * n, 0.0);
    for (auto* a : {&rotation, &spin, &force, &torque, &mean_rotation}) a->assign(3 * n, 0.0);
    for (auto* a : {&bars, &about_lead, &about_trail}) a->assign(3 * (n + 1), 0.0);
    for (auto* a : {&pin_axial, &pin_damper}) a->assign(n + 1, 0.0);
    accounts.resize(n);
    swirl.assign(n, 0.0);
    above.assign(n, 0.0);
    cars.resize(n);
    seen_at.assign(n, 0);
    lies.assign(n, false);
    sheared.assign(kPoints * n, Vector3d::Zero());
    feet.assign(kPoints * n, 0.0);
    sheared_next = sheared;
    alive.assign(n > 0 ? n - 1 : 0, 1.0);
    far.assign(alive.size(), 0.0);
    rise.assign(alive.size(), 0.0);
    axial = ArrayX::Zero(owner.coupler_count());
    damping.resize(alive.size());
    for (std::size_t i = 0; i < alive.size(); ++i)
      damping[i] = coupler_damping(s.coupler, bodies[i].mass, bodies[i + 1].mass);
    stops.resize(alive.size());
    held.resize(alive.size());
    boost::random::mt19937_64 generator(static_cast<std::uint64_t>(s.initial.perturbation.seed) ^ 0x61c5e1ULL);
    boost::random::normal_distribution<double> normal;
    for (std::size_t k = 0; k < n; ++k) {
      for (const std::size_t truck : {k, n + k}) kick[truck] = s.initial.perturbation.kick * normal(generator);
    }
    for (std::size_t k = 0; k < n; ++k) by_x.push_back(static_cast<int>(k));
    for (const Body& b : bodies) {
      const double values[] = {b.half_length, b.half_spacing, b.centre_height,  b.weight,
                               1.0 / b.mass,  b.sag,          b.spring_damping, b.ground_damping};
      for (std::size_t c = 0; c < constants.size(); ++c) constants[c].push_back(values[c]);
    }
    for (Eigen::Index c = 0; c < 3; ++c) {
      for (const Body& b : bodies) inertia.push_back(b.inertia[c]);
    }
    find_arrays();
  }

  /// What the loops see.
  void find_arrays() {
    SpatialArrays& a = arrays;
    a.cars = static_cast<std::ptrdiff_t>(n);
    a.coupler = &scenario.coupler;
    a.rails = &scenario.rails;
    a.spring = scenario.suspension.stiffness;
    a.half_base = scenario.suspension.half_base;
    a.brake_stiffness = scenario.terrain.body_stiffness;
    a.step = step;
    a.grade = scenario.track.grade / std::sqrt(1.0 + scenario.track.grade * scenario.track.grade);
    a.straight = track.straight();
    a.flat = profile.flat();
    const inputs::Coupler& law = scenario.coupler;
    const double swing = std::min(law.swing_limit, law.break_swing);
    a.tan_swing = swing < 0.5 * M_PI ? std::tan(swing) : inputs::kInfinity;
    a.sin_pitch = law.pitch_limit < 0.5 * M_PI ? std::sin(law.pitch_limit) : 1.0;
    a.cos_roll = law.roll_limit < M_PI ? std::cos(law.roll_limit) : -1.0;
    const double** columns[] = {&a.half_length,  &a.half_spacing, &a.centre_height,  &a.weight,
                                &a.inverse_mass, &a.sag,          &a.spring_damping, &a.brake_damping};
    for (std::size_t c = 0; c < constants.size(); ++c) *columns[c] = constants[c].data();
    a.rail_damping = rail_dampings.data();
    a.inertia = inertia.data();
    a.brake_share = brakes.share().data();
    a.rotation = rotation.data();
    a.spin = spin.data();
    a.force = force.data();
    a.torque = torque.data();
    a.on_rails = on_rails.data();
    a.offset = offset.data();
    a.tangent_x = tangent_x.data();
    a.tangent_y = tangent_y.data();
    a.rail_height = rail_height.data();
    a.rail_slope = rail_slope.data();
    a.rail_tilt = rail_tilt.data();
    a.rail_twist = rail_twist.data();
    a.load = load.data();
    a.leaning = leaning.data();
    a.brake = brake.data();
    a.damper = damper.data();
    a.rocker = rocker.data();
    a.alive = alive.data();
    a.damping = damping.data();
    a.axial = axial.data();
    a.pin_axial = pin_axial.data();
    a.pin_damper = pin_damper.data();
    a.bar = bars.data();
    a.about_lead = about_lead.data();
    a.about_trail = about_trail.data();
    a.far = far.data();
    a.rise = rise.data();
    a.mean_rotation = mean_rotation.data();
    find_swapped();
  }
  /// Of columns that change places from step to step.
  void find_swapped() {
    arrays.axes = axes.data();
    arrays.axes_before = axes_before.data();
    arrays.braked = braked.data();
    arrays.braked_next = braked_next.data();
    arrays.lateral = lateral.data();
  }

  const inputs::Scenario scenario;
  const std::size_t n;
  const double step;
  const bool level;
  const double highest_ground, cos_part;  // highest_ground: where the track is level
  Track track;
  const TrackProfile profile;
  const ExtendedKernels& loops;
  const SpatialKernels& wide;
  AirBrakes brakes;
  Record record;
  Rest rest;
  std::vector<std::size_t> still;  // cars that lie down at the end of this step
  std::int64_t round = 0;          // of forces; each force on a car is found once in it
  std::vector<Body> bodies;
  std::array<std::vector<double>, 8> constants;  // the same by columns
  std::vector<double> rail_dampings, radius;     // radius: of a sphere about the centre of mass, around the body
  SpatialArrays arrays;
  std::vector<double> inertia, axes, axes_before, rotation, spin, force, torque, mean_rotation;

  // Trucks: the front trucks of all cars, then the rear ones; SpatialArrays has the forces.
  std::vector<bool> lost, past;
  std::vector<std::size_t> loose;  // trucks that are off the rails, in order
  std::vector<Cause> first_cause;
  std::vector<double> on_rails, arc, offset, tangent_x, tangent_y, place_x, place_y, overloaded, lateral,
      lateral_before, kick;
  std::vector<double> rail_height, rail_slope, rail_tilt, rail_twist;  // empty where all rails are flat
  std::vector<double> load_held, leaning_held;                         // of trucks off the rails, of cars that lie
  std::vector<double> load, leaning, brake, damper, rocker, braked, braked_next;
  std::size_t ordered = 0, standing = 0;  // derailments in order; the first of the last cars that stand on the rails

  // How far friction with the ground has strained it, kPoints a car [m]; the next values belong to the forces found.
  std::vector<Vector3d> sheared, sheared_next;
  std::vector<double> feet;   // arc lengths at which these points were last [m]
  std::vector<bool> lies;     // anything of the car is on the ground
  std::vector<double> above;  // so high at least a body is above it, as far as is known [m]

  // Couplers.
  ArrayX axial;
  std::vector<double> alive, damping, far, rise, bars, about_lead, about_trail, pin_axial, pin_damper;
  struct Stops {
    bool engaged = false;
    double swing = 0.0, moment = 0.0, vertical = 0.0, twist = 0.0;
    double effort = 0.0;  // of all stops, as a force [N]
    std::int64_t round = 0;
  };
  std::vector<Stops> stops;  // what may break or slip, as found last
  std::vector<Held> held;    // where one of the two cars lies still: axial force, effort of the stops

  std::vector<Accounts> accounts;  // of what acts on the cars in the step beside the wide loops
  const double* state = nullptr;   // known last; its cars are taken out when they are looked at
  mutable std::vector<SpatialMotion> cars;
  mutable std::vector<std::int64_t> seen_at;
  std::int64_t moment = 0;
  double now = 0.0;  // at which forces were found last [s]
  bool forces_found = false;

  // Bodies that touch.
  std::vector<int> by_x;
  std::vector<Pair> pairs, old_pairs;
  double moved = inputs::kInfinity;
  double fastest = 0.0, spinning = 0.0;  // largest speed of a centre, largest swirl [m/s]
  std::vector<double> swirl;             // speed of the farthest point of a body about its centre [m/s]

  std::size_t truck_of(std::size_t car, bool front) const { return front ? car : n + car; }
  std::size_t car_of(std::size_t truck) const { return truck < n ? truck : truck - n; }
  double arm_of(std::size_t truck) const {
    const Body& b = bodies[car_of(truck)];
    return truck < n ? b.half_spacing : -b.half_spacing;
  }
  /// From the centre of mass to the middle of a truck at the top of the rails, along the car's axes.
  Vector3d truck_place(std::size_t truck) const { return {arm_of(truck), 0.0, -bodies[car_of(truck)].centre_height}; }

  /// The state from now on.
  void look(const double* y) {
    state = y;
    ++moment;
  }
  const SpatialMotion& at(std::size_t car) const {
    SpatialMotion& m = cars[car];
    if (seen_at[car] == moment) return m;
    seen_at[car] = moment;
    const auto three = [&](const double* first) { return Vector3d(first[car], first[n + car], first[2 * n + car]); };
    m.centre = three(state + SX * n);
    m.velocity = three(state + SVX * n);
    m.body_rates = three(state + ROLL_RATE * n);
    for (Eigen::Index c = 0; c < 3; ++c) m.axes.col(c) = three(axes.data() + static_cast<std::size_t>(3 * c) * n);
    m.rotation = three(rotation.data());
    return m;
  }

  /// Ground under a point: height and the upward vector (not of length 1) along which it pushes.
  struct Under {
    double z;
    Vector3d up;
  };
  Under ground_under(const Vector3d& p, double s_near) const {
    if (level) return {-scenario.terrain.rail_height, Vector3d::UnitZ()};
    if (track.straight() && profile.flat()) {
      const GroundHeight g = ground_height(scenario.terrain, p.y());
      return {g.z, {0.0, -g.slope, 1.0}};
    }
    const double s = track.foot({p.x(), p.y()}, s_near);
    return ground_at(p, s, track.at(s));
  }
  Under ground_at(const Vector3d& p, double s, const Track::Node& node) const {
    const GroundHeight g = ground_height(scenario.terrain, offset_of(p, node));
    const TrackProfile::Place along = profile.at(s);
    return {along.bed + g.z,
            {g.slope * node.tangent.y() - along.grade * node.tangent.x(),
             -g.slope * node.tangent.x() - along.grade * node.tangent.y(), 1.0}};
  }
  /// The same for a point of a car, by whose truck the track is at arc length s: looked for from where it was before.
  Under ground_under(std::size_t point, const Vector3d& p, double s) {
    if (level || track.straight()) return ground_under(p, s);
    double& foot = feet[point];
    if (!(std::abs(foot - s) < 2.0 * radius[point / kPoints])) foot = s;
    const Vector2 place(p.x(), p.y());
    const Track::Node node = track.at(foot);
    const double ahead = (place - node.point).dot(node.tangent);
    // Looked for twice, a foot stays where it is: a run that is resumed finds the same.
    if (std::abs(ahead) < 1e-6) return ground_at(p, foot, node);
    foot = track.foot(place, foot + ahead);
    return ground_at(p, foot, track.at(foot));
  }
  static double offset_of(const Vector3d& p, const Track::Node& node) {
    return (p.y() - node.point.y()) * node.tangent.x() - (p.x() - node.point.x()) * node.tangent.y();
  }
  /// Height of the rails' plane at a point.
  double rails_under(const Vector3d& p, double s_near) const {
    if (profile.flat()) return 0.0;
    const double s = track.foot({p.x(), p.y()}, s_near);
    const TrackProfile::Place along = profile.at(s);
    return along.height + along.tilt * (offset_of(p, track.at(s)) - track.alignment(s));
  }
  /// No ground under a car is higher.
  double highest_ground_under(std::size_t car) const {
    if (profile.flat()) return highest_ground;
    // Of all its points the first truck is no farther away than that.
    return highest_ground + profile.at(arc[car]).bed + 4.0 * radius[car] * profile.steepest();
  }

  Vector3d wheel(const SpatialMotion& q, std::size_t truck, bool left) const {
    const double half_base = scenario.suspension.half_base;
    return q.point(truck_place(truck) + Vector3d(0.0, left ? half_base : -half_base, 0.0));
  }

  /// A car that stands in the plane, on rails that rise and tilt.
  SpatialMotion on_rails_at(std::size_t car, const CarMotion& flat) const {
    const Body& b = bodies[car];
    const auto rails_at = [&](double arm) { return profile.at(track.nearest(flat.centre + arm * flat.axis)); };
    const TrackProfile::Place front = rails_at(b.half_spacing), rear = rails_at(-b.half_spacing);
    SpatialMotion q;
    const Vector3d forward =
        Vector3d(flat.axis.x(), flat.axis.y(), 0.5 * (front.height - rear.height) / b.half_spacing).normalized();
    const Vector3d across(-flat.axis.y(), flat.axis.x(), 0.5 * (front.tilt + rear.tilt));
    q.axes.col(0) = forward;
    q.axes.col(1) = (across - across.dot(forward) * forward).normalized();
    q.axes.col(2) = forward.cross(q.axes.col(1));
    q.centre = Vector3d(flat.centre.x(), flat.centre.y(), 0.5 * (front.height + rear.height)) +
               b.centre_height * q.axes.col(2);
    const Vector3d velocity(flat.velocity.x(), flat.velocity.y(), 0.0);
    q.velocity = flat.velocity.dot(flat.axis) * forward +
                 (velocity - flat.velocity.dot(flat.axis) * Vector3d(flat.axis.x(), flat.axis.y(), 0.0));
    q.rotation = Vector3d(0.0, 0.0, flat.omega);
    q.body_rates = q.axes.transpose() * q.rotation;
    return q;
  }

  void add(std::size_t car, const Vector3d& f, const Vector3d& t) {
    for (std::size_t c = 0; c < 3; ++c) {
      force[c * n + car] += f[static_cast<Eigen::Index>(c)];
      torque[c * n + car] += t[static_cast<Eigen::Index>(c)];
    }
  }
  void push(std::size_t car, const Vector3d& f, const Vector3d& arm) { add(car, f, arm.cross(f)); }
  void push(std::size_t car, Account a, const Vector3d& f, const Vector3d& arm) {
    const Vector3d t = arm.cross(f);
    add(car, f, t);
    accounts[car].add(a, f, t);
  }

  void off_track(std::size_t truck, std::size_t car) {
    if (lost[truck]) return;
    const Body& b = bodies[car];
    const SpatialMotion& q = at(car);
    const inputs::Ground& ground = scenario.ground;
    const double patch = ground.patches.empty() ? 1.0 : patch_factor(ground.patches, arc[truck], offset[truck]);
    // Which way the truck slides, or would: a truck that stands has no other direction than that of the force.
    const auto mu = [&](const Vector3d& rub) {
      if (ground.off_track_law != inputs::OffTrackLaw::by_slip) return patch * ground.off_track_friction;
      return patch * slip_friction<double>(ground, rub.squaredNorm(), rub.dot(q.axes.col(1)), offset[truck]);
    };
    OnGround sum;
    for (const bool left : {false, true}) {
      const Vector3d place = wheel(q, truck, left);
      const std::size_t point = kPoints * car + (truck < n ? 0 : 2) + (left ? 1 : 0);
      const Under under = ground_under(point, place, arc[truck]);
      const double depth = b.sag - (place.z() - under.z);
      if (depth <= 0.0) {
        sheared_next[point].setZero();
        continue;
      }
      const double carried = press_on(sum, q, car, point, place, under.up, b.spring * depth, b.spring_damping, mu);
      load[truck] += carried;
      leaning[truck] += left ? carried : -carried;
    }
    lie(car, TRUCK_DAMPING, sum);
  }

  /// Forces of the ground on some points of a car.
  struct OnGround {
    Wrench all{Vector3d::Zero(), Vector3d::Zero()}, damping = all, friction = all;
    bool any = false;
  };
  void lie(std::size_t car, Account damping, const OnGround& sum) {
    if (!sum.any) return;
    add(car, sum.all.force, sum.all.torque);
    accounts[car].add(damping, sum.damping.force, sum.damping.torque);
    accounts[car].add(OFF_TRACK, sum.friction.force, sum.friction.torque);
    lies[car] = true;
  }

  /// Adds the forces on a point of a car on the ground, where `spring` is its springs' part along `up`, and `damping`
  /// [N s/m]; returns the normal force.
  template <class Friction>
  double press_on(OnGround& sum, const SpatialMotion& q, std::size_t car, std::size_t point, const Vector3d& place,
                  const Vector3d& up, double spring, double damping, const Friction& mu) {
    const Vector3d arm = place - q.centre, v = q.velocity + q.rotation.cross(arm), turning = arm.cross(up);
    const double up_square = level ? 1.0 : up.squaredNorm(), up_rate = v.dot(up);
    const double total = std::max(spring - damping * up_rate, 0.0), carried = total * std::sqrt(up_square);
    const Vector3d slip = v - up_rate / up_square * up;
    const Vector3d rub = hold(car, point, up, up_square, slip, carried, mu), rub_turning = arm.cross(rub);
    sum.any = true;
    sum.all.force += total * up + rub;
    sum.all.torque += total * turning + rub_turning;
    sum.damping.force += (total - spring) * up;
    sum.damping.torque += (total - spring) * turning;
    sum.friction.force += rub;
    sum.friction.torque += rub_turning;
    return carried;
  }

  /// Friction of a point on the ground, at most mu(force) times the load: the ground is strained until it gives way. A
  /// force that grew with the speed instead would let cars creep down a bank.
  template <class Friction>
  Vector3d hold(std::size_t car, std::size_t point, const Vector3d& up, double up_square, const Vector3d& slip,
                double carried, const Friction& mu) {
    const double stiffness = scenario.terrain.body_stiffness;
    Vector3d strain = sheared[point] - sheared[point].dot(up) / up_square * up + step * slip;
    Vector3d rub = -stiffness * strain - bodies[car].ground_damping * slip;
    const double square = rub.squaredNorm(), limit = mu(rub) * carried;
    if (square > limit * limit) {
      rub *= limit / std::sqrt(square);
      strain = rub * (-1.0 / stiffness);
    }
    sheared_next[point] = strain;
    return rub;
  }

  /// A point of the body's edges, from the centre of mass along the car's axes.
  static Vector3d corner_of(const Body& b, std::size_t i) {
    const Vector3d sign(static_cast<double>(i / 4) - 1.0, (i & 1U) != 0 ? 1.0 : -1.0, (i & 2U) != 0 ? 1.0 : -1.0);
    return b.box_centre + sign.cwiseProduct(b.box_half);
  }

  void body_on_ground(std::size_t car) {
    // Nothing of the body can reach the ground: the usual case.
    above[car] -= 1.05 * step * (std::abs(state[SVZ * n + car]) + profile.steepest() * fastest + swirl[car]);
    if (above[car] > 0.0) return;
    const Body& b = bodies[car];
    const Vector3d rise(axes[2 * n + car], axes[5 * n + car], axes[8 * n + car]);
    const double middle = state[SZ * n + car];
    const double lowest = middle + rise.dot(b.box_centre) - rise.cwiseAbs().dot(b.box_half);
    const double highest = highest_ground_under(car);
    above[car] = lowest - highest;
    if (lowest > highest) {
      if (lies[car])
        std::fill_n(sheared_next.begin() + static_cast<std::ptrdiff_t>(kPoints * car + kWheels), kCorners,
                    Vector3d::Zero());
      return;
    }
    const SpatialMotion& q = at(car);
    OnGround sum;
    for (std::size_t i = 0; i < kCorners; ++i) {
      const std::size_t point = kPoints * car + kWheels + i;
      const Vector3d own = corner_of(b, i);
      if (middle + rise.dot(own) < highest) {
        const Vector3d place = q.point(own);
        const Under under = ground_under(point, place, arc[car]);
        const double depth = under.z - place.z();
        if (depth > 0.0) {
          press_on(sum, q, car, point, place, under.up, scenario.terrain.body_stiffness * depth, b.ground_damping,
                   [&](const Vector3d&) { return scenario.terrain.body_friction; });
          continue;
        }
      }
      sheared_next[point].setZero();
    }
    lie(car, BODY_GROUND, sum);
  }

  /// A bar between two pins, as seen from both cars.
  struct Bar {
    Vector3d arm_lead, arm_trail, u;  // from the centres to the pins; from the trail car's pin to the lead car's
    Vector3d own[2];                  // u along the axes of the lead and the trail car
    double gap;

    double yaw(int end) const { return std::atan2(own[end].y(), own[end].x()); }
    double pitch(int end) const { return std::asin(std::clamp(own[end].z(), -1.0, 1.0)); }
  };
  Bar bar(const SpatialMotion& lead, const SpatialMotion& trail, std::size_t i) const {
    Bar b;
    const double height = scenario.coupler.height;
    b.arm_lead = lead.axes * Vector3d(-bodies[i].half_length, 0.0, height - bodies[i].centre_height);
    b.arm_trail = trail.axes * Vector3d(bodies[i + 1].half_length, 0.0, height - bodies[i + 1].centre_height);
    const Vector3d d = (lead.centre - trail.centre) + (b.arm_lead - b.arm_trail);
    b.gap = d.norm();
    b.u = d / b.gap;
    b.own[0] = lead.axes.transpose() * b.u;
    b.own[1] = trail.axes.transpose() * b.u;
    return b;
  }
  static double rate(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b) {
    return (lead.velocity + lead.rotation.cross(b.arm_lead) - trail.velocity - trail.rotation.cross(b.arm_trail))
        .dot(b.u);
  }
  /// Roll of the trail car against the lead car about the bar: between their left sides, seen along it.
  static double roll(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b) {
    const Vector3d left_a = lead.axes.col(1) - b.own[0].y() * b.u, left_b = trail.axes.col(1) - b.own[1].y() * b.u;
    return std::atan2(left_a.cross(left_b).dot(b.u), left_a.dot(left_b));
  }
  /// False if no stop can be engaged and no swing be near its limit: found without an arc tangent.
  bool turned_far(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b) const {
    for (const Vector3d& own : b.own) {
      if (!(own.x() > 0.0 && std::abs(own.y()) <= arrays.tan_swing * own.x() && std::abs(own.z()) <= arrays.sin_pitch))
        return true;
    }
    const double a = b.own[0].y(), c = b.own[1].y();
    const double dot = lead.axes.col(1).dot(trail.axes.col(1)) - a * c;
    const double cos_roll = arrays.cos_roll;
    if (cos_roll <= 0.0) return cos_roll > -1.0;
    return !(dot > 0.0 && dot * dot >= cos_roll * cos_roll * (1.0 - a * a) * (1.0 - c * c));
  }

  double stop_energy_of(const SpatialMotion& lead, const SpatialMotion& trail, const Bar& b) const {
    const inputs::Coupler& law = scenario.coupler;
    if (!turned_far(lead, trail, b)) return 0.0;
    double e = 0.0;
    for (const int end : {0, 1}) {
      e += stop_energy(b.yaw(end), law.swing_limit, law.swing_stiffness, law.swing_moment_max);
      e += stop_energy(b.pitch(end), law.pitch_limit, law.pitch_stiffness, inputs::kInfinity);
    }
    return e + stop_energy(roll(lead, trail, b), law.roll_limit, law.roll_stiffness, inputs::kInfinity);
  }
  double axial_energy_of(const Bar& b) const {
    const inputs::Coupler& law = scenario.coupler;
    if (law.draft_gear_travel == 0.0) return axial_energy(law, b.gap);
    return draft_gear_energy(law, std::max(std::abs(b.gap - law.length) - 0.5 * law.slack, 0.0));
  }

  /// What the loops leave of a coupler: stops, and what may break it.
  void couple(std::size_t i) {
    Stops& found = stops[i];
    const bool lead = rest.lies(i), trail = rest.lies(i + 1);
    if ((lead && trail) || found.round == round) return;
    if (found.engaged) found = {};
    found.round = round;
    if (far[i] > 0.0) engage_stops(i, bar(at(i), at(i + 1), i));
    if (!lead && !trail) return;
    const double change = held[i].change({axial[static_cast<Eigen::Index>(i)], found.effort, 0.0});
    wake_if_pushed(lead ? i : i + 1, change);
  }

  void wake_if_pushed(std::size_t car, double change) {
    if (change > Rest::kPush * bodies[car].weight) wake(car);
  }
  /// A car that lay moves from this step on.
  void wake(std::size_t car) {
    rest.wake(car);
    for (const std::size_t truck : {car, n + car})
      if (on_rails[truck] == 0.0) load[truck] = leaning[truck] = 0.0;
    body_on_ground(car);
    for (const std::size_t truck : {car, n + car})
      if (on_rails[truck] == 0.0) off_track(truck, car);
    // What it leant on all the time is no new impact.
    for (Pair& p : pairs)
      if (static_cast<std::size_t>(p.a) == car || static_cast<std::size_t>(p.b) == car) p.seen = now;
    if (car > 0) couple(car - 1);
    if (car + 1 < n) couple(car);
  }

  /// Cars off the rails that have been slow enough for long enough. Forces are known.
  void find_still(double h) {
    const double limit = scenario.terrain.rest_speed;
    still.clear();
    if (!(limit > 0.0)) return;
    for (std::size_t k = 0; k < n; ++k) {
      if (!off(k) || rest.lies(k)) continue;
      const double speed = velocity(k).norm(), turning = radius[k] * of_car(rotation, k).norm();
      const bool slow = speed + turning < limit;
      if (rest.note(k, slow && of_car(force, k).norm() < Rest::kPull * bodies[k].weight, h)) still.push_back(k);
    }
  }
  Vector3d of_car(const std::vector<double>& column, std::size_t k) const {
    return {column[k], column[n + k], column[2 * n + k]};
  }
  /// Friction takes what motion those that lie down have left.
  void lay_still(double* y) {
    if (still.empty()) return;
    for (const std::size_t k : still) {
      const SpatialMotion& q = at(k);
      const Body& b = bodies[k];
      record.spent.work_off_track +=
          0.5 * b.mass * q.velocity.squaredNorm() + 0.5 * q.body_rates.dot(b.inertia.cwiseProduct(q.body_rates));
      for (const std::size_t column : {SVX, SVY, SVZ, ROLL_RATE, PITCH_RATE, YAW_RATE}) y[column * n + k] = 0.0;
      for (const std::size_t truck : {k, n + k}) {
        load_held[truck] = load[truck];
        leaning_held[truck] = leaning[truck];
      }
      for (Pair& p : pairs)
        if (static_cast<std::size_t>(p.a) == k || static_cast<std::size_t>(p.b) == k) p.hold();
      for (const std::size_t i : {k - 1, k})
        if (i < held.size()) held[i].known = false;
      accounts[k].used = 0;
      rest.lay(k);
    }
    still.clear();
    wide.look(arrays, y);
    look(y);
  }
  /// Cars that lie do not move.
  void hold_still(double* accelerations) {
    if (!rest.any()) return;
    for (std::size_t k = 0; k < n; ++k) {
      if (!rest.lies(k)) continue;
      for (std::size_t column = 0; column < 6; ++column) accelerations[column * n + k] = 0.0;
      for (std::size_t column = 0; column < 3; ++column) spin[column * n + k] = 0.0;
    }
  }

  /// Each stop has an energy that depends on directions of the bar and of the cars. Its gradient turns the cars, and
  /// pushes the pins apart sideways.
  void engage_stops(std::size_t i, const Bar& b) {
    const inputs::Coupler& law = scenario.coupler;
    const std::array<const SpatialMotion*, 2> both{&at(i), &at(i + 1)};
    Stops& found = stops[i];
    found.engaged = true;
    Vector3d gradient = Vector3d::Zero();  // of the energy against u
    double moments = 0.0;
    for (const int end : {0, 1}) {
      const double swing = b.yaw(end);
      const double yaw = stop_moment(swing, law.swing_limit, law.swing_stiffness, law.swing_moment_max);
      const double pitch = stop_moment(b.pitch(end), law.pitch_limit, law.pitch_stiffness, inputs::kInfinity);
      found.swing = std::max(found.swing, std::abs(swing));
      moments += yaw;
      found.effort += (std::abs(yaw) + std::abs(pitch)) / bodies[i].half_length;
      if (yaw == 0.0 && pitch == 0.0) continue;
      const Vector3d& own = b.own[end];
      const double flat = std::max(std::hypot(own.x(), own.y()), 1.0e-3);
      const Vector3d here = both[static_cast<std::size_t>(end)]->axes *
                            Vector3d(-yaw * own.y() / (flat * flat), yaw * own.x() / (flat * flat), pitch / flat);
      add(i + static_cast<std::size_t>(end), Vector3d::Zero(), b.u.cross(here));
      gradient += here;
    }
    found.moment = std::abs(moments);
    const double twist =
        stop_moment(roll(*both[0], *both[1], b), law.roll_limit, law.roll_stiffness, inputs::kInfinity);
    found.twist = std::abs(twist);
    found.effort += found.twist / bodies[i].half_length;
    for (const int end : {0, 1}) {
      if (twist == 0.0) break;
      const double along = b.own[end].y(), sign = end == 0 ? 1.0 : -1.0;
      Vector3d left = both[static_cast<std::size_t>(end)]->axes.col(1) - along * b.u;
      const double size = std::max(left.norm(), 0.1);
      left /= size;
      add(i + static_cast<std::size_t>(end), Vector3d::Zero(), sign * twist * (b.u - along / size * left));
      gradient += sign * twist * along / size * b.u.cross(left);
    }
    const Vector3d shear = (gradient.dot(b.u) * b.u - gradient) / b.gap;
    found.vertical = std::abs(shear.z());
    found.effort += shear.norm();
    push(i, shear, b.arm_lead);
    push(i + 1, -shear, b.arm_trail);
  }

  /// All forces in the state but those between bodies, which depend on the length of the step.
  void find_forces(double t) {
    now = t;
    ++round;
    brakes.prepare(t);
    fastest = wide.swirls(arrays, state, radius.data(), swirl.data(), spinning);
    wide.couple(arrays, state);
    wide.forces(arrays, state);
    for (std::size_t k = 0; k < n; ++k) {
      accounts[k].used = 0;
      if (!rest.lies(k)) body_on_ground(k);
    }
    for (const std::size_t truck : loose) {
      const std::size_t car = car_of(truck);
      if (!rest.lies(car)) {
        off_track(truck, car);
      } else {
        load[truck] = load_held[truck];
        leaning[truck] = leaning_held[truck];
      }
    }
    for (std::size_t i = 0; i < alive.size(); ++i) couple(i);
    forces_found = true;
  }

  /// What friction with the ground has strained becomes the past.
  void keep_strain() {
    braked.swap(braked_next);
    find_swapped();
    for (std::size_t k = 0; k < n; ++k) {
      if (!lies[k] || rest.lies(k)) continue;
      const auto first = static_cast<std::ptrdiff_t>(kPoints * k);
      std::copy_n(sheared_next.begin() + first, kPoints, sheared.begin() + first);
    }
  }

  Vector3d centre(std::size_t k) const { return {state[SX * n + k], state[SY * n + k], state[SZ * n + k]}; }
  Vector3d velocity(std::size_t k) const { return {state[SVX * n + k], state[SVY * n + k], state[SVZ * n + k]}; }

  void find_pairs() {
    const auto begin_of = [this](int i) {
      const auto k = static_cast<std::size_t>(i);
      return state[SX * n + k] - radius[k];
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
        const double reach = radius[a] + radius[b] + 2.0 * kMargin;
        if (begin_of(by_x[j]) > state[SX * n + a] + radius[a] + 2.0 * kMargin) break;
        if ((centre(a) - centre(b)).squaredNorm() > reach * reach) continue;
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

  Box box(std::size_t k) const { return {at(k).point(bodies[k].box_centre), at(k).axes, bodies[k].box_half}; }

  void contacts(double t, double h) {
    if (scenario.contact.law == inputs::ContactLaw::none) return;
    if (moved > kMargin) {
      find_pairs();
      moved = 0.0;
    }
    // Half as much again for what speeds may grow within this step.
    moved += 1.5 * h * (fastest + spinning);
    // Who wakes may wake others.
    for (bool all = false; !all;) {
      all = true;
      for (Pair& pair : pairs) {
        const bool lie = rest.lies(static_cast<std::size_t>(pair.a)) && rest.lies(static_cast<std::size_t>(pair.b));
        if (lie || pair.round == round) continue;
        pair.round = round;
        if (touch(t, h, pair)) all = false;
      }
    }
  }

  /// True if it has woken a car.
  bool touch(double t, double h, Pair& pair) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    // As far as they were apart, less what they may have moved since then, they need not be looked at.
    pair.apart -= 1.05 * h * ((velocity(a) - velocity(b)).cwiseAbs().sum() + swirl[a] + swirl[b]);
    if (pair.apart > 0.0) return false;
    const Box box_a = box(a), box_b = box(b);
    const BoxManifold m = press(box_a, box_b, pair.axis);
    pair.axis = m.axis;
    pair.apart = m.count > 0 ? 0.0 : gap(box_a, box_b) - 1e-3;
    if (m.count == 0) {
      pair.crushed = 0.0;
      pair.sheared.setZero();
      return wakes(pair, Vector3d::Zero());
    }
    inputs::Contact law = scenario.contact;
    if (law.side_crush_force < law.crush_force && !(end_met(at(a), m.normal) && end_met(at(b), -m.normal)))
      law.crush_force = law.side_crush_force;
    const SpatialMotion &q = at(a), &r = at(b);
    // What speeds change in ten steps of free fall: slower than that, a car that lies on another would hop as the force
    // changes between loading and unloading.
    const double quiet = std::max(scenario.ground.regularization_speed, 10.0 * inputs::kStandardGravity * h);
    const auto points = static_cast<std::size_t>(m.count);
    const double share = 1.0 / m.count;
    std::array<Vector3d, 8> slip;
    std::array<double, 8> pushes;
    Vector3d first_velocity = Vector3d::Zero(), mean_slip = Vector3d::Zero();
    double force = 0.0;
    for (std::size_t i = 0; i < points; ++i) {
      const Vector3d v = q.velocity_at(m.point[i]) - r.velocity_at(m.point[i]);
      const double closing = -v.dot(m.normal);
      if (i == 0 || closing > -first_velocity.dot(m.normal)) first_velocity = v;
      pushes[i] = share * quiet_contact_force(law, m.depth[i], closing, quiet, pair.crushed);
      slip[i] = v + closing * m.normal;
      force += pushes[i];
      mean_slip += pushes[i] * slip[i];
      double& overlap = record.incidents.overlap_max;
      overlap = std::max(overlap, m.depth[i] - pair.crushed);
    }
    if (!(force > 0.0)) {
      pair.sheared.setZero();
      return wakes(pair, Vector3d::Zero());
    }
    // Friction strains the bodies until they slide, as on the ground.
    const double reduced = bodies[a].mass * bodies[b].mass / (bodies[a].mass + bodies[b].mass);
    const double rub_damping = friction_damping(law, reduced);
    pair.sheared -= pair.sheared.dot(m.normal) * m.normal;
    pair.sheared += h / force * mean_slip;
    const double strained = law.stiffness * pair.sheared.norm(), most = law.friction * force;
    if (strained > most) pair.sheared *= most / strained;
    const bool woken = wakes(pair, force * m.normal - law.stiffness * pair.sheared);
    for (std::size_t i = 0; i < points; ++i) {
      const double part = pushes[i] / force;
      Vector3d rub = -part * (law.stiffness * pair.sheared + rub_damping * slip[i]);
      const double size = rub.norm(), limit = law.friction * pushes[i];
      if (size > limit) rub *= limit / size;
      const Vector3d normal = pushes[i] * m.normal;
      const Vector3d arm_a = m.point[i] - q.centre, arm_b = m.point[i] - r.centre;
      push(a, IMPACT_NORMAL, normal, arm_a);
      push(b, IMPACT_NORMAL, -normal, arm_b);
      push(a, IMPACT_FRICTION, rub, arm_a);
      push(b, IMPACT_FRICTION, -rub, arm_b);
    }
    note(t, h, pair, m, first_velocity, force);
    return woken;
  }
  /// Wakes a car that lies if the force between it and its neighbour is no longer what it was; true if it has.
  bool wakes(Pair& pair, const Vector3d& force) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    if (!rest.lies(a) && !rest.lies(b)) return false;
    const std::size_t car = rest.lies(a) ? a : b;
    wake_if_pushed(car, pair.held.change(force));
    return !rest.lies(car);
  }

  static Face face_met(const SpatialMotion& car, const Vector3d& push) {
    const Vector3d own = car.axes.transpose() * push;
    const double along = own.x(), across = own.y(), upward = own.z();
    if (std::abs(upward) > std::max(std::abs(along), std::abs(across))) return upward < 0.0 ? Face::top : Face::bottom;
    if (std::abs(along) > std::abs(across)) return along < 0.0 ? Face::front : Face::rear;
    return across < 0.0 ? Face::left : Face::right;
  }

  static bool end_met(const SpatialMotion& car, const Vector3d& push) {
    const Face face = face_met(car, push);
    return face == Face::front || face == Face::rear;
  }

  void note(double t, double h, Pair& pair, const BoxManifold& m, const Vector3d& velocity, double force) {
    std::vector<Impact>& impacts = record.incidents.impacts;
    const SpatialMotion &a = at(static_cast<std::size_t>(pair.a)), &b = at(static_cast<std::size_t>(pair.b));
    if (pair.impact < 0 || t - pair.seen > kSameImpact) {
      pair.impact = static_cast<int>(impacts.size());
      const Vector3d& p = m.point[0];
      impacts.push_back({t, t, pair.a, pair.b, face_met(a, m.normal), face_met(b, -m.normal),
                         (p - a.centre).dot(a.axes.col(0)), (p - b.centre).dot(b.axes.col(0)), p.x(), p.y(), p.z(),
                         velocity.norm(), -velocity.dot(m.normal), 0.0, 0.0});
    }
    pair.seen = t;
    Impact& impact = impacts[static_cast<std::size_t>(pair.impact)];
    impact.end = t + h;
    impact.impulse += force * h;
    impact.peak_force = std::max(impact.peak_force, force);
  }

  double suspension_energy(std::size_t truck, const SpatialMotion& q) const {
    if (lost[truck]) return 0.0;
    const Body& b = bodies[car_of(truck)];
    double e = 0.0;
    for (const bool left : {false, true}) {
      const Vector3d place = wheel(q, truck, left);
      const double ground = on_rails[truck] != 0.0 ? rails_under(place, arc[truck]) : ground_under(place, arc[truck]).z;
      const double depth = std::max(b.sag - (place.z() - ground), 0.0);
      e += 0.5 * b.spring * depth * depth;
    }
    return e;
  }
  double ground_energy(std::size_t car, const SpatialMotion& q) const {
    double e = 0.0;
    for (std::size_t i = 0; i < kCorners; ++i) {
      const Vector3d place = q.point(corner_of(bodies[car], i));
      const double depth = ground_under(place, arc[car]).z - place.z();
      if (depth > 0.0) e += 0.5 * scenario.terrain.body_stiffness * depth * depth;
    }
    return e;
  }

  /// Work of the last step's forces, by account, with the mean of the velocities before and after.
  void account(double h, const double* y, const double* after) {
    wide.work(arrays, y, after, h, record.spent);
    std::array<double, kAccounts> given{};
    for (std::size_t k = 0; k < n; ++k) {
      const Accounts& sum = accounts[k];
      if (sum.used == 0) continue;
      const auto both = [&](std::size_t c) { return y[c * n + k] + after[c * n + k]; };
      const Vector3d v(both(SVX), both(SVY), both(SVZ));
      const Vector3d w(mean_rotation[k], mean_rotation[n + k], mean_rotation[2 * n + k]);
      for (std::size_t a = 0; a < kAccounts; ++a)
        if ((sum.used & 1U << a) != 0) given[a] += sum.of[a].force.dot(v) + sum.of[a].torque.dot(w);
    }
    for (std::size_t a = 0; a < kAccounts; ++a) record.spent.*kTaken[a] -= 0.5 * h * given[a];
  }

  void leave(double t, std::size_t truck, Cause cause, double* y) {
    const std::size_t car = car_of(truck);
    const SpatialMotion& q = at(car);
    const double stored = suspension_energy(truck, q);
    rest.wake(car);  // before forces are found again
    on_rails[truck] = 0.0;
    loose.insert(std::lower_bound(loose.begin(), loose.end(), truck), truck);
    overloaded[truck] = lateral[truck] = braked[truck] = 0.0;
    // What the springs held up falls from the rails to the ground.
    record.spent.work_rails += stored - suspension_energy(truck, q);
    const Vector3d p = q.point(truck_place(truck));
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
    const Vector3d across = at(car).axes.col(1);
    const auto kinetic = [&] {
      const SpatialMotion& q = at(car);
      return 0.5 * b.mass * q.velocity.squaredNorm() + 0.5 * q.body_rates.dot(b.inertia.cwiseProduct(q.body_rates));
    };
    const double kinetic_before = kinetic();
    y[SVX * n + car] += impulse / b.mass * across.x();
    y[SVY * n + car] += impulse / b.mass * across.y();
    y[SVZ * n + car] += impulse / b.mass * across.z();
    y[YAW_RATE * n + car] += impulse * arm / b.inertia.z();
    wide.look(arrays, y);
    look(y);
    record.spent.work_kicks -= kinetic() - kinetic_before;
  }

  /// Finds all trucks on the track; those that have come to its broken or torn parts leave it.
  void pass(double t, double h, double* y) {
    const auto ahead = static_cast<std::size_t>(scenario.initial.cars_ahead);
    for (std::size_t k = ahead; k < n; ++k) past[k] = past[k] || state[SX * n + k] >= 0.0;
    wide.places(arrays, state, place_x.data(), place_y.data());
    for (std::size_t truck = 0; truck < 2 * n; ++truck) {
      const double from = arc[truck];
      if (track.straight()) arc[truck] = place_x[truck];
      else if (!rest.lies(car_of(truck))) arc[truck] = track.foot({place_x[truck], place_y[truck]}, from);
      if (on_rails[truck] == 0.0) continue;
      const double s = arc[truck];
      if (car_of(truck) >= ahead && from < 0.0 && s >= 0.0) leave(t + h - h * s / (s - from), truck, Cause::pod, y);
      else if (s >= track.torn_from() && s <= track.torn_to() && track.torn(s))
        leave(t + h, truck, Cause::torn_track, y);
    }
    find_offsets();
  }

  /// Of all trucks at their arc lengths.
  void find_offsets() {
    if (track.straight()) {
      offset = place_y;
    } else {
      for (std::size_t truck = 0; truck < 2 * n; ++truck) {
        if (on_rails[truck] == 0.0 && rest.lies(car_of(truck))) continue;
        const Track::Node node = track.at(arc[truck]);
        tangent_x[truck] = node.tangent.x();
        tangent_y[truck] = node.tangent.y();
        offset[truck] =
            (place_y[truck] - node.point.y()) * node.tangent.x() - (place_x[truck] - node.point.x()) * node.tangent.y();
      }
    }
    for (std::size_t truck = 0; truck < rail_height.size(); ++truck) {
      if (on_rails[truck] == 0.0) continue;
      const TrackProfile::Place along = profile.at(arc[truck]);
      rail_height[truck] = along.height;
      rail_slope[truck] = along.slope;
      rail_tilt[truck] = along.tilt;
      rail_twist[truck] = along.twist;
    }
    if (!track.aligned()) {
      loops.subtract_alignment(static_cast<std::ptrdiff_t>(2 * n), track.alignments(), arc.data(), on_rails.data(),
                               offset.data());
    }
  }

  bool give_way(double t, double h) {
    bool any = loops.overload(static_cast<std::ptrdiff_t>(2 * n), scenario.rails, h, lateral_before.data(),
                              lateral.data(), load.data(), overloaded.data());
    for (std::size_t truck = 0; any && truck < 2 * n; ++truck) {
      if (on_rails[truck] == 0.0 || overloaded[truck] <= scenario.rails.derail_time) continue;
      leave(t, truck, Cause::lateral, nullptr);
      offset[truck] += track.alignment(arc[truck]);
    }
    for (const std::size_t truck : loose) {
      const std::size_t car = car_of(truck);
      if (lost[truck] || load[truck] > 0.0 || rest.lies(car)) continue;
      if (axes[8 * n + car] >= cos_part) continue;
      record.spent.work_truck_damping += suspension_energy(truck, at(car));
      lost[truck] = true;
      any = true;
    }
    for (std::size_t i = 0; i < alive.size(); ++i) any = break_coupler(t, i) || any;
    return any;
  }

  bool break_coupler(double t, std::size_t i) {
    if (alive[i] == 0.0) return false;
    using By = BrokenCoupler::By;
    const inputs::Coupler& law = scenario.coupler;
    const double force = axial[static_cast<Eigen::Index>(i)];
    const Stops& s = stops[i];
    By by = By::draft;
    if (-force > law.break_draft) by = By::draft;
    else if (s.swing > law.break_swing) by = By::swing;
    else if (s.moment > law.break_moment) by = By::moment;
    else if (std::abs(rise[i]) > law.slip_height) by = By::slip;
    else if (s.vertical > law.vertical_hold) by = By::vertical;
    else if (s.twist > law.break_twist) by = By::twist;
    else return false;
    const Bar b = bar(at(i), at(i + 1), i);
    record.spent.work_coupler_break += stop_energy_of(at(i), at(i + 1), b) + axial_energy_of(b);
    alive[i] = 0.0;
    const double at_limit = std::max(force, -law.break_draft);
    record.incidents.broken.push_back({t, static_cast<Eigen::Index>(i), by, at_limit});
    brakes.vent(t, static_cast<Eigen::Index>(i));
    note_peak(t, i, at_limit);
    return true;
  }

  void note_peaks(double t) {
    for (std::size_t i = 0; i < alive.size(); ++i) note_peak(t, i, axial[static_cast<Eigen::Index>(i)]);
  }
  void note_peak(double t, std::size_t i, double force) {
    Incidents& in = record.incidents;
    if (force > in.buff.force) in.buff = {force, static_cast<Eigen::Index>(i), t};
    if (-force > in.draft.force) in.draft = {-force, static_cast<Eigen::Index>(i), t};
  }

  void note_blockage(double h) {
    if (standing == n || standing == 0 || !off(standing - 1) || alive[standing - 1] == 0.0) return;
    const double force = std::max(axial[static_cast<Eigen::Index>(standing - 1)], 0.0);
    record.incidents.blockage_impulse += h * force;
    record.incidents.blockage_time += h;
    record.incidents.blockage_peak = std::max(record.incidents.blockage_peak, force);
  }

  bool off(std::size_t car) const { return on_rails[car] == 0.0 || on_rails[n + car] == 0.0; }

  void order_derailments() {
    std::vector<Derailment>& all = record.incidents.derailments;
    if (ordered == all.size()) return;
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(ordered);
    std::stable_sort(begin, all.end(), [](const Derailment& a, const Derailment& b) { return a.time < b.time; });
    for (auto d = begin; d != all.end(); ++d) {
      Cause& cause = first_cause[static_cast<std::size_t>(d->car)];
      if (cause == Cause::none) cause = d->cause;
    }
    ordered = all.size();
    find_standing();
  }
  void find_standing() {
    const auto ahead = static_cast<std::size_t>(scenario.initial.cars_ahead);
    standing = n;
    while (standing > ahead && !off(standing - 1)) --standing;
  }
};

std::vector<std::string> SpatialModel::instruction_sets(Eigen::Index cars) { return kSpatialVersions.names(cars); }

SpatialModel::SpatialModel(const inputs::Scenario& scenario, const std::string& instruction_set)
    : TrainModel(scenario), parts_(std::make_unique<Parts>(*this, scenario, instruction_set)) {}

SpatialModel::~SpatialModel() = default;

SpatialMotion SpatialModel::motion(const double* y, Eigen::Index car) const {
  const auto n = static_cast<std::size_t>(car_count()), k = static_cast<std::size_t>(car);
  const auto three = [&](std::size_t c) { return Vector3d(y[c * n + k], y[(c + 1) * n + k], y[(c + 2) * n + k]); };
  SpatialMotion m;
  m.centre = three(SX);
  m.velocity = three(SVX);
  m.body_rates = three(ROLL_RATE);
  // Between two steps a state is interpolated.
  m.axes =
      Eigen::Quaterniond(y[QW * n + k], y[QX * n + k], y[QY * n + k], y[QZ * n + k]).normalized().toRotationMatrix();
  m.rotation = m.axes * m.body_rates;
  return m;
}

void SpatialModel::place(double* y, Eigen::Index car, const SpatialMotion& m) const {
  const Eigen::Index n = car_count();
  const Eigen::Quaterniond turn(m.axes);
  const double values[] = {m.centre.x(),
                           m.centre.y(),
                           m.centre.z(),
                           0.0,
                           0.0,
                           0.0,
                           m.velocity.x(),
                           m.velocity.y(),
                           m.velocity.z(),
                           m.body_rates.x(),
                           m.body_rates.y(),
                           m.body_rates.z(),
                           turn.x(),
                           turn.y(),
                           turn.z(),
                           turn.w()};
  for (Eigen::Index c = 0; c < 16; ++c) y[c * n + car] = values[c];
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
    if (!parts_->profile.flat()) {
      place(y.data(), k, parts_->on_rails_at(static_cast<std::size_t>(k), car));
      continue;
    }
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
  p.wide.look(p.arrays, y);
  p.look(y);
  p.wide.places(p.arrays, y, p.place_x.data(), p.place_y.data());
  for (std::size_t truck = 0; truck < 2 * p.n; ++truck)
    p.arc[truck] = p.track.nearest({p.place_x[truck], p.place_y[truck]});
  const auto ahead = static_cast<std::size_t>(p.scenario.initial.cars_ahead);
  for (std::size_t k = ahead; k < p.n; ++k) p.past[k] = p.at(k).centre.x() >= 0.0;
  for (std::size_t truck = 0; truck < 2 * p.n; ++truck) {
    if (p.car_of(truck) >= ahead && p.arc[truck] >= 0.0) p.leave(0.0, truck, Cause::pod, nullptr);
  }
  p.order_derailments();
  p.find_standing();
  p.find_offsets();
  p.find_forces(0.0);
  p.note_peaks(0.0);
}

void SpatialModel::accelerations(double t, double h, const double* y, double* result) {
  Parts& p = *parts_;
  p.state = y;
  if (!p.forces_found) p.find_forces(t);
  p.forces_found = false;
  p.contacts(t, h);
  p.find_still(h);
  p.wide.accelerate(p.arrays, y, h, result);
  p.hold_still(result);
}

void SpatialModel::settle(double t, double h, const double* before, double* y) {
  Parts& p = *parts_;
  p.axes_before.swap(p.axes);
  p.find_swapped();
  p.wide.turn(p.arrays, y);
  p.look(y);
  p.account(h, before, y);
  p.note_blockage(h);
  p.keep_strain();
  p.lay_still(y);
  p.pass(t, h, y);
  p.lateral_before.swap(p.lateral);
  p.find_swapped();
  p.find_forces(t + h);
  if (p.give_way(t + h, h)) p.find_forces(t + h);
  p.note_peaks(t + h);
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
      const Vector3d place = q.point(p.truck_place(truck));
      const TrackPlace by_track = track_place(car, {place.x(), place.y()});
      const double height = place.z() - p.profile.at(by_track.s).height;
      (front ? o.front_truck : o.rear_truck) = TruckPlace{by_track.s, by_track.offset, height, p.load[truck]};
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
    o.swing_lead = b.yaw(0);
    o.swing_trail = b.yaw(1);
    o.pitch_lead = b.pitch(0);
    o.pitch_trail = b.pitch(1);
    o.broken = p.alive[i] == 0.0;
    if (o.broken) continue;
    const inputs::Coupler& law = p.scenario.coupler;
    const double spring = coupler_spring_force<double>(law, b.gap);
    const double rate = Parts::rate(cars[i], cars[i + 1], b);
    o.axial_force = spring + coupler_damper_force<double>(p.damping[i], spring, rate);
    const auto moment = [&](int end) {
      return stop_moment(b.yaw(end), law.swing_limit, law.swing_stiffness, law.swing_moment_max);
    };
    o.moment_lead = moment(0);
    o.moment_trail = moment(1);
    o.lateral_force = (o.moment_lead + o.moment_trail) / b.gap;
    const double up = stop_moment(b.pitch(0), law.pitch_limit, law.pitch_stiffness, inputs::kInfinity) +
                      stop_moment(b.pitch(1), law.pitch_limit, law.pitch_stiffness, inputs::kInfinity);
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

Footprint SpatialModel::footprint(const double* y, Eigen::Index car) const {
  const Body& b = parts_->bodies[static_cast<std::size_t>(car)];
  const SpatialMotion q = motion(y, car);
  const Vector3d centre = q.point(b.box_centre);
  Footprint f{{centre.x(), centre.y()}, car_motion(y, car).axis, 0.0, 0.0};
  const auto half_extent = [&](const Vector2& u) {
    return (q.axes.topRows<2>().transpose() * u).cwiseAbs().dot(b.box_half);
  };
  f.half_length = half_extent(f.axis);
  f.half_width = half_extent(f.side());
  return f;
}

std::optional<Attitude> SpatialModel::attitude(const double* y, Eigen::Index car) const {
  const Body& b = parts_->bodies[static_cast<std::size_t>(car)];
  const SpatialMotion q = motion(y, car);
  const Vector3d centre = q.point(b.box_centre);
  const double rails = parts_->profile.at(track_place(car, {centre.x(), centre.y()}).s).bed;
  const double middle = centre.z() - rails;
  return Attitude{std::acos(std::clamp(q.axes(2, 2), -1.0, 1.0)), middle,
                  middle - q.axes.row(2).cwiseAbs().dot(b.box_half)};
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
    rate[i] = Parts::rate(lead, trail, b);
  }
}

bool SpatialModel::derailed(Eigen::Index car) const { return parts_->off(static_cast<std::size_t>(car)); }
bool SpatialModel::past_pod(Eigen::Index car) const { return parts_->past[static_cast<std::size_t>(car)]; }
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
  const std::size_t rear = p.n + k;
  return 0.5 * Eigen::Vector4d(p.load[k] - p.leaning[k], p.load[k] + p.leaning[k], p.load[rear] - p.leaning[rear],
                               p.load[rear] + p.leaning[rear]);
}

bool SpatialModel::truck_lost(Eigen::Index car, bool front) const {
  return parts_->lost[parts_->truck_of(static_cast<std::size_t>(car), front)];
}

EnergyLedger SpatialModel::energy(const double* y) const {
  const Parts& p = *parts_;
  EnergyLedger e = p.record.spent;
  std::vector<SpatialMotion> cars(p.n);
  for (std::size_t k = 0; k < p.n; ++k) {
    const SpatialMotion& q = cars[k] = motion(y, static_cast<Eigen::Index>(k));
    const Body& b = p.bodies[k];
    e.kinetic_translation += 0.5 * b.mass * q.velocity.squaredNorm();
    e.kinetic_rotation += 0.5 * q.body_rates.dot(b.inertia.cwiseProduct(q.body_rates));
    e.height += b.weight * (q.centre.z() - b.centre_height);
    e.suspension += p.suspension_energy(k, q) + p.suspension_energy(p.n + k, q) + p.ground_energy(k, q);
  }
  for (std::size_t i = 0; i < p.alive.size(); ++i) {
    if (p.alive[i] == 0.0) continue;
    const Parts::Bar b = p.bar(cars[i], cars[i + 1], i);
    e.coupler_axial += p.axial_energy_of(b);
    e.coupler_swing += p.stop_energy_of(cars[i], cars[i + 1], b);
  }
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
  archive.group("record", [&] { p.record.walk(archive); });
  archive.group("brakes", [&] { p.brakes.walk(archive); });
  archive.column("on_rails", p.on_rails);
  archive.flags("lost", p.lost);
  archive.flags("past", p.past);
  archive.column("alive", p.alive);
  archive.list("first_cause", p.first_cause, [&](Cause& c) { archive.value("cause", c); });
  archive.column("arc", p.arc);
  // Of cars that lie these are not found again.
  for (auto [name, column] : {std::pair{"offset", &p.offset}, {"tangent_x", &p.tangent_x}, {"tangent_y", &p.tangent_y}})
    archive.column(name, *column);
  archive.column("overloaded", p.overloaded);
  archive.column("braked", p.braked);
  archive.value("ordered", p.ordered);
  archive.group("track", [&] { p.track.walk(archive); });
  archive.value("moved", p.moved);
  archive.group("rest", [&] { p.rest.walk(archive); });
  archive.column("load_held", p.load_held);
  archive.column("leaning_held", p.leaning_held);
  archive.list("held", p.held, [&](Held& h) { h.walk(archive); });
  archive.column("feet", p.feet);
  archive.numbers("sheared", p.sheared.data()->data(), static_cast<std::ptrdiff_t>(3 * p.sheared.size()));
  archive.list("by_x", p.by_x, [&](int& car) { archive.value("car", car); });
  archive.list("pairs", p.pairs, [&](Pair& pair) {
    archive.value("a", pair.a);
    archive.value("b", pair.b);
    archive.value("axis", pair.axis);
    archive.value("crushed", pair.crushed);
    archive.column("sheared", pair.sheared);
    archive.value("impact", pair.impact);
    archive.group("held", [&] { pair.held.walk(archive); });
    archive.value("seen", pair.seen);
  });
  if (!archive.restoring()) return;
  if (!(p.scenario.terrain.rest_speed > 0.0)) p.rest.wake_all();
  std::fill(p.above.begin(), p.above.end(), 0.0);
  for (std::size_t k = 0; k < p.n; ++k) {
    const auto first = p.sheared.begin() + static_cast<std::ptrdiff_t>(kPoints * k);
    p.lies[k] = std::any_of(first, first + kPoints, [](const Vector3d& v) { return !v.isZero(0.0); });
  }
  p.loose.clear();
  for (std::size_t truck = 0; truck < 2 * p.n; ++truck)
    if (p.on_rails[truck] == 0.0) p.loose.push_back(truck);
  p.find_standing();
  p.wide.look(p.arrays, y);
  p.look(y);
  p.wide.places(p.arrays, y, p.place_x.data(), p.place_y.data());
  p.find_offsets();
  p.find_forces(t);
}

}  // namespace train_derail::model
