/// \file
/// Runs what a study still lacks, on all cores.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "train_derail/simulation/progress.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

/// How a study is run.
struct RunOptions {
  std::string folder;   ///< where the results go
  int jobs = 0;         ///< threads; 0: one a core
  bool resume = false;  ///< without it a folder that already holds runs is refused
  Shard shard;
};

using simulation::Progress;

/// What a call of run_study() has done.
struct RunReport {
  std::int64_t runs = 0;              ///< of this shard that are in the journal now
  std::int64_t computed = 0;          ///< by this call
  std::int64_t failed = 0;            ///< of these; they are in the journal with their reason
  bool stopped = false;               ///< before all was done
  double wall_time = 0.0;             ///< s
  std::vector<std::string> problems;  ///< lines of journals that were not good: their runs have been computed anew
};

/// Results depend on the study alone: not on threads, order or interruptions.
/// `on_progress` is called from the worker threads, one at a time. `stop` makes it return soon: runs under way are
/// given up. Throws inputs::InputError: the study cannot mean what it says (see check()), or what lies in the folder
/// cannot be read; std::runtime_error: the folder holds another study, or runs and is not to be resumed, or it cannot
/// be written.
RunReport run_study(const Study& study, const RunOptions& options,
                    const std::function<void(const Progress&)>& on_progress, const std::atomic<bool>& stop);

/// The outcome of one run; of inputs that are refused, one that failed. Ended::running: `stop` was set.
outcome::Outcome outcome_of(const Study& study, const Point& point, const Run& run, const std::atomic<bool>& stop);

/// All runs of a study in memory, nothing on disk; those that `stop` prevented have Ended::running. Throws
/// inputs::InputError.
std::vector<outcome::Outcome> run_in_memory(const Study& study, int jobs,
                                            const std::function<void(const Progress&)>& on_progress,
                                            const std::atomic<bool>& stop);

/// Most threads that RunOptions::jobs starts on this machine: more are of no use.
int jobs_max();

}  // namespace train_derail::study
