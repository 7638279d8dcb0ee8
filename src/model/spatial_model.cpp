#include "train_derail/model/spatial_model.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "model/air_brakes.hpp"
#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "model/seen_places.hpp"
#include "model/spatial_cars.hpp"
#include "model/spatial_contacts.hpp"
#include "model/spatial_couplers.hpp"
#include "model/spatial_ground.hpp"
#include "model/spatial_kernels.hpp"
#include "model/spatial_trucks.hpp"
#include "model/traction.hpp"
#include "simd/instruction_sets.hpp"
#include "train_derail/model/extended_model.hpp"
#include "train_derail/model/spatial_bed.hpp"

namespace train_derail::model {

namespace {

using Eigen::Vector3d;

constexpr double kTremor = 30.0;    // speed at which bodies that keep still may tremble, over terrain.rest_speed
constexpr double kBalanced = 1e-4;  // sum of forces on a car that nothing sets in motion, over its weight
constexpr double kStray = 0.25;     // how far they may come meanwhile, over that speed times Rest::kTime

constexpr Versions<ExtendedKernels> kVersions TRAIN_DERAIL_VERSIONS(kExtended);
constexpr Versions<SpatialKernels> kSpatialVersions TRAIN_DERAIL_VERSIONS(kSpatial);

}  // namespace

/// The parts, and the order in which they act.
struct SpatialModel::Parts final : Waker {
  Parts(SpatialModel& owner, const inputs::Scenario& s, const std::string& instruction_set)
      : scenario(s),
        loops(*kVersions.choose(owner.car_count(), instruction_set)),
        cars(scenario, owner.cars(), *kSpatialVersions.choose(owner.car_count(), instruction_set)),
        bed(scenario),
        brakes(scenario, owner.cars(), loops),
        ground(cars, bed),
        trucks(cars, owner.cars(), bed, brakes, loops, record),
        locomotives(locomotives_of(scenario, owner.cars())),
        couplers(cars, owner.cars(), brakes, record, *this),
        contacts(cars, record, *this),
        seen(owner.cars().size()) {
    SpatialArrays& a = cars.arrays;
    a.rails = &scenario.rails;
    a.spring = scenario.suspension.stiffness;
    a.half_base = scenario.suspension.half_base;
    a.brake_stiffness = scenario.terrain.body_stiffness;
    a.grade = scenario.track.grade / std::sqrt(1.0 + scenario.track.grade * scenario.track.grade);
    a.brake_share = brakes.share().data();
  }

  const inputs::Scenario scenario;
  const ExtendedKernels& loops;
  Record record;
  SpatialCars cars;
  SpatialBed bed;
  AirBrakes brakes;
  SpatialGround ground;
  SpatialTrucks trucks;
  std::vector<Locomotive> locomotives;
  SpatialCouplers couplers;
  SpatialContacts contacts;
  SeenPlaces seen;
  std::vector<std::size_t> still;  // cars that lie down at the end of this step
  bool forces_found = false;

  /// All forces in the state but those between bodies, which depend on the length of the step.
  void find_forces(double t) {
    cars.now = t;
    ++cars.round;
    brakes.prepare(t);
    cars.fastest = cars.wide.swirls(cars.arrays, cars.state, cars.radius(), cars.swirl.data(), cars.spinning);
    couplers.pull();
    trucks.find_ground();
    cars.wide.forces(cars.arrays, cars.state);
    cars.accounts.clear();
    for (std::size_t k = 0; k < cars.n; ++k)
      if (!cars.rest.lies(k)) ground.press_body(k, trucks.arc(k));
    pull_on(t);
    couplers.couple_all();
    forces_found = true;
  }

  /// Locomotives on the rails pull at the top of the rails, forward, until the emergency signal comes to them.
  void pull_on(double t) {
    for (Locomotive& l : locomotives) {
      const auto k = static_cast<std::size_t>(l.car);
      const SpatialMotion& q = cars.at(k);
      l.find(t < brakes.signal(l.car) && !trucks.off(k), q.velocity.dot(q.axes.col(0)));
      if (l.pull == 0.0) continue;
      const Vector3d pull = l.pull * q.axes.col(0), arm = -cars.bodies[k].centre_height * q.axes.col(2);
      cars.push(k, ON_TRACK, {pull, arm.cross(pull)});
    }
  }

