// A driver of the spatial model, and what else its tests share.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "extended_fixtures.hpp"
#include "train_derail/files/archive.hpp"
#include "train_derail/model/spatial_model.hpp"

namespace train_derail::test {

/// The spatial model with its integrator, and nothing else: no sampling, no stop rule.
class SpatialTrain final : private solver::SteppedSystem {
 public:
  explicit SpatialTrain(const inputs::Scenario& s, const std::vector<model::SpatialMotion>& cars = {},
                        const std::string& instruction_set = "")
      : model_(s, instruction_set) {
    model::StateVector state = model_.initial_state();
    for (std::size_t k = 0; k < cars.size(); ++k) model_.place(state.data(), static_cast<Eigen::Index>(k), cars[k]);
    model_.start(state.data());
    solver::SteppedSystem& system = *this;
    integrator_ = solver::make_integrator(s.solver, system, 0.0, state);
  }

  /// Goes on from where another one is now, with the same inputs or others; `cars`: with its cars there.
  SpatialTrain(const inputs::Scenario& s, SpatialTrain& saved, const std::vector<model::SpatialMotion>& cars = {})
      : model_(s) {
    files::Archive saving;
    saved.model_.walk(saved.time(), saved.data(), saving);
    model::StateVector state = saved.integrator_->state();
    const auto restore = [&] {
      files::Archive restoring(saving.bytes());
      const model::StateVector& placed = state;
      model_.walk(saved.time(), placed.data(), restoring);
    };
    restore();
    for (std::size_t k = 0; k < cars.size(); ++k) model_.place(state.data(), static_cast<Eigen::Index>(k), cars[k]);
    if (!cars.empty()) restore();
    solver::SteppedSystem& system = *this;
    integrator_ = solver::make_integrator(s.solver, system, saved.time(), state);
  }

  void step() { last_ = integrator_->step(); }
  void to(double t) {
    while (time() < t - 1e-9 && last_.status == solver::StepStatus::stepped) step();
    ASSERT_EQ(last_.status, solver::StepStatus::stepped) << last_.message;
  }
  /// To time t, with a look at the state after every step.
  void to(double t, const std::function<void()>& look) {
    while (time() < t - 1e-9) {
      step();
      look();
    }
  }

  double time() const { return integrator_->time(); }
  const model::SpatialModel& model() const { return model_; }
  const model::Incidents& incidents() const { return *model_.incidents(); }
  const double* data() const { return integrator_->state().data(); }
  model::SpatialMotion car(Eigen::Index k) const { return model_.motion(data(), k); }
  model::EnergyLedger energy() const { return model_.energy(data()); }
  model::SpatialMomentum momentum() const { return model_.momentum(data()); }
  /// Roll of a car, positive if its left side is up [rad].
  double roll(Eigen::Index k) const {
    const Eigen::Matrix3d axes = car(k).axes;
    return std::atan2(axes(2, 1), axes(2, 2));
  }

 private:
  Eigen::Index size() const override { return model_.size(); }
  Eigen::Index position_count() const override { return model_.position_count(); }
  void accelerations(double t, double h, const double* y, double* a) override { model_.accelerations(t, h, y, a); }
  void settle(double t, double h, const double* before, double* y) override { model_.settle(t, h, before, y); }

  model::SpatialModel model_;
  std::unique_ptr<solver::Integrator> integrator_;
  solver::StepResult last_;
};

/// Cars on rails, without any force but weight, springs of trucks and the rails. Trucks weigh nothing: what loses them
/// stays as it is.
inline inputs::Scenario spatial(int cars, double step = 1e-3) {
  inputs::Scenario s = on_rails(cars, step);
  s.model = inputs::Model::spatial;
  s.coupler.pitch_stiffness = s.coupler.roll_stiffness = 0.0;
  for (inputs::CarBlock& block : s.consist) block.truck_weight = 0.0;
  return s;
}

/// A run in which all forces of the model act.
inline inputs::Scenario everything(int cars, double step, bool hilly = false) {
  inputs::Scenario s = test::accident(cars);
  s.model = inputs::Model::spatial;
  s.track.grade = -0.01;
  s.track.curves = {{-400.0, 700.0, 1.0 / 600.0, hilly ? 0.1 : 0.0}};
  if (hilly) s.track.grades = {{-300.0, 250.0, -0.015}, {-50.0, 400.0, 0.02}};
  s.terrain.bank_left = 2.0;
  s.terrain.bank_right = -1.0;
  s.terrain.ballast_height = 0.5;
  s.contact.crush_force = 1.2e6 * inputs::kPoundForce;
  s.contact.side_crush_force = 0.5e6 * inputs::kPoundForce;
  s.initial.cars_ahead = 5;
  s.initial.perturbation.seed = 4;
  s.solver.fixed_step = step;
  s.stop.speed = 0.01;
  s.stop.time_max = 100.0;
  return s;
}

inline double height_of(const inputs::Scenario& s, std::size_t k = 0) {
  return model::expand(s.consist)[k].centre_height;
}

inline model::SpatialMotion at(const Eigen::Vector3d& centre, const Eigen::Matrix3d& axes = Eigen::Matrix3d::Identity(),
                               const Eigen::Vector3d& velocity = Eigen::Vector3d::Zero(),
                               const Eigen::Vector3d& rates = Eigen::Vector3d::Zero()) {
  return {centre, axes, velocity, axes * rates, rates};
}
inline Eigen::Matrix3d turned(double angle, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix();
}

inline constexpr double kGravity = inputs::kStandardGravity;

/// Far ahead of the point of derailment, where trucks are off the rails, and high above the ground: only weight acts.
inline const Eigen::Vector3d kAloft(50.0, 3.0, 60.0);

/// Tanks whose axis goes through the centre of mass, so that they can roll about it.
inline void make_tanks(inputs::Scenario& s) {
  for (inputs::CarBlock& block : s.consist) {
    block.shape = inputs::BodyShape::cylinder;
    block.width = 3.0;
    block.floor_height = 1.0;
    block.roof_height = 4.0;
    block.centre_height = 2.5;
  }
}

}  // namespace train_derail::test
