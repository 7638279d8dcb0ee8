#include "bag_output.hpp"

#include <dlfcn.h>

#include <stdexcept>

namespace train_derail::apps {

std::unique_ptr<BagOutput> open_bag(const std::string& path, files::Existing existing,
                                    const simulation::Simulation& simulation) {
  // The module is never unloaded: its objects live until the process ends.
  void* module = dlopen(kBagModule, RTLD_NOW | RTLD_LOCAL);
  void* function = module == nullptr ? nullptr : dlsym(module, kBagFunction);
  if (function == nullptr) throw std::runtime_error(std::string("--bag: this build has no ROS: ") + dlerror());
  return std::unique_ptr<BagOutput>(reinterpret_cast<OpenBag>(function)(path, existing, simulation));
}

}  // namespace train_derail::apps
