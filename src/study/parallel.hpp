// Independent runs on all cores, dealt out one by one.
#pragma once

#include <cstddef>

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

namespace train_derail::study {

/// Calls each(i) for every i below `count`, on `jobs` threads (0: one a core).
template <class Each>
void for_each_run(std::size_t count, int jobs, const Each& each) {
  const int threads = jobs > 0 ? jobs : tbb::this_task_arena::max_concurrency();
  const tbb::global_control as_asked(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, 1),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t i = range.begin(); i != range.end(); ++i) each(i);
        },
        tbb::simple_partitioner());
  });
}

}  // namespace train_derail::study
