#include "train_derail/model/derailment_model.hpp"

#include <cmath>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <unsupported/Eigen/AutoDiff>

#include "train_derail/model/ground_law.hpp"

namespace train_derail::model {

namespace {

/// Force on a car and moment about its centre from the ground under both trucks.
template <class T>
struct GroundReaction {
  T fx, fy, moment;
};

/// (c, s): cosine and sine of the heading; eqs. (3)-(5) and the ground terms of (10)-(12).
template <class T>
GroundReaction<T> ground_reaction(inputs::OnTrackLaw law, bool derailed, double load, double v_eps, double half_spacing,
                                  const T& c, const T& s, const T& vx, const T& vy, const T& omega) {
  const bool along_track = !derailed && law != inputs::OnTrackLaw::isotropic;
  const T du = -half_spacing * omega * s;
  const T dv = half_spacing * omega * c;
  const auto force = [&](const T& u, const T& v) {
    return along_track ? friction_along_track(load, u, v_eps) : friction(load, u, v, v_eps);
  };
  const GroundForce<T> front = force(T(vx + du), T(vy + dv));
  const GroundForce<T> rear = force(T(vx - du), T(vy - dv));
  return {T(front.x + rear.x), T(front.y + rear.y),
          T(half_spacing * (c * (front.y - rear.y) - s * (front.x - rear.x)))};
}

/// Force of the coupler on the lead car (the trail car feels the opposite) and moments about both centres.
template <class T>
struct CouplerReaction {
  T fx, fy, moment_lead, moment_trail;
};

template <class T>
CouplerReaction<T> coupler_reaction(const inputs::Coupler& law, double cos_limit, double half_lead, double half_trail, const T& dx_centre,
                                    const T& dy_centre, const T& c_lead, const T& s_lead, const T& c_trail,
                                    const T& s_trail) {
  const T dx = dx_centre - half_lead * c_lead - half_trail * c_trail;
  const T dy = dy_centre - half_lead * s_lead - half_trail * s_trail;
  const CouplerLoad<T> b = coupler_load<T>(law, cos_limit, dx, dy, c_lead, s_lead, c_trail, s_trail);
  // Rear pin at -L/2, front pin at +L/2; opposite forces on opposite ends turn both cars the same way.
  return {b.force_x, b.force_y, T(b.moment_lead - half_lead * (c_lead * b.force_y - s_lead * b.force_x)),
          T(b.moment_trail - half_trail * (c_trail * b.force_y - s_trail * b.force_x))};
}

}  // namespace

DerailmentModel::DerailmentModel(const inputs::Scenario& scenario)
    : cars_(expand(scenario.consist)),
      coupler_(scenario.coupler),
      cos_limit_(std::cos(scenario.coupler.swing_limit)),
      ground_(scenario.ground),
      initial_(scenario.initial),
      derailed_(cars_.size(), false) {
  const Eigen::Index n = car_count();
  for (auto* array : {&mass_, &inertia_, &half_length_, &half_spacing_, &load_, &cos_, &sin_}) array->resize(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    mass_[k] = at(k).mass;
    inertia_[k] = at(k).yaw_inertia;
    half_length_[k] = 0.5 * at(k).length;
    half_spacing_[k] = 0.5 * at(k).truck_spacing;
    load_[k] = 0.5 * ground_.on_track_friction * at(k).weight;
  }
  if (n > 0) derail(0);
}

void DerailmentModel::derail(Eigen::Index car) {
  derailed_[static_cast<std::size_t>(car)] = true;
  load_[car] = 0.5 * ground_.off_track_friction * at(car).weight;
}

StateVector DerailmentModel::initial_state() const {
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
  if (n > 0) {
    m(0, OMEGA) = initial_.yaw_rate;  // eq. (17)
    if (p.yaw_rate > 0.0) m(0, OMEGA) *= 1.0 + p.yaw_rate * normal(generator);
  }
  return state;
}

void DerailmentModel::derivative(const double* y, double* dydt) {
  const Eigen::Index n = car_count();
  const ConstMotionMap q = motion(y, n);
  MotionMap d = motion(dydt, n);
  WorkMap power = work(dydt, n);
  power.setZero();
  d.leftCols<3>() = q.rightCols<3>();

  for (Eigen::Index k = 0; k < n; ++k) {
    const double theta = q(k, THETA), c = std::cos(theta), s = std::sin(theta);
    cos_[k] = c;
    sin_[k] = s;
    const auto g = ground_reaction<double>(ground_.on_track_law, derailed(k), load_[k], ground_.regularization_speed,
                                           half_spacing_[k], c, s, q(k, VX), q(k, VY), q(k, OMEGA));
    d(k, VX) = g.fx;
    d(k, VY) = g.fy;
    d(k, OMEGA) = g.moment;
    const double dissipated = -(g.fx * q(k, VX) + g.fy * q(k, VY) + g.moment * q(k, OMEGA));
    power[derailed(k) ? WORK_OFF_TRACK : WORK_ON_TRACK] += dissipated;
  }

  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    const Eigen::Index lead = i, trail = i + 1;
    const auto r = coupler_reaction<double>(coupler_, cos_limit_, half_length_[lead], half_length_[trail], q(lead, X) - q(trail, X),
                                            q(lead, Y) - q(trail, Y), cos_[lead], sin_[lead], cos_[trail], sin_[trail]);
    d(lead, VX) += r.fx;
    d(lead, VY) += r.fy;
    d(lead, OMEGA) += r.moment_lead;
    d(trail, VX) -= r.fx;
    d(trail, VY) -= r.fy;
    d(trail, OMEGA) += r.moment_trail;
  }

