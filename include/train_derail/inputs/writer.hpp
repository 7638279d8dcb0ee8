/// \file
/// Writes a scenario as YAML, and the list of all keys.
#pragma once

#include <string>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// Returns the whole scenario as YAML in SI units, with all defaults filled in. A comment gives each number in the unit
/// that people read. read_scenario() reads the same scenario back from it.
std::string to_yaml(const Scenario& scenario);

/// The same. What `acting` gives and `scenario` leaves out stands there as comments, in its place: `acting` is the same
/// scenario with values for what follows from other keys.
std::string to_yaml(const Scenario& scenario, const Scenario& acting);

/// Returns `value` as a text of YAML in double quotes.
std::string yaml_text(const std::string& value);

/// Returns the list of all keys for `derail keys`: allowed and usual range with unit, default, meaning, when it acts.
std::string describe_keys();

}  // namespace train_derail::inputs
