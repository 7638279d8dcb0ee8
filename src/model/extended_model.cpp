#include "train_derail/model/extended_model.hpp"

#include <algorithm>
#include <cmath>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "model/contacts.hpp"
#include "train_derail/model/brake_law.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"

namespace train_derail::model {

namespace {

double train_length(const inputs::Scenario& s) {
  double length = 0.0;
  for (const inputs::CarBlock& b : s.consist) length += b.count * (b.length + s.coupler.length);
  return length;
}

/// How far ahead of the point of derailment the table of the track reaches [m].
double reach_ahead(const inputs::Scenario& s) {
  return std::min(100.0 + train_length(s) + s.initial.speed * s.stop.time_max, 6000.0);
}

}  // namespace

ExtendedModel::ExtendedModel(const inputs::Scenario& scenario)
    : TrainModel(scenario),
      rails_(scenario.rails),
      brakes_(scenario.brakes),
      grade_(scenario.track.grade),
      rails_on_(scenario.ground.on_track_law == inputs::OnTrackLaw::rails),
      cos_limit_(std::cos(scenario.coupler.swing_limit)),
      cos_break_(scenario.coupler.break_swing < M_PI ? std::cos(scenario.coupler.break_swing) : -2.0),
      track_(scenario, -(train_length(scenario) + 100.0), reach_ahead(scenario)),
      past_pod_(cars_.size(), false),
      links_(cars_.empty() ? 0 : cars_.size() - 1),
      loads_(std::make_unique<Loads>()) {
  const std::size_t n = cars_.size();
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(initial_.perturbation.seed) ^ 0x61c5e1ULL);
  boost::random::normal_distribution<double> normal;
  for (const inputs::CarBlock& b : scenario.consist) {
    for (int i = 0; i < b.count; ++i) brake_source_.push_back(b.brake_source == inputs::BrakeSource::remote);
    for (int i = 0; i < b.count; ++i) brake_force_.push_back(b.brake_share * brakes_.force * b.weight);
  }
  double place = 0.0;
  for (const Car& c : cars_) {
    for (const double sign : {1.0, -1.0}) {
      Truck truck{};
      truck.arm = 0.5 * sign * c.truck_spacing;
      truck.load = 0.5 * c.weight;
      truck.rail_damping = rail_damping(rails_, c.mass);
      truck.kick = initial_.perturbation.kick * normal(generator);
      trucks_.push_back(truck);
    }
    pipe_.push_back(place + 0.5 * c.length);
    place += c.length + coupler_.length;
  }
  signal_.assign(n, inputs::kInfinity);
  for (std::size_t i = 0; i < links_.size(); ++i) {
    links_[i].damping = coupler_damping(coupler_, cars_[i].mass, cars_[i + 1].mass);
  }
  if (scenario.contact.law != inputs::ContactLaw::none) {
    contacts_ = std::make_unique<Contacts>(scenario.contact, cars_, ground_.regularization_speed);
  }
  for (auto* a : {&cos_, &sin_, &loads_->fx, &loads_->fy, &loads_->moment}) a->resize(car_count());
  if (brakes_.emergency_time) vent(*brakes_.emergency_time, 0.0);
}

ExtendedModel::~ExtendedModel() = default;

StateVector ExtendedModel::initial_state() const {
  StateVector state = TrainModel::initial_state();
  if (track_.straight()) return state;
  MotionMap m = motion(state.data(), car_count());
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    // Both truck centres on the centre line, the car turning with the track.
    const Track::Node front = track_.at(m(k, X) + half_spacing_[k]), rear = track_.at(m(k, X) - half_spacing_[k]);
    const Eigen::Vector2d chord = front.point - rear.point, centre = 0.5 * (front.point + rear.point);
    const Eigen::Vector2d velocity = 0.5 * initial_.speed * (front.tangent + rear.tangent);
    const Eigen::Vector2d turning = initial_.speed * (front.tangent - rear.tangent);
    m(k, X) = centre.x();
    m(k, Y) = centre.y();
    m(k, THETA) = std::atan2(chord.y(), chord.x());
    m(k, VX) = velocity.x();
    m(k, VY) = velocity.y();
    m(k, OMEGA) += (chord.x() * turning.y() - chord.y() * turning.x()) / chord.squaredNorm();
  }
  return state;
}