  void wake_if_pushed(std::size_t car, double change) override {
    if (change > Rest::kPush * cars.bodies[car].weight) wake(car);
  }
  /// A car that lay moves from this step on.
  void wake(std::size_t car) {
    cars.rest.wake(car);
    ground.press_body(car, trucks.arc(car));
    trucks.release(car);
    contacts.resume(car);
    if (car > 0) couplers.couple(car - 1);
    if (car + 1 < cars.n) couplers.couple(car);
  }

  /// Nothing pulls at it or lets go of it later.
  bool stands(std::size_t car) const {
    const auto pulls = [car](const Locomotive& l) { return static_cast<std::size_t>(l.car) == car && l.pull != 0.0; };
    // One that has slid until it stood is still at the limit of its brakes.
    const bool balanced = cars.of_car(cars.force.data(), car).norm() < kBalanced * cars.bodies[car].weight;
    return (trucks.held_by_brakes(car) || (balanced && !trucks.grounded(car))) &&
           std::none_of(locomotives.begin(), locomotives.end(), pulls);
  }

  /// It may tremble: bodies that are pressed together do, and those that lie on an edge of the ground.
  bool trembles(std::size_t car, double limit) const {
    // Cars that roll on are told by the first of these.
    return std::abs(cars.state[SVX * cars.n + car]) < kTremor * limit && cars.swirl[car] < kTremor * limit &&
           cars.velocity(car).norm() < kTremor * limit;
  }
  /// No point of a car that trembles has come far since it was seen first.
  bool keeps_still(std::size_t car, double limit) {
    const SpatialMotion& now = cars.at(car);
    if (cars.rest.still_for(car) > 0.0 && seen.way(car, now, cars.bodies[car].radius) < kStray * Rest::kTime * limit)
      return true;
    seen.see(car, now);
    return cars.rest.still_for(car) == 0.0;
  }

  /// Cars that have been slow enough for long enough, off the rails or held by their brakes. Forces are known.
  void find_still(double h) {
    const double limit = scenario.terrain.rest_speed;
    still.clear();
    if (!(limit > 0.0)) return;
    for (std::size_t k = 0; k < cars.n; ++k) {
      if (cars.rest.lies(k)) continue;
      // Most cars are too fast: whether they stand, which costs more, is asked of the others only.
      const bool still_now = trembles(k, limit) && (trucks.grounded(k) || stands(k)) && keeps_still(k, limit);
      if (cars.rest.note(k, still_now, h)) still.push_back(k);
    }
  }
  /// Friction takes what motion those that lie down have left.
  void lay_still(double* y) {
    if (still.empty()) return;
    for (const std::size_t k : still) {
      double EnergyLedger::*spent = trucks.off(k) ? &EnergyLedger::work_off_track : &EnergyLedger::work_on_track;
      record.spent.*spent += cars.bodies[k].kinetic(cars.at(k));
      for (const std::size_t column : {SVX, SVY, SVZ, ROLL_RATE, PITCH_RATE, YAW_RATE}) y[column * cars.n + k] = 0.0;
      trucks.hold(k);
      contacts.hold(k);
      for (const std::size_t i : {k - 1, k}) couplers.hold(i);
      cars.accounts.clear(k);
      cars.rest.lay(k);
    }
    still.clear();
    cars.look_anew(y);
  }
  /// Cars that lie do not move.
  void hold_still(double* accelerations) {
    if (!cars.rest.any()) return;
    const std::size_t n = cars.n;
    for (std::size_t k = 0; k < n; ++k) {
      if (!cars.rest.lies(k)) continue;
      for (std::size_t column = 0; column < 6; ++column) accelerations[column * n + k] = 0.0;
      for (std::size_t column = 0; column < 3; ++column) cars.spin[column * n + k] = 0.0;
    }
  }

  bool give_way(double t, double h, double* y) {
    const bool trucks_have = trucks.give_way(t, h);
    if (trucks_have) part_trucks(y);
    return couplers.give_way(t) || trucks_have;
  }
  /// Cars that have lost both trucks go on without them.
  void part_trucks(double* y) {
    for (std::size_t k = 0; k < cars.n; ++k) {
      if (!trucks.lost_both(k)) continue;
      const double before = cars.stored(k);
      if (!bare(k, true)) continue;
      cars.move_centre(y, k, cars.rise(k));
      record.spent.work_trucks += before - cars.stored(k);
    }
  }
  bool bare(std::size_t car, bool without) {
    const bool changed = cars.bare(car, without);
    if (changed) ground.find_corners(car);
    return changed;
  }

