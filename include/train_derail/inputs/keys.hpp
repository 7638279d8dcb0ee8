/// \file
/// Access to single inputs by their keys, for studies and for the panel.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// One key of a scenario with its present value.
struct KeyValue {
  std::string key;         ///< "consist[0].weight"
  std::string value;       ///< number in SI units, choice or text, as the reader accepts it
  std::string unit;        ///< SI unit in UDUNITS notation; "1" for pure numbers, "" if the value is not a number
  std::string shown_unit;  ///< unit that people read; "" if it is the SI unit
  bool whole = false;      ///< whether only whole numbers are allowed: counts and seeds
  std::string meaning;     ///< explanation in one sentence
  std::string acts_with;   ///< if the value has no effect in this scenario: which inputs would give it one; else ""
};

/// Returns every key of the scenario that has a value, in the order of a scenario file.
std::vector<KeyValue> key_values(const Scenario& scenario);

/// Returns one key. Throws InputError, which lists the keys of this scenario, if there is no such key with a value.
KeyValue key_value(const Scenario& scenario, const std::string& key);

/// Returns `base` with some inputs changed, and validates it. Values are written as in KeyValue::value, so numbers are
/// in SI units. This is much faster than reading a file again. Throws InputError if a key is unknown or a value is not
/// allowed.
Scenario with_values(Scenario base, const std::vector<Override>& values);

}  // namespace train_derail::inputs
