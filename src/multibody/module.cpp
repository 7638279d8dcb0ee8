/// \file
/// The function of the module with Simbody.
#include "multibody/engine_run.hpp"
#include "multibody/planar_engine.hpp"
#include "multibody/spatial_engine.hpp"

extern "C" train_derail::multibody::EngineRun* train_derail_start_engine(
    const train_derail::inputs::Scenario& scenario, const train_derail::multibody::EngineOptions& options,
    const std::vector<train_derail::multibody::BodyMotion>* start) {
  using namespace train_derail;
  const bool space = inputs::model_of(scenario) == inputs::Model::spatial;
  return (space ? multibody::start_spatial_engine(scenario, options, start)
                : multibody::start_planar_engine(scenario, options))
      .release();
}
