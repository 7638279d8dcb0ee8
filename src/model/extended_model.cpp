#include "train_derail/model/extended_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "model/contacts.hpp"
#include "model/extended_kernels.hpp"
#include "model/instruction_sets.hpp"
#include "train_derail/inputs/extent.hpp"
#include "train_derail/model/brake_law.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"
#include "wide.hpp"

namespace train_derail::model {

namespace {

/// Whether a truck that the rails hold has come from before the point of derailment to past it, and whether one stands
/// where track may be torn.
struct OnBadTrack {
  bool passes, may_be_torn;
};
TRAIN_DERAIL_WIDE OnBadTrack on_bad_track(Eigen::Index n, const double* held, const double* before, const double* now,
                                          double from, double to) {
  double passes = 0.0, torn = 0.0;
#pragma omp simd reduction(+ : passes, torn)
  for (Eigen::Index i = 0; i < n; ++i) {
    passes += held[i] * (before[i] < 0.0 && now[i] >= 0.0 ? 1.0 : 0.0);
    torn += held[i] * (now[i] >= from && now[i] <= to ? 1.0 : 0.0);
  }
  return {passes > 0.0, torn > 0.0};
}

/// Brake force over load of every car at time t.
TRAIN_DERAIL_WIDE void brake(const inputs::Brakes& law, double t, Eigen::Index n, const double* ratio,
                             const double* signal, double* along) {
#pragma omp simd
  for (Eigen::Index k = 0; k < n; ++k)
    along[k] = law.rolling_resistance + ratio[k] * brake_build_up(law, t - signal[k]);
}

TRAIN_DERAIL_WIDE void multiply(Eigen::Index n, const double* a, const double* b, double* product) {
#pragma omp simd
  for (Eigen::Index k = 0; k < n; ++k) product[k] = a[k] * b[k];
}

#ifdef TRAIN_DERAIL_X86
constexpr Versions<ExtendedKernels> kVersions{&kExtendedAvx512, &kExtendedAvx2, &kExtendedSse2, &kExtendedPlain};
#else
constexpr Versions<ExtendedKernels> kVersions{nullptr, nullptr, nullptr, &kExtendedPlain};
#endif

}  // namespace

std::vector<std::string> ExtendedModel::instruction_sets(Eigen::Index cars) { return kVersions.names(cars); }

ExtendedModel::ExtendedModel(const inputs::Scenario& scenario, const std::string& instruction_set)
    : TrainModel(scenario),
      rails_(scenario.rails),
      brakes_(scenario.brakes),
      grade_(scenario.track.grade / std::sqrt(1.0 + scenario.track.grade * scenario.track.grade)),
      rails_on_(scenario.ground.on_track_law == inputs::OnTrackLaw::rails),
      cos_limit_(std::cos(scenario.coupler.swing_limit)),
      cos_break_(scenario.coupler.break_swing < M_PI ? std::cos(scenario.coupler.break_swing) : -2.0),
      kernels_(kVersions.choose(car_count(), instruction_set)),
      track_(scenario, inputs::track_extent(scenario).from, inputs::track_extent(scenario).to),
      past_pod_(cars_.size(), false),
      first_cause_(cars_.size(), Cause::none),
      cause_(2 * cars_.size(), Cause::none),
      patches_(scenario.ground.patches) {
  const Eigen::Index n = car_count();
  for (auto* a : {&brake_ratio_, &pipe_, &inverse_mass_, &inverse_inertia_, &cos_, &sin_, &along_, &fx_, &fy_, &moment_,
                  &turned_}) {
    *a = ArrayX::Zero(n);
  }
  for (auto* a : {&kick_, &arc_, &overloaded_, &offset_, &tangent_y_, &load_, &rail_damping_, &px_, &py_, &truck_x_,
                  &truck_y_, &brake_, &lateral_, &lateral_before_}) {
    *a = ArrayX::Zero(2 * n);
  }
  for (auto* a : {&on_track_, &tangent_x_, &patch_}) *a = ArrayX::Ones(2 * n);
  for (auto* a : {&damping_, &axial_, &damper_, &ux_, &uy_, &cos_swing_, &end_moment_}) *a = ArrayX::Zero(n - 1);
  alive_ = ArrayX::Ones(n - 1);
  for (auto* a : {&pin_x_, &pin_y_, &moment_lead_, &moment_trail_}) *a = ArrayX::Zero(n + 1);
  signal_ = ArrayX::Constant(n, inputs::kInfinity);

  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(initial_.perturbation.seed) ^ 0x61c5e1ULL);
  boost::random::normal_distribution<double> normal;
  Eigen::Index car = 0;
  double place = 0.0;
  for (const inputs::CarBlock& block : scenario.consist) {
    for (int i = 0; i < block.count; ++i, ++car) {
      const Car& c = at(car);
      brake_source_.push_back(block.brake_source == inputs::BrakeSource::remote);
      brake_ratio_[car] = block.brake_share * brakes_.force;
      pipe_[car] = place + 0.5 * c.length;
      place += c.length + coupler_.length;
      inverse_mass_[car] = 1.0 / c.mass;
      inverse_inertia_[car] = 1.0 / c.yaw_inertia;
      for (const End end : {FRONT, REAR}) {
        load_[truck(car, end)] = 0.5 * c.weight;
        rail_damping_[truck(car, end)] = rail_damping(rails_, c.mass);
        kick_[truck(car, end)] = initial_.perturbation.kick * normal(generator);
      }
    }
  }
  for (Eigen::Index i = 0; i + 1 < n; ++i) damping_[i] = coupler_damping(coupler_, at(i).mass, at(i + 1).mass);
  if (scenario.contact.law != inputs::ContactLaw::none) {
    contacts_ = std::make_unique<Contacts>(scenario.contact, cars_, ground_.regularization_speed);
  }
  if (brakes_.emergency_time) vent(*brakes_.emergency_time, 0.0);
}

