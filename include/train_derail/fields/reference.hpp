/// \file
/// Tables in Markdown that explain the output fields (docs/outcomes.md).
#pragma once

#include <string>

#include "train_derail/fields/field.hpp"

namespace train_derail::fields {

/// Returns the row of one field.
std::string reference_row(std::string_view name, const Unit& unit, std::string_view meaning,
                          const std::vector<std::string_view>& names);
/// Returns the head of the table: names of its columns and the line below.
std::string reference_head();

/// Returns the table of all fields of a record: name, unit, unit that people read, meaning.
template <class Record>
std::string reference(const Fields<Record>& all) {
  std::string table = reference_head();
  for (const auto& field : all) table += reference_row(field.name, field.unit, field.meaning, field.names);
  return table;
}

}  // namespace train_derail::fields
