#include "model/trucks.hpp"

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "model/derailment_order.hpp"
#include "model/derailment_start.hpp"
#include "model/truck_parts.hpp"
#include "train_derail/inputs/extent.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"

namespace train_derail::model {

namespace {

/// Calls body(from, count) for each of them.
template <class Body>
void for_ranges(const BusyCars& busy, const Body& body) {
  for (const CarRange* r = busy.ranges; r != busy.ranges + busy.count; ++r) body(r->from, r->to - r->from);
}

}  // namespace

Trucks::Trucks(const PlanarModel& train, const PlanarArrays& cars, const inputs::Scenario& scenario,
               const ExtendedKernels& loops, AirBrakes& brakes, Record& record)
    : train_(train),
      cars_(cars),
      loops_(loops),
      rails_(scenario.rails),
      rails_on_(scenario.ground.on_track_law == inputs::OnTrackLaw::rails),
      mechanism_(scenario.initial.mechanism),
      front_first_(starts_with_front(scenario)),
      ahead_(scenario.initial.cars_ahead),
      brakes_(brakes),
      record_(record),
      ties_(scenario, train.cars(), record),
      track_(scenario, inputs::track_extent(scenario).from, inputs::track_extent(scenario).to),
      patches_(scenario.ground.patches),
      past_pod_(train.cars().size(), false),
      first_cause_(train.cars().size(), Cause::none),
      cause_(2 * train.cars().size(), Cause::none),
      bad_places_(bad_places(scenario, train.cars().size())) {
  const Eigen::Index n = train.car_count();
  for (auto* a : {&ground_load_, &kick_, &arc_, &new_arc_, &bed_offset_, &overloaded_, &offset_, &tangent_y_, &load_,
                  &holding_load_, &rail_damping_, &px_, &py_, &lateral_before_}) {
    *a = ArrayX::Zero(2 * n);
  }
  kept_ = ArrayX::Zero(2 * n * TruckParts::kept);
  for (auto* a : {&on_track_, &tangent_x_, &patch_}) *a = ArrayX::Ones(2 * n);
  const inputs::Perturbation& perturbation = scenario.initial.perturbation;
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(perturbation.seed) ^ 0x61c5e1ULL);
  boost::random::normal_distribution<double> normal;
  for (Eigen::Index k = 0; k < n; ++k) {
    const Car& car = train.cars()[static_cast<std::size_t>(k)];
    for (const End end : {FRONT, REAR}) {
      load_[truck(k, end)] = 0.5 * car.weight;
      holding_load_[truck(k, end)] = holding_load(rails_, 0.5 * car.weight, car.weight);
      ground_load_[truck(k, end)] = 0.5 * friction_weight(scenario.ground, car.weight);
      rail_damping_[truck(k, end)] = rail_damping(rails_, car.mass);
      kick_[truck(k, end)] = perturbation.kick * normal(generator);
    }
  }
}

TruckArrays Trucks::arrays() {
  TruckArrays a;
  a.on_track = on_track_.data();
  a.offset = offset_.data();
  a.tangent_x = tangent_x_.data();
  a.tangent_y = tangent_y_.data();
  a.load = load_.data();
  a.rail_damping = rail_damping_.data();
  a.patch = patch_.data();
  a.ground_load = ground_load_.data();
  ties_.show(a);
  a.kept = kept_.data();
  return a;
}

const double* Trucks::lateral() const { return kept_.data() + TruckParts::first<RailHold>() * px_.size(); }

void Trucks::keep_lateral() {
  for_ranges(*busy_trucks_, [this](Eigen::Index from, Eigen::Index count) {
    std::copy_n(lateral() + from, count, &lateral_before_[from]);
  });
}

bool Trucks::derailed(Eigen::Index car) const {
  return rails_on_ ? !on_rails(truck(car, FRONT)) || !on_rails(truck(car, REAR)) : past_pod(car);
}

TrackPlace Trucks::place(Eigen::Index car, const Vector2& point) const {
  const double s = track_.foot(point, arc_[truck(car, FRONT)]);
  const Track::Node n = track_.at(s);
  return {s, (point - n.point).dot(Vector2(-n.tangent.y(), n.tangent.x())), n.tangent};
}

