#include "model/spatial_trucks.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "model/derailment_order.hpp"
#include "model/derailment_start.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"

namespace train_derail::model {

using Eigen::Vector3d;

namespace {

constexpr double kHeld = 0.99;  // of the force at which brakes slide: below that they hold

}  // namespace

SpatialTrucks::SpatialTrucks(SpatialCars& cars, const std::vector<Car>& train, SpatialBed& bed, AirBrakes& brakes,
                             const ExtendedKernels& loops, Record& record)
    : cars_(cars),
      bed_(bed),
      brakes_(brakes),
      loops_(loops),
      record_(record),
      ties_(cars.scenario, train, record),
      bad_places_(bad_places(cars.scenario, cars.n)),
      cos_part_(cars.scenario.suspension.part_angle < M_PI ? std::cos(cars.scenario.suspension.part_angle) : -2.0) {
  const std::size_t n = cars.n, trucks = 2 * n;
  for (const Body& b : cars.bodies) {
    rail_dampings_.push_back(rail_damping(cars.scenario.rails, b.mass));
    ground_share_.push_back(friction_weight(cars.scenario.ground, b.weight) / b.weight);
    rail_share_.push_back(holding_load(cars.scenario.rails, 1.0, b.weight));
  }
  lost_.assign(trucks, false);
  past_.assign(n, false);
  first_cause_.assign(n, Cause::none);
  cause_.assign(trucks, Cause::none);
  for (auto* a : {&arc_,     &offset_,      &overloaded_, &lifted_,       &lateral_,  &lateral_before_, &kick_,
                  &braked_,  &braked_next_, &load_,       &leaning_,      &brake_,    &damper_,         &rocker_,
                  &place_x_, &place_y_,     &load_held_,  &leaning_held_, &grounded_, &holding_load_})
    a->assign(trucks, 0.0);
  for (auto* a : {&sheared_, &sheared_next_, &under_}) a->assign(6 * trucks, 0.0);
  for (auto* a : {&pushed_damped_, &rubbed_}) a->assign(6 * n, 0.0);
  feet_.assign(2 * trucks, 0.0);
  for (std::size_t truck = 0; truck < trucks; ++truck) grip_.push_back(ground_share_[cars.car_of(truck)]);
  on_rails_.assign(trucks, 1.0);
  tangent_x_.assign(trucks, 1.0);
  tangent_y_.assign(trucks, 0.0);
  if (!bed.profile.flat())
    for (auto* a : {&rail_height_, &rail_slope_, &rail_tilt_, &rail_twist_}) a->assign(trucks, 0.0);
  const inputs::Perturbation& p = cars.scenario.initial.perturbation;
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(p.seed) ^ 0x61c5e1ULL);
  boost::random::normal_distribution<double> normal;
  for (std::size_t k = 0; k < n; ++k) {
    for (const std::size_t truck : {k, n + k}) kick_[truck] = p.kick * normal(generator);
  }
  show();
}

void SpatialTrucks::show() {
  SpatialArrays& a = cars_.arrays;
  a.straight = bed_.track.straight();
  a.flat = bed_.profile.flat();
  a.rail_damping = rail_dampings_.data();
  a.on_rails = on_rails_.data();
  a.offset = offset_.data();
  a.tangent_x = tangent_x_.data();
  a.tangent_y = tangent_y_.data();
  a.rail_height = rail_height_.data();
  a.rail_slope = rail_slope_.data();
  a.rail_tilt = rail_tilt_.data();
  a.rail_twist = rail_twist_.data();
  a.load = load_.data();
  a.leaning = leaning_.data();
  a.brake = brake_.data();
  a.damper = damper_.data();
  a.rocker = rocker_.data();
  a.lateral = lateral_.data();
  a.ground = &cars_.scenario.ground;
  a.section = bed_.section_all_along();
  a.level_ground = bed_.level();
  a.grounded = grounded_.data();
  a.load_held = load_held_.data();
  a.leaning_held = leaning_held_.data();
  a.grip = grip_.data();
  a.under = under_.data();
  a.pushed_damped = pushed_damped_.data();
  a.rubbed = rubbed_.data();
  a.ties = ties_.on() ? &ties_.law() : nullptr;
  ties_.show(a);
  show_strain();
}

void SpatialTrucks::show_strain() {
  SpatialArrays& a = cars_.arrays;
  a.braked = braked_.data();
  a.braked_next = braked_next_.data();
  a.sheared = sheared_.data();
  a.sheared_next = sheared_next_.data();
}

