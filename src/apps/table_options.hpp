/// \file
/// What of a run `derail run --csv` writes: --every, --cars, --columns.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simulation/trajectory_csv.hpp"

namespace train_derail::apps {

struct TableOptions {
  std::optional<std::string> every, cars;
  std::vector<std::string> columns;

  /// Adds the options to a command that has --csv.
  void add_to(CLI::App* command);
  /// Columns and cars. Throws InputError, which names the option.
  simulation::TableChoice choice(const inputs::Scenario& scenario) const;
  /// How many steps of the output grid lie between two rows. Throws InputError.
  std::int64_t steps(const inputs::Scenario& scenario) const;
};

}  // namespace train_derail::apps
