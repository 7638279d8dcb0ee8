// Runs what a study still lacks, on all cores.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

#include "train_derail/study/journal.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

struct RunOptions {
  std::string folder;
  int jobs = 0;         // threads; 0: one a core
  bool resume = false;  // without it a folder that already holds runs is refused
  Shard shard;
};

struct Progress {
  std::int64_t done = 0, total = 0;  // of this shard, runs of earlier calls included
  std::int64_t failed = 0;           // by this call
  double rate = 0.0;                 // runs a second, of this call
  std::string message;               // why the last run that failed did
};

struct RunReport {
  std::int64_t runs = 0;      // of this shard that are in the journal now
  std::int64_t computed = 0;  // by this call
  std::int64_t failed = 0;    // of these; they are in the journal with their reason
  bool stopped = false;       // before all was done
  double wall_time = 0.0;     // s
};

/// Results depend on the study alone: not on threads, order or interruptions.
/// `on_progress` is called from the worker threads, one at a time. `stop` makes it return after the runs in flight.
/// Throws std::runtime_error if the folder or its journal cannot be used.
RunReport run_study(const Study& study, const RunOptions& options, const std::function<void(const Progress&)>& on_progress,
                    const std::atomic<bool>& stop);

}  // namespace train_derail::study
