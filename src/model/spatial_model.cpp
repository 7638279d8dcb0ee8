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

/// Where what a force takes is put in the ledger. What is stored comes from the state.
enum Account {
  ON_TRACK,
  RAILS,
  OFF_TRACK,
  GRADE,
  TRUCK_DAMPING,
  COUPLER_DAMPING,
  BODY_GROUND,
  IMPACT_NORMAL,
  IMPACT_FRICTION,
  kAccounts
};
constexpr std::array<double EnergyLedger::*, kAccounts> kTaken{
    &EnergyLedger::work_on_track,    &EnergyLedger::work_rails,         &EnergyLedger::work_off_track,
    &EnergyLedger::work_grade,       &EnergyLedger::work_truck_damping, &EnergyLedger::work_coupler_damping,
    &EnergyLedger::work_body_ground, &EnergyLedger::work_impact_normal, &EnergyLedger::work_impact_friction};

struct Wrench {
  Vector3d force, torque;  // N; about the centre of mass, world frame [N m]
};

/// All that acts on a car in a step.
struct Loads {
  Wrench sum;
  unsigned used;                     // accounts below that are not empty
  std::array<Wrench, kAccounts> of;  // of what is not stored

  void clear() {
    sum = {Vector3d::Zero(), Vector3d::Zero()};
    used = 0;
  }
  void add(const Vector3d& force, const Vector3d& torque) {
    sum.force += force;
    sum.torque += torque;
  }
  void push(const Vector3d& force, const Vector3d& arm) { add(force, arm.cross(force)); }
  void add(Account a, const Vector3d& force, const Vector3d& torque) {
    add(force, torque);
    Wrench& w = of[a];
    if ((used & 1U << a) != 0) {
      w.force += force;
      w.torque += torque;
    } else {
      w = {force, torque};
      used |= 1U << a;
    }
  }
  void push(Account a, const Vector3d& force, const Vector3d& arm) { add(a, force, arm.cross(force)); }
};

/// A car that does not change.
struct Body {
  double mass, weight;
  Vector3d inertia;  // about roll, pitch, yaw axes
  double half_length, half_spacing;
  Vector3d box_centre, box_half;  // of the body, from the centre of mass
  double centre_height;
  double spring, spring_damping, sag;  // of a side of a truck; how far it is pressed at rest
  double rail_damping;
  double ground_damping;
  double radius;  // of a sphere about the centre of mass, around the body
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
  int impact = -1;
  double seen = 0.0;
};

SpatialMotion motion_of(const double* y, std::size_t n, std::size_t car) {
  const auto at = [&](Column c) { return y[static_cast<std::size_t>(c) * n + car]; };
  SpatialMotion m;
  m.centre = {at(SX), at(SY), at(SZ)};
  m.axes = Eigen::Quaterniond(at(QW), at(QX), at(QY), at(QZ)).toRotationMatrix();
  m.velocity = {at(SVX), at(SVY), at(SVZ)};
  m.body_rates = {at(ROLL_RATE), at(PITCH_RATE), at(YAW_RATE)};
  m.rotation = m.axes * m.body_rates;
  return m;
}

}  // namespace