void Trucks::start(const double* y) {
  for (Eigen::Index i = 0; i < px_.size(); ++i) arc_[i] = track_.nearest({px_[i], py_[i]});
  pass_pod(y);
  find_places();
  if (rails_on_) start_derailment();
  order_derailments();
  locate();
  find_standing();
}

void Trucks::find_places() {
  if (track_.straight()) return;
  loops_.locate(cars_.cars, *busy_, track_.line(), px_.data(), py_.data(), arc_.data(),
                {new_arc_.data(), bed_offset_.data(), tangent_x_.data(), tangent_y_.data()});
}

void Trucks::start_derailment() {
  const Cause cause = cause_of(mechanism_);
  const Eigen::Index first = truck(ahead_, front_first_ ? FRONT : REAR);
  for (Eigen::Index i = 0; i < px_.size(); ++i) {
    const bool at_pod = mechanism_ == inputs::Mechanism::broken_rail && car_of(i) >= ahead_ && !(arc_[i] < 0.0);
    if (!at_pod && (mechanism_ == inputs::Mechanism::broken_rail || i != first)) continue;
    cause_[static_cast<std::size_t>(i)] = cause;
    on_track_[i] = 0.0;
    record_.incidents.derailments.push_back({0.0, car_of(i), i < cars_.cars, cause, px_[i], py_[i]});
    if (ties_.on() && cause != Cause::pod) ties_.begin(0.0, i, 0.0);
  }
}

void Trucks::locate() {
  const Eigen::Index trucks = px_.size();
  for_ranges(*busy_trucks_, [this](Eigen::Index from, Eigen::Index count) {
    arc_.segment(from, count) = now().segment(from, count);
    offset_.segment(from, count) = (track_.straight() ? py_ : bed_offset_).segment(from, count);
  });
  // Patches lie along and across the track, wherever its rails have moved to.
  for (Eigen::Index i = 0; i < trucks && !patches_.empty(); ++i)
    patch_[i] = patch_factor(patches_, arc_[i], offset_[i]);
  if (rails_on_ && !track_.aligned())
    loops_.subtract_alignment(*busy_trucks_, track_.alignments(), arc_.data(), on_track_.data(), offset_.data());
  drifted_off_.clear();
  for (const Eigen::Index i : ties_.running()) {
    if (ties_.drift(i, offset_[i], load_[i])) drifted_off_.push_back(i);
  }
}

void Trucks::pass(const Step& step) {
  pass_pod(step.after);
  find_places();
  if (!rails_on_) return;
  if (!ties_.running().empty()) run_on_ties(step);
  leave_bad_track(step);
}

void Trucks::pass_pod(const double* y) {
  const double* x = train_.plan(y).x;
  for_ranges(*busy_, [this, x](Eigen::Index from, Eigen::Index count) {
    for (Eigen::Index k = std::max(from, ahead_); k < from + count; ++k) {
      if (x[k] >= 0.0 && !past_pod(k)) pass_pod(k);
    }
  });
}

void Trucks::pass_pod(Eigen::Index car) {
  past_pod_[static_cast<std::size_t>(car)] = true;
  if (!rails_on_) on_track_[truck(car, FRONT)] = on_track_[truck(car, REAR)] = 0.0;
}

double Trucks::lateral_share(Eigen::Index car) const {
  const auto share = [this](Eigen::Index i) {
    return std::abs(lateral()[i]) / (rails_.derail_ratio * holding_load_[i]);
  };
  return std::max(share(truck(car, FRONT)), share(truck(car, REAR)));
}

bool Trucks::clear(Eigen::Index car, double way, double bend) const {
  for (const Eigen::Index i : {truck(car, FRONT), truck(car, REAR)}) {
    const double s = arc_[i];
    if (s > track_.torn_from() - way && s < track_.torn_to() + way) return false;
    if (car >= ahead_ && std::abs(s - bad_places_[static_cast<std::size_t>(i)]) < way) return false;
    if (!track_.straight() && track_.kinks_between(s - way, s + way, bend)) return false;
  }
  return true;
}

