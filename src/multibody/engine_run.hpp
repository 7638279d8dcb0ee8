/// \file
/// Interface of the module with Simbody. The module is loaded when it is first needed; without it everything else
/// starts faster.
#pragma once

#include "train_derail/multibody/engine.hpp"

namespace train_derail::multibody {

/// One run, see Engine.
class EngineRun {
 public:
  virtual ~EngineRun() = default;
  virtual void advance(double t, const std::atomic<bool>* stop) = 0;
  virtual double time() const = 0;
  virtual bool ended() const = 0;
  virtual std::vector<BodyMotion> cars() const = 0;
  virtual std::vector<CouplerForce> coupler_forces() const = 0;
  virtual outcome::Outcome outcome() const = 0;
};

inline constexpr char kEngineModule[] = "libtrain_derail_multibody.so";
inline constexpr char kEngineFunction[] = "train_derail_start_engine";
/// The function of the module. `start`: motions of the cars, see Engine; null: the scenario's initial motion.
using StartEngine = EngineRun* (*)(const inputs::Scenario& scenario, const EngineOptions& options,
                                   const std::vector<BodyMotion>* start);

}  // namespace train_derail::multibody