struct SpatialModel::Parts {
  Parts(SpatialModel& owner, const inputs::Scenario& s)
      : scenario(s),
        n(static_cast<std::size_t>(owner.car_count())),
        step(s.solver.fixed_step.value_or(0.0)),
        level(s.terrain.bank_left == 0.0 && s.terrain.bank_right == 0.0),
        highest_ground(-s.terrain.rail_height - std::min({s.terrain.bank_left, s.terrain.bank_right, 0.0})),
        grade(s.track.grade / std::sqrt(1.0 + s.track.grade * s.track.grade)),
        tan_swing(quick_tangent(std::min(s.coupler.swing_limit, s.coupler.break_swing))),
        sin_pitch(s.coupler.pitch_limit < 0.5 * M_PI ? std::sin(s.coupler.pitch_limit) : 1.0),
        cos_roll(s.coupler.roll_limit < M_PI ? std::cos(s.coupler.roll_limit) : -1.0),
        cos_part(s.suspension.part_angle < M_PI ? std::cos(s.suspension.part_angle) : -2.0),
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
      b.centre_height = c.centre_height;
      b.box_centre = {0.0, 0.0, 0.5 * (c.floor_height + c.roof_height) - c.centre_height};
      b.box_half = {b.half_length, 0.5 * c.width, 0.5 * (c.roof_height - c.floor_height)};
      b.spring = s.suspension.stiffness;
      b.spring_damping = side_damping(s.suspension, c.mass);
      b.sag = 0.25 * c.weight / b.spring;
      b.rail_damping = rail_damping(s.rails, c.mass);
      b.ground_damping = ground_damping(s.terrain, c.mass);
      b.radius = b.box_half.norm() + b.box_centre.norm();
      bodies.push_back(b);
    }
    const std::size_t trucks = 2 * n;
    on_rails.assign(trucks, true);
    lost.assign(trucks, false);
    past.assign(n, false);
    first_cause.assign(n, Cause::none);
    for (auto* a : {&arc, &overloaded, &lateral, &lateral_before, &kick}) a->assign(trucks, 0.0);
    for (auto* a : {&braked, &braked_next}) a->assign(trucks, 0.0);
    load.assign(2 * trucks, 0.0);
    loads.resize(n);
    now.resize(n);
    before.resize(n);
    spin.resize(n);
    lies.assign(n, false);
    sheared.assign(kPoints * n, Vector3d::Zero());
    sheared_next = sheared;
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

  static double quick_tangent(double angle) { return angle < 0.5 * M_PI ? std::tan(angle) : inputs::kInfinity; }

  const inputs::Scenario scenario;
  const std::size_t n;
  const double step;
  const bool level;
  const double highest_ground, grade;
  const double tan_swing, sin_pitch, cos_roll, cos_part;  // of angles below which nothing has to be looked at closely
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

  // How far friction with the ground has strained it, kPoints a car [m]; the next values belong to the forces found.
  std::vector<Vector3d> sheared, sheared_next;
  std::vector<double> braked, braked_next;  // the same for brakes, a truck each [m]
  std::vector<char> lies;                   // anything of the car is on the ground

  // Couplers.
  std::vector<char> alive;
  ArrayX axial;
  std::vector<double> damping;
  struct Stops {
    double swing = 0.0, moment = 0.0, vertical = 0.0, twist = 0.0, height = 0.0;
  };
  std::vector<Stops> stops;  // what may break or slip, as found last

  std::vector<Loads> loads;                // of the step
  std::vector<Vector3d> spin;              // angular momentum along the car's axes, with what the step has added
  std::vector<SpatialMotion> now, before;  // at the state known last, and a step before
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
  /// From the centre of mass to the middle of a truck at the top of the rails, along the car's axes.
  Vector3d truck_place(std::size_t truck) const { return {arm_of(truck), 0.0, -bodies[car_of(truck)].centre_height}; }

  void load_motions(const double* y) {
    for (std::size_t k = 0; k < n; ++k) now[k] = motion_of(y, n, k);
  }

  /// Ground under a point: height and the upward vector (not of length 1) along which it pushes.
  struct Under {
    double z;
    Vector3d up;
  };
  Under ground_under(const Vector3d& p, double s_near) const {
    if (level) return {-scenario.terrain.rail_height, Vector3d::UnitZ()};
    if (track.straight()) {
      const GroundHeight g = ground_height(scenario.terrain, p.y());
      return {g.z, {0.0, -g.slope, 1.0}};
    }
    const double s = track.foot({p.x(), p.y()}, s_near);
    const Track::Node node = track.at(s);
    const double offset = (p.y() - node.point.y()) * node.tangent.x() - (p.x() - node.point.x()) * node.tangent.y();
    const GroundHeight g = ground_height(scenario.terrain, offset);
    return {g.z, {g.slope * node.tangent.y(), -g.slope * node.tangent.x(), 1.0}};
  }

  Vector3d wheel(std::size_t truck, bool left) const {
    const double half_base = scenario.suspension.half_base;
    return now[car_of(truck)].point(truck_place(truck) + Vector3d(0.0, left ? half_base : -half_base, 0.0));
  }

  /// How far the spring of a side of a truck is pressed.
  double pressed(std::size_t truck, const Vector3d& place) const {
    const double z = on_rails[truck] ? 0.0 : ground_under(place, arc[truck]).z;
    return bodies[car_of(truck)].sag - (place.z() - z);
  }

  void on_track(std::size_t truck, double brake_share) {
    const std::size_t car = car_of(truck);
    const Body& b = bodies[car];
    const SpatialMotion& q = now[car];
    Loads& sum = loads[car];
    const Vector3d arm = q.axes * truck_place(truck), side = scenario.suspension.half_base * q.axes.col(1);
    const Vector3d velocity = q.velocity + q.rotation.cross(arm);
    Vector2 tangent = Vector2::UnitX(), centre_line(arc[truck], 0.0);
    if (!track.straight()) {
      const Track::Node node = track.at(arc[truck]);
      tangent = node.tangent;
      centre_line = node.point;
    }
    const Vector3d along(tangent.x(), tangent.y(), 0.0), across(-tangent.y(), tangent.x(), 0.0);
    const double rise = q.centre.z() + arm.z();
    // Right and left: springs and dampers, upwards.
    double stored[2], total[2];
    for (const int left : {0, 1}) {
      const double sign = left != 0 ? 1.0 : -1.0;
      const double depth = b.sag - (rise + sign * side.z());
      const double rate = velocity.z() + sign * (q.rotation.x() * side.y() - q.rotation.y() * side.x());
      stored[left] = std::max(b.spring * depth, 0.0);
      total[left] = depth > 0.0 ? std::max(stored[left] - b.spring_damping * rate, 0.0) : 0.0;
      load[2 * truck + static_cast<std::size_t>(left)] = total[left];
    }
    const auto lift = [&](double right, double left) {
      const double both = right + left, more = left - right;
      return Wrench{{0.0, 0.0, both}, {arm.y() * both + side.y() * more, -(arm.x() * both + side.x() * more), 0.0}};
    };
    const Wrench spring = lift(stored[0], stored[1]), damper = lift(total[0] - stored[0], total[1] - stored[1]);
    sum.add(spring.force, spring.torque);
    sum.add(TRUCK_DAMPING, damper.force, damper.torque);
    const double carried = total[0] + total[1];
    // Brakes hold a train that stands: what they are strained gives way at their limit.
    const double stiffness = scenario.terrain.body_stiffness, limit = brake_share * carried,
                 speed = velocity.dot(along);
    const double strain = braked[truck] + step * speed, pull = -stiffness * strain - b.ground_damping * speed;
    const double brake = std::clamp(pull, -limit, limit);
    braked_next[truck] = pull == brake ? strain : brake / -stiffness;
    sum.push(ON_TRACK, brake * along, arm);
    // At the top of the rails, sideways.
    const Vector3d middle = q.centre + arm;
    const double offset = (middle.x() - centre_line.x()) * across.x() + (middle.y() - centre_line.y()) * across.y();
    lateral[truck] =
        rail_force<double>(scenario.rails, b.rail_damping, offset - track.alignment(arc[truck]), velocity.dot(across));
    sum.push(RAILS, lateral[truck] * across, arm);
  }

  void off_track(std::size_t truck) {
    load[2 * truck] = load[2 * truck + 1] = 0.0;
    lateral[truck] = 0.0;
    if (lost[truck]) return;
    const std::size_t car = car_of(truck);
    const Body& b = bodies[car];
    const SpatialMotion& q = now[car];
    Loads& sum = loads[car];
    const Vector3d middle = q.point(truck_place(truck)), velocity = q.velocity_at(middle);
    Vector2 tangent = Vector2::UnitX(), centre_line(arc[truck], 0.0);
    if (!track.straight()) {
      const Track::Node node = track.at(arc[truck]);
      tangent = node.tangent;
      centre_line = node.point;
    }
    const double offset = (middle.y() - centre_line.y()) * tangent.x() - (middle.x() - centre_line.x()) * tangent.y();
    double mu = scenario.ground.off_track_friction;
    if (scenario.ground.off_track_law == inputs::OffTrackLaw::by_slip)
      mu = slip_friction<double>(scenario.ground, velocity.squaredNorm(), velocity.dot(q.axes.col(1)), offset);
    if (!scenario.ground.patches.empty()) mu *= patch_factor(scenario.ground.patches, arc[truck], offset);
    for (const bool left : {false, true}) {
      const Vector3d place = wheel(truck, left), arm = place - q.centre;
      const Under under = ground_under(place, arc[truck]);
      const double depth = b.sag - (place.z() - under.z);
      const std::size_t point = kPoints * car + (truck < n ? 0 : 2) + (left ? 1 : 0);
      if (depth <= 0.0) {
        sheared_next[point].setZero();
        continue;
      }
      const Vector3d v = q.velocity_at(place);
      const double spring = b.spring * depth, total = std::max(spring - b.spring_damping * v.dot(under.up), 0.0);
      sum.push(spring * under.up, arm);
      sum.push(TRUCK_DAMPING, (total - spring) * under.up, arm);
      const double carried = total * under.up.norm();
      load[2 * truck + (left ? 1 : 0)] = carried;
      sum.push(OFF_TRACK, hold(car, point, under.up, v, mu * carried), arm);
    }
  }

  /// Friction of a point on the ground, at most `limit`: the ground is strained until it gives way. A force that grew
  /// with the speed instead would let cars creep down a bank.
  Vector3d hold(std::size_t car, std::size_t point, const Vector3d& up, const Vector3d& velocity, double limit) {
    const double stiffness = scenario.terrain.body_stiffness, up_square = up.squaredNorm();
    const auto flat = [&](const Vector3d& v) { return Vector3d(v - v.dot(up) / up_square * up); };
    const Vector3d slip = flat(velocity);
    Vector3d strain = flat(sheared[point]) + step * slip;
    Vector3d force = -stiffness * strain - bodies[car].ground_damping * slip;
    const double size = force.norm();
    if (size > limit) {
      force *= limit / size;
      strain = force / -stiffness;
    }
    sheared_next[point] = strain;
    lies[car] = true;
    return force;
  }

  Vector3d corner(std::size_t car, std::size_t i) const {
    const Body& b = bodies[car];
    const Vector3d sign(static_cast<double>(i / 4) - 1.0, (i & 1U) != 0 ? 1.0 : -1.0, (i & 2U) != 0 ? 1.0 : -1.0);
    return now[car].point(b.box_centre + sign.cwiseProduct(b.box_half));
  }

  void body_on_ground(std::size_t car) {
    const Body& b = bodies[car];
    const SpatialMotion& q = now[car];
    // Nothing of the body can reach the ground: the usual case.
    const Matrix3d& r = q.axes;
    const double lowest = q.centre.z() + r.row(2).dot(b.box_centre) - r.row(2).cwiseAbs().dot(b.box_half);
    if (lowest > highest_ground) {
      if (lies[car])
        std::fill_n(sheared_next.begin() + static_cast<std::ptrdiff_t>(kPoints * car + kWheels), kCorners,
                    Vector3d::Zero());
      return;
    }
    Loads& sum = loads[car];
    for (std::size_t i = 0; i < kCorners; ++i) {
      const std::size_t point = kPoints * car + kWheels + i;
      const Vector3d place = corner(car, i);
      const Under under = place.z() < highest_ground ? ground_under(place, arc[car]) : Under{place.z(), {}};
      const double depth = under.z - place.z();
      if (depth <= 0.0) {
        sheared_next[point].setZero();
        continue;
      }
      const Vector3d v = q.velocity_at(place), arm = place - q.centre;
      const double spring = scenario.terrain.body_stiffness * depth;
      const double total = std::max(spring - b.ground_damping * v.dot(under.up), 0.0);
      sum.push(spring * under.up, arm);
      sum.push(BODY_GROUND, (total - spring) * under.up, arm);
      sum.push(OFF_TRACK, hold(car, point, under.up, v, scenario.terrain.body_friction * total * under.up.norm()), arm);
    }
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
      if (!(own.x() > 0.0 && std::abs(own.y()) <= tan_swing * own.x() && std::abs(own.z()) <= sin_pitch)) return true;
    }
    const double a = b.own[0].y(), c = b.own[1].y();
    const double dot = lead.axes.col(1).dot(trail.axes.col(1)) - a * c;
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

  void couple(std::size_t i) {
    axial[static_cast<Eigen::Index>(i)] = 0.0;
    stops[i] = {};
    if (!alive[i]) return;
    const inputs::Coupler& law = scenario.coupler;
    const SpatialMotion &lead = now[i], &trail = now[i + 1];
    const Bar b = bar(lead, trail, i);
    const double spring = coupler_spring_force<double>(law, b.gap);
    const double damper = coupler_damper_force<double>(damping[i], spring, rate(lead, trail, b));
    axial[static_cast<Eigen::Index>(i)] = spring + damper;
    if (std::isfinite(law.slip_height)) stops[i].height = std::abs(b.gap * (b.own[0].z() + b.own[1].z()) * 0.5);
    if (spring != 0.0) {
      const Vector3d about_lead = b.arm_lead.cross(b.u), about_trail = b.arm_trail.cross(b.u);
      loads[i].add(spring * b.u, spring * about_lead);
      loads[i + 1].add(-spring * b.u, -spring * about_trail);
      loads[i].add(COUPLER_DAMPING, damper * b.u, damper * about_lead);
      loads[i + 1].add(COUPLER_DAMPING, -damper * b.u, -damper * about_trail);
    }
    if (turned_far(lead, trail, b)) engage_stops(i, b);
  }

  /// Each stop has an energy that depends on directions of the bar and of the cars. Its gradient turns the cars, and
  /// pushes the pins apart sideways.
  void engage_stops(std::size_t i, const Bar& b) {
    const inputs::Coupler& law = scenario.coupler;
    const std::array<const SpatialMotion*, 2> cars{&now[i], &now[i + 1]};
    Stops& found = stops[i];
    Vector3d gradient = Vector3d::Zero();  // of the energy against u
    double moments = 0.0;
    for (const int end : {0, 1}) {
      const double swing = b.yaw(end);
      const double yaw = stop_moment(swing, law.swing_limit, law.swing_stiffness, law.swing_moment_max);
      const double pitch = stop_moment(b.pitch(end), law.pitch_limit, law.pitch_stiffness, inputs::kInfinity);
      found.swing = std::max(found.swing, std::abs(swing));
      moments += yaw;
      if (yaw == 0.0 && pitch == 0.0) continue;
      const Vector3d& own = b.own[end];
      const double flat = std::max(std::hypot(own.x(), own.y()), 1.0e-3);
      const Vector3d here = cars[static_cast<std::size_t>(end)]->axes *
                            Vector3d(-yaw * own.y() / (flat * flat), yaw * own.x() / (flat * flat), pitch / flat);
      loads[i + static_cast<std::size_t>(end)].add(Vector3d::Zero(), b.u.cross(here));
      gradient += here;
    }
    found.moment = std::abs(moments);
    const double twist =
        stop_moment(roll(now[i], now[i + 1], b), law.roll_limit, law.roll_stiffness, inputs::kInfinity);
    found.twist = std::abs(twist);
    for (const int end : {0, 1}) {
      if (twist == 0.0) break;
      const double along = b.own[end].y(), sign = end == 0 ? 1.0 : -1.0;
      Vector3d left = cars[static_cast<std::size_t>(end)]->axes.col(1) - along * b.u;
      const double size = std::max(left.norm(), 0.1);
      left /= size;
      loads[i + static_cast<std::size_t>(end)].add(Vector3d::Zero(), sign * twist * (b.u - along / size * left));
      gradient += sign * twist * along / size * b.u.cross(left);
    }
    const Vector3d shear = (gradient.dot(b.u) * b.u - gradient) / b.gap;
    found.vertical = std::abs(shear.z());
    loads[i].push(shear, b.arm_lead);
    loads[i + 1].push(-shear, b.arm_trail);
  }

  /// All forces at the motions `now` but those between bodies, which depend on the length of the step.
  void find_forces(double t) {
    brakes.prepare(t);
    for (std::size_t k = 0; k < n; ++k) {
      const Body& b = bodies[k];
      Loads& sum = loads[k];
      sum.clear();
      sum.sum.force.z() = -b.weight;
      if (grade != 0.0) climb(k);
      const double share = brakes.share()[static_cast<Eigen::Index>(k)];
      for (const std::size_t truck : {k, n + k}) {
        if (on_rails[truck]) on_track(truck, share);
        else off_track(truck);
      }
      body_on_ground(k);
    }
    for (std::size_t i = 0; i < alive.size(); ++i) couple(i);
    forces_found = true;
  }

  /// The track is level here, and gravity is inclined against it.
  void climb(std::size_t car) {
    for (const std::size_t truck : {car, n + car}) {
      const Vector2 tangent = track.straight() ? Vector2::UnitX() : track.at(arc[truck]).tangent;
      loads[car].add(GRADE, -0.5 * grade * bodies[car].weight * Vector3d(tangent.x(), tangent.y(), 0.0),
                     Vector3d::Zero());
    }
  }

  /// What friction with the ground has strained becomes the past.
  void keep_strain() {
    braked.swap(braked_next);
    for (std::size_t k = 0; k < n; ++k) {
      if (!lies[k]) continue;
      const auto first = static_cast<std::ptrdiff_t>(kPoints * k);
      std::copy_n(sheared_next.begin() + first, kPoints, sheared.begin() + first);
    }
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
      fastest = std::max(fastest, std::sqrt(now[k].velocity.squaredNorm()) +
                                      bodies[k].radius * std::sqrt(now[k].rotation.squaredNorm()));
    // Half as much again for what speeds may grow within this step.
    moved += 1.5 * h * fastest;
    for (Pair& pair : pairs) touch(t, h, pair);
  }

  void touch(double t, double h, Pair& pair) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    const double reach = bodies[a].radius + bodies[b].radius;
    BoxManifold m;
    if ((now[a].centre - now[b].centre).squaredNorm() < reach * reach) m = press(box(a), box(b), pair.axis);
    pair.axis = m.axis;
    if (m.count == 0) {
      pair.crushed = 0.0;
      pair.sheared.setZero();
      return;
    }
    const inputs::Contact& law = scenario.contact;
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
      const Vector3d v = now[a].velocity_at(m.point[i]) - now[b].velocity_at(m.point[i]);
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
      return;
    }
    // Friction strains the bodies until they slide, as on the ground.
    const double reduced = bodies[a].mass * bodies[b].mass / (bodies[a].mass + bodies[b].mass);
    const double rub_damping = friction_damping(law, reduced);
    pair.sheared -= pair.sheared.dot(m.normal) * m.normal;
    pair.sheared += h / force * mean_slip;
    const double strained = law.stiffness * pair.sheared.norm(), most = law.friction * force;
    if (strained > most) pair.sheared *= most / strained;
    for (std::size_t i = 0; i < points; ++i) {
      const double part = pushes[i] / force;
      Vector3d rub = -part * (law.stiffness * pair.sheared + rub_damping * slip[i]);
      const double size = rub.norm(), limit = law.friction * pushes[i];
      if (size > limit) rub *= limit / size;
      const Vector3d normal = pushes[i] * m.normal;
      const Vector3d arm_a = m.point[i] - now[a].centre, arm_b = m.point[i] - now[b].centre;
      loads[a].push(IMPACT_NORMAL, normal, arm_a);
      loads[b].push(IMPACT_NORMAL, -normal, arm_b);
      loads[a].push(IMPACT_FRICTION, rub, arm_a);
      loads[b].push(IMPACT_FRICTION, -rub, arm_b);
    }
    note(t, h, pair, m, first_velocity, force);
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
      const double depth = std::max(pressed(truck, wheel(truck, left)), 0.0);
      e += 0.5 * bodies[car_of(truck)].spring * depth * depth;
    }
    return e;
  }
  double ground_energy() const {
    double e = 0.0;
    for (std::size_t car = 0; car < n; ++car) {
      for (std::size_t i = 0; i < kCorners; ++i) {
        const Vector3d place = corner(car, i);
        const double depth = ground_under(place, arc[car]).z - place.z();
        if (depth > 0.0) e += 0.5 * scenario.terrain.body_stiffness * depth * depth;
      }
    }
    return e;
  }

  /// Work of the last step's forces, by account, with the mean of the velocities before and after.
  void account(double h) {
    std::array<double, kAccounts> given{};
    for (std::size_t k = 0; k < n; ++k) {
      const SpatialMotion &was = before[k], &is = now[k];
      const Vector3d v = was.velocity + is.velocity, w = was.axes * (was.body_rates + is.body_rates);
      const Loads& sum = loads[k];
      for (std::size_t a = 0; a < kAccounts; ++a)
        if ((sum.used & 1U << a) != 0) given[a] += sum.of[a].force.dot(v) + sum.of[a].torque.dot(w);
    }
    for (std::size_t a = 0; a < kAccounts; ++a) record.spent.*kTaken[a] -= 0.5 * h * given[a];
  }

  void leave(double t, std::size_t truck, Cause cause, double* y) {
    const double stored = suspension_energy(truck);
    on_rails[truck] = false;
    overloaded[truck] = 0.0;
    // What the springs held up falls from the rails to the ground.
    record.spent.work_rails += stored - suspension_energy(truck);
    const std::size_t car = car_of(truck);
    const Vector3d p = now[car].point(truck_place(truck));
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
    const Vector3d across = now[car].axes.col(1);
    const auto kinetic = [&] {
      const SpatialMotion& q = now[car];
      return 0.5 * b.mass * q.velocity.squaredNorm() + 0.5 * q.body_rates.dot(b.inertia.cwiseProduct(q.body_rates));
    };
    const double kinetic_before = kinetic();
    y[SVX * n + car] += impulse / b.mass * across.x();
    y[SVY * n + car] += impulse / b.mass * across.y();
    y[SVZ * n + car] += impulse / b.mass * across.z();
    y[YAW_RATE * n + car] += impulse * arm / b.inertia.z();
    now[car] = motion_of(y, n, car);
    record.spent.work_kicks -= kinetic() - kinetic_before;
  }

  /// Finds all trucks on the track; those that have come to its broken or torn parts leave it.
  void pass(double t, double h, double* y) {
    const auto ahead = static_cast<std::size_t>(scenario.initial.cars_ahead);
    for (std::size_t k = ahead; k < n; ++k) past[k] = past[k] || now[k].centre.x() >= 0.0;
    for (std::size_t truck = 0; truck < 2 * n; ++truck) {
      const std::size_t car = car_of(truck);
      const SpatialMotion& q = now[car];
      const Vector3d own = truck_place(truck);
      const double x = q.centre.x() + q.axes.row(0).dot(own), from = arc[truck];
      arc[truck] = track.straight() ? x : track.foot({x, q.centre.y() + q.axes.row(1).dot(own)}, from);
      if (!on_rails[truck]) continue;
      const double s = arc[truck];
      if (car >= ahead && from < 0.0 && s >= 0.0) leave(t + h - h * s / (s - from), truck, Cause::pod, y);
      else if (s >= track.torn_from() && s <= track.torn_to() && track.torn(s))
        leave(t + h, truck, Cause::torn_track, y);
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
      } else if (!lost[truck] && carried == 0.0 && now[car_of(truck)].axes(2, 2) < cos_part) {
        record.spent.work_truck_damping += suspension_energy(truck);
        lost[truck] = true;
        any = true;
      }
    }
    for (std::size_t i = 0; i < alive.size(); ++i) any = break_coupler(t, i) || any;
    return any;
  }

  bool break_coupler(double t, std::size_t i) {
    if (!alive[i]) return false;
    using By = BrokenCoupler::By;
    const inputs::Coupler& law = scenario.coupler;
    const double force = axial[static_cast<Eigen::Index>(i)];
    const Stops& s = stops[i];
    By by = By::draft;
    if (-force > law.break_draft) by = By::draft;
    else if (s.swing > law.break_swing) by = By::swing;
    else if (s.moment > law.break_moment) by = By::moment;
    else if (s.height > law.slip_height) by = By::slip;
    else if (s.vertical > law.vertical_hold) by = By::vertical;
    else if (s.twist > law.break_twist) by = By::twist;
    else return false;
    const Bar b = bar(now[i], now[i + 1], i);
    record.spent.work_coupler_break += stop_energy_of(now[i], now[i + 1], b) + axial_energy_of(b);
    alive[i] = false;
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
  const auto n = static_cast<std::size_t>(car_count()), k = static_cast<std::size_t>(car);
  SpatialMotion m = motion_of(y, n, k);
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
    const Vector3d place = p.now[p.car_of(truck)].point(p.truck_place(truck));
    p.arc[truck] = p.track.nearest({place.x(), place.y()});
  }
  const auto ahead = static_cast<std::size_t>(p.scenario.initial.cars_ahead);
  for (std::size_t k = ahead; k < p.n; ++k) p.past[k] = p.now[k].centre.x() >= 0.0;
  for (std::size_t truck = 0; truck < 2 * p.n; ++truck) {
    if (p.car_of(truck) >= ahead && p.arc[truck] >= 0.0) p.leave(0.0, truck, Cause::pod, nullptr);
  }
  p.order_derailments();
  p.find_forces(0.0);
  p.note_peaks(0.0);
}

