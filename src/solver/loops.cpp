#include "solver/loops.hpp"

#include "simd/instruction_sets.hpp"

namespace train_derail::solver {

namespace {

#ifdef TRAIN_DERAIL_X86
constexpr Versions<VectorLoops> kVersions{&kLoopsAvx512, &kLoopsAvx2, &kLoopsSse2, &kLoopsPlain};
#else
constexpr Versions<VectorLoops> kVersions{nullptr, nullptr, nullptr, &kLoopsPlain};
#endif

}  // namespace

const VectorLoops& loops() {
  static const VectorLoops& fastest = *kVersions.fastest();
  return fastest;
}

std::vector<const VectorLoops*> usable_loops() { return kVersions.usable(kVersions.any_length); }

}  // namespace train_derail::solver