void ExtendedModel::start(const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  headings(y);
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    const bool behind = k >= initial_.cars_ahead;
    for (std::size_t end = 0; end < 2; ++end) {
      Truck& truck = trucks_[2 * static_cast<std::size_t>(k) + end];
      const Eigen::Vector2d p(q(k, X) + truck.arm * cos_[k], q(k, Y) + truck.arm * sin_[k]);
      truck.s = track_.foot(p, p.x());
      if (rails_on_ && behind && truck.s >= 0.0) {
        truck.cause = Cause::pod;
        incidents_.derailments.push_back({0.0, k, end == 0, Cause::pod, p.x(), p.y()});
      }
    }
    past_pod_[static_cast<std::size_t>(k)] = behind && q(k, X) >= 0.0;
  }
}

void ExtendedModel::headings(const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  cos_ = q.col(THETA).cos();
  sin_ = q.col(THETA).sin();
}

bool ExtendedModel::derailed(Eigen::Index car) const {
  if (!rails_on_) return past_pod(car);
  const auto i = 2 * static_cast<std::size_t>(car);
  return trucks_[i].cause != Cause::none || trucks_[i + 1].cause != Cause::none;
}

double ExtendedModel::off_centre(const Eigen::Vector2d& point) const {
  if (track_.straight()) return point.y();
  const Track::Node n = track_.at(track_.foot(point, point.x()));
  return (point - n.point).dot(Eigen::Vector2d(-n.tangent.y(), n.tangent.x()));
}

void ExtendedModel::accelerations(double t, double h, const double* y, double* result) {
  const Eigen::Index n = car_count();
  Loads& loads = *loads_;
  headings(y);
  loads.fx.setZero();
  loads.fy.setZero();
  loads.moment.setZero();
  couple(loads, y);
  stand(t, loads, y);
  if (contacts_) {
    const CarColumns q{y + X * n, y + Y * n, cos_.data(), sin_.data(), y + VX * n, y + VY * n, y + OMEGA * n};
    contacts_->add_forces(t, h, q, loads, incidents_);
  }
  Eigen::Map<Eigen::ArrayXd>(result, n) = loads.fx / mass_;
  Eigen::Map<Eigen::ArrayXd>(result + n, n) = loads.fy / mass_;
  Eigen::Map<Eigen::ArrayXd>(result + 2 * n, n) = loads.moment / inertia_;
}

void ExtendedModel::couple(Loads& loads, const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  const bool gear = coupler_.draft_gear_travel > 0.0;
  const double closed = coupler_.length - 0.5 * coupler_.slack, stretched = coupler_.length + 0.5 * coupler_.slack;
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    Link& link = links_[static_cast<std::size_t>(i)];
    if (link.broken) continue;
    const Eigen::Index j = i + 1;
    // From the centres to the pins.
    const double ax = -half_length_[i] * cos_[i], ay = -half_length_[i] * sin_[i];
    const double bx = half_length_[j] * cos_[j], by = half_length_[j] * sin_[j];
    const double dx = q(i, X) + ax - q(j, X) - bx, dy = q(i, Y) + ay - q(j, Y) - by;
    auto b = coupler_load<double>(coupler_, cos_limit_, dx, dy, cos_[i], sin_[i], cos_[j], sin_[j]);
    double axial = b.axial;
    if (gear) axial = b.gap < closed ? draft_gear_force(coupler_, closed - b.gap)
                    : b.gap > stretched ? -draft_gear_force(coupler_, b.gap - stretched) : 0.0;
    link.damper = 0.0;
    if (link.damping > 0.0 && axial != 0.0) {
      const double rx = q(i, VX) - q(i, OMEGA) * ay - q(j, VX) + q(j, OMEGA) * by;
      const double ry = q(i, VY) + q(i, OMEGA) * ax - q(j, VY) - q(j, OMEGA) * bx;
      link.damper = coupler_damper_force(link.damping, axial, rx * b.ux + ry * b.uy);
    }
    const double fx = b.force_x + (axial + link.damper - b.axial) * b.ux;
    const double fy = b.force_y + (axial + link.damper - b.axial) * b.uy;
    loads.fx[i] += fx;
    loads.fy[i] += fy;
    loads.moment[i] += ax * fy - ay * fx + b.moment_lead;
    loads.fx[j] -= fx;
    loads.fy[j] -= fy;
    loads.moment[j] -= bx * fy - by * fx - b.moment_trail;
    link.ux = b.ux;
    link.uy = b.uy;
    link.axial = axial + link.damper;
    link.moment = std::abs(b.moment_lead + b.moment_trail);
    link.cos_swing = std::min(b.ux * cos_[i] + b.uy * sin_[i], b.ux * cos_[j] + b.uy * sin_[j]);
  }
}

