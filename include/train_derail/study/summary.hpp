#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

/// What the runs of a folder have in common.
struct Totals {
  std::int64_t runs = 0, failed = 0;
  std::vector<std::string> warnings;  // "3 of 200 runs: energy residual ..."; points whose runs are all the same run
};

/// From runs.csv of a folder: `summary.csv` (spread of each outcome at each point, or over all points of a random plan)
/// and, for the plan saltelli, `sobol.csv`. Failed runs are counted, not averaged. Throws inputs::InputError (runs.csv
/// is not of this study), std::runtime_error, Stopped.
Totals write_summary(const std::string& folder, const Study& study, const std::atomic<bool>* stop = nullptr);

/// `about.json`: the study, titles and units of the columns of runs.csv, version of the program, machine, runs,
/// warnings and time, and the checksums (CRC-32) of the tables that lie beside it. Throws std::runtime_error.
void write_about(const std::string& folder, const Study& study, const Totals& totals, double wall_time);

/// All of these and runs.csv: what a finished study leaves in its folder. Throws as they do.
Totals write_results(const std::string& folder, const Study& study, double wall_time,
                     const std::atomic<bool>* stop = nullptr);

/// What people read after a study: medians and 5-95 % ranges in mph, kip, ft. Throws as write_summary().
std::string to_table(const std::string& folder, const Study& study);

/// Of an ensemble of one scenario (ensemble_of()), outcomes in the order of runs; those that are still running are left
/// out. SI beside mph, kip, ft.
std::string ensemble_table(const Study& study, const std::vector<outcome::Outcome>& outcomes);
/// JSON in SI: runs, failed, warnings, spread of each outcome.
std::string ensemble_json(const Study& study, const std::vector<outcome::Outcome>& outcomes);
/// A row a run, columns as in runs.csv.
std::string ensemble_csv(const Study& study, const std::vector<outcome::Outcome>& outcomes);

}  // namespace train_derail::study