ExtendedModel::~ExtendedModel() = default;

StateVector ExtendedModel::initial_state() const {
  StateVector state = TrainModel::initial_state();
  if (!rails_on_) return state;
  MotionMap m = motion(state.data(), car_count());
  // The front truck of the first car to derail has come to the point of derailment; the car turns about its rear truck,
  // which still stands on the rails.
  const Eigen::Index first = initial_.cars_ahead;
  m.col(X) -= half_spacing_[first];
  m(first, VY) = m(first, OMEGA) * half_spacing_[first];
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    // Both truck centres on the rails, the car moving along them.
    const auto on_rails_at = [&](double s) {
      const Track::Node n = track_.at(s);
      return Vector2(n.point + track_.alignment(s) * Vector2(-n.tangent.y(), n.tangent.x()));
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

ExtendedArrays ExtendedModel::arrays() {
  return {car_count(),
          &coupler_,
          &ground_,
          &rails_,
          cos_limit_,
          grade_,
          rails_on_,
          ground_.off_track_law == inputs::OffTrackLaw::by_slip,
          track_.straight(),
          half_length_.data(),
          half_spacing_.data(),
          inverse_mass_.data(),
          inverse_inertia_.data(),
          alive_.data(),
          damping_.data(),
          on_track_.data(),
          offset_.data(),
          tangent_x_.data(),
          tangent_y_.data(),
          load_.data(),
          rail_damping_.data(),
          along_.data(),
          patch_.data(),
          cos_.data(),
          sin_.data(),
          axial_.data(),
          damper_.data(),
          ux_.data(),
          uy_.data(),
          cos_swing_.data(),
          end_moment_.data(),
          pin_x_.data(),
          pin_y_.data(),
          moment_lead_.data(),
          moment_trail_.data(),
          truck_x_.data(),
          truck_y_.data(),
          brake_.data(),
          lateral_.data(),
          fx_.data(),
          fy_.data(),
          moment_.data()};
}

void ExtendedModel::start(const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  cos_ = q.col(THETA).cos();
  sin_ = q.col(THETA).sin();
  kernels_->places(arrays(), y, px_.data(), py_.data());
  for (Eigen::Index i = 0; i < px_.size(); ++i) arc_[i] = track_.nearest({px_[i], py_[i]});
  pass_pod(y);
  if (rails_on_) {
    for (Eigen::Index i = 0; i < px_.size(); ++i) {
      if (car_of(i) < initial_.cars_ahead || arc_[i] < 0.0) continue;
      cause_[static_cast<std::size_t>(i)] = Cause::pod;
      on_track_[i] = 0.0;
      incidents_.derailments.push_back({0.0, car_of(i), i < car_count(), Cause::pod, px_[i], py_[i]});
    }
  }
  order_derailments(0);
  locate();
  find_standing();
  find_forces(0.0, y);
  note_peaks(0.0);
}

void ExtendedModel::locate() {
  const Eigen::Index trucks = px_.size();
  if (track_.straight()) {
    arc_ = px_;
    offset_ = py_;
  } else {
    for (Eigen::Index i = 0; i < trucks; ++i) {
      arc_[i] = track_.foot({px_[i], py_[i]}, arc_[i]);
      const Track::Node node = track_.at(arc_[i]);
      tangent_x_[i] = node.tangent.x();
      tangent_y_[i] = node.tangent.y();
      offset_[i] = (py_[i] - node.point.y()) * node.tangent.x() - (px_[i] - node.point.x()) * node.tangent.y();
    }
  }
  // Patches lie along and across the track, wherever its rails have moved to.
  for (Eigen::Index i = 0; i < trucks && !patches_.empty(); ++i)
    patch_[i] = patch_factor(patches_, arc_[i], offset_[i]);
  if (rails_on_ && !track_.aligned()) track_.subtract_alignment(trucks, arc_.data(), on_track_.data(), offset_.data());
}

void ExtendedModel::pass_pod(const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  for (Eigen::Index k = initial_.cars_ahead; k < car_count(); ++k) {
    if (q(k, X) < 0.0 || past_pod_[static_cast<std::size_t>(k)]) continue;
    past_pod_[static_cast<std::size_t>(k)] = true;
    if (!rails_on_) on_track_[truck(k, FRONT)] = on_track_[truck(k, REAR)] = 0.0;
  }
}

bool ExtendedModel::derailed(Eigen::Index car) const {
  return rails_on_ ? !on_rails(truck(car, FRONT)) || !on_rails(truck(car, REAR)) : past_pod(car);
}

TrackPlace ExtendedModel::track_place(Eigen::Index car, const Vector2& point) const {
  if (track_.straight()) return TrainModel::track_place(car, point);
  const double s = track_.foot(point, arc_[truck(car, FRONT)]);
  const Track::Node n = track_.at(s);
  return {s, (point - n.point).dot(Vector2(-n.tangent.y(), n.tangent.x())), n.tangent};
}

void ExtendedModel::find_forces(double t, const double* y) {
  if (brakes_.law == inputs::BrakeLaw::air) {
    brake(brakes_, t, car_count(), brake_ratio_.data(), signal_.data(), along_.data());
  } else {
    along_ = ground_.on_track_friction;
  }
  const CouplerPeaks peaks = kernels_->forces(arrays(), y);
  buff_ = peaks.buff;
  draft_ = peaks.draft;
  cos_swing_least_ = peaks.cos_swing;
  end_moment_largest_ = peaks.end_moment;
  forces_found_ = true;
}

void ExtendedModel::accelerations(double t, double h, const double* y, double* result) {
  const Eigen::Index n = car_count();
  if (!forces_found_) find_forces(t, y);
  forces_found_ = false;
  if (contacts_) {
    const CarColumns q{y + X * n, y + Y * n, cos_.data(), sin_.data(), y + VX * n, y + VY * n, y + OMEGA * n};
    contacts_->add_forces(t, h, q, {fx_.data(), fy_.data(), moment_.data()}, incidents_);
  }
  multiply(n, fx_.data(), inverse_mass_.data(), result);
  multiply(n, fy_.data(), inverse_mass_.data(), result + n);
  multiply(n, moment_.data(), inverse_inertia_.data(), result + 2 * n);
}

void ExtendedModel::settle(double t, double h, const double* before, double* y) {
  const Eigen::Index n = car_count();
  const StepWork w = kernels_->work(arrays(), before, y, h);
  spent_.work_on_track += w.on_track;
  spent_.work_off_track += w.off_track;
  spent_.work_rails += w.rails;
  spent_.work_coupler_damping += w.damping;
  spent_.work_grade += w.grade;
  if (contacts_) {
    const auto columns = [&](const double* state) {
      return CarColumns{state + X * n,  state + Y * n,  cos_.data(),      sin_.data(),
                        state + VX * n, state + VY * n, state + OMEGA * n};
    };
    const Contacts::Work c = contacts_->work(h, columns(before), columns(y));
    spent_.work_impact_normal += c.normal;
    spent_.work_impact_friction += c.friction;
  }
  note_blockage(h);
  const auto derailed_before = static_cast<std::ptrdiff_t>(incidents_.derailments.size());

  turned_ = motion(y, n).col(THETA) - motion(before, n).col(THETA);
  kernels_->turn(arrays(), turned_.data());
  kernels_->places(arrays(), y, px_.data(), py_.data());
  pass_pod(y);
  if (rails_on_) leave_bad_track(t + h, h, y);
  locate();
  lateral_before_.swap(lateral_);
  find_forces(t + h, y);
  // What gives way does so before a force beyond its limit can act: such forces are found anew.
  const bool broken = break_couplers(t + h, h, before, y);
  const bool left = rails_on_ && leave_overloaded(t + h, h, y);
  if (left) locate();
  if (broken || left) find_forces(t + h, y);
  note_peaks(t + h);
  order_derailments(derailed_before);
  work(y, n)[WORK_ON_TRACK] = spent_.work_on_track;
  work(y, n)[WORK_OFF_TRACK] = spent_.work_off_track;
}

void ExtendedModel::order_derailments(std::ptrdiff_t first) {
  const auto begin = incidents_.derailments.begin() + first, end = incidents_.derailments.end();
  std::stable_sort(begin, end, [](const Derailment& a, const Derailment& b) { return a.time < b.time; });
  for (auto d = begin; d != end; ++d) {
    Cause& cause = first_cause_[static_cast<std::size_t>(d->car)];
    if (cause == Cause::none) cause = d->cause;
  }
}

void ExtendedModel::note_peaks(double t) {
  if (coupler_count() == 0) return;
  Eigen::Index i = 0;
  if (buff_ > incidents_.buff.force) {
    axial_.maxCoeff(&i);
    incidents_.buff = {buff_, i, t};
  }
  if (draft_ > incidents_.draft.force) {
    axial_.minCoeff(&i);
    incidents_.draft = {draft_, i, t};
  }
}

void ExtendedModel::note_blockage(double h) {
  // Once their coupler has broken, the two sides have nothing to do with each other.
  if (standing_ <= 0 || broken(standing_ - 1)) return;
  const double force = std::max(axial_[standing_ - 1], 0.0);
  incidents_.blockage_impulse += h * force;
  incidents_.blockage_time += h;
  incidents_.blockage_peak = std::max(incidents_.blockage_peak, force);
}

bool ExtendedModel::break_couplers(double t, double h, const double* before, const double* y) {
  if (draft_ <= coupler_.break_draft && cos_swing_least_ >= cos_break_ && end_moment_largest_ <= coupler_.break_moment)
    return false;
  std::vector<BrokenCoupler> found;
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    const bool draft = -axial_[i] > coupler_.break_draft, swing = cos_swing_[i] < cos_break_;
    const bool moment = std::abs(end_moment_[i]) > coupler_.break_moment;
    if (broken(i) || !(draft || swing || moment)) continue;
    const CouplerState<double> was = coupler(before, i), is = coupler(y, i);
    // Everything taken to run linearly through the step: the share of it after which the first limit is reached.
    double share = 1.0;
    BrokenCoupler::By by = BrokenCoupler::By::draft;
    const auto consider = [&](bool beyond, double from, double to, double limit, BrokenCoupler::By what) {
      const double at = to > from ? std::clamp((limit - from) / (to - from), 0.0, 1.0) : 0.0;
      if (!beyond || at >= share) return;
      share = at;
      by = what;
    };
    const auto largest_swing = [](const CouplerState<double>& b) {
      return std::max(std::abs(b.swing_lead), std::abs(b.swing_trail));
    };
    const auto end_moment = [](const CouplerState<double>& b) { return std::abs(b.moment_lead + b.moment_trail); };
    consider(draft, -was.axial, -is.axial, coupler_.break_draft, BrokenCoupler::By::draft);
    consider(swing, largest_swing(was), largest_swing(is), coupler_.break_swing, BrokenCoupler::By::swing);
    consider(moment, end_moment(was), end_moment(is), coupler_.break_moment, BrokenCoupler::By::moment);
    const auto between = [share](double from, double to) { return from + share * (to - from); };
    const double force = std::max(between(was.axial, is.axial), -coupler_.break_draft);
    found.push_back({t - (1.0 - share) * h, i, by, force});
    spent_.work_coupler_break += spring_energy(between(was.gap, is.gap)) +
                                 swing_energy(coupler_, between(was.swing_lead, is.swing_lead)) +
                                 swing_energy(coupler_, between(was.swing_trail, is.swing_trail));
    if (-force > incidents_.draft.force) incidents_.draft = {-force, i, found.back().time};
    if (force > incidents_.buff.force) incidents_.buff = {force, i, found.back().time};
  }
  std::sort(found.begin(), found.end(), [](const BrokenCoupler& a, const BrokenCoupler& b) { return a.time < b.time; });
  for (const BrokenCoupler& b : found) {
    alive_[b.coupler] = 0.0;
    incidents_.broken.push_back(b);
    vent(b.time, 0.5 * (pipe_[b.coupler] + pipe_[b.coupler + 1]));
  }
  return !found.empty();
}

void ExtendedModel::leave_bad_track(double t, double h, double* y) {
  const Eigen::Index n = car_count();
  // Most steps nothing happens: find that out for all trucks together.
  const OnBadTrack bad =
      on_bad_track(2 * n, on_track_.data(), arc_.data(), px_.data(), track_.torn_from(), track_.torn_to());
  const bool anything =
      !track_.straight() || bad.passes || (bad.may_be_torn && track_.any_torn(2 * n, px_.data(), on_track_.data()));
  if (!anything) return;
  bool left = false;
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    if (!on_rails(i)) continue;
    const double s = track_.foot({px_[i], py_[i]}, arc_[i]);
    const double from = arc_[i];
    arc_[i] = s;
    if (car_of(i) >= initial_.cars_ahead && from < 0.0 && s >= 0.0) leave(t - h * s / (s - from), i, Cause::pod, y);
    else if (track_.torn(s)) leave(t, i, Cause::torn_track, y);
    else continue;
    left = true;
  }
  if (left) find_standing();
}

