#pragma once

#include <optional>
#include <string>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::apps {

/// What `derail run --seeds` was asked for.
struct EnsembleArguments {
  std::string name;                      // of the scenario's file
  std::optional<std::string> csv, json;  // files; "-" is standard output
  int seeds = 0, jobs = 0;
  bool force = false, quiet = false;
};

/// Many runs of one scenario, each with a seed of its own: medians and ranges as a table, the runs as CSV, both as
/// JSON. Returns the exit code. Throws inputs::InputError: runs that cannot differ; std::runtime_error: a file cannot
/// be written.
int run_ensemble(const inputs::Scenario& scenario, const EnsembleArguments& arguments);

}  // namespace train_derail::apps