void SpatialTrucks::start() {
  const std::size_t n = cars_.n;
  cars_.wide.places(cars_.arrays, cars_.state, place_x_.data(), place_y_.data());
  for (std::size_t truck = 0; truck < 2 * n; ++truck)
    arc_[truck] = bed_.track.nearest({place_x_[truck], place_y_[truck]});
  const inputs::Mechanism mechanism = cars_.scenario.initial.mechanism;
  const auto ahead = static_cast<std::size_t>(cars_.scenario.initial.cars_ahead);
  for (std::size_t k = ahead; k < n; ++k) past_[k] = cars_.at(k).centre.x() >= 0.0;
  const bool broken_rail = mechanism == inputs::Mechanism::broken_rail;
  const std::size_t first = cars_.truck_of(ahead, starts_with_front(cars_.scenario));
  for (std::size_t truck = 0; truck < 2 * n; ++truck) {
    if (broken_rail ? cars_.car_of(truck) >= ahead && arc_[truck] >= 0.0 : truck == first)
      leave(0.0, truck, cause_of(mechanism), nullptr);
  }
  order_derailments();
  find_standing();
  find_offsets();
}

void SpatialTrucks::find_ground() {
  if (cars_.arrays.section != nullptr && cars_.scenario.ground.patches.empty()) return;
  for (const std::size_t truck : loose_)
    if (grounded_[truck] != 0.0) find_ground_under(truck);
}

void SpatialTrucks::find_ground_under(std::size_t truck) {
  const std::vector<inputs::GroundPatch>& patches = cars_.scenario.ground.patches;
  const std::size_t car = cars_.car_of(truck), wheels = 4 * cars_.n;
  if (!patches.empty()) grip_[truck] = ground_share_[car] * patch_factor(patches, arc_[truck], offset_[truck]);
  if (cars_.arrays.section != nullptr) return;
  const SpatialMotion& q = cars_.at(car);
  for (const bool left : {false, true}) {
    const std::size_t number = (left ? 2 * cars_.n : 0) + truck;
    const Under found = bed_.ground(wheel(q, truck, left), arc_[truck], 2.0 * cars_.bodies[car].radius, feet_[number]);
    under_[number] = found.z;
    under_[wheels + number] = found.up.x();
    under_[2 * wheels + number] = found.up.y();
  }
}

void SpatialTrucks::find_grounded(std::size_t car) {
  for (const std::size_t truck : {car, cars_.n + car})
    grounded_[truck] = on_ground(truck) && !lost_[truck] && !cars_.rest.lies(car) ? 1.0 : 0.0;
}

/// Loops that skip a car leave what they have found of it.
void SpatialTrucks::forget_taken(std::size_t car) {
  for (std::size_t c = 0; c < 6; ++c) pushed_damped_[c * cars_.n + car] = rubbed_[c * cars_.n + car] = 0.0;
}

bool SpatialTrucks::held_by_brakes(std::size_t car) const {
  const double share = brakes_.share()[static_cast<Eigen::Index>(car)];
  const auto held = [&](std::size_t truck) {
    const double drag = derailed(truck) ? ties_.law().drag : share;
    return !on_ground(truck) && std::abs(brake_[truck]) < kHeld * drag * load_[truck];
  };
  return held(car) && held(cars_.n + car);
}

void SpatialTrucks::hold(std::size_t car) {
  const std::size_t trucks = 2 * cars_.n;
  for (const std::size_t truck : {car, cars_.n + car}) {
    grounded_[truck] = 0.0;
    for (std::size_t c = 0; c < 6; ++c) sheared_next_[c * trucks + truck] = sheared_[c * trucks + truck];
    if (!on_ground(truck)) continue;
    load_held_[truck] = load_[truck];
    leaning_held_[truck] = leaning_[truck];
  }
  forget_taken(car);
}

void SpatialTrucks::release(std::size_t car) {
  find_grounded(car);
  for (const std::size_t truck : {car, cars_.n + car}) {
    load_held_[truck] = leaning_held_[truck] = 0.0;
    if (!on_ground(truck)) continue;
    load_[truck] = leaning_[truck] = 0.0;
    if (grounded_[truck] != 0.0) find_ground_under(truck);
  }
  press_trucks_of(cars_.arrays, cars_.state, static_cast<std::ptrdiff_t>(car));
}

void SpatialTrucks::keep_strain() {
  braked_.swap(braked_next_);
  sheared_.swap(sheared_next_);
  show_strain();
}

