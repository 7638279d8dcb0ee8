/// \file
/// Description of every field of an outcome.
#pragma once

#include <string>

#include "train_derail/fields/field.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Returns all fields of an outcome, in the order of JSON, tables and journals.
const fields::Fields<Outcome>& outcome_fields();

/// The value of a field as the texts of a table's row.
struct FieldRow {
  std::string si,  ///< in SI units, "12.3 m/s"
      shown,       ///< in the unit that people read, "27.5 mph"; empty if it is the SI unit
      note;        ///< where and when, "cars 3 and 4 at 1.25 s"; empty if there is no remark
};
/// Returns the row of a field for one outcome.
FieldRow row_of(const fields::Field<Outcome>& field, const Outcome& outcome);

}  // namespace train_derail::outcome
