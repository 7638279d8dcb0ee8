/// \file
/// Computes independent runs on all cores.
#pragma once

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace train_derail {

/// Returns the number of cores that this process may use.
inline int cores() {
  cpu_set_t set;
  return sched_getaffinity(0, sizeof set, &set) == 0
             ? std::max(CPU_COUNT(&set), 1)
             : static_cast<int>(std::max(std::thread::hardware_concurrency(), 1U));
}

/// Returns the largest useful number of threads; more are not started.
inline int jobs_max() { return 4 * cores(); }

/// Calls each(i) for every i below `count`, on `jobs` threads (0: one for each core); the calling thread is one of
/// them. If the system does not start as many threads, fewer do the work. If each() throws, all threads stop and the
/// exception is thrown here.
template <class Each>
void for_each_run(std::size_t count, int jobs, const Each& each) {
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
  } catch (const std::system_error&) {  // the system allows no more threads: go on with fewer
  }
  work();
  for (std::thread& thread : others) thread.join();
  if (broken) std::rethrow_exception(broken);
}

}  // namespace train_derail
