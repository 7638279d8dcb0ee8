// Reference tables of what comes out.
#pragma once

#include <string>

#include "train_derail/fields/field.hpp"

namespace train_derail::fields {

/// A row of a table in Markdown.
std::string reference_row(std::string_view name, const Unit& unit, std::string_view meaning,
                          const std::vector<std::string_view>& names);
std::string reference_head();

/// All entries as a table in Markdown: name, unit, the unit that people read, meaning.
template <class Record>
std::string reference(const Fields<Record>& all) {
  std::string table = reference_head();
  for (const auto& field : all) table += reference_row(field.name, field.unit, field.meaning, field.names);
  return table;
}

}  // namespace train_derail::fields
