// Access to single inputs by name, as studies and panels need it.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// One key of a scenario as it stands ("consist[0].weight").
struct KeyValue {
  std::string key;
  std::string value;       // SI number, choice or text, as the reader takes it
  std::string unit;        // SI, UDUNITS notation; "1" if it has none, "" if it is not a number
  std::string shown_unit;  // the one people read; "" if the same
  bool whole = false;      // counts and seeds: no fractions
  std::string meaning;
  std::string acts_with;  // if the value has no effect in this scenario: what it would have one with; "" if it acts
};

/// Every key of the scenario that has a value, in the order of the file.
std::vector<KeyValue> key_values(const Scenario& scenario);

/// One of them. Throws InputError that names the keys there are.
KeyValue key_value(const Scenario& scenario, const std::string& key);

/// `base` with some inputs changed (values as KeyValue::value has them), validated. Much cheaper than reading a file
/// anew. Throws InputError.
Scenario with_values(Scenario base, const std::vector<Override>& values);

}  // namespace train_derail::inputs
