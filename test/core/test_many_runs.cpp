// Many runs at a time: what is kept, what is counted, how they are stopped and how they fail.
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "simulation/many_runs.hpp"

namespace train_derail::simulation {
namespace {

constexpr std::size_t kRuns = 200;

/// Run i is at rest after i seconds; every tenth fails.
outcome::Outcome outcome_of_run(std::size_t i) {
  outcome::Outcome o;
  o.ended = i % 10 == 9 ? outcome::Ended::integration_failed : outcome::Ended::at_rest;
  if (i % 10 == 9) o.message = "run " + std::to_string(i);
  o.stop_time = static_cast<double>(i);
  return o;
}

Progress of(std::int64_t total) {
  Progress progress;
  progress.total = total;
  return progress;
}

TEST(ManyRuns, KeepEachOnceAtAnyNumberOfThreads) {
  for (const int jobs : {0, 1, 3, 64}) {
    std::vector<double> kept(kRuns, -1.0);
    std::int64_t told = 0;
    const std::atomic<bool> stop{false};
    const ManyRuns runs = run_many(
        kRuns, jobs, of(kRuns), outcome_of_run,
        [&](std::size_t i, const outcome::Outcome& o) {
          EXPECT_EQ(kept[i], -1.0) << i;
          kept[i] = o.stop_time;
        },
        [&](const Progress& p) { EXPECT_EQ(p.done, ++told); }, stop);
    for (std::size_t i = 0; i < kRuns; ++i) EXPECT_EQ(kept[i], static_cast<double>(i));
    EXPECT_EQ(told, static_cast<std::int64_t>(kRuns));
    EXPECT_EQ(runs.computed, told);
    EXPECT_EQ(runs.progress.failed, told / 10);
    EXPECT_EQ(runs.progress.message.rfind("run ", 0), 0U);
    EXPECT_GT(runs.progress.rate, 0.0);
    EXPECT_GT(runs.wall_time, 0.0);
  }
}

TEST(ManyRuns, CountOnFromWhatIsThereAlready) {
  Progress before = of(10);
  before.done = 7;
  const std::atomic<bool> stop{false};
  const ManyRuns runs = run_many(
      3, 1, before, outcome_of_run, [](std::size_t, const outcome::Outcome&) {}, [](const Progress&) {}, stop);
  EXPECT_EQ(runs.progress.done, 10);
  EXPECT_EQ(runs.computed, 3);
}

TEST(ManyRuns, StopKeepsWhatIsDoneAndLeavesOutWhatWasBrokenOff) {
  std::atomic<bool> stop{false};
  std::set<std::size_t> kept;
  const auto compute = [&](std::size_t i) {
    outcome::Outcome o = outcome_of_run(i);
    if (i == 4) {
      stop = true;
      o.ended = outcome::Ended::running;
    }
    return o;
  };
  const auto keep = [&](std::size_t i, const outcome::Outcome&) { kept.insert(i); };
  const ManyRuns runs = run_many(
      kRuns, 1, of(kRuns), compute, keep, [](const Progress&) {}, stop);
  EXPECT_EQ(kept, (std::set<std::size_t>{0, 1, 2, 3}));
  EXPECT_EQ(runs.computed, 4);
  EXPECT_EQ(runs.progress.done, 4);
}

TEST(ManyRuns, AnExceptionEndsAllAndIsThrown) {
  const std::atomic<bool> stop{false};
  std::int64_t told = 0;
  const auto keep = [](std::size_t i, const outcome::Outcome&) {
    if (i == 5) throw std::runtime_error("the disk is full");
  };
  const auto run = [&](int jobs) {
    run_many(
        kRuns, jobs, of(kRuns), outcome_of_run, keep, [&](const Progress& p) { told = p.done; }, stop);
  };
  EXPECT_THROW(run(1), std::runtime_error);
  EXPECT_EQ(told, 5) << "none is begun after it";
  EXPECT_THROW(run(4), std::runtime_error);
}

}  // namespace
}  // namespace train_derail::simulation
