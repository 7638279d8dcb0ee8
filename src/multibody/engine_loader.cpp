/// \file
/// Loads the module with the multibody engine, and passes all calls on to it.
#include <dlfcn.h>

#include <stdexcept>

#include "multibody/engine_run.hpp"
#include "multibody/spatial_engine.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::multibody {

namespace {

template <class Function>
Function load(const char* name) {
  // The module is never unloaded: its objects live until the process ends.
  void* module = dlopen(kEngineModule, RTLD_NOW | RTLD_LOCAL);
  void* function = module == nullptr ? nullptr : dlsym(module, name);
  if (function == nullptr) {
    throw std::runtime_error(std::string("the multibody engine cannot be loaded: ") + dlerror() +
                             "; a build has it if Simbody is installed (Debian: libsimbody-dev) and "
                             "TRAIN_DERAIL_MULTIBODY is ON");
  }
  return reinterpret_cast<Function>(function);
}

StartEngine start_engine() {
  static const auto function = load<StartEngine>(kEngineFunction);
  return function;
}

}  // namespace

void require() { start_engine(); }

void require_paper(const inputs::Scenario& scenario) {
  const auto refuse = [](const std::string& key, const char* value, const char* why) {
    throw inputs::InputError("scenario", key, value, why, "the paper's model alone");
  };
  if (scenario.model == inputs::Model::spatial)
    refuse("model", "spatial",
           "the multibody engine computes no scenario of this model, only single cars and couplers "
           "in the tests (docs/spatial_model.md)");
  const std::string part = inputs::first_part_beyond_the_paper(scenario);
  if (!part.empty()) refuse(part, "", "the multibody engine has no such part");
}

Engine::Engine(const inputs::Scenario& scenario, const EngineOptions& options) {
  require_paper(scenario);
  run_.reset(start_engine()(scenario, options));
}
Engine::~Engine() = default;
Engine::Engine(Engine&&) noexcept = default;
Engine& Engine::operator=(Engine&&) noexcept = default;
void Engine::advance(double t, const std::atomic<bool>* stop) { run_->advance(t, stop); }
void Engine::run(const std::atomic<bool>* stop) { advance(inputs::kInfinity, stop); }
double Engine::time() const { return run_->time(); }
bool Engine::ended() const { return run_->ended(); }
std::vector<BodyMotion> Engine::cars() const { return run_->cars(); }
std::vector<CouplerForce> Engine::coupler_forces() const { return run_->coupler_forces(); }
outcome::Outcome Engine::outcome() const { return run_->outcome(); }

std::unique_ptr<SpatialEngineRun> start_spatial_engine(const inputs::Scenario& scenario,
                                                       const std::vector<FreeMotion>& start,
                                                       const SpatialEngineOptions& options) {
  static const auto function = load<StartSpatialEngine>(kSpatialEngineFunction);
  return std::unique_ptr<SpatialEngineRun>(function(scenario, start, options));
}

}  // namespace train_derail::multibody
