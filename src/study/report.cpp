#include "train_derail/study/report.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/json_file.hpp"
#include "study/results.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/files/recognise.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/outcome/outcome.hpp"
#include "train_derail/study/statistics.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

using nlohmann::ordered_json;

namespace {

// With no-break spaces, so that a range stays on one line.
constexpr const char* kTo = "\u00A0to\u00A0";
constexpr const char* kSpace = "\u00A0";
/// Most rows of a chart: more cannot be told apart.
constexpr std::size_t kChartRowsMax = 120;
/// About how many bars a histogram has.
constexpr double kBars = 24.0;

/// A cell of a table: a text, and the number that it is sorted by (null: by its text).
ordered_json cell(const std::string& text) { return {{"text", text}, {"value", nullptr}}; }
ordered_json cell(const std::string& text, double value) {
  ordered_json c = cell(text);
  if (std::isfinite(value)) c["value"] = value;
  return c;
}
ordered_json cell(const Number& of, const std::string& si) {
  return of.numeric ? cell(of.text(si), of.shown(si)) : cell(si);
}
ordered_json count_cell(const std::string& text) {
  return cell(text, files::number<double>(text).value_or(std::nan("")));
}

ordered_json column(const std::string& title, bool numeric) { return {{"title", title}, {"numeric", numeric}}; }

/// A table under a heading; `name` is its id in the page.
ordered_json section(const char* name, const char* title, const std::string& note, const ordered_json& columns,
                     const ordered_json& rows) {
  return {{"name", name}, {"title", title}, {"note", note}, {"columns", columns}, {"rows", rows}};
}

/// Names and values.
ordered_json fact(const std::string& name, const std::string& value) { return ordered_json::array({name, value}); }

/// Returns `j[key]` as text, whether it is a text or a number.
std::string field(const ordered_json& j, const char* key) {
  if (!j.contains(key)) return "not known";
  return j.at(key).is_string() ? j.at(key).get<std::string>() : j.at(key).dump();
}

ordered_json overview(const Results& r) {
  const ordered_json& p = r.study.at("perturbation");
  ordered_json facts = ordered_json::array({fact("plan", field(r.study, "plan"))});
  if (!r.by_point()) facts.push_back(fact("samples", field(r.study, "samples")));
  facts.push_back(fact("runs", fmt::format("{}, of which failed: {}", r.runs, r.failed)));
  facts.push_back(fact("runs for each point", field(r.study, "replicates")));
  facts.push_back(
      fact("perturbation of every run",
           fmt::format("spacing {} m, yaw rate {} (relative), kick {} m/s, alignment {} m", digits(p.at("spacing")),
                       digits(p.at("yaw_rate")), digits(p.at("kick")), digits(p.at("alignment")))));
  facts.push_back(fact("seed", field(r.study, "seed")));
  facts.push_back(fact("base scenario", field(r.study.at("scenario"), "title")));
  return facts;
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

ordered_json inputs_of(const Results& r) {
  ordered_json rows = ordered_json::array();
  for (std::size_t i = 0; i < r.factors.size(); ++i) {
    const Number& factor = r.factors[i];
    rows.push_back({cell(factor.title), cell(factor.name), cell(factor, r.base(factor)),
                    cell(range_of(factor, r.study.at("factors").at(i)))});
  }
  return section(
      "inputs", "Inputs",
      r.factors.empty() ? "None varies: all runs are of the base scenario, each with a seed of its own." : "",
      {column("input", false), column("key", false), column("base", true), column("values", false)}, rows);
}

/// A row of summary.csv.
struct Cells {
  const Table& table;
  const Row& row;
  const std::string& operator[](const char* name) const { return row[table.column(name)]; }
};

/// "14 (12.7 to 15.3)".
std::string median_of(const Cells& cells, const Number& outcome) {
  // On the screen these cells do not break; on paper they may, after "to".
  return fmt::format("{} ({}{}to {})", outcome.number(cells["median"]), outcome.number(cells["low"]), kSpace,
                     outcome.number(cells["high"]));
}

/// The cells that identify a point: the input that was changed, or all inputs.
ordered_json point_cells(const Results& r, const std::string& point, const std::string& name) {
  const auto found = r.points.find(point);
  ordered_json cells = ordered_json::array();
  for (std::size_t i = 0; i < (r.one_at_a_time() ? 3 : r.factors.size()); ++i) cells.push_back(cell(""));
  if (found == r.points.end()) {  // none of its runs has been computed yet
    if (!cells.empty()) cells[0] = cell(name);
    return cells;
  }
  if (!r.one_at_a_time()) {
    for (std::size_t i = 0; i < cells.size(); ++i) cells[i] = cell(r.factors[i], found->second[i]);
    return cells;
  }
  cells[0] = cell("base");
  for (std::size_t i = 0; i < r.factors.size(); ++i) {
    const Number& factor = r.factors[i];
    if (found->second[i] == r.base(factor)) continue;
    const double change = 100.0 * (factor.shown(found->second[i]) / factor.shown(r.base(factor)) - 1.0);
    const bool relative = factor.numeric && std::isfinite(change);
    cells = {cell(factor.title), cell(factor, found->second[i]),
             relative ? cell(fmt::format("{:+.3g}{}%", change, kSpace), change) : cell("")};
  }
  return cells;
}

/// A point in words: "train speed 30 mph", "10 mph, guided".
std::string words_of(const ordered_json& identity, bool one_at_a_time) {
  std::string words;
  for (std::size_t i = 0; i < (one_at_a_time ? std::min<std::size_t>(2, identity.size()) : identity.size()); ++i) {
    const std::string text = identity[i].at("text");
    if (!text.empty()) words += (words.empty() ? "" : one_at_a_time ? " " : ", ") + text;
  }
  return words.empty() ? "all runs" : words;
}

/// A row of a chart of ranges: whiskers from `low` to `high`, a box between the quartiles if there are any, a dot.
ordered_json range_row(const std::string& label, double low, double dot, double high, const std::string& says) {
  return {{"label", label}, {"low", low}, {"high", high}, {"dot", dot}, {"says", says}, {"box", nullptr}, {"group", 0}};
}

/// A chart of one outcome.
ordered_json chart(const Number& outcome, const char* kind, const std::string& axis, const std::string& note) {
  const std::string& t = outcome.title;
  return {{"name", outcome.name}, {"title", t},     {"kind", kind},         {"axis", axis},
          {"note", note},         {"whole", false}, {"reference", nullptr}, {"rows", ordered_json::array()}};
}

/// What the ranges of all points are: "lowest to highest of 7 runs", "5 to 95 % of 24 to 25 runs".
std::string ranges_of(const Results& r) {
  std::map<std::string, std::pair<std::size_t, std::size_t>> kinds;  // least and most runs
  for (const Row& row : r.summary.rows) {
    const Cells cells{r.summary, row};
    const auto runs = static_cast<std::size_t>(files::number<double>(cells["runs"]).value_or(0.0));
    if (runs == 0) continue;
    auto& [least, most] = kinds.try_emplace(cells["range"], runs, runs).first->second;
    least = std::min(least, runs);
    most = std::max(most, runs);
  }
  std::string words;
  for (const auto& [kind, runs] : kinds) {
    const auto& [least, most] = runs;
    const std::string count = least == most ? fmt::format("{}", least) : fmt::format("{} to {}", least, most);
    words += fmt::format("{}{} of {} runs", words.empty() ? "" : "; ", kind, count);
  }
  return words;
}

/// The table of all points, and a chart of each outcome over them.
ordered_json by_point(const Results& r, ordered_json& charts) {
  const std::string range = ranges_of(r);
  ordered_json columns = ordered_json::array();
  if (r.one_at_a_time() && !r.factors.empty())
    columns = {column("input", false), column("value", true), column("change", true)};
  else
    for (const Number& factor : r.factors) columns.push_back(column(factor.title, factor.numeric));
  const std::size_t identity = columns.size();
  columns.push_back(column("runs", true));
  columns.push_back(column("failed", true));
  for (const Number& outcome : r.outcomes) {
    columns.push_back(column(outcome.label(), true));
    charts.push_back(chart(outcome, "ranges", outcome.label(),
                           "Dot: median. Box: 25 to 75 % of the runs. Line: " + range + "." +
                               std::string(r.one_at_a_time() ? " Dashed: median of the base." : "")));
  }

  ordered_json rows = ordered_json::array();
  std::string last;
  for (const Row& row : r.summary.rows) {  // the outcomes of a point follow each other, in the order of the study
    const Cells cells{r.summary, row};
    if (rows.empty() || cells["point"] != last) {
      rows.push_back(point_cells(r, cells["point"], cells["name"]));
      rows.back().erase(rows.back().begin() + static_cast<std::ptrdiff_t>(std::min(identity, rows.back().size())),
                        rows.back().end());
      rows.back().push_back(count_cell(cells["runs"]));
      rows.back().push_back(count_cell(cells["failed"]));
    }
    last = cells["point"];
    const std::size_t place = rows.back().size() - identity - 2;
    const Number& outcome = r.outcomes.at(place);
    const double median = outcome.shown(cells["median"]);
    rows.back().push_back(cell(median_of(cells, outcome), median));
    if (!std::isfinite(median)) continue;
    ordered_json identity_cells(rows.back().begin(), rows.back().begin() + static_cast<std::ptrdiff_t>(identity));
    const std::string label = words_of(identity_cells, r.one_at_a_time());
    ordered_json bar = range_row(
        label, outcome.shown(cells["low"]), median, outcome.shown(cells["high"]),
        fmt::format("{}: median {}, {} of {} runs: {}{}{}", label, outcome.text(cells["median"]), cells["range"],
                    cells["runs"], outcome.text(cells["low"]), kTo, outcome.text(cells["high"])));
    bar["box"] = {outcome.shown(cells["q25"]), outcome.shown(cells["q75"])};
    charts[place]["rows"].push_back(bar);
    if (r.one_at_a_time() && charts[place]["rows"].size() == 1) charts[place]["reference"] = median;
  }
  for (ordered_json& row : rows) {
    while (row.size() < columns.size()) row.push_back(cell(""));
  }
  return section("outcomes", "Outcomes", fmt::format("Median of the runs of each point; in brackets: {}.", range),
                 columns, rows);
}

/// Bars of equal width; of whole numbers each bar holds the same number of them.
struct Bars {
  double from = 0.0, width = 1.0;
  std::vector<std::int64_t> counts;

  explicit Bars(const Extent& extent) {
    const double raw = std::max(extent.high - extent.low, 1e-12 * std::max(1.0, std::abs(extent.high))) / kBars;
    const double power = std::pow(10.0, std::floor(std::log10(raw)));
    for (const double step : {1.0, 2.0, 5.0, 10.0}) {
      width = step * power;
      if (width >= raw) break;
    }
    if (extent.whole) width = std::max(1.0, width);
    from = std::floor(extent.low / width) * width;
    counts.resize(static_cast<std::size_t>(std::floor((extent.high - from) / width)) + 1, 0);
  }
  void add(double value) {
    const double place = std::floor((value - from) / width);
    counts[static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(counts.size() - 1)))]++;
  }
};

