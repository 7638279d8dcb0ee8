// Scenarios of the parts beyond the paper, and a driver of the extended model, that their tests share.
#pragma once

#include <memory>
#include <vector>

#include "fixtures.hpp"
#include "train_derail/model/extended_model.hpp"

namespace train_derail::test {

/// All parts on as in config/variants/accident_sources.yaml, for a train of `cars` equal cars in emergency from the
/// start.
inline inputs::Scenario accident(int cars, double mph = 37.0) {
  using namespace inputs;
  Scenario s;
  s.title = "accident";
  CarBlock block;
  block.name = "tank_car";
  block.count = cars;
  block.length = 55.0 * kFoot;
  block.weight = 286.0 * kKip;
  block.truck_spacing = 42.0 * kFoot;
  s.consist = {block};
  s.coupler.slack = 0.08 * kFoot;
  s.coupler.stiffness = 30e6 * kPoundForce / kFoot;
  s.coupler.draft_gear_travel = 0.5 * kFoot;
  s.coupler.damping_ratio = 0.15;
  s.coupler.swing_limit = 13.0 * kDegree;
  s.coupler.swing_stiffness = 3e6 * kPoundForce * kFoot;
  s.coupler.break_draft = 650.0 * kKip;
  s.coupler.break_swing = 45.0 * kDegree;
  s.ground.on_track_law = OnTrackLaw::rails;
  s.ground.off_track_law = OffTrackLaw::by_slip;
  s.brakes.law = BrakeLaw::air;
  s.brakes.emergency_time = 0.0;
  s.contact.law = ContactLaw::elastic;
  s.initial.speed = mph * kMph;
  s.initial.yaw_rate = 0.1;
  s.initial.perturbation.kick = 1.0 * kFoot;
  s.initial.perturbation.alignment = 0.02 * kFoot;
  s.initial.perturbation.spacing = 0.02 * kFoot;
  s.stop.time_max = 60.0;
  s.outcome.sample_interval = 0.05;
  s.solver.method = Method::semi_implicit;
  s.solver.fixed_step = 0.002;
  return s;
}

/// The same cars with every part off and no force of any kind: switch on what is looked at.
inline inputs::Scenario bare(int cars, double step = 1e-3) {
  inputs::Scenario s = accident(cars);
  s.model = inputs::Model::extended;
  s.coupler = {};
  s.coupler.stiffness = s.coupler.swing_stiffness = 0.0;
  s.ground = {};
  s.rails.rolling_share = 0.0;
  set_friction(s, 0.0, 0.0);
  s.brakes = {};
  s.contact = {};
  s.initial = {};
  s.solver.fixed_step = step;
  return s;
}

/// bare() on rails, with brakes that roll without resistance.
inline inputs::Scenario on_rails(int cars, double step = 1e-3) {
  inputs::Scenario s = bare(cars, step);
  s.ground.on_track_law = inputs::OnTrackLaw::rails;
  s.brakes.law = inputs::BrakeLaw::air;
  s.brakes.rolling_resistance = 0.0;
  return s;
}

/// Distance between the centres of the cars of accident() and bare() at mid-slack [m].
inline constexpr double kPitch = 59.0 * inputs::kFoot;

/// The extended model with its integrator, and nothing else: no sampling, no stop rule.
class Train final : private solver::SteppedSystem {
 public:
  explicit Train(const inputs::Scenario& s) : model_(s) { begin(s, model_.initial_state()); }
  Train(const inputs::Scenario& s, const std::vector<CarMotion>& cars) : model_(s) { begin(s, state_of(cars)); }

  void step() { last_ = integrator_->step(); }
  /// To the end of the step that t lies in.
  void to(double t) {
    while (time() < t - 1e-9 && last_.status == solver::StepStatus::stepped) step();
  }

  double time() const { return integrator_->time(); }
  bool failed() const { return last_.status == solver::StepStatus::failed; }
  const model::ExtendedModel& model() const { return model_; }
  const model::Incidents& incidents() const { return *model_.incidents(); }
  const model::StateVector& state() const { return integrator_->state(); }
  const double* data() const { return state().data(); }
  CarMotion car(Eigen::Index k) const {
    const auto q = model::motion(data(), model_.car_count());
    return {q(k, model::X), q(k, model::Y), q(k, model::THETA), q(k, model::VX), q(k, model::VY), q(k, model::OMEGA)};
  }
  model::EnergyLedger energy() const { return model_.energy(data()); }
  model::Momentum momentum() const { return model_.momentum(data()); }
  /// Accelerations of a car in the state at time(), by the positions' second difference over one more step of the
  /// model.
  CarMotion rates_over_a_step(Eigen::Index k) {
    const CarMotion a = car(k);
    const double t = time();
    step();
    const CarMotion b = car(k);
    const double h = time() - t;
    return {(b.x - a.x) / h,   (b.y - a.y) / h,   (b.theta - a.theta) / h,
            (b.vx - a.vx) / h, (b.vy - a.vy) / h, (b.omega - a.omega) / h};
  }

 private:
  void begin(const inputs::Scenario& s, const model::StateVector& state) {
    model_.start(state.data());
    solver::SteppedSystem& system = *this;
    integrator_ = solver::make_integrator(s.solver, system, 0.0, state);
  }
  Eigen::Index size() const override { return model_.size(); }
  Eigen::Index position_count() const override { return 3 * model_.car_count(); }
  void accelerations(double t, double h, const double* y, double* a) override { model_.accelerations(t, h, y, a); }
  void settle(double t, double h, const double* before, double* y) override { model_.settle(t, h, before, y); }

  model::ExtendedModel model_;
  std::unique_ptr<solver::Integrator> integrator_;
  solver::StepResult last_;
};

/// Cars of a straight train at mid-slack, the first one's centre at `x`.
inline std::vector<CarMotion> in_line(int cars, double x, double speed) {
  std::vector<CarMotion> train;
  for (int k = 0; k < cars; ++k) train.push_back({x - k * kPitch, 0.0, 0.0, speed, 0.0, 0.0});
  return train;
}

}  // namespace train_derail::test