void SpatialTrucks::keep_lateral() {
  lateral_before_.swap(lateral_);
  cars_.arrays.lateral = lateral_.data();
}

double SpatialTrucks::energy(std::size_t truck, const SpatialMotion& q) const {
  if (lost_[truck]) return 0.0;
  const Body& b = cars_.bodies[cars_.car_of(truck)];
  double e = 0.0;
  for (const bool left : {false, true}) {
    const Vector3d place = wheel(q, truck, left);
    const double ground = !on_ground(truck) ? bed_.rails(place, arc_[truck]) : bed_.ground(place, arc_[truck]).z;
    const double depth = std::max(b.sag - (place.z() - ground), 0.0);
    e += 0.5 * b.spring * depth * depth;
  }
  return e;
}

void SpatialTrucks::leave(double t, std::size_t truck, Cause cause, double* y) {
  const std::size_t car = cars_.car_of(truck);
  const Vector3d p = cars_.at(car).point(cars_.truck_place(truck));
  cause_[truck] = cause;
  overloaded_[truck] = lateral_[truck] = braked_[truck] = 0.0;
  record_.incidents.derailments.push_back({t, static_cast<Eigen::Index>(car), truck < cars_.n, cause, p.x(), p.y()});
  const bool first_of_train_forces = cause == Cause::lateral && t == 0.0;
  if (ties_.on() && (cause == Cause::bad_track || cause == Cause::defect || first_of_train_forces)) {
    ties_.begin(t, static_cast<Eigen::Index>(truck), 0.0);
    return;
  }
  drop(truck);
  if (cause == Cause::pod || cause == Cause::bad_track) push_sideways(truck, kick_[truck], y);
}

void SpatialTrucks::drop(std::size_t truck) {
  const std::size_t car = cars_.car_of(truck);
  const SpatialMotion& q = cars_.at(car);
  const double stored = energy(truck, q);
  cars_.rest.wake(car);  // before forces are found again
  on_rails_[truck] = 0.0;
  for (const std::size_t both : {car, cars_.n + car}) load_held_[both] = leaning_held_[both] = 0.0;
  find_grounded(car);
  loose_.insert(std::lower_bound(loose_.begin(), loose_.end(), truck), truck);
  // What the springs held up falls from the rails to the ground.
  record_.spent.work_rails += stored - energy(truck, q);
  bed_.track.tear(arc_[truck]);
}

void SpatialTrucks::leave_bed(double t, std::size_t truck, TieRun::End by, double* y) {
  const auto i = static_cast<Eigen::Index>(truck);
  ties_.end(t, i, by);
  lateral_[truck] = braked_[truck] = 0.0;
  drop(truck);
  if (by == TieRun::End::obstacle) push_sideways(truck, ties_.throw_speed(i), y);
}

/// In a step of length h from t on.
void SpatialTrucks::run_on_ties(double t, double h, std::size_t truck, double* y) {
  const TieRuns::Met met = ties_.run(static_cast<Eigen::Index>(truck), arc_before_[truck], arc_[truck]);
  const double moment = t + met.share * h;
  if (met.parted) brakes_.part(moment, static_cast<Eigen::Index>(cars_.car_of(truck)));
  if (met.thrown) leave_bed(moment, truck, TieRun::End::obstacle, y);
}

void SpatialTrucks::drift(double t) {
  const std::vector<Eigen::Index> running = ties_.running();  // some of them may end
  for (const Eigen::Index i : running) {
    const auto truck = static_cast<std::size_t>(i);
    if (!ties_.drift(i, offset_[truck], load_[truck])) continue;
    leave_bed(t, truck, TieRun::End::drift, nullptr);
    offset_[truck] += bed_.track.alignment(arc_[truck]);
  }
}

/// An impulse at the truck, in the plane, across the car, that changes the truck's velocity by `speed`.
void SpatialTrucks::push_sideways(std::size_t truck, double speed, double* y) {
  if (speed == 0.0 || y == nullptr) return;
  const std::size_t n = cars_.n, car = cars_.car_of(truck);
  const Body& b = cars_.bodies[car];
  const double arm = cars_.arm_of(truck);
  const double impulse = speed / (1.0 / b.mass + arm * arm / b.inertia.z());
  const Vector3d across = cars_.at(car).axes.col(1);
  const double kinetic_before = b.kinetic(cars_.at(car));
  y[SVX * n + car] += impulse / b.mass * across.x();
  y[SVY * n + car] += impulse / b.mass * across.y();
  y[SVZ * n + car] += impulse / b.mass * across.z();
  y[YAW_RATE * n + car] += impulse * arm / b.inertia.z();
  cars_.look_anew(y);
  record_.spent.work_kicks -= b.kinetic(cars_.at(car)) - kinetic_before;
}

