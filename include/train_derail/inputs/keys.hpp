// Access to single inputs by name, as studies and panels need it.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// One key of a scenario as it stands ("consist[0].weight").
struct KeyValue {
  std::string key;
  std::string value;       // SI number, choice or text, as the reader takes it
  std::string unit;        // SI, UDUNITS notation; "1" if it has none, "" if it is not a number
  std::string shown_unit;  // the one people read; "" if the same
  std::string meaning;
};

/// Every key of the scenario that has a value, in the order of the file.
std::vector<KeyValue> key_values(const Scenario& scenario);

/// One of them. Throws InputError that names the keys there are.
KeyValue key_value(const Scenario& scenario, const std::string& key);

}  // namespace train_derail::inputs
