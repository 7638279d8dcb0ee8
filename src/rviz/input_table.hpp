// Inputs as people read and write them; keys, ranges and meanings come from the schema of the scenario.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::rviz_panel {

struct InputItem {
  std::string unit;     // the one people read; empty: a bare number, a choice or a text
  std::string unit_si;  // empty if there is none
  std::string allowed;  // in `unit`
  std::string meaning;
  std::vector<std::string> choices;  // empty: not a choice
  std::string value;                 // with `unit`
  std::string value_si;              // with the SI unit; empty if `unit` is that or there is none
  std::string exact;                 // every digit, to compare
  std::string acts_with;  // if the value has no effect in this scenario: what it would have one with; empty if it acts
};

/// Every key of a scenario that has a value in it.
using InputTable = std::map<std::string, InputItem>;

InputTable make_input_table(const inputs::Scenario& scenario);

/// What somebody has typed for one key.
struct CheckedInput {
  std::string error;  // empty if it may stand there; otherwise what the reader says
  std::string text;   // with the unit that was meant, if it was a bare number
  std::string value_si;
  bool as_before = false;  // the scenario has this value already
};

/// A bare number counts as being in the unit that is shown. `tree`: the scenario it would be part of; `table`: of it.
CheckedInput check_input(const YAML::Node& tree, const InputTable& table, const std::string& key,
                         const std::string& typed);

/// "a = 1; b=2" is {"a = 1", "b=2"}.
std::vector<std::string> split_overrides(const std::string& text);

}  // namespace train_derail::rviz_panel
