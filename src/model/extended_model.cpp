#include "train_derail/model/extended_model.hpp"

#include <algorithm>
#include <cmath>

#include "model/air_brakes.hpp"
#include "model/contacts.hpp"
#include "model/couplers.hpp"
#include "model/derailment_start.hpp"
#include "model/extended_kernels.hpp"
#include "model/planar_rest.hpp"
#include "model/planar_rolling.hpp"
#include "model/rolled_away.hpp"
#include "model/traction.hpp"
#include "model/trucks.hpp"
#include "simd/instruction_sets.hpp"
#include "train_derail/model/draft_gear_law.hpp"

namespace train_derail::model {

namespace {

constexpr Versions<ExtendedKernels> kVersions TRAIN_DERAIL_VERSIONS(kExtended);

}  // namespace

std::vector<std::string> ExtendedModel::instruction_sets(Eigen::Index cars) { return kVersions.names(cars); }

struct ExtendedModel::Parts {
  const ExtendedKernels& loops;
  Record record;
  AirBrakes brakes;
  Couplers couplers;
  Trucks trucks;
  PlanarRest rest;
  PlanarRolling rolling;
  const inputs::Track track;
  std::unique_ptr<Contacts> contacts;  // null: bodies pass through each other
  std::unique_ptr<Traction> traction;  // null: locomotives coast
  const bool front_first;              // the truck that is off first
  const bool still;                    // the first car has no lateral motion at the start
  std::vector<Part*> all;              // in the order in which they act
  ExtendedArrays arrays;

  Parts(const PlanarModel& train, const PlanarArrays& cars, const inputs::Scenario& s, const ExtendedKernels& kernels)
      : loops(kernels),
        brakes(s, train.cars(), loops),
        couplers(train, s.coupler, brakes, record),
        trucks(train, cars, s, loops, brakes, record),
        rest(s.ground, train.cars(), couplers, trucks.arrays()),
        rolling(s, train.cars(), cars, couplers, trucks, rest),
        track(s.track),
        front_first(starts_with_front(s)),
        still(starts_on_ties(s)),
        all{&brakes, &couplers, &trucks} {
    if (s.contact.law != inputs::ContactLaw::none) {
      contacts =
          std::make_unique<Contacts>(s.contact, train.cars(), s.ground.regularization_speed, loops, record, rest);
      all.push_back(contacts.get());
    }
    if (s.traction.law == inputs::TractionLaw::steady) {
      traction = std::make_unique<Traction>(s, train.cars(), brakes, trucks, record);
      all.push_back(traction.get());
    }
    static_cast<PlanarArrays&>(arrays) = cars;
    arrays.grade = s.track.grade / std::sqrt(1.0 + s.track.grade * s.track.grade);
    arrays.rails_on = trucks.rails_on();
    arrays.by_slip = s.ground.off_track_law == inputs::OffTrackLaw::by_slip;
    arrays.straight = trucks.track().straight();
    arrays.brake_share = brakes.share().data();
    arrays.couplers = couplers.arrays();
    arrays.trucks = trucks.arrays();
    arrays.busy = &rest.busy().cars();
    arrays.rolling = &rolling.cars();
    trucks.look_at(rest.busy());
  }
};

ExtendedModel::ExtendedModel(const inputs::Scenario& scenario, const std::string& instruction_set)
    : PlanarModel(scenario),
      parts_(
          std::make_unique<Parts>(*this, planar_arrays(), scenario, *kVersions.choose(car_count(), instruction_set))) {
  for (auto* a : {&fx_, &fy_, &moment_}) *a = ArrayX::Zero(car_count());
  ExtendedArrays& arrays = parts_->arrays;
  arrays.ground = &ground_;
  arrays.rails = &parts_->trucks.rails();
  arrays.ties = parts_->trucks.ties().on() ? &parts_->trucks.ties().law() : nullptr;
  arrays.fx = fx_.data();
  arrays.fy = fy_.data();
  arrays.moment = moment_.data();
}

ExtendedModel::~ExtendedModel() = default;

const PlanarKernels& ExtendedModel::loops() const { return parts_->loops; }

StateVector ExtendedModel::initial_state() const {
  StateVector state = PlanarModel::initial_state();
  if (!parts_->trucks.rails_on()) return state;
  const Track& track = parts_->trucks.track();
  MotionMap m = motion(state.data(), car_count());
  // The front truck of the first car to derail has come to the point of derailment; the car turns about its rear truck,
  // which still stands on the rails.
  const Eigen::Index first = initial_.cars_ahead;
  m.col(X) -= half_spacing_[first];
  if (parts_->still) m(first, OMEGA) = 0.0;
  m(first, VY) = m(first, OMEGA) * (parts_->front_first ? half_spacing_[first] : -half_spacing_[first]);
  if (initial_.mechanism == inputs::Mechanism::train_forces) squeeze(m.col(X));
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    // Both truck centres on the rails, the car moving along them.
    const auto on_rails_at = [&](double s) {
      const Track::Node n = track.at(s);
      return Vector2(n.point + track.alignment(s) * Vector2(-n.tangent.y(), n.tangent.x()));
    };
    const double s_front = m(k, X) + half_spacing_[k], s_rear = m(k, X) - half_spacing_[k], step = 0.01;
    const Vector2 front = on_rails_at(s_front), rear = on_rails_at(s_rear);
    const Vector2 front_velocity = initial_.speed / step * (on_rails_at(s_front + step) - front);
    const Vector2 rear_velocity = initial_.speed / step * (on_rails_at(s_rear + step) - rear);
    const Vector2 chord = front - rear, centre = 0.5 * (front + rear),
                  velocity = 0.5 * (front_velocity + rear_velocity);
    const Vector2 turning = front_velocity - rear_velocity, across(-chord.normalized().y(), chord.normalized().x());
    const double swing_out = m(k, VY);
    m(k, X) = centre.x();
    m(k, Y) = centre.y();
    m(k, THETA) = std::atan2(chord.y(), chord.x());
    m(k, VX) = velocity.x() + swing_out * across.x();
    m(k, VY) = velocity.y() + swing_out * across.y();
    m(k, OMEGA) += (chord.x() * turning.y() - chord.y() * turning.x()) / chord.squaredNorm();
  }
  return state;
}

