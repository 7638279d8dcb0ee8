// What a run yields, described once.
#pragma once

#include <string>

#include "train_derail/fields/field.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// In the order in which JSON, tables and journals have them.
const fields::Fields<Outcome>& outcome_fields();

/// A line of a table for people: "12.3 m/s", "27.5 mph", "cars 3 and 4 at 1.25 s".
struct Row {
  std::string si, shown, note;
};
Row row_of(const fields::Field<Outcome>& field, const Outcome& outcome);

}  // namespace train_derail::outcome
