/// \file
/// Loads the module with the multibody engine, and passes all calls on to it.
#include <dlfcn.h>

#include <stdexcept>

#include "multibody/engine_run.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::multibody {

namespace {

StartEngine load() {
  // The module is never unloaded: its objects live until the process ends.
  void* module = dlopen(kEngineModule, RTLD_NOW | RTLD_LOCAL);
  void* function = module == nullptr ? nullptr : dlsym(module, kEngineFunction);
  if (function == nullptr) {
    throw std::runtime_error(std::string("the multibody engine cannot be loaded: ") + dlerror() +
                             "; a build has it if Simbody is installed (Debian: libsimbody-dev) and "
                             "TRAIN_DERAIL_MULTIBODY is ON");
  }
  return reinterpret_cast<StartEngine>(function);
}

StartEngine start_engine() {
  static const StartEngine function = load();
  return function;
}

}  // namespace

void require() { start_engine(); }

Engine::Engine(const inputs::Scenario& scenario, const EngineOptions& options) {
  inputs::validate(scenario);
  require_parts(scenario);
  run_.reset(start_engine()(scenario, options, nullptr));
}
Engine::Engine(const inputs::Scenario& scenario, const EngineOptions& options, const std::vector<BodyMotion>& start) {
  if (inputs::model_of(scenario) != inputs::Model::spatial)
    throw std::invalid_argument("cars start from given motions in space only");
  inputs::validate(scenario);
  require_parts(scenario);
  run_.reset(start_engine()(scenario, options, &start));
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

}  // namespace train_derail::multibody
