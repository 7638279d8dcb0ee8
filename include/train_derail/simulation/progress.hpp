/// \file
/// How far the computing of many runs has come.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace train_derail::simulation {

/// Counts of many runs, told again whenever one is done.
struct Progress {
  std::int64_t done = 0;    ///< runs that are there, those of earlier calls included
  std::int64_t total = 0;   ///< runs that are wanted
  std::int64_t failed = 0;  ///< runs of this call whose integration failed
  double rate = 0.0;        ///< runs of this call per second of wall time
  std::string message;      ///< why the last run that failed did
};

/// Called from the threads that compute, one call at a time.
using OnProgress = std::function<void(const Progress&)>;

}  // namespace train_derail::simulation
