#include "train_derail/study/report.hpp"
#include "train_derail/files/checksum.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/html.hpp"
#include "study/json_file.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/outcome/outcome.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

namespace {

constexpr std::size_t kFailedShown = 100;
// With no-break spaces, so that a range stays on one line.
constexpr const char* kTo = "\u00A0to\u00A0";
constexpr const char* kSpace = "\u00A0";

using Row = std::vector<std::string>;
constexpr const char* kWrites = "derail study, at its end, or derail merge";
using Facts = std::vector<std::pair<std::string, std::string>>;

std::string digits(double value) { return std::isnan(value) ? "\u2013" : fmt::format("{:.4g}", value); }

/// A column of runs.csv, as about.json describes it.
struct Number {
  std::string name, title, shown_unit;
  bool numeric;
  double per_shown;

  double shown(const std::string& si) const { return files::number<double>(si).value_or(std::nan("")) / per_shown; }
  std::string number(const std::string& si) const { return digits(shown(si)); }
  std::string text(const std::string& si) const {
    return !numeric ? si : shown_unit.empty() ? number(si) : number(si) + kSpace + shown_unit;
  }
  std::string label() const { return shown_unit.empty() ? title : fmt::format("{} ({})", title, shown_unit); }
};

/// A table that was read into memory.
struct Table {
  std::string path;
  std::vector<std::string> names;
  std::vector<Row> rows;

  std::size_t column(const std::string& name) const {
    const auto place = std::find(names.begin(), names.end(), name);
    if (place == names.end()) throw inputs::InputError(path + ":1", name, "", "missing column", "");
    return static_cast<std::size_t>(place - names.begin());
  }
};

struct Results {
  std::string folder;
  ordered_json about, study;
  std::vector<Number> factors, outcomes;
  Table summary;
  std::int64_t runs = 0;
  std::optional<Table> sobol;
  std::map<std::string, Row> points;  // inputs of each point, SI units as text
  std::size_t failed = 0;
  std::vector<Row> failures;  // the first failed runs: number, inputs, reason

  bool one_at_a_time() const { return study.at("plan") == to_string(Plan::one_at_a_time); }
  bool by_point() const { return one_at_a_time() || study.at("plan") == to_string(Plan::grid); }
  std::string base(const Number& factor) const { return study.at("scenario").at(factor.name).get<std::string>(); }
};

std::string in(const std::string& folder, const char* name) { return (fs::path(folder) / name).string(); }

Number number_of(const ordered_json& about, const std::string& name) {
  const ordered_json& c = about.at("columns").at(name);
  return {name, c.at("title"), c.at("shown_unit"), c.at("unit") != "", c.at("per_shown")};
}

/// Returns the path of a table after checking that it was not changed: about.json, which is written last, has its
/// checksum.
std::string checked(const Results& r, const char* name) {
  const std::string path = in(r.folder, name);
  const std::string now = files::crc32_of_file(path);
  if (now.empty()) wrong_json(path, kWrites, "missing or cannot be read");
  if (r.about.at("crc32").at(name) != now)
    wrong_json(path, kWrites, "was changed since it was written (its checksum in about.json differs)");
  return path;
}

Table read_table(const std::string& path) try {
  files::CsvTable table(path);
  Table t{path, table.names(), {}};
  for (Row row; table.next(row);) t.rows.push_back(row);
  return t;
} catch (const files::CsvError& e) {
  throw inputs::InputError(e.what(), "", "", fmt::format("{} writes this table", kWrites), "");
}

void read_runs(Results& r) {
  const std::string path = checked(r, "runs.csv");
  try {
    files::CsvTable table(path);
    const std::size_t run = table.column("run"), point = table.column("point"), ended = table.column("ended"),
                      message = table.column("message");
    std::vector<std::size_t> inputs;
    for (const Number& factor : r.factors) inputs.push_back(table.column(factor.name));
    for (Row row; table.next(row); ++r.runs) {
      Row values;
      for (const std::size_t column : inputs) values.push_back(row[column]);
      r.points.try_emplace(row[point], values);
      if (row[ended] != outcome::to_string(outcome::Ended::integration_failed)) continue;
      ++r.failed;
      if (r.failures.size() == kFailedShown) continue;
      r.failures.push_back({row[run]});
      r.failures.back().insert(r.failures.back().end(), values.begin(), values.end());
      r.failures.back().push_back(row[message]);
    }
  } catch (const files::CsvError& e) {
    throw inputs::InputError(e.what(), "", "", fmt::format("{} writes this table", kWrites), "");
  }
}

Results read_results(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error))
    throw inputs::InputError(folder, "", "", "no such folder", "a folder that derail study has written");
  if (!fs::exists(in(folder, "runs.csv")) && fs::exists(in(folder, "validation.json"))) {
    throw inputs::InputError(folder, "", "", "holds a validation, not a study",
                             "a folder that derail study has written");
  }
  Results r;
  r.folder = folder;
  const std::string path = in(folder, "about.json");
  r.about = read_json(path, kWrites);
  checked_json(path, kWrites, [&] {
    r.study = r.about.at("study");
    for (const ordered_json& factor : r.study.at("factors")) r.factors.push_back(number_of(r.about, factor.at("key")));
    for (const ordered_json& name : r.study.at("outcomes")) r.outcomes.push_back(number_of(r.about, name));
    read_runs(r);
    r.summary = read_table(checked(r, "summary.csv"));
    if (r.study.at("plan") == to_string(Plan::saltelli)) r.sobol = read_table(checked(r, "sobol.csv"));
  });
  return r;
}