  /// Of the centre of mass, in any state.
  SpatialMotion motion(const double* y, std::size_t k) const {
    const std::size_t n = cars.n;
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

  /// What the cars that stand push against the first that is off the rails.
  void note_blockage(double h) {
    const std::size_t standing = trucks.standing();
    if (standing == cars.n || standing == 0 || !trucks.off(standing - 1) || couplers.broken(standing - 1)) return;
    const double force = std::max(couplers.axial()[static_cast<Eigen::Index>(standing - 1)], 0.0);
    record.incidents.blockage_impulse += h * force;
    record.incidents.blockage_time += h;
    record.incidents.blockage_peak = std::max(record.incidents.blockage_peak, force);
  }

  /// A car that stands in the plane, on rails that rise and tilt.
  SpatialMotion on_rails_at(std::size_t car, const CarMotion& flat) const {
    const Body& b = cars.bodies[car];
    const auto rails_at = [&](double arm) { return bed.profile.at(bed.track.nearest(flat.centre + arm * flat.axis)); };
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
};

std::vector<std::string> SpatialModel::instruction_sets(Eigen::Index cars) { return kSpatialVersions.names(cars); }

SpatialModel::SpatialModel(const inputs::Scenario& scenario, const std::string& instruction_set)
    : TrainModel(scenario), parts_(std::make_unique<Parts>(*this, scenario, instruction_set)) {
  if (scenario.track.grades.empty() || parts_->locomotives.empty()) return;
  // Locomotives have held the train on the grades where it begins, too.
  const StateVector first = initial_state();
  double uphill = 0.0;
  for (Eigen::Index k = 0; k < car_count(); ++k) uphill += at(k).weight * motion(first.data(), k).axes(2, 0);
  parts_->locomotives = locomotives_of(scenario, cars(), uphill);
}

SpatialModel::~SpatialModel() = default;

SpatialMotion SpatialModel::motion(const double* y, Eigen::Index car) const {
  const auto k = static_cast<std::size_t>(car);
  return lifted(parts_->motion(y, k), -parts_->cars.rise(k));
}

void SpatialModel::place(double* y, Eigen::Index car, const SpatialMotion& whole) const {
  const Eigen::Index n = car_count();
  const SpatialMotion m = lifted(whole, parts_->cars.rise(static_cast<std::size_t>(car)));
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
    if (!parts_->bed.profile.flat()) {
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
  p.cars.look_anew(y);
  p.trucks.start();
  p.find_forces(0.0);
  p.couplers.note_peaks(0.0);
}

void SpatialModel::accelerations(double t, double h, const double* y, double* result) {
  Parts& p = *parts_;
  p.cars.state = y;
  if (p.cars.rest.all()) {
    std::fill_n(result, position_count(), 0.0);
    return;
  }
  if (!p.forces_found) p.find_forces(t);
  p.forces_found = false;
  p.contacts.press_all(t, h);
  p.find_still(h);
  p.cars.wide.accelerate(p.cars.arrays, y, h, result);
  p.hold_still(result);
}

void SpatialModel::settle(double t, double h, const double* before, double* y) {
  Parts& p = *parts_;
  if (p.cars.rest.all()) {
    // Nothing moves any more, and no force changes.
    p.note_blockage(h);
    return;
  }
  p.cars.swap_axes();
  p.cars.wide.turn(p.cars.arrays, y);
  p.cars.look(y);
  p.cars.account(h, before, y, p.record.spent);
  p.note_blockage(h);
  p.trucks.keep_strain();
  p.ground.keep_strain();
  p.lay_still(y);
  p.trucks.pass(t, h, y);
  p.trucks.keep_lateral();
  p.find_forces(t + h);
  if (p.give_way(t + h, h, y)) p.find_forces(t + h);
  p.couplers.note_peaks(t + h);
  p.trucks.order_derailments();
}

Observation SpatialModel::observe(const double* y) const {
  const Parts& p = *parts_;
  Observation seen;
  seen.cars.resize(p.cars.n);
  std::vector<SpatialMotion> cars(p.cars.n);
  for (std::size_t k = 0; k < p.cars.n; ++k) {
    const auto car = static_cast<Eigen::Index>(k);
    cars[k] = p.motion(y, k);
    const SpatialMotion q = motion(y, car);
    CarObservation& o = seen.cars[k];
    const Eigen::Quaterniond turn(q.axes);
    o.x = q.centre.x();
    o.y = q.centre.y();
    o.z = q.centre.z() - at(car).centre_height;
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
      const std::size_t truck = p.cars.truck_of(k, front);
      const Vector3d place = cars[k].point(p.cars.truck_place(truck));
      const TrackPlace by_track = track_place(car, {place.x(), place.y()});
      const double height = place.z() - p.bed.profile.at(by_track.s).height;
      (front ? o.front_truck : o.rear_truck) = TruckPlace{by_track.s, by_track.offset, height, p.trucks.load(truck)};
    }
    o.past_pod = past_pod(car);
    o.derailed = derailed(car);
    o.cause = cause(car);
  }
  for (std::size_t i = 0; i < p.couplers.count(); ++i)
    seen.couplers.push_back(p.couplers.observe(cars[i], cars[i + 1], i));
  return seen;
}

PlanColumns SpatialModel::plan(const double* y) const {
  plan_.resize(car_count(), 5);
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    const SpatialMotion q = motion(y, k);
    plan_.row(k) << q.centre.x(), q.centre.y(), q.velocity.x(), q.velocity.y(), q.rotation.z();
  }
  const auto column = [&](Eigen::Index c) { return plan_.col(c).data(); };
  return {column(0), column(1), column(2), column(3), column(4)};
}

std::optional<SpaceColumns> SpatialModel::in_space(const double* y) const {
  in_space_.resize(car_count(), 7);
  Vector3d velocity_before = Vector3d::Zero(), pin_before = Vector3d::Zero();
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    const SpatialMotion q = motion(y, k);
    const Car& car = at(k);
    const auto velocity = [&q](const Vector3d& station) {
      return Vector3d(q.velocity + q.rotation.cross(q.axes * station));
    };
    const Vector3d below(0.0, 0.0, -car.centre_height), front(0.5 * car.truck_spacing, 0.0, 0.0);
    const Vector3d pin(0.5 * car.length, 0.0, coupler_law().height - car.centre_height), behind(-pin.x(), 0.0, pin.z());
    const Vector3d middle = q.point(below);
    const double speed_squared = std::max(velocity(below + front).squaredNorm(), velocity(below - front).squaredNorm());
    in_space_.row(k) << middle.x(), middle.y(), q.axes(0, 0), q.axes(1, 0), speed_squared, 0.0, 0.0;
    if (k > 0) {
      in_space_(k - 1, 5) = (pin_before - velocity(pin)).squaredNorm();
      in_space_(k - 1, 6) = (velocity_before - q.velocity).squaredNorm();
    }
    pin_before = velocity(behind);
    velocity_before = q.velocity;
  }
  const auto column = [&](Eigen::Index c) { return in_space_.col(c).data(); };
  return SpaceColumns{column(0), column(1), column(2), column(3), column(4), column(5), column(6)};
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
  const auto k = static_cast<std::size_t>(car);
  const Body& b = parts_->cars.bodies[k];
  const SpatialMotion q = parts_->motion(y, k);
  const Vector3d centre = q.point(b.box_centre);
  Footprint f{{centre.x(), centre.y()}, car_motion(y, car).axis, 0.0, 0.0};
  const auto half_extent = [&](const Vector2& u) { return b.half_extent(q.axes.topRows<2>().transpose() * u); };
  f.half_length = half_extent(f.axis);
  f.half_width = half_extent(f.side());
  return f;
}

std::optional<Attitude> SpatialModel::attitude(const double* y, Eigen::Index car) const {
  const auto k = static_cast<std::size_t>(car);
  const Body& b = parts_->cars.bodies[k];
  const SpatialMotion q = parts_->motion(y, k);
  const Vector3d centre = q.point(b.box_centre);
  // Above the rails beside it, which rise and fall on a grade.
  const auto above_rails = [&](const Vector3d& p) {
    return p.z() - parts_->bed.profile.at(track_place(car, {p.x(), p.y()}).s).bed;
  };
  double lowest = inputs::kInfinity;
  SpatialGround::each_point(
      b, q, [&](const Vector3d& place, double radius) { lowest = std::min(lowest, above_rails(place) - radius); });
  return Attitude{std::acos(std::clamp(q.axes(2, 2), -1.0, 1.0)), above_rails(centre), lowest};
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
    const auto k = static_cast<std::size_t>(i);
    const SpatialMotion lead = parts_->motion(y, k), trail = parts_->motion(y, k + 1);
    const Bar b = parts_->couplers.bar(lead, trail, k);
    gap[i] = b.gap;
    rate[i] = b.rate(lead, trail);
  }
}