std::vector<Bars> histograms(const Results& r) try {
  files::CsvTable table(in_folder(r.folder, "runs.csv"));
  const std::size_t ended = table.column("ended");
  std::vector<std::size_t> columns;
  std::vector<Bars> all;
  for (std::size_t i = 0; i < r.outcomes.size(); ++i) {
    columns.push_back(table.column(r.outcomes[i].name));
    all.emplace_back(r.extents[i]);
  }
  for (Row row; table.next(row);) {
    if (row[ended] == outcome::to_string(outcome::Ended::integration_failed)) continue;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double value = r.outcomes[i].shown(row[columns[i]]);
      if (std::isfinite(value)) all[i].add(value);
    }
  }
  return all;
} catch (const files::CsvError& e) {
  throw inputs::InputError(e.what(), "", "", fmt::format("{} writes this table", kResultsWriter), "");
}

ordered_json histogram(const Number& outcome, const Bars& bars, const Extent& extent) {
  ordered_json c =
      chart(outcome, "histogram", outcome.label(), fmt::format("How many of {} runs. Dashed: median.", extent.values));
  c["whole"] = extent.whole;
  for (std::size_t i = 0; i < bars.counts.size(); ++i) {
    const double from = bars.from + static_cast<double>(i) * bars.width, to = from + bars.width;
    const std::string unit = outcome.shown_unit.empty() ? "" : kSpace + outcome.shown_unit;
    const std::string range = extent.whole && bars.width == 1.0 ? digits(from)
                              : extent.whole                    ? digits(from) + kTo + digits(to - 1.0)
                                                                : digits(from) + kTo + digits(to);
    // A bar of whole numbers stands over them.
    const double shift = extent.whole ? 0.5 : 0.0;
    c["rows"].push_back({{"low", from - shift},
                         {"high", to - shift},
                         {"count", bars.counts[i]},
                         {"says", fmt::format("{}{}: {} of {} runs", range, unit, bars.counts[i], extent.values)}});
  }
  return c;
}