PathPoint Trucks::seat_truck(Eigen::Index i, double s) {
  const Track::Node node = track_.at(s);
  const Vector2 left(-node.tangent.y(), node.tangent.x());
  const Track::Deviation rails = track_.deviation(s);
  const PathPoint path{node.point + rails.offset * left, node.tangent + rails.slope * left, rails.bend};
  px_[i] = path.place.x();
  py_[i] = path.place.y();
  arc_[i] = s;
  offset_[i] = overloaded_[i] = 0.0;
  if (track_.straight()) return path;
  tangent_x_[i] = node.tangent.x();
  tangent_y_[i] = node.tangent.y();
  new_arc_[i] = s;
  bed_offset_[i] = rails.offset;
  return path;
}

TruckPath Trucks::seat(Eigen::Index car, const Vector2& centre) {
  const double s = track_.foot(centre, 0.5 * (front_arc(car) + rear_arc(car))), d = cars_.half_spacing[car];
  TruckPath path{seat_truck(truck(car, FRONT), s + d), seat_truck(truck(car, REAR), s - d)};
  if (!track_.straight()) {
    const Vector2 ahead = tangent(car), behind(tangent_x_[truck(car, REAR)], tangent_y_[truck(car, REAR)]);
    const double curvature = (behind.x() * ahead.y() - behind.y() * ahead.x()) / (2.0 * d);
    path.front.bend += curvature;
    path.rear.bend += curvature;
  }
  if (car >= ahead_ && centre.x() >= 0.0 && !past_pod(car)) pass_pod(car);
  return path;
}

void Trucks::set_lateral(Eigen::Index car, double front, double rear) {
  const auto set = [this](Eigen::Index i, double force) {
    kept_[TruckParts::first<RailHold>() * px_.size() + i] = lateral_before_[i] = force;
  };
  set(truck(car, FRONT), front);
  set(truck(car, REAR), rear);
}

void Trucks::leave_bad_track(const Step& step) {
  const Eigen::Index trucks = px_.size();
  // Most steps nothing happens: find that out for all trucks together.
  const OnBadTrack bad = loops_.on_bad_track(*busy_trucks_, on_track_.data(), arc_.data(), now().data(),
                                             track_.torn_from(), track_.torn_to());
  const bool anything =
      bad.passes || passes_bad_place() ||
      (bad.may_be_torn && loops_.any_torn(*busy_trucks_, track_.torn_bins(), now().data(), on_track_.data()));
  if (!anything) return;
  bool left = false;
  for (Eigen::Index i = 0; i < trucks; ++i) {
    if (!on_rails(i)) continue;
    const double s = now()[i], from = arc_[i];
    arc_[i] = s;
    const double bad_place = bad_places_[static_cast<std::size_t>(i)];
    if (car_of(i) >= ahead_ && from < bad_place && s >= bad_place)
      leave(step.end() - step.length * (s - bad_place) / (s - from), i, cause_of(mechanism_), step.after);
    else if (track_.torn(s)) leave(step.end(), i, Cause::torn_track, step.after);
    else continue;
    left = true;
  }
  if (left) find_standing();
}

bool Trucks::passes_bad_place() const {
  if (mechanism_ != inputs::Mechanism::bad_track) return false;  // the loops find the others
  for (Eigen::Index i = 0; i < px_.size(); ++i) {
    const double place = bad_places_[static_cast<std::size_t>(i)];
    if (on_track_[i] > 0.0 && arc_[i] < place && now()[i] >= place) return true;
  }
  return false;
}

void Trucks::run_on_ties(const Step& step) {
  const std::vector<Eigen::Index> running = ties_.running();  // some of them may end
  for (const Eigen::Index i : running) {
    const double s = now()[i];
    const TieRuns::Met met = ties_.run(i, arc_[i], s);
    arc_[i] = s;
    const double t = step.time + met.share * step.length;
    if (met.parted) brakes_.part(t, car_of(i));
    if (met.thrown) leave_bed(t, i, TieRun::End::obstacle, step.after);
  }
}

void Trucks::leave_bed(double t, Eigen::Index truck, TieRun::End by, double* y) {
  ties_.end(t, truck, by);
  track_.tear(arc_[truck]);
  if (by == TieRun::End::obstacle) push_sideways(truck, ties_.throw_speed(truck), y);
}

