#include "train_derail/model/train_model.hpp"

#include <cmath>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

namespace train_derail::model {

TrainModel::TrainModel(const inputs::Scenario& scenario)
    : cars_(expand(scenario.consist)),
      coupler_(scenario.coupler),
      ground_(scenario.ground),
      initial_(scenario.initial) {
  for (auto* array : {&mass_, &inertia_, &half_length_, &half_spacing_}) array->resize(car_count());
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    mass_[k] = at(k).mass;
    inertia_[k] = at(k).yaw_inertia;
    half_length_[k] = 0.5 * at(k).length;
    half_spacing_[k] = 0.5 * at(k).truck_spacing;
  }
}

StateVector TrainModel::initial_state() const {
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

CouplerState<double> TrainModel::coupler(const double* y, Eigen::Index i) const {
  const ConstMotionMap q = motion(y, car_count());
  const Vector2 d = rear_pin(y, i).position - front_pin(y, i + 1).position;
  return coupler_state<double>(coupler_, d.x(), d.y(), std::cos(q(i, THETA)), std::sin(q(i, THETA)),
                               std::cos(q(i + 1, THETA)), std::sin(q(i + 1, THETA)));
}

std::vector<CouplerState<double>> TrainModel::couplers(const double* y) const {
  std::vector<CouplerState<double>> all;
  for (Eigen::Index i = 0; i < coupler_count(); ++i) all.push_back(coupler(y, i));
  return all;
}

PlanColumns TrainModel::plan(const double* y) const {
  const Eigen::Index n = car_count();
  return {y + X * n, y + Y * n, y + VX * n, y + VY * n, y + OMEGA * n};
}

Observation TrainModel::observe(const double* y) const {
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

CarMotion TrainModel::car_motion(const double* y, Eigen::Index car) const {
  const ConstMotionMap q = motion(y, car_count());
  return {{q(car, X), q(car, Y)},
          {std::cos(q(car, THETA)), std::sin(q(car, THETA))},
          {q(car, VX), q(car, VY)},
          q(car, OMEGA)};
}

EnergyLedger TrainModel::mechanical_energy(const double* y) const {
  const Eigen::Index n = car_count();
  const ConstMotionMap q = motion(y, n);
  EnergyLedger e;
  e.kinetic_translation = 0.5 * (mass_ * (q.col(VX).square() + q.col(VY).square())).sum();
  e.kinetic_rotation = 0.5 * (inertia_ * q.col(OMEGA).square()).sum();
  for (const CouplerState<double>& b : couplers(y)) {
    e.coupler_axial += axial_energy(coupler_, b.gap);
    e.coupler_swing += swing_energy(coupler_, b.swing_lead) + swing_energy(coupler_, b.swing_trail);
  }
  return e;
}

Momentum TrainModel::momentum(const double* y) const {
  const ConstMotionMap q = motion(y, car_count());
  Momentum p;
  p.x = (mass_ * q.col(VX)).sum();
  p.y = (mass_ * q.col(VY)).sum();
  p.angular = (inertia_ * q.col(OMEGA) + mass_ * (q.col(X) * q.col(VY) - q.col(Y) * q.col(VX))).sum();
  return p;
}

}  // namespace train_derail::model
