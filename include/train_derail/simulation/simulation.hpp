// One run of one scenario: the same object under the node, the command line and the studies.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train_model.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::simulation {

struct CarSnapshot {
  double x, y, theta;                            // centre of mass [m, m, rad]
  double vx, vy, omega;                          // m/s, m/s, rad/s
  bool past_pod;                                 // has passed the point of derailment
  bool off_track;                                // counts as off the track
  double front_truck_offset, rear_truck_offset;  // y of the truck centres, left positive [m]
  bool derailed;                                 // a truck is off the rails (without rails that yield: past_pod)
  model::Cause cause = model::Cause::none;       // what took its first truck off; rails that yield only
};

/// Coupler i (from 0) joins cars[i] (lead) and cars[i + 1] (trail).
struct CouplerSnapshot {
  double gap;                      // G, pin to pin [m]
  double angle;                    // beta, of the line from the trail car's front pin to the lead car's rear pin [rad]
  double axial_force;              // F, buff positive [N]
  double lateral_force;            // E [N]
  double swing_lead, swing_trail;  // gamma at either end [rad]
  double moment_lead, moment_trail;  // m on either car [N m]
  bool broken;                       // carries nothing any more
  // Largest in the steps of the last call of advance() that moved time, found within steps, up to now; magnitudes.
  double buff_peak = 0.0;        // [N]
  double draft_peak = 0.0;       // [N]
  double buff_peak_time = 0.0;   // [s]
  double draft_peak_time = 0.0;  // [s]
};

struct Snapshot {
  double time = 0.0;  // s
  std::vector<CarSnapshot> cars;
  std::vector<CouplerSnapshot> couplers;
};

/// Not thread-safe; not copyable. The result does not depend on how advance() is called, bit for bit.
class Simulation {
 public:
  /// Throws inputs::InputError if the scenario is not valid.
  explicit Simulation(const inputs::Scenario& scenario);
  /// Starts from `initial` (layout of model/state.hpp) instead of the scenario's initial motion.
  /// Throws std::invalid_argument if it lets a car on the track leave the rails of the reading `guided`.
  Simulation(const inputs::Scenario& scenario, const model::StateVector& initial);
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

  const inputs::Scenario& scenario() const;
  const std::vector<model::Car>& cars() const;
  double time() const;  // of snapshot() and state() [s]
  bool ended() const;
  /// State at time(); layout of model/state.hpp.
  const model::StateVector& state() const;
  Snapshot snapshot() const;
  /// So far; final once ended().
  outcome::Outcome outcome() const;
  /// First touches of two cars so far, in the order of time; valid until the next call that is not const.
  const std::vector<outcome::Closing>& touches() const;
  /// Trucks that left the rails, broken couplers, impacts so far; empty for the paper's model, which notes nothing
  /// itself.
  const model::Incidents& incidents() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace train_derail::simulation
