#include "train_derail/study/runner.hpp"

#include <chrono>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>

#include "study/parallel.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::study {

namespace {

outcome::Outcome outcome_of(const Study& study, const Point& point, const Run& run) {
  const auto finished = [](auto computed) {
    computed.run();
    return computed.outcome();
  };
  try {
    const inputs::Scenario scenario = scenario_of(study, point, run);
    if (study.engine == Engine::multibody) return finished(multibody::Engine(scenario));
    return finished(simulation::Simulation(scenario));
  } catch (const inputs::InputError& e) {
    outcome::Outcome refused;
    refused.ended = outcome::Ended::integration_failed;
    refused.message = e.what();
    return refused;
  }
}

}  // namespace

RunReport run_study(const Study& study, const RunOptions& options, const std::function<void(const Progress&)>& on_progress,
                    const std::atomic<bool>& stop) {
  if (study.engine == Engine::multibody) multibody::require();
  const std::vector<Point> all = points(study);
  const auto total = static_cast<std::int64_t>(all.size()) * study.replicates;
  claim_folder(options.folder, study);
  Journal journal(options.folder, study, options.shard);
  if (!journal.finished().empty() && !options.resume) {
    throw std::runtime_error(fmt::format("{}: holds {} finished runs of this study; --resume computes what is missing",
                                         options.folder, journal.finished().size()));
  }

  std::vector<bool> have(static_cast<std::size_t>(total), false);
  for (const std::int64_t index : journal.finished()) {
    if (index >= 0 && index < total) have[static_cast<std::size_t>(index)] = true;
  }
  std::vector<std::int64_t> missing;
  Progress progress;
  for (std::int64_t index = 0; index < total; ++index) {
    if (!options.shard.owns(index)) continue;
    ++progress.total;
    if (have[static_cast<std::size_t>(index)]) ++progress.done;
    else missing.push_back(index);
  }

  RunReport report;
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  std::mutex mutex;
  std::exception_ptr broken;  // the journal cannot be written: nothing more can be kept
  for_each_run(missing.size(), options.jobs, [&](std::size_t i) {
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (stop || broken) return;
    }
    const Run run = run_of(study, missing[i]);
    const Point& point = all[static_cast<std::size_t>(run.point)];
    const outcome::Outcome outcome = outcome_of(study, point, run);
    const std::lock_guard<std::mutex> lock(mutex);
    if (broken) return;
    try {
      journal.append(point, run, outcome);
    } catch (const std::runtime_error&) {
      broken = std::current_exception();
      return;
    }
    ++report.computed;
    ++progress.done;
    if (outcome.ended == outcome::Ended::integration_failed) {
      ++report.failed;
      progress.message = outcome.message;
    }
    progress.failed = report.failed;
    progress.rate = static_cast<double>(report.computed) / elapsed();
    on_progress(progress);
  });
  if (broken) std::rethrow_exception(broken);
  report.runs = progress.done;
  report.stopped = progress.done < progress.total;
  report.wall_time = elapsed();
  return report;
}

}  // namespace train_derail::study