bool ExtendedModel::leave_overloaded(double t, double h, double* y) {
  if (!kernels_->overload(arrays(), h, lateral_before_.data(), overloaded_.data())) return false;
  bool left = false;
  for (Eigen::Index i = 0; i < 2 * car_count(); ++i) {
    if (!on_rails(i) || overloaded_[i] <= rails_.derail_time) continue;
    leave(derail_moment(rails_, lateral_before_[i], lateral_[i], load_[i], t, h, overloaded_[i]), i, Cause::lateral, y);
    left = true;
  }
  if (left) find_standing();
  return left;
}

void ExtendedModel::find_standing() {
  standing_ = -1;
  for (Eigen::Index k = car_count() - 1; k >= initial_.cars_ahead && !derailed(k); --k) standing_ = k;
  if (standing_ > 0 && !derailed(standing_ - 1)) standing_ = -1;
}

void ExtendedModel::leave(double t, Eigen::Index truck, Cause cause, double* y) {
  MotionMap q = motion(y, car_count());
  const Eigen::Index car = car_of(truck);
  cause_[static_cast<std::size_t>(truck)] = cause;
  on_track_[truck] = 0.0;
  overloaded_[truck] = 0.0;
  incidents_.derailments.push_back({t, car, truck < car_count(), cause, px_[truck], py_[truck]});
  track_.tear(arc_[truck]);
  if (cause != Cause::pod || kick_[truck] == 0.0) return;
  // An impulse at the truck, across the car, that changes the truck's velocity by the kick.
  const double impulse = kick_[truck] / (inverse_mass_[car] + arm(truck) * arm(truck) * inverse_inertia_[car]);
  const auto kinetic = [&] {
    return 0.5 * mass_[car] * (q(car, VX) * q(car, VX) + q(car, VY) * q(car, VY)) +
           0.5 * inertia_[car] * q(car, OMEGA) * q(car, OMEGA);
  };
  const double before = kinetic();
  q(car, VX) -= impulse * inverse_mass_[car] * sin_[car];
  q(car, VY) += impulse * inverse_mass_[car] * cos_[car];
  q(car, OMEGA) += impulse * arm(truck) * inverse_inertia_[car];
  spent_.work_kicks -= kinetic() - before;
}