void ExtendedModel::squeeze(Eigen::Ref<ArrayX> x) const {
  const Eigen::Index first = initial_.cars_ahead, couplers = coupler_count();
  const auto closer = [&](Eigen::Index i) {  // by how much the cars of a coupler are than at mid-slack
    const auto share = i < first ? static_cast<double>(i + 1) / static_cast<double>(first)
                                 : static_cast<double>(couplers - i) / static_cast<double>(couplers - first);
    const double shift = 0.5 * coupler_.slack + draft_gear_excess(coupler_, share * std::abs(initial_.buff_force));
    return initial_.buff_force < 0.0 ? -shift : shift;
  };
  double shift = 0.0;
  for (Eigen::Index k = first + 1; k <= couplers; ++k) x[k] += shift += closer(k - 1);
  shift = 0.0;
  for (Eigen::Index k = first - 1; k >= 0; --k) x[k] -= shift += closer(k);
}

void ExtendedModel::start(const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  cos_ = q.col(THETA).cos();
  sin_ = q.col(THETA).sin();
  parts_->loops.places(parts_->arrays, y, parts_->trucks.place_x(), parts_->trucks.place_y());
  parts_->trucks.start(y);
  find_forces(0.0, y);
  parts_->couplers.note_peaks(0.0);
}

void ExtendedModel::walk(double t, const double* y, files::Archive& archive) {
  archive.column("cosine", cos_);
  archive.column("sine", sin_);
  archive.group("record", [&] { parts_->record.walk(archive); });
  archive.group("brakes", [&] { parts_->brakes.walk(archive); });
  archive.group("couplers", [&] { parts_->couplers.walk(archive); });
  archive.group("trucks", [&] { parts_->trucks.walk(archive); });
  if (parts_->contacts) archive.group("contacts", [&] { parts_->contacts->walk(archive); });
  archive.group("rest", [&] { parts_->rest.walk(archive); });
  archive.group("rolling", [&] { parts_->rolling.walk(archive); });
  if (archive.restoring()) find_forces(t, y);
}

void ExtendedModel::find_forces(double t, const double* y) {
  for (Part* part : parts_->all) part->prepare(t);
  parts_->couplers.found(parts_->loops.forces(parts_->arrays, y));
  forces_found_ = true;
}