/// Returns `j[key]` as text, whether it is a text or a number.
std::string field(const ordered_json& j, const char* key) {
  if (!j.contains(key)) return "not known";
  return j.at(key).is_string() ? j.at(key).get<std::string>() : j.at(key).dump();
}

std::string overview(const Results& r) {
  const ordered_json& perturbation = r.study.at("perturbation");
  Facts facts{
      {"plan", field(r.study, "plan")},
      {"runs", fmt::format("{}, of which failed: {}", r.runs, r.failed)},
      {"runs for each point", field(r.study, "replicates")},
      {"perturbation of every run", fmt::format("spacing {} m, yaw rate {} (relative), kick {} m/s, alignment {} m",
                                                digits(perturbation.at("spacing")), digits(perturbation.at("yaw_rate")),
                                                digits(perturbation.at("kick")), digits(perturbation.at("alignment")))},
      {"seed", field(r.study, "seed")},
      {"base scenario", field(r.study.at("scenario"), "title")}};
  if (!r.by_point()) facts.insert(facts.begin() + 1, {"samples", field(r.study, "samples")});
  return html::facts(facts);
}

std::string range_of(const Number& factor, const ordered_json& entry) {
  if (entry.contains("values")) {
    std::string text;
    for (const ordered_json& value : entry.at("values")) text += (text.empty() ? "" : ", ") + factor.text(value);
    return text;
  }
  const auto end = [&](const char* key) { return factor.text(fmt::format("{}", entry.at(key).get<double>())); };
  return fmt::format("{}: {}{}{}", field(entry, "distribution"), end("low"), kTo, end("high"));
}

std::string inputs_of(const Results& r) {
  if (r.factors.empty())
    return "<h2>Inputs</h2>\n<p>None varies: all runs are of the base scenario, each with a seed of its own.</p>\n";
  std::vector<Row> rows;
  for (std::size_t i = 0; i < r.factors.size(); ++i) {
    const Number& factor = r.factors[i];
    const std::string range = range_of(factor, r.study.at("factors").at(i));
    rows.push_back({factor.title, factor.name, factor.text(r.base(factor)), range});
  }
  return "<h2>Inputs</h2>\n" + html::table({{"input", false}, {"key", false}, {"base", true}, {"values", false}}, rows);
}

/// "14 (12.7 – 15.3)".
std::string median_of(const Results& r, const Row& cell, const Number& outcome) {
  const auto q = [&](const char* name) { return outcome.number(cell[r.summary.column(name)]); };
  return fmt::format("{} ({}{}{})", q("median"), q("q05"), kTo, q("q95"));
}

