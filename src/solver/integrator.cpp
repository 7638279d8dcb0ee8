#include "train_derail/solver/integrator.hpp"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "stepper.hpp"

namespace train_derail::solver {

void Integrator::walk(files::Archive&) { throw std::logic_error("an integrator that cannot be saved"); }

StepResult Stepper::step() {
  StepResult result;
  if (step_count() >= options_.steps_max) {
    result.status = StepStatus::failed;
    result.message = fmt::format("solver.steps_max = {} steps taken at t = {} s", options_.steps_max, time_);
    return result;
  }
  last_good_ = state_;
  error_.clear();
  double t = time_;
  Flag flag = evolve(t, state_);
  if (flag != Flag::failed && !(std::isfinite(t) && all_finite(state_.data(), state_.size()))) {
    flag = Flag::failed;
    error_ = "the state is not finite";
  }
  if (flag == Flag::failed) {
    state_ = last_good_;
    result.status = StepStatus::failed;
    result.message = fmt::format("{} (last good time {} s)", error_, time_);
    return result;
  }
  previous_time_ = time_;
  time_ = t;
  if (flag == Flag::root) {
    result.status = StepStatus::event;
    directions_.assign(static_cast<std::size_t>(system_.event_count()), 0);
    root_info(directions_.data());
    for (std::size_t i = 0; i < directions_.size(); ++i) {
      if (directions_[i] != 0) result.events.push_back(static_cast<Eigen::Index>(i));
    }
  }
  return result;
}

void Stepper::error_weights(const double* y, double* weights, Eigen::Index size) const {
  const Eigen::Index controlled = size - system_.quadrature_count();
  solver::error_weights(options_.rtol, options_.atol, y, weights, controlled);
  // SUNDIALS wants positive weights.
  Eigen::Map<ArrayX>(weights + controlled, size - controlled).setConstant(1e-100);
}

int Stepper::derivative(double t, const double* y, double* dydt) { return system_.derivative(t, y, dydt) ? 0 : 1; }

std::unique_ptr<Integrator> make_integrator(const inputs::Solver& options, OdeSystem& system, double t0,
                                            const VectorX& y0) {
  if (options.method == inputs::Method::bdf) return make_bdf(options, system, t0, y0);
  if (options.method == inputs::Method::dormand_prince) return make_dormand_prince(options, system, t0, y0);
  return make_explicit(options, system, t0, y0);
}

}  // namespace train_derail::solver
