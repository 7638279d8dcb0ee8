/// \file
/// The multibody engine in three dimensions: cars are free bodies of Simbody.
#pragma once

#include <memory>
#include <vector>

#include "multibody/engine_run.hpp"

namespace train_derail::multibody {

/// Starts a run; the scenario must be valid, and have no parts that the engine has not. `start`: motions of the cars,
/// see Engine; null: the scenario's initial motion. Trucks that start past the point of derailment are off the rails;
/// others leave them there.
std::unique_ptr<EngineRun> start_spatial_engine(const inputs::Scenario& scenario, const EngineOptions& options,
                                                const std::vector<BodyMotion>* start);

}  // namespace train_derail::multibody