void ExtendedModel::stand(double t, Loads& loads, const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  const double v_eps = ground_.regularization_speed;
  const bool air = brakes_.law == inputs::BrakeLaw::air, by_slip = ground_.off_track_law == inputs::OffTrackLaw::by_slip;
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    double along = ground_.on_track_friction;  // of the load
    if (air) along = brakes_.rolling_resistance + brake_force_[i] / cars_[i].weight * brake_build_up(brakes_, t - signal_[i]);
    for (std::size_t end = 0; end < 2; ++end) {
      Truck& truck = trucks_[2 * i + end];
      const double rx = truck.arm * cos_[k], ry = truck.arm * sin_[k];
      const double px = q(k, X) + rx, py = q(k, Y) + ry;
      const double u = q(k, VX) - q(k, OMEGA) * ry, v = q(k, VY) + q(k, OMEGA) * rx;
      double tx = 1.0, ty = 0.0;
      truck.along_x = truck.along_y = 0.0;
      if (on_rails(truck)) {
        double offset = py;
        if (!track_.straight()) {
          const Track::Node node = track_.at(truck.s);
          tx = node.tangent.x();
          ty = node.tangent.y();
          offset = (py - node.point.y()) * tx - (px - node.point.x()) * ty;
        }
        const double ut = u * tx + v * ty, vn = v * tx - u * ty;
        truck.rail_lateral = rail_force(rails_, truck.rail_damping, offset - track_.alignment(truck.s), vn);
        const double brake = friction(along * truck.load, ut, 0.0, v_eps).x;
        truck.along_x = brake * tx;
        truck.along_y = brake * ty;
        truck.fx = truck.along_x - truck.rail_lateral * ty;
        truck.fy = truck.along_y + truck.rail_lateral * tx;
      } else if (!rails_on_ && !past_pod_[i]) {
        const bool lateral = ground_.on_track_law == inputs::OnTrackLaw::isotropic;
        const auto f = friction(along * truck.load, u, lateral ? v : 0.0, v_eps);
        truck.along_x = truck.fx = f.x;
        truck.along_y = truck.fy = f.y;
      } else {
        double mu = ground_.off_track_friction;
        if (by_slip) {
          const double across = v * cos_[k] - u * sin_[k];
          mu = slip_friction(ground_, std::sqrt(u * u + v * v), across, track_.straight() ? py : off_centre({px, py}));
        }
        if (!ground_.patches.empty()) mu *= patch_factor(ground_.patches, px, py);
        const auto f = friction(mu * truck.load, u, v, v_eps);
        truck.fx = f.x;
        truck.fy = f.y;
      }
      loads.fx[k] += truck.fx;
      loads.fy[k] += truck.fy;
      loads.moment[k] += rx * truck.fy - ry * truck.fx;
      if (grade_ != 0.0) {
        const double pull = truck.load * grade_ / std::sqrt(1.0 + grade_ * grade_);
        loads.fx[k] -= pull * tx;
        loads.fy[k] -= pull * ty;
        loads.moment[k] -= pull * (rx * ty - ry * tx);
      }
    }
  }
}

