/// \file
/// Tables that sum up a study or an ensemble.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/study/statistics.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

/// Totals over all runs of a results folder.
struct Totals {
  std::int64_t runs = 0,              ///< finished runs
      failed = 0;                     ///< those of them that failed
  std::vector<std::string> warnings;  ///< "3 of 200 runs: energy residual ...", and points whose runs are all equal
};

/// Spread of one outcome over the runs of one point.
struct PointSpread {
  std::int64_t point = 0;   ///< number of the point; -1: all points together, for a random plan
  std::string name;         ///< name of the point, see Points::name()
  std::string outcome;      ///< name of the outcome::Quantity
  Spread spread;            ///< of the runs that did not fail, SI unit
  std::int64_t failed = 0;  ///< number of runs that failed
};
/// Returns the spread of each outcome of the study at each point, from the runs.csv of a folder; the outcomes of a
/// point stand together. Throws as write_summary() does.
std::vector<PointSpread> spreads(const std::string& folder, const Study& study,
                                 const std::atomic<bool>* stop = nullptr);

/// Writes `summary.csv` from the runs.csv of a folder: the spread of each outcome at each point, or over all points of
/// a random plan. For the plan saltelli also writes `sobol.csv`. Failed runs are counted, but left out of the spread.
/// Throws inputs::InputError if runs.csv does not belong to this study, std::runtime_error if a file cannot be written,
/// and Stopped once `stop` is set.
Totals write_summary(const std::string& folder, const Study& study, const std::atomic<bool>* stop = nullptr);

/// Writes `about.json`: what was computed (JSON `described`; empty: the study), titles and units of the columns of
/// runs.csv, version of the program, machine, number of runs, warnings, computing time `wall_time` [s], and the CRC-32
/// of each table in the folder. Throws std::runtime_error if it cannot be written.
void write_about(const std::string& folder, const Study& study, const Totals& totals, double wall_time,
                 const std::string& described = "");

/// Writes all tables of a finished study: runs.csv, those of write_summary(), and about.json. Throws as these functions
/// do.
Totals write_results(const std::string& folder, const Study& study, double wall_time,
                     const std::atomic<bool>* stop = nullptr);

/// Returns the table that is printed after a study: medians and ranges (range_words()) in mph, kip and ft. Throws as
/// write_summary() does.
std::string to_table(const std::string& folder, const Study& study);

/// Returns the table of an ensemble of one scenario (see ensemble_of()), the SI units of the table of a single run
/// beside mph, kip and ft. `outcomes` are in the order of the runs; those with Ended::running are left out.
std::string ensemble_table(const Study& study, const std::vector<outcome::Outcome>& outcomes);
/// Returns the same as JSON in SI units: runs, failed runs, warnings, spread of each outcome.
std::string ensemble_json(const Study& study, const std::vector<outcome::Outcome>& outcomes);
/// Returns the runs as CSV: one row for each run, with the columns of runs.csv.
std::string ensemble_csv(const Study& study, const std::vector<outcome::Outcome>& outcomes);

}  // namespace train_derail::study