/// Returns the cells that identify a point: the input that was changed, or all inputs.
Row point_cells(const Results& r, const std::string& point, const std::string& name) {
  const auto found = r.points.find(point);
  Row cells(r.one_at_a_time() ? 3 : r.factors.size());
  if (found == r.points.end()) {  // none of its runs has been computed yet
    cells[0] = name;
    return cells;
  }
  if (!r.one_at_a_time()) {
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = r.factors[i].text(found->second[i]);
    return cells;
  }
  cells[0] = "base";
  for (std::size_t i = 0; i < r.factors.size(); ++i) {
    const Number& factor = r.factors[i];
    if (found->second[i] == r.base(factor)) continue;
    const double change = 100.0 * (factor.shown(found->second[i]) / factor.shown(r.base(factor)) - 1.0);
    const bool relative = factor.numeric && std::isfinite(change);
    cells = {factor.title, factor.text(found->second[i]), relative ? fmt::format("{:+.3g}{}%", change, kSpace) : ""};
  }
  return cells;
}

std::string table_by_point(const Results& r) {
  std::vector<html::PageColumn> columns;
  if (r.one_at_a_time()) columns = {{"input", false}, {"value", true}, {"change", true}};
  else
    for (const Number& factor : r.factors) columns.push_back({factor.title, true});
  const std::size_t identity = columns.size();
  columns.insert(columns.end(), {{"runs", true}, {"failed", true}});
  for (const Number& outcome : r.outcomes) columns.push_back({outcome.label(), true});

  std::vector<Row> rows;
  std::string last;
  for (const Row& cell : r.summary.rows) {  // the outcomes of a point follow each other, in the order of the study
    const std::string& point = cell[r.summary.column("point")];
    if (rows.empty() || point != last) {
      rows.push_back(point_cells(r, point, cell[r.summary.column("name")]));
      rows.back().push_back(cell[r.summary.column("runs")]);
      rows.back().push_back(cell[r.summary.column("failed")]);
    }
    last = point;
    rows.back().push_back(median_of(r, cell, r.outcomes.at(rows.back().size() - identity - 2)));
  }
  for (Row& row : rows) row.resize(columns.size());
  return html::table(columns, rows);
}

std::string table_over_all(const Results& r) {
  constexpr const char* kNames[] = {"median", "q05", "q95", "q25", "q75", "mean", "sd"};
  std::vector<Row> rows;
  for (const Row& cell : r.summary.rows) {
    const Number& outcome = r.outcomes.at(rows.size());
    rows.push_back({outcome.label()});
    for (const char* name : kNames) rows.back().push_back(outcome.number(cell[r.summary.column(name)]));
  }
  return html::table({{"outcome", false},
                      {"median", true},
                      {"5 %", true},
                      {"95 %", true},
                      {"25 %", true},
                      {"75 %", true},
                      {"mean", true},
                      {"standard deviation", true}},
                     rows);
}

std::string medians(const Results& r) {
  if (!r.by_point()) return "<h2>Outcomes</h2>\n" + table_over_all(r);
  return "<h2>Outcomes</h2>\n<p>Median of the runs of each point; in brackets the range from 5 to 95 %.</p>\n" +
         table_by_point(r);
}

std::string sobol_table(const Results& r) {
  if (!r.sobol || r.sobol->rows.empty()) return "";
  const Table& t = *r.sobol;
  const auto title = [](const std::vector<Number>& of, const std::string& name) {
    const auto found = std::find_if(of.begin(), of.end(), [&](const Number& n) { return n.name == name; });
    return found == of.end() ? name : found->title;
  };
  std::vector<Row> rows;
  for (const Row& row : t.rows) {
    const auto index = [&](const std::string& kind) {
      const auto at = [&](const char* end) {
        return files::number<double>(row[t.column(kind + end)]).value_or(std::nan(""));
      };
      return fmt::format("{:.3f} ({:.3f}{}{:.3f})", at(""), at("_low"), kTo, at("_high"));
    };
    rows.push_back({title(r.outcomes, row[t.column("outcome")]), title(r.factors, row[t.column("factor")]),
                    index("first"), index("total"), row[t.column("samples")]});
  }
  return "<h2>Sobol indices</h2>\n<p>Share of each input in the variance of the outcome: alone (first order), and with "
         "all of its interactions (total); in brackets 95 % confidence intervals.</p>\n" +
         html::table({{"outcome", false}, {"input", false}, {"first order", true}, {"total", true}, {"samples", true}},
                     rows);
}