void SpatialModel::accelerations(double t, double h, const double* y, double* result) {
  Parts& p = *parts_;
  if (!p.forces_found) {
    p.load_motions(y);
    p.find_forces(t);
  }
  p.forces_found = false;
  p.contacts(t, h);
  const std::size_t n = p.n;
  for (std::size_t k = 0; k < n; ++k) {
    const Body& b = p.bodies[k];
    const SpatialMotion& q = p.now[k];
    const Wrench& sum = p.loads[k].sum;
    const Vector3d a = sum.force / b.mass;
    p.spin[k] = b.inertia.cwiseProduct(q.body_rates) + h * (q.axes.transpose() * sum.torque);
    const Vector3d turning = (mean_rates(b.inertia, p.spin[k], h) - q.body_rates) / h;
    for (std::size_t c = 0; c < 3; ++c) {
      result[c * n + k] = a[static_cast<Eigen::Index>(c)];
      result[(c + 3) * n + k] = turning[static_cast<Eigen::Index>(c)];
    }
  }
}

void SpatialModel::settle(double t, double h, const double* /*before*/, double* y) {
  Parts& p = *parts_;
  const std::size_t n = p.n;
  p.before.swap(p.now);
  for (std::size_t k = 0; k < n; ++k) {
    const auto at = [&](Column c) -> double& { return y[static_cast<std::size_t>(c) * n + k]; };
    const Eigen::Quaterniond turn = rotation_by({at(TURN_X), at(TURN_Y), at(TURN_Z)});
    const Vector3d rates = rates_of(p.bodies[k].inertia, p.spin[k], turn);
    at(ROLL_RATE) = rates.x();
    at(PITCH_RATE) = rates.y();
    at(YAW_RATE) = rates.z();
    Eigen::Quaterniond turned = Eigen::Quaterniond(at(QW), at(QX), at(QY), at(QZ)) * turn;
    // Of length 1 but for rounding, hence one round of Newton's.
    turned.coeffs() *= 1.5 - 0.5 * turned.squaredNorm();
    at(QX) = turned.x();
    at(QY) = turned.y();
    at(QZ) = turned.z();
    at(QW) = turned.w();
    at(TURN_X) = at(TURN_Y) = at(TURN_Z) = 0.0;
  }
  p.load_motions(y);
  p.account(h);
  p.note_blockage(h);
  p.keep_strain();
  p.pass(t, h, y);
  p.lateral_before.swap(p.lateral);
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
    o.swing_lead = b.yaw(0);
    o.swing_trail = b.yaw(1);
    o.pitch_lead = b.pitch(0);
    o.pitch_trail = b.pitch(1);
    o.broken = !p.alive[i];
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
    e.coupler_axial += p.axial_energy_of(b);
    e.coupler_swing += p.stop_energy_of(p.now[i], p.now[i + 1], b);
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
  archive.column("arc", p.arc);
  archive.column("overloaded", p.overloaded);
  archive.column("braked", p.braked);
  archive.value("ordered", p.ordered);
  archive.group("track", [&] { p.track.walk(archive); });
  archive.value("moved", p.moved);
  archive.numbers("sheared", p.sheared.data()->data(), static_cast<std::ptrdiff_t>(3 * p.sheared.size()));
  archive.list("by_x", p.by_x, [&](int& car) { archive.value("car", car); });
  archive.list("pairs", p.pairs, [&](Pair& pair) {
    archive.value("a", pair.a);
    archive.value("b", pair.b);
    archive.value("axis", pair.axis);
    archive.value("crushed", pair.crushed);
    archive.column("sheared", pair.sheared);
    archive.value("impact", pair.impact);
    archive.value("seen", pair.seen);
  });
  if (!archive.restoring()) return;
  for (std::size_t k = 0; k < p.n; ++k) {
    const auto first = p.sheared.begin() + static_cast<std::ptrdiff_t>(kPoints * k);
    p.lies[k] = std::any_of(first, first + kPoints, [](const Vector3d& v) { return !v.isZero(0.0); });
  }
  p.load_motions(y);
  p.find_forces(t);
}

}  // namespace train_derail::model
