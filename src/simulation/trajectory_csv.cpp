#include "train_derail/simulation/trajectory_csv.hpp"

#include <ostream>

#include <fmt/format.h>

#include "train_derail/simulation/fields.hpp"

namespace train_derail::simulation {

namespace {

// Numbers are most of it, and the names of choices need no quotes.
void append(std::string& line, const fields::Value& value, const std::vector<std::string_view>& names) {
  line += ',';
  if (const auto* number = std::get_if<double>(&value)) fmt::format_to(std::back_inserter(line), "{}", *number);
  else line += fields::text(value, names);
}

}  // namespace

void write_csv_header(std::ostream& out) {
  std::string line = "time_s,car";
  for (const auto& field : car_fields()) line += "," + fields::column(field.name, field.unit);
  for (const auto& field : coupler_fields()) line += "," + fields::column(field.name, field.unit);
  out << line << '\n';
}

void write_csv_rows(std::ostream& out, const Snapshot& s) {
  std::string text;
  for (std::size_t k = 0; k < s.cars.size(); ++k) {
    fmt::format_to(std::back_inserter(text), "{},{}", s.time, k + 1);
    for (const auto& field : car_fields()) append(text, field.get(s.cars[k]), field.names);
    if (k < s.couplers.size()) {
      for (const auto& field : coupler_fields()) append(text, field.get(s.couplers[k]), field.names);
    } else {
      text.append(coupler_fields().size(), ',');
    }
    text += '\n';
  }
  out << text;
}

}  // namespace train_derail::simulation
