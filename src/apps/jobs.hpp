// What commands that compute many runs have in common.
#pragma once

#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "train_derail/study/runner.hpp"

namespace train_derail::apps {

/// `jobs` as asked for, or as many as are of use here; says so.
inline int useful_jobs(int jobs) {
  if (jobs <= study::jobs_max()) return jobs;
  std::cerr << fmt::format("derail: --jobs = {}: more threads than are useful on this machine; {} are used\n", jobs,
                           study::jobs_max());
  return study::jobs_max();
}

/// Lines of journals that were not believed, and what came of it.
inline void say_problems(const std::vector<std::string>& problems, const std::string& consequence) {
  constexpr std::size_t kShown = 20;
  for (std::size_t i = 0; i < problems.size() && i < kShown; ++i)
    std::cerr << "derail: " << problems[i] << "; " << consequence << "\n";
  if (problems.size() > kShown) std::cerr << fmt::format("derail: ... and {} lines more\n", problems.size() - kShown);
}

}  // namespace train_derail::apps
