// The class of accidents that a preset was fitted on: outside of it its counts are a guess.
#pragma once

#include <string>
#include <vector>

#include "train_derail/validation/accidents.hpp"

namespace train_derail::validation {

/// Read from a small file beside the presets (config/classes/loaded_unit_broken_rail.yaml), where the sources stand.
struct FittedClass {
  struct Range {
    std::string column;  ///< of the table of accidents
    double low = 0.0, high = 0.0;
  };
  std::string path;  ///< empty: not known
  std::string title;
  std::vector<Range> ranges;        ///< least and largest of the fitted rows
  std::vector<std::string> causes;  ///< codes

  bool known() const { return !path.empty(); }
};

/// Throws inputs::InputError.
FittedClass read_fitted_class(const std::string& path);

/// In what the row lies outside: "tons_per_car 45.6 (fitted: 111 to 188.9); cause H307"; empty if in nothing that the
/// table tells.
std::string outside(const FittedClass& of, const Accident& accident);

/// What the table does not tell of its rows, so that it cannot be judged: "cause", "empty_cars".
std::vector<std::string> not_told(const FittedClass& of, const AccidentTable& table);

}  // namespace train_derail::validation