void SpatialTrucks::pass(double t, double h, double* y) {
  Track& track = bed_.track;
  const std::size_t n = cars_.n;
  const auto ahead = static_cast<std::size_t>(cars_.scenario.initial.cars_ahead);
  const double* x = cars_.state + SX * n;
  for (std::size_t k = ahead; k < n; ++k)
    if (x[k] >= 0.0) past_[k] = true;
  cars_.wide.places(cars_.arrays, cars_.state, place_x_.data(), place_y_.data());
  if (track.straight()) {
    arc_before_.swap(arc_);
    arc_ = place_x_;
  } else {
    arc_before_ = arc_;
    for (std::size_t truck = 0; truck < 2 * n; ++truck)
      if (!cars_.rest.lies(cars_.car_of(truck)))
        arc_[truck] = track.foot({place_x_[truck], place_y_[truck]}, arc_[truck]);
  }
  const LeavingPlaces places{arc_before_.data(), arc_.data(), bad_places_.data(), track.torn_from(), track.torn_to()};
  const bool any = !ties_.running().empty() || cars_.wide.may_leave(cars_.arrays, places);
  for (std::size_t truck = 0; any && truck < 2 * n; ++truck) {
    if (on_ground(truck)) continue;
    if (derailed(truck)) {
      run_on_ties(t, h, truck, y);
      continue;
    }
    const double from = arc_before_[truck], s = arc_[truck], bad_place = bad_places_[truck];
    if (from < bad_place && s >= bad_place && cars_.car_of(truck) >= ahead)
      leave(t + h - h * (s - bad_place) / (s - from), truck, cause_of(cars_.scenario.initial.mechanism), y);
    else if (s >= track.torn_from() && s <= track.torn_to() && track.torn(s)) leave(t + h, truck, Cause::torn_track, y);
  }
  find_offsets();
  drift(t + h);
}

/// Of all trucks at their arc lengths.
void SpatialTrucks::find_offsets() {
  const Track& track = bed_.track;
  const std::size_t trucks = 2 * cars_.n;
  if (track.straight()) {
    offset_ = place_y_;
  } else {
    for (std::size_t truck = 0; truck < trucks; ++truck) {
      if (on_ground(truck) && cars_.rest.lies(cars_.car_of(truck))) continue;
      const Track::Node node = track.at(arc_[truck]);
      tangent_x_[truck] = node.tangent.x();
      tangent_y_[truck] = node.tangent.y();
      offset_[truck] =
          (place_y_[truck] - node.point.y()) * node.tangent.x() - (place_x_[truck] - node.point.x()) * node.tangent.y();
    }
  }
  for (std::size_t truck = 0; truck < rail_height_.size(); ++truck) {
    if (on_ground(truck)) continue;
    const TrackProfile::Place along = bed_.profile.at(arc_[truck]);
    rail_height_[truck] = along.height;
    rail_slope_[truck] = along.slope;
    rail_tilt_[truck] = along.tilt;
    rail_twist_[truck] = along.twist;
  }
  if (!track.aligned()) {
    const CarRange all{0, static_cast<std::ptrdiff_t>(trucks)};
    loops_.subtract_alignment({&all, 1}, track.alignments(), arc_.data(), on_rails_.data(), offset_.data());
  }
}

bool SpatialTrucks::give_way(double t, double h) {
  const std::size_t n = cars_.n;
  const inputs::Rails& rails = cars_.scenario.rails;
  const CarRange all{0, static_cast<std::ptrdiff_t>(2 * n)};
  const bool any_lifted = find_holding_load();
  bool any = loops_.overload({&all, 1}, rails, h, lateral_before_.data(), lateral_.data(), holding_load_.data(),
                             overloaded_.data());
  for (std::size_t truck = 0; any && truck < 2 * n; ++truck) {
    if (derailed(truck) || overloaded_[truck] <= rails.derail_time) continue;
    leave(t, truck, Cause::lateral, nullptr);
    offset_[truck] += bed_.track.alignment(arc_[truck]);
  }
  if (any_lifted || lifted_before_) any |= lift(t, h);
  lifted_before_ = any_lifted;
  for (const std::size_t truck : loose_) {
    const std::size_t car = cars_.car_of(truck);
    if (load_[truck] > 0.0 || lost_[truck] || cars_.rest.lies(car)) continue;
    if (cars_.axes[8 * n + car] >= cos_part_) continue;
    record_.spent.work_trucks += energy(truck, cars_.at(car));
    lost_[truck] = true;
    find_grounded(car);
    forget_taken(car);
    any = true;
  }
  return any;
}