bool Trucks::give_way(const Step& step) {
  for (const Eigen::Index i : drifted_off_) leave_bed(step.end(), i, TieRun::End::drift, step.after);
  const bool drifted = !drifted_off_.empty();
  drifted_off_.clear();
  return leave_overloaded(step) || drifted;
}

bool Trucks::leave_overloaded(const Step& step) {
  if (!rails_on_ || !loops_.overload(*busy_trucks_, rails_, step.length, lateral_before_.data(), lateral(),
                                     holding_load_.data(), overloaded_.data()))
    return false;
  bool left = false;
  for (Eigen::Index i = 0; i < px_.size(); ++i) {
    if (!on_rails(i) || overloaded_[i] <= rails_.derail_time) continue;
    const double t = derail_moment(rails_, lateral_before_[i], lateral()[i], holding_load_[i], step.end(), step.length,
                                   overloaded_[i]);
    leave(t, i, Cause::lateral, step.after);
    left = true;
  }
  if (!left) return false;
  find_standing();
  locate();
  return true;
}

void Trucks::leave(double t, Eigen::Index truck, Cause cause, double* y) {
  const Eigen::Index car = car_of(truck);
  cause_[static_cast<std::size_t>(truck)] = cause;
  on_track_[truck] = 0.0;
  overloaded_[truck] = 0.0;
  record_.incidents.derailments.push_back({t, car, truck < cars_.cars, cause, px_[truck], py_[truck]});
  if (ties_.on() && (cause == Cause::bad_track || cause == Cause::defect)) {
    ties_.begin(t, truck, 0.0);
    return;
  }
  track_.tear(arc_[truck]);
  if (cause == Cause::pod || cause == Cause::bad_track) push_sideways(truck, kick_[truck], y);
}

// An impulse at the truck, across the car, that changes the truck's velocity by `speed`.
void Trucks::push_sideways(Eigen::Index truck, double speed, double* y) {
  if (speed == 0.0) return;
  MotionMap q = motion(y, cars_.cars);
  const Eigen::Index car = car_of(truck);
  const double arm = truck < cars_.cars ? cars_.half_spacing[car] : -cars_.half_spacing[car];
  const double impulse = speed / (cars_.inverse_mass[car] + arm * arm * cars_.inverse_inertia[car]);
  const auto kinetic = [&] {
    const Car& c = train_.cars()[static_cast<std::size_t>(car)];
    return 0.5 * c.mass * (q(car, VX) * q(car, VX) + q(car, VY) * q(car, VY)) +
           0.5 * c.yaw_inertia * q(car, OMEGA) * q(car, OMEGA);
  };
  const double before = kinetic();
  q(car, VX) -= impulse * cars_.inverse_mass[car] * cars_.sine[car];
  q(car, VY) += impulse * cars_.inverse_mass[car] * cars_.cosine[car];
  q(car, OMEGA) += impulse * arm * cars_.inverse_inertia[car];
  record_.spent.work_kicks -= kinetic() - before;
}

void Trucks::find_standing() {
  standing_ = -1;
  for (Eigen::Index k = cars_.cars - 1; k >= ahead_ && !derailed(k); --k) standing_ = k;
  if (standing_ > 0 && !derailed(standing_ - 1)) standing_ = -1;
}

void Trucks::order_derailments() { order_new(record_.incidents.derailments, ordered_, first_cause_); }

void Trucks::walk(files::Archive& archive) {
  archive.flags("past_pod", past_pod_);
  archive.list("first_cause", first_cause_, [&](Cause& c) { archive.value("cause", c); });
  archive.list("cause", cause_, [&](Cause& c) { archive.value("cause", c); });
  archive.value("standing", standing_);
  archive.value("ordered", ordered_);
  archive.column("arc", arc_);
  archive.column("overloaded", overloaded_);
  archive.column("on_track", on_track_);
  archive.column("offset", offset_);
  archive.column("tangent_x", tangent_x_);
  archive.column("tangent_y", tangent_y_);
  archive.column("patch", patch_);
  archive.column("place_x", px_);
  archive.column("place_y", py_);
  archive.group("ties", [&] { ties_.walk(archive); });
  archive.column("new_arc", new_arc_);
  archive.column("bed_offset", bed_offset_);
  archive.group("track", [&] { track_.walk(archive); });
}

}  // namespace train_derail::model