void ExtendedModel::vent(double t, double place) {
  if (brakes_.law != inputs::BrakeLaw::air) return;
  const auto spread = [&](double at, double from) {
    for (Eigen::Index k = 0; k < signal_.size(); ++k) {
      signal_[k] = std::min(signal_[k], at + brake_signal_delay(brakes_, pipe_[k] - from));
    }
  };
  spread(t, place);
  for (Eigen::Index k = 0; k < pipe_.size(); ++k) {
    if (brake_source_[static_cast<std::size_t>(k)]) spread(t + brakes_.radio_delay, pipe_[k]);
  }
}

double ExtendedModel::spring_energy(double gap) const {
  if (coupler_.draft_gear_travel == 0.0) return axial_energy(coupler_, gap);
  return draft_gear_energy(coupler_, std::max(std::abs(gap - coupler_.length) - 0.5 * coupler_.slack, 0.0));
}

CouplerState<double> ExtendedModel::coupler(const double* y, Eigen::Index i) const {
  CouplerState<double> b = TrainModel::coupler(y, i);
  if (broken(i)) {
    b.axial = b.lateral = b.moment_lead = b.moment_trail = b.force_x = b.force_y = 0.0;
    return b;
  }
  const double spring = coupler_spring_force(coupler_, b.gap);
  const Vector2 rate = rear_pin(y, i).velocity - front_pin(y, i + 1).velocity;
  const double axial = spring + coupler_damper_force(damping_[i], spring, rate.x() * b.ux + rate.y() * b.uy);
  b.force_x += (axial - b.axial) * b.ux;
  b.force_y += (axial - b.axial) * b.uy;
  b.axial = axial;
  return b;
}

void ExtendedModel::find_headings(const double* y, double* cosine, double* sine) const {
  kernels_->headings(car_count(), y + THETA * car_count(), cosine, sine);
}

void ExtendedModel::find_gaps(const double* y, double* gap, double* rate) const {
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    const PointMotion lead = rear_pin(y, i), trail = front_pin(y, i + 1);
    const Vector2 d = lead.position - trail.position;
    gap[i] = d.norm();
    rate[i] = d.dot(lead.velocity - trail.velocity) / gap[i];
  }
}

EnergyLedger ExtendedModel::energy(const double* y) const {
  const EnergyLedger m = mechanical_energy(y);
  EnergyLedger e = spent_;
  e.kinetic_translation = m.kinetic_translation;
  e.kinetic_rotation = m.kinetic_rotation;
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    if (broken(i)) continue;
    const CouplerState<double> b = coupler(y, i);
    e.coupler_axial += spring_energy(b.gap);
    e.coupler_swing += swing_energy(coupler_, b.swing_lead) + swing_energy(coupler_, b.swing_trail);
  }
  return e;
}

}  // namespace train_derail::model
