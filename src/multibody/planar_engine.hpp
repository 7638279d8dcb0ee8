/// \file
/// The multibody engine in the plane: cars are planar bodies of Simbody.
#pragma once

#include <memory>

#include "multibody/engine_run.hpp"

namespace train_derail::multibody {

/// Starts a run; the scenario must be valid.
std::unique_ptr<EngineRun> start_planar_engine(const inputs::Scenario& scenario, const EngineOptions& options);

}  // namespace train_derail::multibody
