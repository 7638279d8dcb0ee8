/// \file
/// One run of one scenario: the same object under the node, the command line and the studies.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train_model.hpp"
#include "train_derail/outcome/outcome.hpp"
#include "train_derail/simulation/checkpoint.hpp"

namespace train_derail::simulation {

/// One car at one moment, and what it has been through.
struct CarSnapshot : model::CarObservation {
  bool off_track = false;      ///< a truck centre has been sideways by more than outcome.off_track_threshold
  double lateral_reach = 0.0;  ///< of the farthest corner of the footprint from the centre line [m]

  /// Angle between the car's own vertical axis and the vertical, 0 to pi [rad].
  double tilt() const { return 2.0 * std::asin(std::min(1.0, std::hypot(qx, qy))); }
};

/// One coupler at one moment, and its largest forces in the steps of the last call of advance() that moved time. Forces
/// are magnitudes; they are looked for within steps too.
struct CouplerSnapshot : model::CouplerObservation {
  double buff_peak = 0.0;        ///< largest compression [N]
  double draft_peak = 0.0;       ///< largest tension [N]
  double buff_peak_time = 0.0;   ///< when [s]
  double draft_peak_time = 0.0;  ///< when [s]
};

/// The train at one moment.
struct Snapshot {
  double time = 0.0;  ///< s
  std::vector<CarSnapshot> cars;
  std::vector<CouplerSnapshot> couplers;
};

/// Not thread-safe; not copyable. The result does not depend on how advance() is called, bit for bit.
class Simulation {
 public:
  /// Throws inputs::InputError if the scenario is not valid.
  explicit Simulation(const inputs::Scenario& scenario);
  /// Starts from `initial` (a state of the model, as state() gives it) instead of the scenario's initial motion.
  /// Throws std::invalid_argument if it lets a car on the track leave the rails of the reading `guided`.
  Simulation(const inputs::Scenario& scenario, const model::StateVector& initial);
  /// Goes on from a checkpoint: bit for bit as the run that was saved, if the scenario is the one it was saved with;
  /// else with these inputs from there on. Throws inputs::InputError if the scenario is not valid, has another train
  /// (`consist`) or another model, or if the checkpoint does not fit it.
  Simulation(const inputs::Scenario& scenario, const Checkpoint& checkpoint);
  ~Simulation();
  Simulation(Simulation&&) noexcept;
  Simulation& operator=(Simulation&&) noexcept;

  /// Starts anew at time 0. If it throws InputError the running simulation is untouched.
  void reset(const inputs::Scenario& scenario);

  /// Runs on to simulated time t [s], or to the end of the run if that comes first. A t in the past does nothing.
  /// Returns within a few steps once `stop` is set: then time() may be short of t and the run has not ended; a later
  /// call goes on.
  void advance(double t, const std::atomic<bool>* stop = nullptr);
  /// Runs to the end.
  void run(const std::atomic<bool>* stop = nullptr);

  /// The inputs of this run.
  const inputs::Scenario& scenario() const;
  /// The cars in the order of the train.
  const std::vector<model::Car>& cars() const;
  /// Simulated time of snapshot() and state() [s].
  double time() const;
  /// Nothing moves any more, stop.time_max is reached, or the integration has failed; outcome() says which.
  bool ended() const;
  /// State at time(), to start another run from; snapshot() says what is in it.
  const model::StateVector& state() const;
  Snapshot snapshot() const;
  /// The run as it is now. Throws inputs::InputError unless solver.method is semi_implicit: the history that error
  /// control keeps cannot be saved.
  Checkpoint checkpoint() const;
  /// The outcome so far; final once ended().
  outcome::Outcome outcome() const;
  /// First touches of two cars so far, in the order of time; valid until the next call that is not const.
  const std::vector<outcome::FirstTouch>& touches() const;
  /// Trucks that left the rails, broken couplers, impacts so far; empty for the paper's model, which notes nothing
  /// itself.
  const model::Incidents& incidents() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace train_derail::simulation
