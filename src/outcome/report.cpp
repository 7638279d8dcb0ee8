#include "train_derail/outcome/report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "train_derail/outcome/fields.hpp"

namespace train_derail::outcome {

std::string to_json(const Outcome& o) {
  nlohmann::ordered_json j;
  for (const auto& field : outcome_fields()) {
    const std::string name(field.name);
    std::visit([&](const auto& value) { j[name] = value; }, field.get(o));
    if (!field.names.empty()) j[name] = fields::text(field.get(o), field.names);
  }
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string to_table(const Outcome& o) {
  std::string table;
  for (const auto& field : outcome_fields()) {
    if (field.title.empty() || (field.when && !field.when(o))) continue;
    const FieldRow row = row_of(field, o);
    const std::string note = row.note.empty() ? "" : "   " + row.note;
    std::string line = fmt::format("{:<44} {:>14} {:>22}{}", field.title, row.si, row.shown, note);
    line.erase(line.find_last_not_of(' ') + 1);
    table += line + '\n';
  }
  for (const std::string& warning : o.warnings) table += "warning: " + warning + "\n";
  return table;
}

}  // namespace train_derail::outcome
