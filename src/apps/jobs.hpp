/// \file
/// Shared by the commands that compute many runs.
#pragma once

#include <iostream>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "train_derail/study/runner.hpp"

namespace train_derail::apps {

/// Returns `jobs`, or the largest useful number of threads if that is less, and then says so on standard error.
inline int useful_jobs(int jobs) {
  if (jobs <= study::jobs_max()) return jobs;
  std::cerr << fmt::format("derail: --jobs = {}: more threads than are useful on this machine; {} are used\n", jobs,
                           study::jobs_max());
  return study::jobs_max();
}

/// Prints the bad lines of journals and what was done about them.
inline void say_problems(const std::vector<std::string>& problems, const std::string& consequence) {
  constexpr std::size_t kShown = 20;
  for (std::size_t i = 0; i < problems.size() && i < kShown; ++i)
    std::cerr << "derail: " << problems[i] << "; " << consequence << "\n";
  if (problems.size() > kShown) std::cerr << fmt::format("derail: ... and {} lines more\n", problems.size() - kShown);
}

}  // namespace train_derail::apps
