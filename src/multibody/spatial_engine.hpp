/// \file
/// Interface of the second opinion on trains in three dimensions: cars are free bodies of Simbody. Its part of the
/// module with Simbody is loaded when it is first needed.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::multibody {

/// Mistakes that can be put into the engine, to show that the comparison finds such mistakes.
enum class SpatialFault {
  none,
  gyroscopic_sign,    ///< the gyroscopic moment turns cars the wrong way
  centre_below_rail,  ///< forces on trucks act as far above the centre of mass as they should act below it
  no_roll_stop,       ///< a car that goes over does not take its neighbours along
};

struct SpatialEngineOptions {
  double accuracy = 1e-8;     ///< of a step of Simbody
  double settle_time = 5e-5;  ///< in which the strain of friction that slides comes to its limit [s]
  SpatialFault fault = SpatialFault::none;
};

/// A car in space: centre of mass [m], its velocity [m/s], unit vectors forward, left and up, and angular velocity in
/// the world frame [rad/s].
struct FreeMotion {
  Eigen::Vector3d centre;
  Eigen::Matrix3d axes;
  Eigen::Vector3d velocity, rotation;
};

/// A run. Trucks that start past the point of derailment are off the rails; others leave them there.
class SpatialEngineRun {
 public:
  virtual ~SpatialEngineRun() = default;
  /// Continues to time t [s].
  virtual void advance(double t) = 0;
  virtual double time() const = 0;
  virtual std::vector<FreeMotion> cars() const = 0;
};

/// Starts cars of the scenario from those motions. The engine has springs and dampers of trucks, straight rails that
/// hold, ground with banks, and couplers that break and slip. Throws std::invalid_argument if the scenario has other
/// parts; std::runtime_error if this build has no engine.
std::unique_ptr<SpatialEngineRun> start_spatial_engine(const inputs::Scenario& scenario,
                                                       const std::vector<FreeMotion>& start,
                                                       const SpatialEngineOptions& options = {});

inline constexpr char kSpatialEngineFunction[] = "train_derail_start_spatial_engine";
using StartSpatialEngine = SpatialEngineRun* (*)(const inputs::Scenario& scenario, const std::vector<FreeMotion>& start,
                                                 const SpatialEngineOptions& options);

}  // namespace train_derail::multibody
