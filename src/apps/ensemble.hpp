#pragma once

#include <optional>
#include <string>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::apps {

/// Arguments of `derail run --seeds`.
struct EnsembleArguments {
  std::string name;                      // path of the scenario
  std::optional<std::string> csv, json;  // files; "-" is standard output
  int seeds = 0, jobs = 0;
  bool force = false, quiet = false;
};

/// Computes an ensemble of one scenario. Prints medians and ranges as a table, and writes the runs as CSV and the
/// ranges as JSON. Returns the exit code. Throws inputs::InputError if the runs cannot differ, std::runtime_error if a
/// file cannot be written.
int run_ensemble(const inputs::Scenario& scenario, const EnsembleArguments& arguments);

}  // namespace train_derail::apps
