#include "study/results.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "study/json_file.hpp"
#include "train_derail/files/checksum.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/outcome/outcome.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

constexpr const char* kSpace = "\u00A0";

}  // namespace

std::string digits(double value) {
  if (std::isnan(value)) return "\u2013";
  // Areas and forces: powers of ten are wider, and nobody reads them.
  const bool plain = std::abs(value) >= 9999.5 && std::abs(value) < 1e7;
  return plain ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
}

double Number::shown(const std::string& si) const {
  return files::number<double>(si).value_or(std::nan("")) / per_shown;
}
std::string Number::number(const std::string& si) const { return digits(shown(si)); }
std::string Number::text(const std::string& si) const {
  return !numeric ? si : shown_unit.empty() ? number(si) : number(si) + kSpace + shown_unit;
}
std::string Number::label() const { return shown_unit.empty() ? title : fmt::format("{} ({})", title, shown_unit); }

std::size_t Table::column(const std::string& name) const {
  const auto place = std::find(names.begin(), names.end(), name);
  if (place == names.end())
    throw inputs::InputError(path + ":1", name, "", "missing column",
                             "derail study FILE --resume writes this table anew");
  return static_cast<std::size_t>(place - names.begin());
}

bool Results::one_at_a_time() const { return study.at("plan") == to_string(Plan::one_at_a_time); }
bool Results::by_point() const { return one_at_a_time() || study.at("plan") == to_string(Plan::grid); }

std::string in_folder(const std::string& folder, const char* name) { return (fs::path(folder) / name).string(); }

namespace {

/// The tree that these keys ("consist[1].count") and values make, as YAML; JSON is YAML too.
std::string tree_of(const ordered_json& values) {
  ordered_json flat;
  for (const auto& [key, value] : values.items()) {
    std::string pointer = "/";
    for (const char c : key) {
      if (c == '.' || c == '[') pointer += '/';
      else if (c != ']') pointer += c;
    }
    flat[pointer] = value;
  }
  return flat.unflatten().dump();
}

Number number_of(const ordered_json& about, const std::string& name) {
  const ordered_json& c = about.at("columns").at(name);
  return {name, c.at("title"), c.at("shown_unit"), c.at("unit") != "", c.at("per_shown")};
}

/// Returns the path of a table after checking that it was not changed: about.json, which is written last, has its
/// checksum.
std::string checked(const Results& r, const char* name) {
  const std::string path = in_folder(r.folder, name);
  const std::string now = files::crc32_of_file(path);
  if (now.empty()) wrong_json(path, kResultsWriter, "missing or cannot be read");
  if (r.about.at("crc32").at(name) != now)
    wrong_json(path, kResultsWriter, "was changed since it was written (its checksum in about.json differs)");
  return path;
}

Table read_table(const std::string& path) try {
  files::CsvTable table(path);
  Table t{path, table.names(), {}};
  for (Row row; table.next(row);) t.rows.push_back(row);
  return t;
} catch (const files::CsvError& e) {
  throw inputs::InputError(e.what(), "", "", fmt::format("{} writes this table", kResultsWriter), "");
}

void add(Extent& extent, double value) {
  if (!std::isfinite(value)) return;
  const bool first = extent.values++ == 0;
  extent.low = first ? value : std::min(extent.low, value);
  extent.high = first ? value : std::max(extent.high, value);
  extent.whole = extent.whole && value == std::floor(value);
}

void read_runs(Results& r) {
  const std::string path = checked(r, "runs.csv");
  try {
    files::CsvTable table(path);
    const std::size_t run = table.column("run"), point = table.column("point"), ended = table.column("ended"),
                      message = table.column("message");
    std::vector<std::size_t> inputs, outcomes;
    for (const Number& factor : r.factors) inputs.push_back(table.column(factor.name));
    for (const Number& outcome : r.outcomes) outcomes.push_back(table.column(outcome.name));
    r.extents.resize(outcomes.size());
    for (Row row; table.next(row); ++r.runs) {
      Row values;
      for (const std::size_t column : inputs) values.push_back(row[column]);
      r.points.try_emplace(row[point], values);
      if (row[ended] != outcome::to_string(outcome::Ended::integration_failed)) {
        for (std::size_t i = 0; i < outcomes.size(); ++i) add(r.extents[i], r.outcomes[i].shown(row[outcomes[i]]));
        continue;
      }
      ++r.failed;
      if (r.failures.size() == kFailedShown) continue;
      r.failures.push_back({row[run]});
      r.failures.back().insert(r.failures.back().end(), values.begin(), values.end());
      r.failures.back().push_back(row[message]);
    }
  } catch (const files::CsvError& e) {
    throw inputs::InputError(e.what(), "", "", fmt::format("{} writes this table", kResultsWriter), "");
  }
}

}  // namespace

inputs::Scenario base_of(const Results& r) {
  const std::string path = in_folder(r.folder, "about.json");
  return inputs::read_scenario(inputs::load_text(tree_of(r.study.at("scenario")), path), path);
}

Results read_results(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw inputs::InputError(folder, "", "", "no such folder", "a folder that derail study has written");
  if (!fs::exists(in_folder(folder, "runs.csv")) && fs::exists(in_folder(folder, "validation.json"))) {
    throw inputs::InputError(folder, "", "", "holds a validation, not a study",
                             "a folder that derail study has written");
  }
  Results r;
  r.folder = folder;
  const std::string path = in_folder(folder, "about.json");
  r.about = read_json(path, kResultsWriter);
  checked_json(path, kResultsWriter, [&] {
    r.study = r.about.at("study");
    for (const ordered_json& factor : r.study.at("factors")) r.factors.push_back(number_of(r.about, factor.at("key")));
    for (const ordered_json& name : r.study.at("outcomes")) r.outcomes.push_back(number_of(r.about, name));
    read_runs(r);
    r.summary = read_table(checked(r, "summary.csv"));
    if (r.study.at("plan") == to_string(Plan::saltelli)) r.sobol = read_table(checked(r, "sobol.csv"));
  });
  return r;
}

}  // namespace train_derail::study
