#include "train_derail/model/derailment_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <unsupported/Eigen/AutoDiff>

#include "model/kernels.hpp"
#include "model/reactions.hpp"
#include "simd/instruction_sets.hpp"

namespace train_derail::model {

namespace {

constexpr Versions<DerailmentKernels> kVersions TRAIN_DERAIL_VERSIONS(k);

}  // namespace

std::vector<std::string> DerailmentModel::instruction_sets(Eigen::Index cars) { return kVersions.names(cars); }

DerailmentModel::DerailmentModel(const inputs::Scenario& scenario, const std::string& instruction_set)
    : PlanarModel(scenario),
      derailed_(cars_.size(), false),
      kernels_(kVersions.choose(car_count(), instruction_set)),
      arrays_(std::make_unique<DerailmentArrays>()) {
  const Eigen::Index n = car_count();
  for (auto* array : {&load_, &lateral_, &past_pod_, &inverse_mass_y_}) array->resize(n);
  static_cast<PlanarArrays&>(*arrays_) = planar_arrays();
  arrays_->load = load_.data();
  arrays_->lateral = lateral_.data();
  arrays_->past_pod = past_pod_.data();
  arrays_->inverse_mass_y = inverse_mass_y_.data();
  for (Eigen::Index k = 0; k < n; ++k) lay(k);
  if (n > 0) derail(0);
}

DerailmentModel::~DerailmentModel() = default;

const PlanarKernels& DerailmentModel::loops() const { return *kernels_; }

void DerailmentModel::lay(Eigen::Index car) {
  const bool past_pod = derailed(car);
  const bool held = !past_pod && ground_.on_track_law == inputs::OnTrackLaw::guided;
  const bool lateral = past_pod || ground_.on_track_law == inputs::OnTrackLaw::isotropic;
  past_pod_[car] = past_pod ? 1.0 : 0.0;
  load_[car] = 0.5 * (past_pod ? ground_.off_track_friction : ground_.on_track_friction) * at(car).weight;
  lateral_[car] = lateral ? 1.0 : 0.0;
  // Rails that hold a car are an infinite mass sideways and in yaw; their reactions do no work.
  inverse_mass_y_[car] = held ? 0.0 : 1.0 / at(car).mass;
  inverse_inertia_[car] = held ? 0.0 : 1.0 / at(car).yaw_inertia;
}

void DerailmentModel::derail(Eigen::Index car) {
  derailed_[static_cast<std::size_t>(car)] = true;
  lay(car);
}

void DerailmentModel::start(const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    if (q(k, X) >= 0.0) {
      derail(k);
    } else if (ground_.on_track_law == inputs::OnTrackLaw::guided &&
               (q(k, Y) != 0.0 || q(k, THETA) != 0.0 || q(k, VY) != 0.0 || q(k, OMEGA) != 0.0)) {
      throw std::invalid_argument(
          fmt::format("initial state: car {} is on the track, where the reading 'guided' wants "
                      "y, theta and their rates to be 0",
                      k + 1));
    }
  }
}

Eigen::Index DerailmentModel::foremost(const double* y) const {
  const ConstMotionMap q = motion(y, car_count());
  Eigen::Index first = -1;
  for (Eigen::Index k = 0; k < car_count(); ++k) {
    if (!derailed(k) && (first < 0 || q(k, X) > q(first, X))) first = k;
  }
  return first;
}

void DerailmentModel::reach_pod(const double* y) {
  const ConstMotionMap q = motion(y, car_count());
  // The car whose crossing has been located may stand a rounding short of it.
  Eigen::Index car = foremost(y);
  do {
    derail(car);
    car = foremost(y);
  } while (car >= 0 && q(car, X) >= 0.0);
}

void DerailmentModel::walk(files::Archive& archive) {
  archive.flags("derailed", derailed_);
  for (Eigen::Index k = 0; k < car_count(); ++k) lay(k);
}

std::vector<Eigen::Index> DerailmentModel::band_positions() const {
  const Eigen::Index n = car_count();
  std::vector<Eigen::Index> positions(static_cast<std::size_t>(size()));
  for (Eigen::Index i = 0; i < size(); ++i) {
    positions[static_cast<std::size_t>(i)] =
        i < kCoordinates * n ? band_index(i % n, static_cast<Coordinate>(i / n)) : i;
  }
  return positions;
}

