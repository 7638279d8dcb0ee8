#include "outcome/loops.hpp"

#include "simd/instruction_sets.hpp"

namespace train_derail::outcome {

namespace {

constexpr Versions<MonitorLoops> kVersions TRAIN_DERAIL_VERSIONS(kLoops);

}  // namespace

const MonitorLoops& loops() {
  static const MonitorLoops& fastest = *kVersions.fastest();
  return fastest;
}

std::vector<const MonitorLoops*> usable_loops() { return kVersions.usable(kVersions.any_length); }

}  // namespace train_derail::outcome
