#pragma once

#include <cstdint>
#include <string>

#include "train_derail/study/study.hpp"

namespace train_derail::study {

/// From runs.csv of a folder: `summary.csv` (spread of each outcome at each point, or over all points of a random plan) and,
/// for the plan saltelli, `sobol.csv`. Failed runs are counted, not averaged. Throws std::runtime_error.
void write_summary(const std::string& folder, const Study& study);

/// `about.json`: the study, titles and units of the columns of runs.csv, version of the program, machine, runs and time.
/// Throws std::runtime_error.
void write_about(const std::string& folder, const Study& study, std::int64_t runs, std::int64_t failed, double wall_time);

/// All of these and runs.csv: what a finished study leaves in its folder. Returns how many runs it holds.
/// Throws std::runtime_error.
std::int64_t write_results(const std::string& folder, const Study& study, std::int64_t failed, double wall_time);

/// What people read after a study: medians and 5-95 % ranges in mph, kip, ft.
std::string to_table(const std::string& folder, const Study& study);

}  // namespace train_derail::study
