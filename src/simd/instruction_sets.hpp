// Which versions of kernels this processor can run.
#pragma once

#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#ifdef TRAIN_DERAIL_X86
#include <xsimd/xsimd.hpp>
#endif

#include "train_derail/eigen_types.hpp"

namespace train_derail {

/// The versions of a set of loops, from the objects name##Plain and, on x86, name##Sse2, name##Avx2, name##Avx512.
#ifdef TRAIN_DERAIL_X86
#define TRAIN_DERAIL_VERSIONS(name) \
  { &name##Avx512, &name##Avx2, &name##Sse2, &name##Plain }
#else
#define TRAIN_DERAIL_VERSIONS(name) \
  { nullptr, nullptr, nullptr, &name##Plain }
#endif

/// One object a version, each with instruction_set (its name) and lanes.
template <class Kernels>
struct Versions {
  const Kernels* avx512;
  const Kernels* avx2;
  const Kernels* sse2;
  const Kernels* plain;

  /// Those that the processor at hand can run and that suit the length of the train, fastest first.
  std::vector<const Kernels*> usable(Eigen::Index cars) const {
    std::vector<const Kernels*> all;
#ifdef TRAIN_DERAIL_X86
    const auto has = xsimd::available_architectures();
    if (has.avx512dq) all.push_back(avx512);
    if (has.fma3_avx2) all.push_back(avx2);
    all.push_back(sse2);
#endif
    std::vector<const Kernels*> suited;
    for (const Kernels* v : all) {
      if (v->lanes < cars) suited.push_back(v);
    }
    suited.push_back(plain);
    return suited;
  }

  /// The fastest for loops of any length.
  const Kernels* fastest() const { return choose(any_length, ""); }
  static constexpr Eigen::Index any_length = std::numeric_limits<Eigen::Index>::max();

  std::vector<std::string> names(Eigen::Index cars) const {
    std::vector<std::string> names;
    for (const Kernels* v : usable(cars)) names.emplace_back(v->instruction_set);
    return names;
  }

  /// The one of that name, by default the fastest. Throws std::invalid_argument.
  const Kernels* choose(Eigen::Index cars, const std::string& instruction_set) const {
    for (const Kernels* v : usable(cars)) {
      if (instruction_set.empty() || instruction_set == v->instruction_set) return v;
    }
    throw std::invalid_argument(fmt::format("instruction set '{}' for {} cars: this processor has {}", instruction_set,
                                            cars, fmt::join(names(cars), ", ")));
  }
};

}  // namespace train_derail
