/// \file
/// Many runs that do not depend on each other, on all cores: the one machinery of studies, validation and verification.
#pragma once

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/simulation/progress.hpp"

namespace train_derail::simulation {

/// Cores that this process may use.
inline int cores() {
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0
             ? std::max(CPU_COUNT(&set), 1)
             : static_cast<int>(std::max(std::thread::hardware_concurrency(), 1U));
}

/// Most threads that are of any use; what is asked for beyond is not started.
inline int jobs_max() { return 4 * cores(); }

namespace detail {

/// Calls each(i) for every i below `count`, on `jobs` threads, this one among them. Where the system gives no more
/// threads, those that are there do it. An exception of each() ends all and is thrown here.
template <class Each>
void on_threads(std::size_t count, int jobs, const Each& each) {
  const int wanted = std::min(jobs > 0 ? jobs : cores(), jobs_max());
  const std::size_t threads = std::min(static_cast<std::size_t>(wanted), count);
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr broken;
  const auto work = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        each(i);
      } catch (...) {
        const std::lock_guard<std::mutex> lock(mutex);
        if (!broken) broken = std::current_exception();
        next = count;
      }
    }
  };
  std::vector<std::thread> others;
  others.reserve(threads);
  try {
    for (std::size_t k = 1; k < threads; ++k) others.emplace_back(work);
  } catch (const std::system_error&) {  // a limit of the system: fewer then
  }
  work();
  for (std::thread& thread : others) thread.join();
  if (broken) std::rethrow_exception(broken);
}

inline const outcome::Outcome& outcome_of(const outcome::Outcome& outcome) { return outcome; }
template <class Result>
const outcome::Outcome& outcome_of(const Result& result) {
  return result.outcome;
}

}  // namespace detail

/// What came of run_many().
struct ManyRuns {
  Progress progress;          ///< at the end
  std::int64_t computed = 0;  ///< runs of this call that are done
  double wall_time = 0.0;     ///< [s]
};

/// Computes runs 0 to `count` - 1 on `jobs` threads (0: one a core), dealt out one by one. compute(i) returns an
/// Outcome or something with a member `outcome`; many threads call it at a time. keep(i, result) puts the result away;
/// one thread calls it at a time, and on_progress() after it. What is kept depends on the runs alone, not on threads
/// and order, if compute() and keep() see to it that run i stays run i.
///
/// Once `stop` is set no run begins, and one that was broken off (Ended::running) is neither kept nor counted.
/// `before`: counts of what is there already. An exception of any of the three functions ends all and is thrown here.
template <class Compute, class Keep>
ManyRuns run_many(std::size_t count, int jobs, Progress before, const Compute& compute, const Keep& keep,
                  const OnProgress& on_progress, const std::atomic<bool>& stop) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  const auto elapsed = [start] { return std::chrono::duration<double>(Clock::now() - start).count(); };
  ManyRuns runs;
  runs.progress = std::move(before);
  std::mutex mutex;
  detail::on_threads(count, jobs, [&](std::size_t i) {
    if (stop) return;
    auto result = compute(i);
    const outcome::Outcome& outcome = detail::outcome_of(result);
    if (outcome.ended == outcome::Ended::running) return;
    const bool failed = outcome.ended == outcome::Ended::integration_failed;
    std::string message = failed ? outcome.message : "";
    const std::lock_guard<std::mutex> lock(mutex);
    keep(i, std::move(result));
    ++runs.computed;
    ++runs.progress.done;
    if (failed) {
      ++runs.progress.failed;
      runs.progress.message = std::move(message);
    }
    runs.progress.rate = static_cast<double>(runs.computed) / elapsed();
    on_progress(runs.progress);
  });
  runs.wall_time = elapsed();
  return runs;
}

}  // namespace train_derail::simulation
