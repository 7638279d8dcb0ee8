#include "train_derail/study/runner.hpp"

#include <chrono>
#include <mutex>
#include <vector>

#include "parallel.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::study {

namespace {

/// Counts what is done and says so; calls come from all threads.
class Teller {
 public:
  Teller(Progress& progress, const std::function<void(const Progress&)>& on_progress)
      : progress_(progress), on_progress_(on_progress) {}

  double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  std::int64_t computed() const { return computed_; }

  /// `keep` is called first, under the same lock.
  template <class Keep>
  void done(const outcome::Outcome& outcome, const Keep& keep) {
    const std::lock_guard<std::mutex> lock(mutex_);
    keep();
    ++computed_;
    ++progress_.done;
    if (outcome.ended == outcome::Ended::integration_failed) {
      ++progress_.failed;
      progress_.message = outcome.message;
    }
    progress_.rate = static_cast<double>(computed_) / elapsed();
    on_progress_(progress_);
  }

 private:
  Progress& progress_;
  const std::function<void(const Progress&)>& on_progress_;
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
  std::int64_t computed_ = 0;
};

}  // namespace

int jobs_max() { return train_derail::jobs_max(); }

outcome::Outcome outcome_of(const Study& study, const Point& point, const Run& run, const std::atomic<bool>& stop) {
  try {
    const inputs::Scenario scenario = scenario_of(study, point, run);
    if (study.engine == Engine::multibody) {
      multibody::Engine engine(scenario);
      engine.run(&stop);
      return engine.outcome();
    }
    simulation::Simulation simulation(scenario);
    simulation.run(&stop);
    return simulation.outcome();
  } catch (const inputs::InputError& e) {
    outcome::Outcome refused;
    refused.ended = outcome::Ended::integration_failed;
    refused.message = e.what();
    return refused;
  }
}

RunReport run_study(const Study& study, const RunOptions& options,
                    const std::function<void(const Progress&)>& on_progress, const std::atomic<bool>& stop) {
  if (study.engine == Engine::multibody) multibody::require();
  RunReport report;
  try {
    check(study, &stop);
    const Points points(study, &stop);
    const std::int64_t total = run_count(study);
    const JournalFormat format = journal_format(study);
    claim_folder(options.folder, format.identity);
    std::vector<bool> have(static_cast<std::size_t>(total), false);
    Journal journal(options.folder, format, options.shard, options.resume,
                    [&](const JournalRow& row) { have[static_cast<std::size_t>(row.run)] = true; });
    report.problems = journal.problems();
    std::vector<std::int64_t> missing;
    Progress progress;
    for (std::int64_t index = options.shard.index - 1; index < total; index += options.shard.count) {
      ++progress.total;
      if (have[static_cast<std::size_t>(index)]) ++progress.done;
      else missing.push_back(index);
    }

    Teller teller(progress, on_progress);
    for_each_run(missing.size(), options.jobs, [&](std::size_t i) {
      if (stop) return;
      const Run run = run_of(study, missing[i]);
      const outcome::Outcome outcome = outcome_of(study, points[run.point], run, stop);
      if (outcome.ended == outcome::Ended::running) return;
      teller.done(outcome, [&] { journal.append(journal_fields(run, outcome), outcome.wall_time); });
    });
    report.computed = teller.computed();
    report.failed = progress.failed;
    report.runs = progress.done;
    report.stopped = progress.done < progress.total;
    report.wall_time = teller.elapsed();
  } catch (const Stopped&) {
    report.stopped = true;
  }
  return report;
}

std::vector<outcome::Outcome> run_in_memory(const Study& study, int jobs,
                                            const std::function<void(const Progress&)>& on_progress,
                                            const std::atomic<bool>& stop) {
  if (study.engine == Engine::multibody) multibody::require();
  check(study, &stop);
  const Points points(study, &stop);
  std::vector<outcome::Outcome> outcomes(static_cast<std::size_t>(run_count(study)));
  Progress progress;
  progress.total = static_cast<std::int64_t>(outcomes.size());
  Teller teller(progress, on_progress);
  for_each_run(outcomes.size(), jobs, [&](std::size_t i) {
    if (stop) return;
    const Run run = run_of(study, static_cast<std::int64_t>(i));
    outcomes[i] = outcome_of(study, points[run.point], run, stop);
    if (outcomes[i].ended != outcome::Ended::running) teller.done(outcomes[i], [] {});
  });
  return outcomes;
}

}  // namespace train_derail::study
