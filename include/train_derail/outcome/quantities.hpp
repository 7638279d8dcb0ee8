// The numbers of an outcome that studies and comparisons are made of.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

struct Quantity {
  std::string_view name;        ///< as in JSON
  std::string_view unit;        ///< SI
  std::string_view shown_unit;  ///< the one people read; "" if the same
  double per_shown;             ///< SI value of one shown unit
  std::string_view title;
  std::function<double(const Outcome&)> value;
};

/// Those of outcome_fields() that are marked for it, in their order.
const std::vector<Quantity>& quantities();

/// Null if there is none of that name.
const Quantity* find_quantity(std::string_view name);

}  // namespace train_derail::outcome