void ExtendedModel::settle(double t, double h, const double* before, double* y) {
  const Eigen::Index n = car_count();
  const ConstMotionMap q0 = motion(before, n);
  MotionMap q = motion(y, n);
  const Motion mid = 0.5 * (q0 + q);  // velocities with which the forces of the step did their work
  const double now = t + h;

  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    for (std::size_t end = 0; end < 2; ++end) {
      const Truck& truck = trucks_[2 * i + end];
      const double u = mid(k, VX) - mid(k, OMEGA) * truck.arm * sin_[k], v = mid(k, VY) + mid(k, OMEGA) * truck.arm * cos_[k];
      const double all = -h * (truck.fx * u + truck.fy * v);
      if (on_rails(truck)) {
        const double brake = -h * (truck.along_x * u + truck.along_y * v);
        spent_.work_on_track += brake;
        spent_.work_rails += all - brake;
      } else {
        (rails_on_ || past_pod_[i] ? spent_.work_off_track : spent_.work_on_track) += all;
      }
    }
  }
  if (grade_ != 0.0) {
    // As in stand(): along the tangent on rails, along x off them.
    for (Eigen::Index k = 0; k < n; ++k) {
      for (std::size_t end = 0; end < 2; ++end) {
        const Truck& truck = trucks_[2 * static_cast<std::size_t>(k) + end];
        const Eigen::Vector2d tangent = on_rails(truck) ? track_.at(truck.s).tangent : Eigen::Vector2d(1.0, 0.0);
        const double u = mid(k, VX) - mid(k, OMEGA) * truck.arm * sin_[k], v = mid(k, VY) + mid(k, OMEGA) * truck.arm * cos_[k];
        spent_.work_grade += h * truck.load * grade_ / std::sqrt(1.0 + grade_ * grade_) * (u * tangent.x() + v * tangent.y());
      }
    }
  }
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    Link& link = links_[static_cast<std::size_t>(i)];
    if (link.broken) continue;
    if (link.damper != 0.0) {
      const Eigen::Index j = i + 1;
      const double rx = mid(i, VX) + mid(i, OMEGA) * half_length_[i] * sin_[i] - mid(j, VX) + mid(j, OMEGA) * half_length_[j] * sin_[j];
      const double ry = mid(i, VY) - mid(i, OMEGA) * half_length_[i] * cos_[i] - mid(j, VY) - mid(j, OMEGA) * half_length_[j] * cos_[j];
      spent_.work_coupler_damping -= h * link.damper * (rx * link.ux + ry * link.uy);
    }
    const auto keep = [&](Peak& peak, double force) {
      if (force > peak.force) peak = {force, i, t};
    };
    keep(incidents_.buff, link.axial);
    keep(incidents_.draft, -link.axial);
    if (-link.axial > coupler_.break_draft) break_coupler(now, i, BrokenCoupler::By::draft, before);
    else if (link.cos_swing < cos_break_) break_coupler(now, i, BrokenCoupler::By::swing, before);
    else if (link.moment > coupler_.break_moment) break_coupler(now, i, BrokenCoupler::By::moment, before);
  }
  if (contacts_) {
    const auto columns = [&](const double* state) {
      return CarColumns{state + X * n, state + Y * n, cos_.data(), sin_.data(), state + VX * n, state + VY * n, state + OMEGA * n};
    };
    const Contacts::Work w = contacts_->work(h, columns(before), columns(y));
    spent_.work_impact_normal += w.normal;
    spent_.work_impact_friction += w.friction;
  }

  Eigen::Index standing = -1;  // the foremost car that still stands on the rails behind what has derailed
  for (Eigen::Index k = n - 1; k >= initial_.cars_ahead; --k) {
    if (derailed(k)) break;
    standing = k;
  }
  if (standing > 0 && derailed(standing - 1)) {
    const double force = std::max(links_[static_cast<std::size_t>(standing - 1)].axial, 0.0);
    incidents_.blockage_impulse += h * force;
    incidents_.blockage_time += h;
    incidents_.blockage_peak = std::max(incidents_.blockage_peak, force);
  }

  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const bool behind = k >= initial_.cars_ahead;
    if (behind && q(k, X) >= 0.0) past_pod_[i] = true;
    if (!rails_on_) continue;
    for (int end = 0; end < 2; ++end) {
      Truck& truck = trucks_[2 * i + static_cast<std::size_t>(end)];
      if (truck.cause != Cause::none) continue;
      const Eigen::Vector2d p(q(k, X) + truck.arm * std::cos(q(k, THETA)), q(k, Y) + truck.arm * std::sin(q(k, THETA)));
      const double s = track_.foot(p, truck.s);
      const bool crosses = behind && truck.s < 0.0 && s >= 0.0;
      truck.s = s;
      if (crosses) leave(now, k, end, Cause::pod, y);
      else if (track_.torn(s)) leave(now, k, end, Cause::torn_track, y);
      else if (rails_yield(rails_, truck.rail_lateral, truck.load, h, truck.overloaded)) leave(now, k, end, Cause::lateral, y);
    }
  }
  work(y, n)[WORK_ON_TRACK] = spent_.work_on_track;
  work(y, n)[WORK_OFF_TRACK] = spent_.work_off_track;
}