/// The table over all runs, and a histogram of each outcome.
ordered_json over_all(const Results& r, ordered_json& charts) {
  const bool quantiles = is_quantile_range(static_cast<std::size_t>(r.runs) - r.failed);
  const std::pair<const char*, const char*> columns_of[] = {{"median", "median"},
                                                            {"low", quantiles ? "5 %" : "lowest"},
                                                            {"high", quantiles ? "95 %" : "highest"},
                                                            {"q25", "25 %"},
                                                            {"q75", "75 %"},
                                                            {"mean", "mean"},
                                                            {"sd", "standard deviation"}};
  ordered_json columns = ordered_json::array({column("outcome", false)}), rows = ordered_json::array();
  for (const auto& [name, title] : columns_of) columns.push_back(column(title, true));
  const std::vector<Bars> bars = histograms(r);
  for (const Row& row : r.summary.rows) {
    const Cells cells{r.summary, row};
    const std::size_t place = rows.size();
    const Number& outcome = r.outcomes.at(place);
    rows.push_back(ordered_json::array({cell(outcome.label())}));
    for (const auto& [name, title] : columns_of)
      rows.back().push_back(cell(outcome.number(cells[name]), outcome.shown(cells[name])));
    if (r.extents[place].values == 0) continue;
    charts.push_back(histogram(outcome, bars[place], r.extents[place]));
    charts.back()["reference"] = outcome.shown(cells["median"]);
  }
  return section("outcomes", "Outcomes", fmt::format("Of {} runs.", static_cast<std::size_t>(r.runs) - r.failed),
                 columns, rows);
}

