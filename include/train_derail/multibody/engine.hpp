/// \file
/// Computes a run by a general multibody engine (Simbody), as a second opinion on the purpose-built models. Cars are
/// planar or free bodies of Simbody; couplers, trucks and friction are its force elements; integrator and events are
/// its own too. Only inputs and outcome are shared with the purpose-built models, no physics. Simbody is linked into a
/// separate module.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "train_derail/eigen_types.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::multibody {

/// Checks that this build has the engine. Throws std::runtime_error, which says how to get such a build, if it has not.
void require();

/// Checks that the engine computes such a scenario: the paper's model without further parts, or the model in three
/// dimensions on straight track with one grade and one cross-section, a broken rail, air brakes and bodies that are
/// boxes. Throws inputs::InputError, which names `where` (file or scenario) and all keys that ask for parts that it has
/// not, their values and what is allowed.
void require_parts(const inputs::Scenario& scenario, const std::string& where = "scenario");

class EngineRun;

/// Mistakes that can be put into the engine. For tests only: they show that the comparison finds such mistakes.
enum class Fault {
  none,                ///< no mistake
  lateral_force_sign,  ///< plane: the lateral force E of the couplers acts the wrong way
  coupler_arm,         ///< plane: couplers pull at the truck centres instead of the pins
  no_front_truck,      ///< plane: no friction under front trucks
  friction_swapped,    ///< plane: on-track friction acts past the point of derailment, off-track friction before it
  yaw_inertia,         ///< plane: yaw inertia is 20 % too large
  gyroscopic_sign,     ///< space: the gyroscopic moment turns cars the wrong way
  centre_below_rail,   ///< space: forces on trucks act as far above the centre of mass as they should act below it
  no_roll_stop,        ///< space: a car that goes over does not take its neighbours along
  contact_at_centre,   ///< space: cars push each other at their centres of mass instead of where they touch
};

/// EngineOptions of the engine.
struct EngineOptions {
  /// Simbody's accuracy of a step, root mean square over the train; 0: solver.rtol, in space 1e-5.
  double accuracy = 0.0;
  bool rods = false;  ///< couplers are rigid rods (constraints) instead of springs; slack and stiffness are unused
  Fault fault = Fault::none;  ///< for tests
  double settle_time = 5e-4;  ///< in space: in which the strain of friction that slides comes to its limit [s]
};

/// Motion of one car in the world frame: x along the track, y to the left, z up from the top of the rails. In the plane
/// heights are zero.
struct BodyMotion {
  Eigen::Vector3d centre;    ///< of mass [m]
  Eigen::Matrix3d axes;      ///< columns: unit vectors forward, left and up of the car
  Eigen::Vector3d velocity;  ///< of the centre of mass [m/s]
  Eigen::Vector3d rotation;  ///< angular velocity, world frame [rad/s]
};

/// Forces of one coupler (docs/model.md, section 3).
struct CouplerForce {
  double axial;    ///< F, buff positive, of rods too [N]
  double lateral;  ///< E, lateral force; not known in space, where it is 0 [N]
};

/// One run, computed by Simbody's Runge-Kutta-Merson method. Of the scenario's solver.* only rtol (in the plane),
/// steps_max and wall_time_max are used. Not copyable. An object must be used by one thread at a time; several objects
/// may run at once.
class Engine {
 public:
  /// Starts a run. Throws inputs::InputError if the scenario is not valid or has parts that the engine has not,
  /// std::runtime_error if this build has no engine.
  explicit Engine(const inputs::Scenario& scenario, const EngineOptions& options = {});
  /// The same in space, from those motions of the cars instead of the scenario's initial motion. Throws
  /// std::invalid_argument if they are not one for each car, or the scenario is not in space.
  Engine(const inputs::Scenario& scenario, const EngineOptions& options, const std::vector<BodyMotion>& start);
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
  /// In space no ledger of the energy is kept and no blockage force: these are NaN.
  outcome::Outcome outcome() const;

 private:
  std::unique_ptr<EngineRun> run_;
};

}  // namespace train_derail::multibody