std::string failed_table(const Results& r) {
  if (r.failed == 0) return "";
  std::vector<html::PageColumn> columns{{"run", true}};
  for (const Number& factor : r.factors) columns.push_back({factor.title, true});
  columns.push_back({"reason", false});
  std::vector<Row> rows = r.failures;
  for (Row& row : rows) {
    for (std::size_t i = 0; i < r.factors.size(); ++i) row[1 + i] = r.factors[i].text(row[1 + i]);
  }
  std::string rest;
  if (r.failed > rows.size()) rest = fmt::format("<p>{} more in runs.csv.</p>\n", r.failed - rows.size());
  return "<h2>Failed runs</h2>\n<p>They are counted, but left out of all medians.</p>\n" + html::table(columns, rows) +
         rest;
}

/// Returns the warnings, which should be read before the numbers are believed.
std::string warnings(const Results& r) {
  std::string list;
  for (const ordered_json& warning : r.about.at("warnings"))
    list += "<li>" + html::escape(warning.get<std::string>()) + "</li>\n";
  return list.empty() ? "" : "<h2>Warnings</h2>\n<ul>\n" + list + "</ul>\n";
}

bool ends_with(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// Returns the pictures, those of each outcome together, all others first.
std::string pictures(const Results& r) {
  std::vector<std::string> paths = html::pictures_in(in(r.folder, "pictures"));
  if (paths.empty()) {
    return fmt::format(
        "<h2>Pictures</h2>\n<p>There are none yet: <code>rosrun train_derail plot_study.py {}</code> "
        "draws them; then make this page again.</p>\n",
        html::escape(r.folder));
  }
  std::string of_outcomes;
  for (const Number& outcome : r.outcomes) {
    std::string some;
    for (std::string& path : paths) {
      if (path.empty() || !ends_with(fs::path(path).stem().string(), "_" + outcome.name)) continue;
      some += html::figure(path);
      path.clear();
    }
    if (!some.empty()) of_outcomes += "<h3>" + html::escape(outcome.title) + "</h3>\n" + some;
  }
  std::string others;
  for (const std::string& path : paths) {
    if (!path.empty()) others += html::figure(path);
  }
  return "<h2>Pictures</h2>\n" + others + of_outcomes;
}

std::string origin(const Results& r) {
  const ordered_json machine = r.about.value("machine", ordered_json::object());
  const double wall_time = r.about.value("wall_time", 0.0);
  Facts facts{{"train_derail", field(r.about, "version")},
              {"system", field(machine, "system")},
              {"processor", field(machine, "processor") + ", cores: " + field(machine, "cores")}};
  if (wall_time > 0.0) facts.push_back({"computing time of the last call", fmt::format("{:.1f} s", wall_time)});
  return "<h2>Version and machine</h2>\n" + html::facts(facts);
}

std::string scenario(const Results& r) {
  Facts facts;
  for (const auto& [key, value] : r.study.at("scenario").items()) facts.emplace_back(key, value.get<std::string>());
  return "<h2>Base scenario</h2>\n<p>In SI units, all defaults filled in.</p>\n" + html::facts(facts);
}

}  // namespace

std::string to_html(const std::string& folder) {
  const Results r = read_results(folder);
  try {
    return checked_json(in(folder, "about.json"), kWrites, [&] {
      const std::string given = field(r.study, "title"), title = given.empty() ? "Study" : given;
      return html::page(title, "<h1>" + html::escape(title) + "</h1>\n" + overview(r) + warnings(r) + inputs_of(r) +
                                   medians(r) + sobol_table(r) + failed_table(r) + pictures(r) + origin(r) +
                                   scenario(r));
    });
  } catch (const std::out_of_range&) {
    wrong_json(in(folder, "summary.csv"), kWrites, "more rows than the study has outcomes");
  }
}

}  // namespace train_derail::study