bool SpatialModel::derailed(Eigen::Index car) const { return parts_->trucks.off(static_cast<std::size_t>(car)); }
bool SpatialModel::past_pod(Eigen::Index car) const { return parts_->trucks.past(static_cast<std::size_t>(car)); }
Cause SpatialModel::cause(Eigen::Index car) const { return parts_->trucks.cause(static_cast<std::size_t>(car)); }
bool SpatialModel::straight_track() const { return parts_->bed.track.straight(); }
const Incidents* SpatialModel::incidents() const { return &parts_->record.incidents; }
const ArrayX* SpatialModel::axial_forces() const { return &parts_->couplers.axial(); }

TrackPlace SpatialModel::track_place(Eigen::Index car, const Vector2& point) const {
  if (straight_track()) return TrainModel::track_place(car, point);
  const double s = parts_->bed.track.foot(point, parts_->trucks.arc(static_cast<std::size_t>(car)));
  const Track::Node n = parts_->bed.track.at(s);
  return {s, (point - n.point).dot(Vector2(-n.tangent.y(), n.tangent.x())), n.tangent};
}

Eigen::Vector4d SpatialModel::wheel_loads(Eigen::Index car) const {
  const SpatialTrucks& t = parts_->trucks;
  const auto front = static_cast<std::size_t>(car), rear = parts_->cars.n + front;
  return 0.5 * Eigen::Vector4d(t.load(front) - t.leaning(front), t.load(front) + t.leaning(front),
                               t.load(rear) - t.leaning(rear), t.load(rear) + t.leaning(rear));
}

