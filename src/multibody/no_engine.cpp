// Stands in for engine.cpp in a build without Simbody.
#include <stdexcept>

#include "train_derail/multibody/engine.hpp"

namespace train_derail::multibody {

struct Engine::Impl {};

bool available() { return false; }

void require() {
  throw std::runtime_error(
      "this build has no multibody engine; install Simbody (Debian: libsimbody-dev) and configure anew "
      "with -DTRAIN_DERAIL_MULTIBODY=ON");
}

Engine::Engine(const inputs::Scenario&, const Options&) { require(); }
Engine::~Engine() = default;
Engine::Engine(Engine&&) noexcept = default;
Engine& Engine::operator=(Engine&&) noexcept = default;
void Engine::advance(double) {}
void Engine::run() {}
double Engine::time() const { return 0.0; }
bool Engine::ended() const { return true; }
std::vector<CarMotion> Engine::cars() const { return {}; }
std::vector<CouplerForce> Engine::coupler_forces() const { return {}; }
outcome::Outcome Engine::outcome() const { return {}; }

}  // namespace train_derail::multibody
