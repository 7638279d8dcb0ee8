#include "outcome/loops.hpp"

#include "simd/instruction_sets.hpp"

namespace train_derail::outcome {

namespace {

#ifdef TRAIN_DERAIL_X86
constexpr Versions<MonitorLoops> kVersions{&kLoopsAvx512, &kLoopsAvx2, &kLoopsSse2, &kLoopsPlain};
#else
constexpr Versions<MonitorLoops> kVersions{nullptr, nullptr, nullptr, &kLoopsPlain};
#endif

}  // namespace

const MonitorLoops& loops() {
  static const MonitorLoops& fastest = *kVersions.fastest();
  return fastest;
}

std::vector<const MonitorLoops*> usable_loops() { return kVersions.usable(kVersions.any_length); }

}  // namespace train_derail::outcome
