#include "bag_output.hpp"

#include <dlfcn.h>

#include <stdexcept>

#include "bag_input.hpp"

namespace train_derail::apps {

namespace {

/// A function of the module. The module is never unloaded: its objects live until the process ends.
template <class Function>
Function from_module(const char* name, const std::string& asked) {
  void* module = dlopen(kBagModule, RTLD_NOW | RTLD_LOCAL);
  void* function = module == nullptr ? nullptr : dlsym(module, name);
  if (function == nullptr) throw std::runtime_error(asked + ": this build has no ROS: " + dlerror());
  return reinterpret_cast<Function>(function);
}

}  // namespace

std::unique_ptr<BagOutput> open_bag(const std::string& path, files::Existing existing,
                                    const simulation::Simulation& simulation) {
  return std::unique_ptr<BagOutput>(from_module<OpenBag>(kBagFunction, "--bag")(path, existing, simulation));
}

std::vector<std::string> read_bag(const std::string& path, std::uint32_t run_id, const std::string& name) {
  std::vector<std::string> documents;
  from_module<ReadBag>(kReadBagFunction, path)(path, run_id, name, documents);
  return documents;
}

}  // namespace train_derail::apps
