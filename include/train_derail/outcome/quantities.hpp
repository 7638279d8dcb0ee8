/// \file
/// Quantities: the numbers of an outcome that studies and comparisons use.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// One number of an outcome.
struct Quantity {
  std::string_view name;                        ///< name as in JSON
  std::string_view unit;                        ///< SI unit
  std::string_view shown_unit;                  ///< unit that people read; "" if it is the SI unit
  double per_shown;                             ///< SI value of one shown unit
  std::string_view title;                       ///< title in tables
  std::function<double(const Outcome&)> value;  ///< reads the number from an outcome, in SI units
};

/// Returns all quantities: the fields of outcome_fields() marked by in_studies(), in their order.
const std::vector<Quantity>& quantities();

/// Returns the quantity of this name, or null if there is none.
const Quantity* find_quantity(std::string_view name);

}  // namespace train_derail::outcome
