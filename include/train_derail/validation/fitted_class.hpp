/// \file
/// The kind of accidents that a scenario was fitted on. For other accidents its predicted counts are only a guess.
#pragma once

#include <string>
#include <vector>

#include "train_derail/validation/accidents.hpp"

namespace train_derail::validation {

/// Ranges and causes of the accidents that a scenario was fitted on. They are read from a file, such as
/// config/classes/loaded_unit_broken_rail.yaml, which also gives the sources.
struct FittedClass {
  /// Range of one column over the rows of the fit.
  struct Range {
    std::string column;  ///< column of the table of accidents
    double low = 0.0,    ///< least value
        high = 0.0;      ///< largest value
  };
  std::string path;                 ///< path of the file; empty if the class is not known
  std::string title;                ///< title for tables
  std::vector<Range> ranges;        ///< one range for each column that counts
  std::vector<std::string> causes;  ///< codes of causes, as in the table

  /// Whether a class was read.
  bool known() const { return !path.empty(); }
};

/// Reads the file of a class. Throws inputs::InputError.
FittedClass read_fitted_class(const std::string& path);

/// Returns in which columns an accident lies outside of the class, "tons_per_car 45.6 (fitted: 111 to 188.9); cause
/// H307". Empty if it lies inside as far as the table tells.
std::string outside(const FittedClass& of, const Accident& accident);

/// Returns the columns that some rows lack ("cause", "empty_cars"), so that it is not known whether they lie outside.
std::vector<std::string> not_told(const FittedClass& of, const AccidentTable& table);

}  // namespace train_derail::validation