std::int64_t SpatialModel::force_rounds() const { return parts_->cars.round; }

bool SpatialModel::truck_lost(Eigen::Index car, bool front) const {
  return parts_->trucks.lost(parts_->cars.truck_of(static_cast<std::size_t>(car), front));
}

EnergyLedger SpatialModel::energy(const double* y) const {
  const Parts& p = *parts_;
  EnergyLedger e = p.record.spent;
  std::vector<SpatialMotion> cars(p.cars.n);
  for (std::size_t k = 0; k < p.cars.n; ++k) {
    const SpatialMotion& q = cars[k] = p.motion(y, k);
    const Body& b = p.cars.bodies[k];
    e.kinetic_translation += 0.5 * b.mass * q.velocity.squaredNorm();
    e.kinetic_rotation += 0.5 * q.body_rates.dot(b.inertia.cwiseProduct(q.body_rates));
    e.height += b.weight * (q.centre.z() - b.centre_height);
    e.suspension += p.trucks.energy(k, q) + p.trucks.energy(p.cars.n + k, q) + p.ground.energy(k, q, p.trucks.arc(k));
  }
  for (std::size_t i = 0; i < p.couplers.count(); ++i) {
    if (p.couplers.broken(i)) continue;
    const Bar b = p.couplers.bar(cars[i], cars[i + 1], i);
    e.coupler_axial += p.couplers.axial_energy_of(b);
    e.coupler_swing += p.couplers.stop_energy_of(cars[i], cars[i + 1], b, i);
  }
  return e;
}

SpatialMomentum SpatialModel::momentum(const double* y) const {
  SpatialMomentum sum;
  for (std::size_t k = 0; k < parts_->cars.n; ++k) {
    const SpatialMotion q = parts_->motion(y, k);
    const Body& b = parts_->cars.bodies[k];
    sum.linear += b.mass * q.velocity;
    sum.angular += b.mass * q.centre.cross(q.velocity) + q.axes * b.inertia.cwiseProduct(q.body_rates);
  }
  return sum;
}

void SpatialModel::walk(double t, const double* y, files::Archive& archive) {
  Parts& p = *parts_;
  archive.group("record", [&] { p.record.walk(archive); });
  archive.group("brakes", [&] { p.brakes.walk(archive); });
  archive.group("track", [&] { p.bed.track.walk(archive); });
  archive.group("rest", [&] {
    p.cars.rest.walk(archive);
    p.seen.walk(archive);
  });
  archive.group("ground", [&] { p.ground.walk(archive); });
  archive.group("trucks", [&] { p.trucks.walk(archive); });
  archive.group("couplers", [&] { p.couplers.walk(archive); });
  archive.group("contacts", [&] { p.contacts.walk(archive); });
  if (!archive.restoring()) return;
  if (!(p.scenario.terrain.rest_speed > 0.0)) p.cars.rest.wake_all();
  for (std::size_t k = 0; k < p.cars.n; ++k) p.bare(k, p.trucks.lost_both(k));
  p.cars.look_anew(y);
  p.trucks.restored();
  p.find_forces(t);
}

}  // namespace train_derail::model
