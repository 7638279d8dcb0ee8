/// \file
/// What runs by Simbody in the plane and in space have in common: bodies in a system, steps from sample to sample, the
/// stop rule, and why a run ended.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <Simbody.h>

#include "multibody/engine_run.hpp"
#include "multibody/observer.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::multibody {

class SimbodyRun : public EngineRun {
 public:
  void advance(double t, const std::atomic<bool>* stop) override;
  double time() const override { return state().getTime(); }
  bool ended() const override { return ended_ != outcome::Ended::running; }
  outcome::Outcome outcome() const override;

 protected:
  /// The scenario must be valid.
  explicit SimbodyRun(const inputs::Scenario& scenario);

  /// The run begins from that state, with that accuracy of a step.
  void begin(const SimTK::State& state, double accuracy);
  const SimTK::State& state() const { return stepper_.getState(); }

  /// All cars from above.
  virtual std::vector<PlanMotion> from_above() const = 0;
  /// Looks at the state after every step.
  virtual void follow() = 0;
  /// Writes all but how the run went to the outcome.
  virtual void report(outcome::Outcome& o) const = 0;

  const inputs::Scenario scenario_;
  const std::vector<model::Car> train_;
  SimTK::MultibodySystem system_;
  SimTK::SimbodyMatterSubsystem matter_;
  SimTK::GeneralForceSubsystem forces_;
  Observer observer_;

 private:
  void advance_by_steps(double target, const std::atomic<bool>* stop);
  void require_budget() const;
  double due() const { return static_cast<double>(next_sample_) * scenario_.outcome.sample_interval; }
  /// Takes a sample if one is due at the time that was reached.
  void sample();
  double elapsed() const;

  SimTK::RungeKuttaMersonIntegrator integrator_;
  SimTK::TimeStepper stepper_;
  std::int64_t next_sample_ = 0;
  outcome::Ended ended_ = outcome::Ended::running;
  std::string message_;
  double wall_time_ = 0.0;                         // of the calls of advance() before this one
  std::chrono::steady_clock::time_point started_;  // this one
};

}  // namespace train_derail::multibody