void ExtendedModel::accelerations(double t, double h, const double* y, double* result) {
  if (!forces_found_) find_forces(t, y);
  forces_found_ = false;
  const PlanColumns q = plan(y);
  const CarColumns cars{q.x, q.y, cos_.data(), sin_.data(), q.vx, q.vy, q.omega};
  const Wrenches sum{fx_.data(), fy_.data(), moment_.data()};
  parts_->rest.begin(sum);
  for (Part* part : parts_->all) part->add(t, h, cars, sum);
  parts_->rest.hold(h, cars, sum);
  parts_->rest.look(h, cars);
  parts_->loops.accelerate(parts_->arrays, result);
  parts_->rest.still(h, result);
}

void ExtendedModel::settle(double t, double h, const double* before, double* y) {
  Parts& p = *parts_;
  p.loops.work(p.arrays, before, y, h, p.record.spent);
  const auto columns = [&](const double* state) {
    const PlanColumns q = plan(state);
    return CarColumns{q.x, q.y, cos_.data(), sin_.data(), q.vx, q.vy, q.omega};
  };
  for (Part* part : p.all) part->account(h, columns(before), columns(y));
  note_blockage(h);
  p.record.spent.work_off_track += p.rest.lay(y);

  p.loops.turn(p.arrays, before, y);
  p.loops.places(p.arrays, y, p.trucks.place_x(), p.trucks.place_y());
  const Step step{t, h, before, y};
  p.trucks.pass(step);
  p.trucks.locate();
  p.record.spent.work_rails += p.rolling.look(h, y, p.contacts.get());
  p.trucks.keep_lateral();
  find_forces(step.end(), y);
  bool gave_way = false;
  for (Part* part : p.all) gave_way = part->give_way(step) || gave_way;
  if (gave_way) find_forces(step.end(), y);
  p.rest.keep({fx_.data(), fy_.data(), moment_.data()});
  p.couplers.note_peaks(step.end());
  p.trucks.order_derailments();
  const Eigen::Index n = car_count();
  work(y, n)[WORK_ON_TRACK] = p.record.spent.work_on_track;
  work(y, n)[WORK_OFF_TRACK] = p.record.spent.work_off_track;
}

void ExtendedModel::note_blockage(double h) {
  // Once their coupler has broken, the two sides have nothing to do with each other.
  const Eigen::Index standing = parts_->trucks.standing();
  if (standing <= 0 || broken(standing - 1)) return;
  const double force = std::max(parts_->couplers.axial()[standing - 1], 0.0);
  Incidents& incidents = parts_->record.incidents;
  incidents.blockage_impulse += h * force;
  incidents.blockage_time += h;
  incidents.blockage_peak = std::max(incidents.blockage_peak, force);
}

bool ExtendedModel::rolls(Eigen::Index car) const { return parts_->rolling.rolls(car); }
bool ExtendedModel::derailed(Eigen::Index car) const { return parts_->trucks.derailed(car); }
bool ExtendedModel::past_pod(Eigen::Index car) const { return parts_->trucks.past_pod(car); }
Cause ExtendedModel::cause(Eigen::Index car) const { return parts_->trucks.cause(car); }
bool ExtendedModel::broken(Eigen::Index i) const { return parts_->couplers.broken(i); }
bool ExtendedModel::straight_track() const { return parts_->trucks.track().straight(); }
const Incidents* ExtendedModel::incidents() const { return &parts_->record.incidents; }
const ArrayX* ExtendedModel::axial_forces() const { return &parts_->couplers.axial(); }

TrackPlace ExtendedModel::track_place(Eigen::Index car, const Vector2& point) const {
  return straight_track() ? PlanarModel::track_place(car, point) : parts_->trucks.place(car, point);
}

CouplerState<double> ExtendedModel::coupler_between(const CarMotion& lead, const CarMotion& trail,
                                                    Eigen::Index i) const {
  const Vector2 rate = lead_pin(lead, i).velocity - trail_pin(trail, i).velocity;
  return parts_->couplers.state(PlanarModel::coupler_between(lead, trail, i), rate, i);
}

Eigen::Index ExtendedModel::gone(const double* y) const {
  const Parts& p = *parts_;
  return rolled_away({cars_, p.track, p.couplers, p.trucks, p.brakes}, plan(y));
}

EnergyLedger ExtendedModel::energy(const double* y) const {
  const EnergyLedger moving = kinetic_energy(y);
  EnergyLedger e = parts_->record.spent;
  e.kinetic_translation = moving.kinetic_translation;
  e.kinetic_rotation = moving.kinetic_rotation;
  parts_->couplers.add_energy(y, e);
  return e;
}

}  // namespace train_derail::model
