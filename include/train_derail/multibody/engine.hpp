// The same train, computed anew by a general multibody engine (Simbody): planar bodies, couplers and ground friction as
// its force elements, its integrator, its events. Shares inputs and outcome with the purpose-built model, and no
// physics. Simbody stays in a module of its own.
#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::multibody {

/// Throws std::runtime_error that says how to get a build with the engine, if this one has none.
void require();

class EngineRun;

/// Mistakes that can be put into the engine's forces, so that tests can show that a comparison notices them. For tests
/// only.
enum class Fault {
  none,
  lateral_force_sign,  // the lateral force E of the couplers acts the wrong way
  coupler_arm,         // couplers pull at the truck centres, not at the pins
  no_front_truck,      // no friction under front trucks
  friction_swapped,    // the friction of either side of the point of derailment acts on the other
  yaw_inertia,         // 20 % too large
};

struct Options {
  double accuracy = 0.0;  // Simbody's: of a step, root mean square over the train; 0: solver.rtol
  bool rods = false;  // couplers keep their length: constraints instead of springs; slack and stiffness have no meaning
  Fault fault = Fault::none;
};

struct CarMotion {
  double x, y, theta;    // centre of mass [m, m, rad]
  double vx, vy, omega;  // m/s, m/s, rad/s
};

struct CouplerForce {
  double axial;    // F, buff positive; of rods as well [N]
  double lateral;  // E [N]
};

/// One run, by the Runge-Kutta-Merson method. Of the scenario's solver.* only rtol, steps_max and wall_time_max apply.
/// Not copyable; one thread an object, any number of objects.
class Engine {
 public:
  /// Throws inputs::InputError if the scenario is not valid, std::runtime_error if this build has no engine.
  explicit Engine(const inputs::Scenario& scenario, const Options& options = {});
  ~Engine();
  Engine(Engine&&) noexcept;
  Engine& operator=(Engine&&) noexcept;

  /// Runs on to simulated time t [s], or to the end of the run if that comes first. A t in the past does nothing.
  /// Returns within a sample once `stop` is set: then time() may be short of t and the run has not ended; a later call
  /// goes on.
  void advance(double t, const std::atomic<bool>* stop = nullptr);
  /// Runs to the end.
  void run(const std::atomic<bool>* stop = nullptr);

  double time() const;  // s
  bool ended() const;
  /// At time(), from the first car to derail back.
  std::vector<CarMotion> cars() const;
  std::vector<CouplerForce> coupler_forces() const;
  /// So far; final once ended(). Same definitions as of the purpose-built model, observed by code of its own.
  outcome::Outcome outcome() const;

 private:
  std::unique_ptr<EngineRun> run_;
};

}  // namespace train_derail::multibody
