#include "solver/loops.hpp"

#include "simd/instruction_sets.hpp"

namespace train_derail::solver {

namespace {

constexpr Versions<VectorLoops> kVersions TRAIN_DERAIL_VERSIONS(kLoops);

}  // namespace

const VectorLoops& loops() {
  static const VectorLoops& fastest = *kVersions.fastest();
  return fastest;
}

std::vector<const VectorLoops*> usable_loops() { return kVersions.usable(kVersions.any_length); }

}  // namespace train_derail::solver