bool DerailmentModel::derivative(const double* y, double* dydt) const {
  return kernels_->right_hand_side(*arrays_, y, dydt);
}

bool DerailmentModel::accelerations(const double* y, double* dydt) const {
  return kernels_->accelerations(*arrays_, y, dydt);
}

double DerailmentModel::foremost_on_track(const double* y) const { return kernels_->foremost(*arrays_, y); }

void DerailmentModel::jacobian(const double* y, const SetEntry& set) const {
  // The same force laws, differentiated automatically: exact, and no second copy of the physics.
  using Dual = Eigen::AutoDiffScalar<Eigen::Vector4d>;
  const auto constant = [](double value) { return Dual(value, Eigen::Vector4d::Zero()); };
  using Block = Eigen::Matrix3d;  // accelerations (x, y, theta) against three positions or velocities
  const Eigen::Index n = car_count();
  const ConstMotionMap q = motion(y, n);
  std::vector<Block> by_velocity(cars_.size()), diagonal(cars_.size()), upper(cars_.size()), lower(cars_.size());

  for (Eigen::Index k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Dual theta(q(k, THETA), 4, 0), vx(q(k, VX), 4, 1), vy(q(k, VY), 4, 2), omega(q(k, OMEGA), 4, 3);
    const auto g =
        ground_reaction<Dual>(constant(load_[k]), constant(lateral_[k]), constant(half_spacing_[k]),
                              ground_.regularization_speed, Dual(cos(theta)), Dual(sin(theta)), vx, vy, omega);
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
    CouplerReaction<Dual> r;
    with_coupler_reaction<Dual>(coupler_, cos_limit_, constant(half_length_[i]), constant(half_length_[i + 1]), dx, dy,
                                Dual(cos(theta_lead)), Dual(sin(theta_lead)), Dual(cos(theta_trail)),
                                Dual(sin(theta_trail)), [&r](const CouplerReaction<Dual>& found) { r = found; });
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
    const double inverse[3] = {inverse_mass_[k], inverse_mass_y_[k], inverse_inertia_[k]};
    for (Eigen::Index r = 0; r < 3; ++r) {
      const Eigen::Index row = kCoordinates * k + 3 + r;
      set(kCoordinates * k + r, row, 1.0);
      for (Eigen::Index c = 0; c < 3; ++c) {
        set(row, kCoordinates * k + c, diagonal[i](r, c) * inverse[r]);
        set(row, kCoordinates * k + 3 + c, by_velocity[i](r, c) * inverse[r]);
        if (k + 1 < n) set(row, kCoordinates * (k + 1) + c, upper[i](r, c) * inverse[r]);
        if (k > 0) set(row, kCoordinates * (k - 1) + c, lower[i](r, c) * inverse[r]);
      }
    }
  }
}

std::vector<CouplerState<double>> DerailmentModel::couplers(const double* y) const {
  const ConstMotionMap q = motion(y, car_count());
  kernels_->headings(car_count(), y + THETA * car_count(), cos_.data(), sin_.data());
  std::vector<CouplerState<double>> all;
  all.reserve(cars_.size());
  for (Eigen::Index i = 0; i < coupler_count(); ++i) {
    const double lead = half_length_[i], trail = half_length_[i + 1];
    all.push_back(coupler_state<double>(coupler_, q(i, X) - q(i + 1, X) - lead * cos_[i] - trail * cos_[i + 1],
                                        q(i, Y) - q(i + 1, Y) - lead * sin_[i] - trail * sin_[i + 1], cos_[i], sin_[i],
                                        cos_[i + 1], sin_[i + 1]));
  }
  return all;
}

EnergyLedger DerailmentModel::energy(const double* y) const {
  EnergyLedger e = kinetic_energy(y);
  for (const CouplerState<double>& b : couplers(y)) {
    e.coupler_axial += axial_energy(coupler_, b.gap);
    e.coupler_swing += swing_energy(coupler_, b.swing_lead) + swing_energy(coupler_, b.swing_trail);
  }
  e.work_on_track = work(y, car_count())[WORK_ON_TRACK];
  e.work_off_track = work(y, car_count())[WORK_OFF_TRACK];
  return e;
}

}  // namespace train_derail::model
