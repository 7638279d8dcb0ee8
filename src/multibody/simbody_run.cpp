#include "multibody/simbody_run.hpp"

#include <algorithm>
#include <stdexcept>

#include <fmt/format.h>

namespace train_derail::multibody {

SimbodyRun::SimbodyRun(const inputs::Scenario& scenario)
    : scenario_(scenario),
      train_(model::expand(scenario_.consist)),
      matter_(system_),
      forces_(system_),
      observer_(train_, scenario_),
      integrator_(system_),
      stepper_(system_, integrator_) {
  forces_.setNumberOfThreads(1);  // the runs are distributed over the cores, not the forces of one run
}

void SimbodyRun::begin(const SimTK::State& state, double accuracy) {
  integrator_.setAccuracy(accuracy);
  integrator_.setReturnEveryInternalStep(true);
  stepper_.setReportAllSignificantStates(true);
  stepper_.initialize(state);
}

double SimbodyRun::elapsed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - started_).count();
}

void SimbodyRun::advance(double t, const std::atomic<bool>* stop) {
  started_ = std::chrono::steady_clock::now();
  advance_by_steps(std::min(t, scenario_.stop.time_max), stop);
  wall_time_ += elapsed();
}

void SimbodyRun::advance_by_steps(double target, const std::atomic<bool>* stop) {
  sample();
  while (!ended() && time() < target) {
    if (stop != nullptr && stop->load(std::memory_order_relaxed)) return;
    try {
      require_budget();
      stepper_.stepTo(std::min(due(), target));
      follow();
    } catch (const std::exception& e) {
      ended_ = outcome::Ended::integration_failed;
      message_ = e.what();
      return;
    }
    sample();
  }
  if (!ended() && time() >= scenario_.stop.time_max) ended_ = outcome::Ended::time_max;
}

void SimbodyRun::require_budget() const {
  if (integrator_.getNumStepsTaken() >= scenario_.solver.steps_max)
    throw std::runtime_error(fmt::format("solver.steps_max = {} is reached", scenario_.solver.steps_max));
  if (wall_time_ + elapsed() > scenario_.solver.wall_time_max) {
    throw std::runtime_error(fmt::format("solver.wall_time_max = {} s of computing are used up at t = {:.4g} s",
                                         scenario_.solver.wall_time_max, time()));
  }
}

void SimbodyRun::sample() {
  const double t = due();
  if (time() < t) return;
  ++next_sample_;
  observer_.sample(t, from_above());
  if (observer_.at_rest()) ended_ = outcome::Ended::at_rest;
}

outcome::Outcome SimbodyRun::outcome() const {
  outcome::Outcome o;
  report(o);
  o.stop_time = time();
  o.ended = ended_;
  o.message = message_;
  o.solver.steps = integrator_.getNumStepsTaken();
  o.solver.rejected_steps = integrator_.getNumStepsAttempted() - integrator_.getNumStepsTaken();
  o.solver.rhs_evaluations = integrator_.getNumRealizations();
  o.wall_time = wall_time_;
  return o;
}

}  // namespace train_derail::multibody