  d.col(VX) /= mass_;
  d.col(VY) /= mass_;
  d.col(OMEGA) /= inertia_;
  if (ground_.on_track_law == inputs::OnTrackLaw::guided) {
    for (Eigen::Index k = 0; k < n; ++k) {
      if (held(k)) d(k, VY) = d(k, OMEGA) = 0.0;  // the rails' reactions do no work
    }
  }
}

void DerailmentModel::jacobian(const double* y, const SetEntry& set) const {
  // The same force laws, differentiated automatically: exact, and no second copy of the physics.
  using Dual = Eigen::AutoDiffScalar<Eigen::Vector4d>;
  using Block = Eigen::Matrix3d;  // accelerations (x, y, theta) against three positions or velocities
  const Eigen::Index n = car_count();
  const ConstMotionMap q = motion(y, n);
  std::vector<Block> by_velocity(cars_.size()), diagonal(cars_.size()), upper(cars_.size()), lower(cars_.size());

  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Dual theta(q(k, THETA), 4, 0), vx(q(k, VX), 4, 1), vy(q(k, VY), 4, 2), omega(q(k, OMEGA), 4, 3);
    const auto g = ground_reaction<Dual>(ground_.on_track_law, derailed(k), load_[k], ground_.regularization_speed,
                                         half_spacing_[k], Dual(cos(theta)), Dual(sin(theta)), vx, vy, omega);
    diagonal[i].setZero();
    const Dual* rows[3] = {&g.fx, &g.fy, &g.moment};
    for (int r = 0; r < 3; ++r) {
      diagonal[i](r, 2) = rows[r]->derivatives()[0];
      by_velocity[i].row(r) = rows[r]->derivatives().tail<3>();
    }
  }

  for (Eigen::Index i = 0; i + 1 < n; ++i) {
    const auto lead = static_cast<std::size_t>(i);
    const Dual dx(q(i, X) - q(i + 1, X), 4, 0), dy(q(i, Y) - q(i + 1, Y), 4, 1);
    const Dual theta_lead(q(i, THETA), 4, 2), theta_trail(q(i + 1, THETA), 4, 3);
    const auto r = coupler_reaction<Dual>(coupler_, cos_limit_, half_length_[i], half_length_[i + 1], dx, dy, Dual(cos(theta_lead)),
                                          Dual(sin(theta_lead)), Dual(cos(theta_trail)), Dual(sin(theta_trail)));
    Eigen::Matrix<double, 3, 4> on_lead, on_trail;
    on_lead << r.fx.derivatives().transpose(), r.fy.derivatives().transpose(), r.moment_lead.derivatives().transpose();
    on_trail << -r.fx.derivatives().transpose(), -r.fy.derivatives().transpose(),
        r.moment_trail.derivatives().transpose();
    // d/dx of the lead car is d/d(dx), of the trail car its opposite.
    const auto against_lead = [](const Eigen::Matrix<double, 3, 4>& d) {
      return (Block() << d.col(0), d.col(1), d.col(2)).finished();
    };
    const auto against_trail = [](const Eigen::Matrix<double, 3, 4>& d) {
      return (Block() << -d.col(0), -d.col(1), d.col(3)).finished();
    };
    diagonal[lead] += against_lead(on_lead);
    upper[lead] = against_trail(on_lead);
    lower[lead + 1] = against_lead(on_trail);
    diagonal[lead + 1] += against_trail(on_trail);
  }

  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double divisor[3] = {mass_[k], mass_[k], inertia_[k]};
    for (Eigen::Index r = 0; r < 3; ++r) {
      const Eigen::Index row = kCoordinates * k + 3 + r;
      set(kCoordinates * k + r, row, 1.0);
      if (held(k) && r > 0) continue;
      for (Eigen::Index c = 0; c < 3; ++c) {
        set(row, kCoordinates * k + c, diagonal[i](r, c) / divisor[r]);
        set(row, kCoordinates * k + 3 + c, by_velocity[i](r, c) / divisor[r]);
        if (k + 1 < n) set(row, kCoordinates * (k + 1) + c, upper[i](r, c) / divisor[r]);
        if (k > 0) set(row, kCoordinates * (k - 1) + c, lower[i](r, c) / divisor[r]);
      }
    }
  }
}