void ExtendedModel::leave(double t, Eigen::Index car, int end, Cause cause, double* y) {
  MotionMap q = motion(y, car_count());
  Truck& truck = trucks_[2 * static_cast<std::size_t>(car) + static_cast<std::size_t>(end)];
  truck.cause = cause;
  const Eigen::Vector2d axis(std::cos(q(car, THETA)), std::sin(q(car, THETA)));
  incidents_.derailments.push_back({t, car, end == 0, cause, q(car, X) + truck.arm * axis.x(), q(car, Y) + truck.arm * axis.y()});
  track_.tear(truck.s);
  if (cause == Cause::pod && truck.kick != 0.0) {
    // An impulse at the truck, across the car, that changes the truck's velocity by the kick.
    const double impulse = truck.kick / (1.0 / mass_[car] + truck.arm * truck.arm / inertia_[car]);
    const auto kinetic = [&] {
      return 0.5 * mass_[car] * (q(car, VX) * q(car, VX) + q(car, VY) * q(car, VY)) + 0.5 * inertia_[car] * q(car, OMEGA) * q(car, OMEGA);
    };
    const double before = kinetic();
    q(car, VX) -= impulse / mass_[car] * axis.y();
    q(car, VY) += impulse / mass_[car] * axis.x();
    q(car, OMEGA) += impulse * truck.arm / inertia_[car];
    spent_.work_kicks -= kinetic() - before;
  }
}

void ExtendedModel::break_coupler(double t, Eigen::Index i, BrokenCoupler::By by, const double* y) {
  const CouplerState<double> state = coupler(y, i);
  spent_.work_coupler_break += strain_energy(state.gap) + swing_energy(coupler_, state.swing_lead) + swing_energy(coupler_, state.swing_trail);
  Link& link = links_[static_cast<std::size_t>(i)];
  link = Link{};
  link.broken = true;
  incidents_.broken.push_back({t, i, by});
  const auto lead = static_cast<std::size_t>(i);
  vent(t, 0.5 * (pipe_[lead] + pipe_[lead + 1]));
}

void ExtendedModel::vent(double t, double place) {
  if (brakes_.law != inputs::BrakeLaw::air) return;
  const auto spread = [&](double at, double from) {
    for (std::size_t k = 0; k < signal_.size(); ++k) {
      signal_[k] = std::min(signal_[k], at + brake_signal_delay(brakes_, pipe_[k] - from));
    }
  };
  spread(t, place);
  if (emergency_) return;
  emergency_ = true;
  for (std::size_t k = 0; k < pipe_.size(); ++k) {
    if (brake_source_[k]) spread(t + brakes_.radio_delay, pipe_[k]);
  }
}

double ExtendedModel::strain_energy(double gap) const {
  if (coupler_.draft_gear_travel == 0.0) return axial_energy(coupler_, gap);
  return draft_gear_energy(coupler_, std::max(std::abs(gap - coupler_.length) - 0.5 * coupler_.slack, 0.0));
}

CouplerState<double> ExtendedModel::coupler(const double* y, Eigen::Index i) const {
  CouplerState<double> b = TrainModel::coupler(y, i);
  const Link& link = links_[static_cast<std::size_t>(i)];
  if (link.broken) {
    b.axial = b.lateral = b.moment_lead = b.moment_trail = b.force_x = b.force_y = 0.0;
    return b;
  }
  if (coupler_.draft_gear_travel > 0.0 || link.damping > 0.0) {
    const double spring = b.gap < coupler_.length ? draft_gear_force(coupler_, std::max(coupler_.length - 0.5 * coupler_.slack - b.gap, 0.0))
                                                  : -draft_gear_force(coupler_, std::max(b.gap - coupler_.length - 0.5 * coupler_.slack, 0.0));
    const Eigen::Vector2d rate = rear_pin(y, i).velocity - front_pin(y, i + 1).velocity;
    const double axial = spring + coupler_damper_force(link.damping, spring, rate.x() * b.ux + rate.y() * b.uy);
    b.force_x += (axial - b.axial) * b.ux;
    b.force_y += (axial - b.axial) * b.uy;
    b.axial = axial;
  }
  return b;
}

void ExtendedModel::gaps(const double* y, Eigen::ArrayXd& gap, Eigen::ArrayXd& rate) const {
  gap.resize(coupler_count());
  rate.resize(coupler_count());
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    const PointMotion lead = rear_pin(y, i), trail = front_pin(y, i + 1);
    const Eigen::Vector2d d = lead.position - trail.position;
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
    e.coupler_axial += strain_energy(b.gap);
    e.coupler_swing += swing_energy(coupler_, b.swing_lead) + swing_energy(coupler_, b.swing_trail);
  }
  return e;
}

}  // namespace train_derail::model
