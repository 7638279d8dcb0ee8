#include "train_derail/fields/field.hpp"
#include "train_derail/fields/reference.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace train_derail::fields {

std::string text(const Value& value, const std::vector<std::string_view>& names) {
  if (const auto* count = std::get_if<std::int64_t>(&value)) {
    return names.empty() ? fmt::format("{}", *count) : std::string(names.at(static_cast<std::size_t>(*count)));
  }
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "1" : "0";
  if (const auto* plain = std::get_if<std::string>(&value)) return *plain;
  if (const auto* lines = std::get_if<std::vector<std::string>>(&value))
    return fmt::format("{}", fmt::join(*lines, "; "));
  return fmt::format("{}", std::get<double>(value));
}

std::string column(std::string_view name, const Unit& unit) {
  std::string column(name);
  if (unit.si.empty() || unit.si == "1") return column;
  column += '_';
  for (const char c : unit.si) column += c == ' ' || c == '/' ? '_' : c;
  return column;
}

std::string reference_head() { return "| name | unit | also shown in | meaning |\n|---|---|---|---|\n"; }

std::string reference_row(std::string_view name, const Unit& unit, std::string_view meaning,
                          const std::vector<std::string_view>& names) {
  std::string choice;
  for (const std::string_view n : names) choice += fmt::format("{} `{}`", choice.empty() ? " One of" : ",", n);
  const bool also = !unit.shown.empty() && unit.shown != unit.si && unit.si != "1";
  return fmt::format("| `{}` | {} | {} | {}{} |\n", name, unit.si.empty() || unit.si == "1" ? "-" : unit.si,
                     also ? unit.shown : "-", meaning, choice.empty() ? "" : choice + ".");
}

std::string number_in_si(double value, const Unit& unit) {
  const double number = value / unit.per_table_si;
  return unit.table_powers ? fmt::format("{:.{}e}", number, unit.table_si_digits)
                           : fmt::format("{:.{}f}", number, unit.table_si_digits);
}

std::string unit_in_si(const Unit& unit) {
  if (unit.si == "1") return "";
  return std::string(unit.table_si.empty() ? unit.si : unit.table_si);
}

std::string in_si(double value, const Unit& unit) {
  const std::string name = unit_in_si(unit);
  return name.empty() ? number_in_si(value, unit) : number_in_si(value, unit) + " " + name;
}

std::string number_in_shown(double value, const Unit& unit) {
  if (unit.si == "1" || unit.shown.empty() || unit.shown == unit.si) return "";
  return fmt::format("{:.{}f}", value / unit.per_shown, unit.shown_digits);
}

std::string in_shown(double value, const Unit& unit) {
  const std::string number = number_in_shown(value, unit);
  return number.empty() ? "" : fmt::format("{} {}", number, unit.shown);
}

}  // namespace train_derail::fields
