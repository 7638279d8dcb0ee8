#include "train_derail/model/planar_model.hpp"

#include <cmath>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "model/kernels.hpp"

namespace train_derail::model {

PlanarModel::PlanarModel(const inputs::Scenario& scenario)
    : TrainModel(scenario), cos_limit_(std::cos(scenario.coupler.swing_limit)) {
  const Eigen::Index n = car_count();
  for (auto* array : {&mass_, &inertia_, &inverse_mass_, &inverse_inertia_, &half_length_, &half_spacing_})
    array->resize(n);
  for (auto* array : {&cos_, &sin_}) *array = ArrayX::Zero(n);
  for (auto* array : {&pin_x_, &pin_y_, &moment_lead_, &moment_trail_}) *array = ArrayX::Zero(n + 1);
  for (Eigen::Index k = 0; k < n; ++k) {
    mass_[k] = at(k).mass;
    inertia_[k] = at(k).yaw_inertia;
    inverse_mass_[k] = 1.0 / at(k).mass;
    inverse_inertia_[k] = 1.0 / at(k).yaw_inertia;
    half_length_[k] = 0.5 * at(k).length;
    half_spacing_[k] = 0.5 * at(k).truck_spacing;
  }
}

PlanarArrays PlanarModel::planar_arrays() const {
  PlanarArrays a;
  a.cars = car_count();
  a.coupler = &coupler_;
  a.cos_limit = cos_limit_;
  a.regularization_speed = ground_.regularization_speed;
  a.half_length = half_length_.data();
  a.half_spacing = half_spacing_.data();
  a.inverse_mass = inverse_mass_.data();
  a.inverse_inertia = inverse_inertia_.data();
  a.cosine = cos_.data();
  a.sine = sin_.data();
  a.pin_x = pin_x_.data();
  a.pin_y = pin_y_.data();
  a.moment_lead = moment_lead_.data();
  a.moment_trail = moment_trail_.data();
  return a;
}

void PlanarModel::find_gaps(const double* y, double* gap, double* rate) const {
  loops().gaps(planar_arrays(), y, gap, rate);
}

void PlanarModel::find_headings(const double* y, double* cosine, double* sine) const {
  loops().headings(car_count(), y + THETA * car_count(), cosine, sine);
}

StateVector PlanarModel::initial_state() const {
  const Eigen::Index n = car_count();
  StateVector state = StateVector::Zero(size());
  MotionMap m = motion(state.data(), n);
  const inputs::Perturbation& p = initial_.perturbation;
  boost::random::mt19937_64 generator(static_cast<std::uint64_t>(p.seed));
  boost::random::normal_distribution<double> normal;
  double x = 0.0;
  for (Eigen::Index k = 0; k < n; ++k) {
    if (k > 0) x -= half_length_[k - 1] + half_length_[k] + coupler_.length;  // eq. (15)
    m(k, X) = k > 0 && p.spacing > 0.0 ? x - p.spacing * std::abs(normal(generator)) : x;
    m(k, VX) = initial_.speed;  // eq. (16)
  }
  const Eigen::Index first = initial_.cars_ahead;
  if (first < n) {
    m(first, OMEGA) = initial_.yaw_rate;  // eq. (17)
    if (p.yaw_rate > 0.0) m(first, OMEGA) *= 1.0 + p.yaw_rate * normal(generator);
    if (first > 0) m.col(X) -= m(first, X);
  }
  return state;
}

CouplerState<double> PlanarModel::coupler_between(const CarMotion& lead, const CarMotion& trail, Eigen::Index i) const {
  const Vector2 d = lead_pin(lead, i).position - trail_pin(trail, i).position;
  return coupler_state<double>(coupler_, d.x(), d.y(), lead.axis.x(), lead.axis.y(), trail.axis.x(), trail.axis.y());
}

CouplerState<double> PlanarModel::coupler(const double* y, Eigen::Index i) const {
  return coupler_between(car_motion(y, i), car_motion(y, i + 1), i);
}

std::vector<CouplerState<double>> PlanarModel::couplers(const double* y) const {
  std::vector<CouplerState<double>> all;
  all.reserve(static_cast<std::size_t>(coupler_count()));
  CarMotion lead = car_motion(y, 0);
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    const CarMotion trail = car_motion(y, i + 1);
    all.push_back(coupler_between(lead, trail, i));
    lead = trail;
  }
  return all;
}