/// Also by the weight of its car. Whether a truck on the rails does not stand on both.
bool SpatialTrucks::find_holding_load() {
  const bool any_lifted = cars_.wide.holding(cars_.arrays, holding_load_.data());
  if (cars_.scenario.rails.load_exponent != 1.0) {
    for (std::size_t truck = 0; truck < holding_load_.size(); ++truck)
      holding_load_[truck] *= rail_share_[cars_.car_of(truck)];
  }
  return any_lifted;
}

bool SpatialTrucks::lift(double t, double h) {
  const inputs::Rails& rails = cars_.scenario.rails;
  if (rails.flange_height == inputs::kInfinity || rails.derail_ratio == inputs::kInfinity) return false;
  bool any = false;
  for (std::size_t truck = 0; truck < 2 * cars_.n; ++truck) {
    const bool both_press = load_[truck] > std::abs(leaning_[truck]);
    if (both_press || derailed(truck) || height_of_wheels(truck) <= rails.flange_height) {
      lifted_[truck] = 0.0;
      continue;
    }
    lifted_[truck] += h;
    if (lifted_[truck] <= rails.derail_time) continue;
    leave(t, truck, Cause::lateral, nullptr);
    offset_[truck] += bed_.track.alignment(arc_[truck]);
    any = true;
  }
  return any;
}

/// Of the side that is higher, above the rail [m].
double SpatialTrucks::height_of_wheels(std::size_t truck) const {
  const SpatialMotion& q = cars_.at(cars_.car_of(truck));
  const double sag = cars_.bodies[cars_.car_of(truck)].sag;
  double most = -inputs::kInfinity;
  for (const bool left : {false, true}) {
    const Vector3d place = wheel(q, truck, left);
    most = std::max(most, place.z() - bed_.rails(place, arc_[truck]) - sag);
  }
  return most;
}

void SpatialTrucks::order_derailments() {
  if (order_new(record_.incidents.derailments, ordered_, first_cause_)) find_standing();
}

void SpatialTrucks::find_standing() {
  const auto ahead = static_cast<std::size_t>(cars_.scenario.initial.cars_ahead);
  standing_ = cars_.n;
  while (standing_ > ahead && !off(standing_ - 1)) --standing_;
}

void SpatialTrucks::walk(files::Archive& archive) {
  archive.column("on_rails", on_rails_);
  archive.flags("lost", lost_);
  archive.flags("past", past_);
  archive.list("first_cause", first_cause_, [&](Cause& c) { archive.value("cause", c); });
  archive.list("cause", cause_, [&](Cause& c) { archive.value("cause", c); });
  archive.column("arc", arc_);
  // Of cars that lie these are not found again.
  archive.column("offset", offset_);
  archive.column("tangent_x", tangent_x_);
  archive.column("tangent_y", tangent_y_);
  archive.column("load_held", load_held_);
  archive.column("leaning_held", leaning_held_);
  archive.column("overloaded", overloaded_);
  archive.column("lifted", lifted_);
  archive.column("braked", braked_);
  archive.column("feet", feet_);
  archive.column("sheared", sheared_);
  archive.value("ordered", ordered_);
  archive.group("ties", [&] { ties_.walk(archive); });
}

void SpatialTrucks::restored() {
  loose_.clear();
  for (std::size_t truck = 0; truck < 2 * cars_.n; ++truck)
    if (on_ground(truck)) loose_.push_back(truck);
  lifted_before_ = true;
  sheared_next_ = sheared_;
  show_strain();
  for (std::size_t car = 0; car < cars_.n; ++car) {
    find_grounded(car);
    if (cars_.rest.lies(car)) continue;
    load_held_[car] = leaning_held_[car] = load_held_[cars_.n + car] = leaning_held_[cars_.n + car] = 0.0;
  }
  find_standing();
  cars_.wide.places(cars_.arrays, cars_.state, place_x_.data(), place_y_.data());
  find_offsets();
}

}  // namespace train_derail::model