/// Indices of the plan saltelli, and a chart of each outcome.
ordered_json sobol(const Results& r, ordered_json& charts) {
  ordered_json rows = ordered_json::array();
  const auto number_of = [](const std::vector<Number>& of, const std::string& name) {
    const auto found = std::find_if(of.begin(), of.end(), [&](const Number& n) { return n.name == name; });
    return found == of.end() ? Number{name, name, "", true, 1.0} : *found;
  };
  std::string last;
  for (const Row& row : r.sobol->rows) {
    const Cells cells{*r.sobol, row};
    const Number outcome = number_of(r.outcomes, cells["outcome"]), factor = number_of(r.factors, cells["factor"]);
    if (cells["outcome"] != last)
      charts.push_back(
          chart(outcome, "ranges", "share of the variance of " + outcome.title,
                "Dot: index. Line: 95 % confidence. Above: the input alone; below: with all interactions."));
    last = cells["outcome"];
    rows.push_back(ordered_json::array({cell(outcome.title), cell(factor.title)}));
    for (const auto& [kind, words] : {std::pair("first", "alone"), std::pair("total", "with interactions")}) {
      const auto at = [&, name = std::string(kind)](const char* end) {
        return files::number<double>(cells[(name + end).c_str()]).value_or(std::nan(""));
      };
      const std::string text = fmt::format("{:.3f} ({:.3f}{}{:.3f})", at(""), at("_low"), kTo, at("_high"));
      rows.back().push_back(cell(text, at("")));
      const std::string label = factor.title + ", " + words;
      charts.back()["rows"].push_back(
          range_row(label, at("_low"), at(""), at("_high"), fmt::format("{}: {}", label, text)));
      charts.back()["rows"].back()["group"] = std::string_view(kind) == "total" ? 1 : 0;
    }
    rows.back().push_back(count_cell(cells["samples"]));
  }
  return section("sobol", "Sobol indices",
                 "Share of each input in the variance of the outcome: alone (first order), and with all of its "
                 "interactions (total); in brackets 95 % confidence intervals.",
                 {column("outcome", false), column("input", false), column("first order", true), column("total", true),
                  column("samples", true)},
                 rows);
}