PlanColumns PlanarModel::plan(const double* y) const {
  const Eigen::Index n = car_count();
  return {y + X * n, y + Y * n, y + VX * n, y + VY * n, y + OMEGA * n};
}

Observation PlanarModel::observe(const double* y) const {
  const ConstMotionMap q = motion(y, car_count());
  ArrayX cosine, sine;
  headings(y, cosine, sine);
  Observation seen;
  seen.cars.resize(cars_.size());
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    CarObservation& car = seen.cars[static_cast<std::size_t>(k)];
    car.x = q(k, X);
    car.y = q(k, Y);
    car.theta = q(k, THETA);
    car.qz = std::sin(0.5 * car.theta);
    car.qw = std::cos(0.5 * car.theta);
    car.vx = q(k, VX);
    car.vy = q(k, VY);
    car.omega = q(k, OMEGA);
    const Vector2 centre(car.x, car.y), arm = half_spacing_[k] * Vector2(cosine[k], sine[k]);
    const auto truck = [&](const Vector2& place) {
      const TrackPlace by_track = track_place(k, place);
      return TruckPlace{by_track.s, by_track.offset, 0.0, 0.5 * at(k).weight};
    };
    car.front_truck = truck(centre + arm);
    car.rear_truck = truck(centre - arm);
    car.past_pod = past_pod(k);
    car.derailed = derailed(k);
    car.cause = cause(k);
  }
  const std::vector<CouplerState<double>> bars = couplers(y);
  seen.couplers.resize(bars.size());
  for (std::size_t i = 0; i < bars.size(); ++i) {
    const CouplerState<double>& bar = bars[i];
    CouplerObservation& coupler = seen.couplers[i];
    coupler.gap = bar.gap;
    coupler.angle = std::atan2(bar.uy, bar.ux);
    coupler.axial_force = bar.axial;
    coupler.lateral_force = bar.lateral;
    coupler.swing_lead = bar.swing_lead;
    coupler.swing_trail = bar.swing_trail;
    coupler.moment_lead = bar.moment_lead;
    coupler.moment_trail = bar.moment_trail;
    coupler.broken = broken(static_cast<Eigen::Index>(i));
  }
  return seen;
}

CarMotion PlanarModel::car_motion(const double* y, Eigen::Index car) const {
  const ConstMotionMap q = motion(y, car_count());
  return {{q(car, X), q(car, Y)},
          {std::cos(q(car, THETA)), std::sin(q(car, THETA))},
          {q(car, VX), q(car, VY)},
          q(car, OMEGA)};
}

EnergyLedger PlanarModel::kinetic_energy(const double* y) const {
  const Eigen::Index n = car_count();
  const ConstMotionMap q = motion(y, n);
  EnergyLedger e;
  e.kinetic_translation = 0.5 * (mass_ * (q.col(VX).square() + q.col(VY).square())).sum();
  e.kinetic_rotation = 0.5 * (inertia_ * q.col(OMEGA).square()).sum();
  return e;
}

Momentum PlanarModel::momentum(const double* y) const {
  const ConstMotionMap q = motion(y, car_count());
  Momentum p;
  p.x = (mass_ * q.col(VX)).sum();
  p.y = (mass_ * q.col(VY)).sum();
  p.angular = (inertia_ * q.col(OMEGA) + mass_ * (q.col(X) * q.col(VY) - q.col(Y) * q.col(VX))).sum();
  return p;
}

}  // namespace train_derail::model