CouplerState<double> DerailmentModel::coupler(const double* y, Eigen::Index i) const {
  const ConstMotionMap q = motion(y, car_count());
  const Eigen::Vector2d d = rear_pin(y, i).position - front_pin(y, i + 1).position;
  return coupler_state<double>(coupler_, d.x(), d.y(), std::cos(q(i, THETA)), std::sin(q(i, THETA)),
                               std::cos(q(i + 1, THETA)), std::sin(q(i + 1, THETA)));
}

PointMotion DerailmentModel::point(const double* y, Eigen::Index car, double offset) const {
  const ConstMotionMap q = motion(y, car_count());
  const Eigen::Vector2d axis(std::cos(q(car, THETA)), std::sin(q(car, THETA)));
  const Eigen::Vector2d normal(-axis.y(), axis.x());
  return {Eigen::Vector2d(q(car, X), q(car, Y)) + offset * axis,
          Eigen::Vector2d(q(car, VX), q(car, VY)) + offset * q(car, OMEGA) * normal};
}

EnergyLedger DerailmentModel::energy(const double* y) const {
  const Eigen::Index n = car_count();
  const ConstMotionMap q = motion(y, n);
  EnergyLedger e;
  e.kinetic_translation = 0.5 * (mass_ * (q.col(VX).square() + q.col(VY).square())).sum();
  e.kinetic_rotation = 0.5 * (inertia_ * q.col(OMEGA).square()).sum();
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    const CouplerState<double> b = coupler(y, i);
    e.coupler_axial += axial_energy(coupler_, b.gap);
    e.coupler_swing += swing_energy(coupler_, b.swing_lead) + swing_energy(coupler_, b.swing_trail);
  }
  e.work_on_track = work(y, n)[WORK_ON_TRACK];
  e.work_off_track = work(y, n)[WORK_OFF_TRACK];
  return e;
}

Momentum DerailmentModel::momentum(const double* y) const {
  const ConstMotionMap q = motion(y, car_count());
  Momentum p;
  p.x = (mass_ * q.col(VX)).sum();
  p.y = (mass_ * q.col(VY)).sum();
  p.angular = (inertia_ * q.col(OMEGA) + mass_ * (q.col(X) * q.col(VY) - q.col(Y) * q.col(VX))).sum();
  return p;
}

}  // namespace train_derail::model