ordered_json failed_runs(const Results& r) {
  ordered_json columns = ordered_json::array({column("run", true)}), rows = ordered_json::array();
  for (const Number& factor : r.factors) columns.push_back(column(factor.title, factor.numeric));
  columns.push_back(column("reason", false));
  for (const Row& failure : r.failures) {
    rows.push_back(ordered_json::array({count_cell(failure.front())}));
    for (std::size_t i = 0; i < r.factors.size(); ++i) rows.back().push_back(cell(r.factors[i], failure[1 + i]));
    rows.back().push_back(cell(failure.back()));
  }
  std::string note = "They are counted, but left out of all medians.";
  if (r.failed > r.failures.size()) note += fmt::format(" {} more are in runs.csv.", r.failed - r.failures.size());
  return section("failed", "Failed runs", note, columns, rows);
}

ordered_json origin(const Results& r) {
  const ordered_json machine = r.about.value("machine", ordered_json::object());
  const double wall_time = r.about.value("wall_time", 0.0);
  ordered_json facts =
      ordered_json::array({fact("train_derail", field(r.about, "version")), fact("system", field(machine, "system")),
                           fact("processor", field(machine, "processor") + ", cores: " + field(machine, "cores"))});
  if (wall_time > 0.0) facts.push_back(fact("computing time of the last call", fmt::format("{:.1f} s", wall_time)));
  return facts;
}

/// A value with its unit, and in the one that people read: "1868253.08 N; 420 kip", as derail check has it.
std::string with_unit(const inputs::KeyValue& v, const std::string& value) {
  std::string text = value;
  if (v.unit.empty() || v.unit == "1") return text;
  text += " " + v.unit;
  if (const auto si = files::number<double>(value); si && !v.shown_unit.empty())
    text += fmt::format("; {:.6g} {}", inputs::from_si(*si, v.unit, v.shown_unit), v.shown_unit);
  return text;
}

ordered_json scenario(const Results& r) {
  std::map<std::string, inputs::KeyValue> known;
  try {
    for (inputs::KeyValue& v : inputs::key_values(base_of(r))) known[v.key] = v;
  } catch (const inputs::InputError&) {  // of another version: its values stand alone, as they are in about.json
  }
  ordered_json facts = ordered_json::array();
  for (const auto& [key, value] : r.study.at("scenario").items()) {
    const auto found = known.find(key);
    const auto text = value.get<std::string>();
    facts.push_back(fact(key, found == known.end() ? text : with_unit(found->second, text)));
  }
  return facts;
}

ordered_json document(const Results& r) {
  const std::string title = field(r.study, "title");
  ordered_json j{{"version", TRAIN_DERAIL_VERSION},
                 {"mark", files::kReportMark},
                 {"title", title.empty() ? "Study" : title},
                 {"folder", r.folder},
                 {"facts", overview(r)},
                 {"warnings", ordered_json::array()},
                 {"sections", ordered_json::array({inputs_of(r)})},
                 {"charts", ordered_json::array()},
                 {"pictures_folder", in_folder(r.folder, "pictures")},
                 {"outcomes", ordered_json::array()},
                 {"origin", origin(r)},
                 {"scenario", scenario(r)}};
  for (const ordered_json& warning : r.about.at("warnings")) j["warnings"].push_back(warning.get<std::string>());
  ordered_json& charts = j["charts"];
  j["sections"].push_back(r.by_point() && !r.factors.empty() ? by_point(r, charts) : over_all(r, charts));
  if (r.sobol && !r.sobol->rows.empty()) j["sections"].push_back(sobol(r, charts));
  if (r.failed > 0) j["sections"].push_back(failed_runs(r));
  for (ordered_json& c : charts) {
    if (c["rows"].size() <= kChartRowsMax) continue;
    c["note"] = fmt::format("{} rows: too many for a chart; summary.csv has them.", c["rows"].size());
    c["rows"] = ordered_json::array();
  }
  for (const Number& outcome : r.outcomes) j["outcomes"].push_back({{"name", outcome.name}, {"title", outcome.title}});
  return j;
}

}  // namespace

std::string report_document(const std::string& folder) {
  const Results r = read_results(folder);
  try {
    return checked_json(in_folder(folder, "about.json"), kResultsWriter,
                        [&] { return document(r).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace); });
  } catch (const std::out_of_range&) {
    wrong_json(in_folder(folder, "summary.csv"), kResultsWriter, "more rows than the study has outcomes");
  }
}

}  // namespace train_derail::study
