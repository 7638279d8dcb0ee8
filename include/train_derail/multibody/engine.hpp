/// \file
/// Computes a run by a general multibody engine (Simbody), as a second opinion on the purpose-built model. Cars are
/// planar bodies of Simbody; couplers and ground friction are its force elements; integrator and events are its own
/// too. Only inputs and outcome are shared with the purpose-built model, no physics. Simbody is linked into a separate
/// module.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::multibody {

/// Checks that this build has the engine. Throws std::runtime_error, which says how to get such a build, if it has not.
void require();

/// Checks that the engine computes such a scenario: the paper's model, without further parts. Throws
/// inputs::InputError, which names the first part that it has not.
void require_paper(const inputs::Scenario& scenario);

class EngineRun;

/// Mistakes that can be put into the engine's forces. For tests only: they show that the comparison finds such
/// mistakes.
enum class Fault {
  none,                ///< no mistake
  lateral_force_sign,  ///< the lateral force E of the couplers acts the wrong way
  coupler_arm,         ///< couplers pull at the truck centres instead of the pins
  no_front_truck,      ///< no friction under front trucks
  friction_swapped,    ///< on-track friction acts past the point of derailment, off-track friction before it
  yaw_inertia,         ///< yaw inertia is 20 % too large
};

/// EngineOptions of the engine.
struct EngineOptions {
  double accuracy = 0.0;  ///< Simbody's accuracy of a step, root mean square over the train; 0: solver.rtol
  bool rods = false;      ///< couplers are rigid rods (constraints) instead of springs; slack and stiffness are unused
  Fault fault = Fault::none;  ///< for tests
};

/// Motion of one car in the world frame: x along the track, y to the left, angles counter-clockwise.
struct BodyMotion {
  double x, y, theta;    ///< centre of mass [m] and heading [rad]
  double vx, vy, omega;  ///< velocity of the centre of mass [m/s] and yaw rate [rad/s]
};

/// Forces of one coupler (docs/model.md, section 3).
struct CouplerForce {
  double axial;    ///< F, buff positive, of rods too [N]
  double lateral;  ///< E, lateral force [N]
};

/// One run, computed by Simbody's Runge-Kutta-Merson method. Of the scenario's solver.* only rtol, steps_max and
/// wall_time_max are used. Not copyable. An object must be used by one thread at a time; several objects may run at
/// once.
class Engine {
 public:
  /// Starts a run. Throws inputs::InputError if the scenario is not valid, std::runtime_error if this build has no
  /// engine.
  explicit Engine(const inputs::Scenario& scenario, const EngineOptions& options = {});
  ~Engine();
  Engine(Engine&&) noexcept;
  Engine& operator=(Engine&&) noexcept;

  /// Continues the run to the simulated time t [s], or to its end if that comes first. A time in the past does nothing.
  /// Once `stop` is set it returns within one sample; then time() may be less than t, and a later call continues.
  void advance(double t, const std::atomic<bool>* stop = nullptr);
  /// Continues the run to its end, or until `stop` is set.
  void run(const std::atomic<bool>* stop = nullptr);

  /// Simulated time that was reached [s].
  double time() const;
  /// Whether the run has ended.
  bool ended() const;
  /// Motion of all cars at time(), from the foremost car back.
  std::vector<BodyMotion> cars() const;
  /// Forces of all couplers at time(), in the order of the train.
  std::vector<CouplerForce> coupler_forces() const;
  /// Outcome so far; final once ended(). It is defined as for the purpose-built model, but computed by separate code.
  outcome::Outcome outcome() const;

 private:
  std::unique_ptr<EngineRun> run_;
};

}  // namespace train_derail::multibody
