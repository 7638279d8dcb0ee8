#include "train_derail/study/runner.hpp"

#include <utility>
#include <vector>

#include "simulation/many_runs.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::study {

int jobs_max() { return simulation::jobs_max(); }

outcome::Outcome outcome_of(const Study& study, const Point& point, const Run& run, const std::atomic<bool>& stop) {
  try {
    const inputs::Scenario scenario = scenario_of(study, point, run);
    if (study.engine == EngineChoice::multibody) {
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
  if (study.engine == EngineChoice::multibody) multibody::require();
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

    const auto compute = [&](std::size_t i) {
      const Run run = run_of(study, missing[i]);
      return outcome_of(study, points[run.point], run, stop);
    };
    const auto keep = [&](std::size_t i, const outcome::Outcome& outcome) {
      journal.append(journal_fields(run_of(study, missing[i]), outcome), outcome.wall_time);
    };
    const auto runs = simulation::run_many(missing.size(), options.jobs, progress, compute, keep, on_progress, stop);
    report.computed = runs.computed;
    report.failed = runs.progress.failed;
    report.runs = runs.progress.done;
    report.stopped = runs.progress.done < runs.progress.total;
    report.wall_time = runs.wall_time;
  } catch (const Stopped&) {
    report.stopped = true;
  }
  return report;
}

std::vector<outcome::Outcome> run_in_memory(const Study& study, int jobs,
                                            const std::function<void(const Progress&)>& on_progress,
                                            const std::atomic<bool>& stop) {
  if (study.engine == EngineChoice::multibody) multibody::require();
  check(study, &stop);
  const Points points(study, &stop);
  std::vector<outcome::Outcome> outcomes(static_cast<std::size_t>(run_count(study)));
  Progress progress;
  progress.total = static_cast<std::int64_t>(outcomes.size());
  const auto compute = [&](std::size_t i) {
    const Run run = run_of(study, static_cast<std::int64_t>(i));
    return outcome_of(study, points[run.point], run, stop);
  };
  const auto keep = [&](std::size_t i, outcome::Outcome outcome) { outcomes[i] = std::move(outcome); };
  simulation::run_many(outcomes.size(), jobs, progress, compute, keep, on_progress, stop);
  return outcomes;
}

}  // namespace train_derail::study
