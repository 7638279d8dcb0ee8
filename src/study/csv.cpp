#include "study/csv.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include <fmt/format.h>

namespace train_derail::study {

std::vector<std::string> fields_of(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (c == '"') {
      const bool doubled = quoted && i + 1 < line.size() && line[i + 1] == '"';
      if (doubled) fields.back() += line[++i];
      else quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else {
      fields.back() += c;
    }
  }
  return fields;
}

std::size_t Table::column(const std::string& name) const {
  const auto place = std::find(names.begin(), names.end(), name);
  if (place == names.end()) throw std::runtime_error(fmt::format("{}: no column '{}'", path, name));
  return static_cast<std::size_t>(place - names.begin());
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out + "\"";
}

Table read_csv(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  Table table;
  table.path = path;
  std::string line;
  if (std::getline(file, line)) table.names = fields_of(line);
  while (std::getline(file, line)) {
    table.rows.push_back(fields_of(line));
    if (table.rows.back().size() != table.names.size()) {
      throw std::runtime_error(fmt::format("{}:{}: {} fields, but {} columns", path, table.rows.size() + 1,
                                           table.rows.back().size(), table.names.size()));
    }
  }
  return table;
}

}  // namespace train_derail::study
