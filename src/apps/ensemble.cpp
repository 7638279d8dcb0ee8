#include "ensemble.hpp"

#include <algorithm>
#include <iostream>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "exit_codes.hpp"
#include "files.hpp"
#include "interrupt.hpp"
#include "jobs.hpp"
#include "progress.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail::apps {

int run_ensemble(const inputs::Scenario& scenario, const EnsembleArguments& a) {
  const study::Study study = study::ensemble_of(scenario, a.seeds);
  for (const std::string& warning : study::check(study)) std::cerr << "derail: warning: " << warning << "\n";
  // Opened before the computing, so that a path that cannot be written is reported at once.
  std::vector<NamedPath> outputs;
  if (a.csv) outputs.push_back({"--csv", *a.csv});
  if (a.json) outputs.push_back({"--json", *a.json});
  require_apart({{"FILE", a.name}}, outputs);
  stop_on_signals();
  std::optional<files::OutputFile> csv, json;
  if (a.csv) csv.emplace(*a.csv, existing(a.force), &stop);
  if (a.json) json.emplace(*a.json, existing(a.force), &stop);
  std::vector<outcome::Outcome> outcomes;
  try {
    ProgressLine progress(!a.quiet);
    outcomes = study::run_in_memory(
        study, useful_jobs(a.jobs),
        [&](const study::Progress& p) {
          progress.update(static_cast<double>(p.done) / static_cast<double>(p.total),
                          fmt::format("{} of {} runs", p.done, p.total));
        },
        stop);
  } catch (const study::Stopped&) {  // before the first run began
  }
  const auto ended = [&](outcome::Ended how) {
    return std::count_if(outcomes.begin(), outcomes.end(), [&](const outcome::Outcome& o) { return o.ended == how; });
  };
  const auto not_run = ended(outcome::Ended::running), failed = ended(outcome::Ended::integration_failed);
  if (not_run == static_cast<std::ptrdiff_t>(outcomes.size())) {
    std::cerr << fmt::format("derail: stopped before any of {} runs was finished; nothing has been written\n", a.seeds);
    return kInterrupted;
  }
  // First what needs no disk, which may be full by now.
  const bool on_standard_output =
      std::any_of(outputs.begin(), outputs.end(), [](const NamedPath& o) { return files::same_file(o.path, "-"); });
  if (!a.quiet && !on_standard_output) {
    std::cout << (scenario.title.empty() ? a.name : scenario.title) << "\n"
              << study::ensemble_table(study, outcomes) << std::flush;
  }
  if (csv) csv->stream() << study::ensemble_csv(study, outcomes);
  if (json) json->stream() << study::ensemble_json(study, outcomes) << "\n";
  if (csv) csv->commit();
  if (json) json->commit();
  if (not_run > 0) {
    std::cerr << fmt::format("derail: stopped; {} of {} runs are left out\n", not_run, outcomes.size());
    return kInterrupted;
  }
  if (failed > 0) {
    const auto first = std::find_if(outcomes.begin(), outcomes.end(), [](const outcome::Outcome& o) {
      return o.ended == outcome::Ended::integration_failed;
    });
    std::cerr << fmt::format("derail: {} of {} runs failed, the first: {}\n", failed, outcomes.size(), first->message);
    return kRunsFailed;
  }
  return kOk;
}

}  // namespace train_derail::apps
