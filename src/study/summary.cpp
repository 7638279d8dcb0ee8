#include "train_derail/study/summary.hpp"
#include "train_derail/files/checksum.hpp"

#include <sys/utsname.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/warnings.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/statistics.hpp"

namespace train_derail::study {

namespace {

std::string in(const std::string& folder, const char* name) { return (std::filesystem::path(folder) / name).string(); }

void look_at(const std::atomic<bool>* stop) {
  if (stop != nullptr && *stop) throw Stopped();
}

const outcome::Quantity& quantity(const std::string& name) {
  const outcome::Quantity* found = outcome::find_quantity(name);
  if (found == nullptr) throw std::out_of_range("no outcome of this name");
  return *found;
}

/// The runs of runs.csv as numbers, in the order of the file.
struct Runs {
  std::vector<std::int64_t> points;
  std::vector<bool> failed;
  std::vector<std::uint64_t> prints;          // checksums of all outcomes: equal runs have equal ones
  std::vector<std::vector<double>> outcomes;  // for each of Study::outcomes: its values, run by run
  WarningCount warnings;

  std::size_t size() const { return points.size(); }
  void add(std::int64_t point, bool has_failed, std::uint64_t print, const std::string& warned) {
    points.push_back(point);
    failed.push_back(has_failed);
    prints.push_back(print);
    warnings.add(warned);
  }
};

Runs read_runs(const std::string& folder, const Study& study, const std::atomic<bool>* stop) {
  files::CsvTable table(in(folder, "runs.csv"));
  const std::size_t run = table.column("run"), point = table.column("point"), ended = table.column("ended"),
                    warned = table.column("warnings");
  std::vector<std::size_t> wanted, all;
  for (const std::string& name : study.outcomes) wanted.push_back(table.column(name));
  for (const auto& q : outcome::quantities()) all.push_back(table.column(std::string(q.name)));
  const std::int64_t total = run_count(study);
  Runs runs;
  runs.outcomes.resize(wanted.size());
  std::int64_t last = -1;
  std::vector<std::string> fields;
  while (table.next(fields)) {
    look_at(stop);
    for (const std::size_t column : {run, point}) {
      if (const std::string problem = flaw_of_count(table.names()[column], fields[column]); !problem.empty())
        table.fail(problem);
    }
    const std::int64_t index = std::stoll(fields[run]), place = std::stoll(fields[point]);
    if (index <= last || index >= total || place != index / study.replicates) {
      table.fail(fmt::format("run {} of point {}: not a run of this study, or out of order", index, place));
    }
    last = index;
    if (const std::string problem = flaw_of_ended(fields[ended]); !problem.empty()) table.fail(problem);
    std::string text;
    for (const std::size_t column : all) text += fields[column] + ",";
    runs.add(place, fields[ended] == outcome::to_string(outcome::Ended::integration_failed), files::crc64(text),
             fields[warned]);
    for (std::size_t i = 0; i < wanted.size(); ++i) runs.outcomes[i].push_back(table.number(fields, wanted[i]));
  }
  return runs;
}

bool by_point(const Study& s) { return s.plan == Plan::one_at_a_time || s.plan == Plan::grid; }

/// Calls use(cell) for each outcome of each point, or of all points of a random plan together.
template <class Use>
void for_each_cell(const Runs& runs, const Study& study, const std::atomic<bool>* stop, const Use& use) {
  const Points points(study, stop);
  const std::int64_t groups = by_point(study) ? points.size() : 1;
  std::size_t begin = 0;
  for (std::int64_t g = 0; g < groups; ++g) {
    look_at(stop);
    std::size_t end = by_point(study) ? begin : runs.size();
    while (end < runs.size() && runs.points[end] == g) ++end;
    const std::string name = by_point(study) ? points.name(g) : "all points";
    const auto failed = std::count(runs.failed.begin() + static_cast<std::ptrdiff_t>(begin),
                                   runs.failed.begin() + static_cast<std::ptrdiff_t>(end), true);
    for (std::size_t i = 0; i < study.outcomes.size(); ++i) {
      std::vector<double> sample;
      for (std::size_t r = begin; r < end; ++r) {
        if (!runs.failed[r]) sample.push_back(runs.outcomes[i][r]);
      }
      use(PointSpread{by_point(study) ? g : -1, name, study.outcomes[i], spread(std::move(sample)), failed});
    }
    begin = end;
  }
}

/// Returns a warning if there are points whose runs all have exactly the same outcome, so that their seeds changed
/// nothing.
std::vector<std::string> equal_points(const Runs& runs, const Study& study) {
  std::int64_t points = 0, equal = 0;
  for (std::size_t begin = 0, end = 0; begin < runs.size(); begin = end) {
    std::size_t good = 0;
    bool same = true;
    std::uint64_t first = 0;
    for (end = begin; end < runs.size() && runs.points[end] == runs.points[begin]; ++end) {
      if (runs.failed[end]) continue;
      if (good++ == 0) first = runs.prints[end];
      same &= runs.prints[end] == first;
    }
    if (good < 2) continue;
    ++points;
    equal += same ? 1 : 0;
  }
  if (study.replicates < 2 || equal == 0) return {};
  return {fmt::format("{} of {} points: all runs are equal, the seeds change nothing; their ranges have no meaning",
                      equal, points)};
}

Totals totals_of(const Runs& runs, const Study& study) {
  Totals totals;
  totals.runs = static_cast<std::int64_t>(runs.size());
  totals.failed = std::count(runs.failed.begin(), runs.failed.end(), true);
  totals.warnings = runs.warnings.texts(totals.runs);
  for (std::string& text : equal_points(runs, study)) totals.warnings.push_back(std::move(text));
  return totals;
}

void write_sobol(const std::string& folder, const Study& study, const Runs& runs, const std::atomic<bool>* stop) {
  const std::size_t d = study.factors.size(), stride = d + 2;
  files::OutputFile file(in(folder, "sobol.csv"), files::Existing::replace);
  file.stream() << "outcome,factor,first,first_low,first_high,total,total_low,total_high,samples\n";
  for (std::size_t o = 0; o < study.outcomes.size(); ++o) {
    // Mean over the replicates of each point. A sample is used only if all its points have results.
    std::vector<double> sum(stride * static_cast<std::size_t>(study.samples), 0.0);
    std::vector<int> count(sum.size(), 0);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (runs.failed[r]) continue;
      sum[static_cast<std::size_t>(runs.points[r])] += runs.outcomes[o][r];
      ++count[static_cast<std::size_t>(runs.points[r])];
    }
    std::vector<double> a, b;
    std::vector<std::vector<double>> ab(d);
    for (std::size_t s = 0; s < static_cast<std::size_t>(study.samples); ++s) {
      const std::size_t first = s * stride;
      if (std::any_of(count.begin() + static_cast<std::ptrdiff_t>(first),
                      count.begin() + static_cast<std::ptrdiff_t>(first + stride), [](int c) { return c == 0; })) {
        continue;
      }
      const auto mean = [&](std::size_t p) { return sum[first + p] / count[first + p]; };
      a.push_back(mean(0));
      b.push_back(mean(1));
      for (std::size_t i = 0; i < d; ++i) ab[i].push_back(mean(2 + i));
    }
    if (a.size() < 2) continue;
    const std::vector<SobolIndex> indices = sobol_indices(a, b, ab, kBootstraps, stop);
    for (std::size_t i = 0; i < d; ++i) {
      const SobolIndex& x = indices[i];
      file.stream() << files::csv_row({study.outcomes[o], study.factors[i].key, fmt::format("{}", x.first),
                                       fmt::format("{}", x.first_low), fmt::format("{}", x.first_high),
                                       fmt::format("{}", x.total), fmt::format("{}", x.total_low),
                                       fmt::format("{}", x.total_high), fmt::format("{}", a.size())})
                    << "\n";
    }
  }
  file.commit();
}

/// Returns titles and units of the columns of runs.csv, so that pictures and reports need not know them.
nlohmann::ordered_json columns(const Study& study) {
  nlohmann::ordered_json j;
  for (const Factor& f : study.factors) {
    const bool converted = !f.shown_unit.empty();
    j[f.key] = {{"title", f.label},
                {"unit", f.unit},
                {"shown_unit", converted       ? f.shown_unit
                               : f.unit == "1" ? ""
                                               : f.unit},
                {"per_shown", converted ? inputs::to_si("1 " + f.shown_unit, f.unit) : 1.0}};
  }
  for (const auto& q : outcome::quantities()) {
    j[std::string(q.name)] = {
        {"title", q.title}, {"unit", q.unit}, {"shown_unit", q.shown_unit}, {"per_shown", q.per_shown}};
  }
  return j;
}

std::string cpu_model() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);) {
    if (line.compare(0, 10, "model name") == 0) return line.substr(line.find(':') + 2);
  }
  return "unknown";
}

}  // namespace

std::vector<PointSpread> spreads(const std::string& folder, const Study& study, const std::atomic<bool>* stop) {
  std::vector<PointSpread> all;
  for_each_cell(read_runs(folder, study, stop), study, stop, [&](const PointSpread& s) { all.push_back(s); });
  return all;
}

Totals write_summary(const std::string& folder, const Study& study, const std::atomic<bool>* stop) {
  const Runs runs = read_runs(folder, study, stop);
  files::OutputFile file(in(folder, "summary.csv"), files::Existing::replace);
  file.stream() << "point,name,outcome,unit,runs,failed,mean,sd,q05,q25,median,q75,q95,low,high,range\n";
  for_each_cell(runs, study, stop, [&](const PointSpread& c) {
    const Spread& s = c.spread;
    std::vector<std::string> fields{fmt::format("{}", c.point),
                                    c.name,
                                    c.outcome,
                                    std::string(quantity(c.outcome).unit),
                                    fmt::format("{}", s.count),
                                    fmt::format("{}", c.failed)};
    for (const double value : {s.mean, s.sd, s.q05, s.q25, s.median, s.q75, s.q95, s.low, s.high})
      fields.push_back(fmt::format("{}", value));
    fields.push_back(range_kind(s.count));
    file.stream() << files::csv_row(fields) << "\n";
  });
  file.commit();
  if (study.plan == Plan::saltelli) write_sobol(folder, study, runs, stop);
  return totals_of(runs, study);
}

void write_about(const std::string& folder, const Study& study, const Totals& totals, double wall_time,
                 const std::string& described) {
  nlohmann::ordered_json j;
  j["study"] = nlohmann::ordered_json::parse(described.empty() ? to_json(study) : described);
  j["columns"] = columns(study);
  j["version"] = TRAIN_DERAIL_VERSION;
  utsname name{};
  uname(&name);
  j["machine"] = {{"system", fmt::format("{} {} {}", name.sysname, name.release, name.machine)},
                  {"processor", cpu_model()},
                  {"cores", std::thread::hardware_concurrency()}};
  j["runs"] = totals.runs;
  j["failed"] = totals.failed;
  j["warnings"] = totals.warnings;
  j["wall_time"] = wall_time;
  j["crc32"] = nlohmann::ordered_json::object();
  for (const char* table : {"runs.csv", "summary.csv", "sobol.csv", "rows.csv", "members.csv"}) {
    if (const std::string crc = files::crc32_of_file(in(folder, table)); !crc.empty()) j["crc32"][table] = crc;
  }
  files::write_file(in(folder, "about.json"), j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n",
                    files::Existing::replace);
}

Totals write_results(const std::string& folder, const Study& study, double wall_time, const std::atomic<bool>* stop) {
  write_runs(folder, study, stop);
  const Totals totals = write_summary(folder, study, stop);
  write_about(folder, study, totals, wall_time);
  return totals;
}

namespace {

/// Median and range of an outcome as a table prints them, and their unit.
struct SpreadTexts {
  std::string median, range, unit;
};

/// In the units and with the digits of the table of a single run. A median of counts may lie between two of them.
SpreadTexts texts_of(const Spread& s, const fields::Unit& unit, bool shown) {
  const bool pure = unit.si == "1" && !unit.table_powers;
  const auto number = [&](double value) {
    if (pure) return fmt::format("{:.4g}", value);
    const std::string text = shown ? fields::number_in_shown(value, unit) : "";
    return text.empty() ? fields::number_in_si(value, unit) : text;
  };
  const bool converted = pure || (shown && !fields::number_in_shown(s.median, unit).empty());
  return {number(s.median), fmt::format("{} to {}", number(s.low), number(s.high)),
          converted ? std::string(unit.shown) : fields::unit_in_si(unit)};
}

const fields::Unit& unit_of(const std::string& outcome) { return outcome::outcome_fields().find(outcome)->unit; }

}  // namespace

std::string to_table(const std::string& folder, const Study& study) {
  constexpr std::int64_t kPointsShown = 500;
  const Runs runs = read_runs(folder, study, nullptr);
  std::string text;
  for_each_cell(runs, study, nullptr, [&](const PointSpread& c) {
    if (c.point >= kPointsShown) return;
    if (c.outcome == study.outcomes.front()) {
      text += fmt::format("{} (median, {}{})\n", c.name, range_words(c.spread.count),
                          c.failed > 0 ? fmt::format("; {} failed", c.failed) : "");
    }
    const outcome::Quantity& q = quantity(c.outcome);
    const SpreadTexts t = texts_of(c.spread, unit_of(c.outcome), true);
    const std::string unit = t.unit.empty() ? "" : " " + t.unit;
    text += fmt::format("    {:<42}{:>12}{:<10}{}{}\n", q.title, t.median, unit, t.range, unit);
  });
  if (by_point(study) && run_count(study) / study.replicates > kPointsShown) {
    text += fmt::format("... and {} points more in summary.csv\n", run_count(study) / study.replicates - kPointsShown);
  }
  return text;
}

namespace {

/// Results of an ensemble, without runs that were stopped.
Runs runs_of(const Study& study, const std::vector<outcome::Outcome>& outcomes) {
  Runs runs;
  runs.outcomes.resize(study.outcomes.size());
  for (const outcome::Outcome& o : outcomes) {
    if (o.ended == outcome::Ended::running) continue;
    std::string text;
    for (const auto& q : outcome::quantities()) text += fmt::format("{},", q.value(o));
    runs.add(0, o.ended == outcome::Ended::integration_failed, files::crc64(text), warnings_field(o.warnings));
    for (std::size_t i = 0; i < study.outcomes.size(); ++i)
      runs.outcomes[i].push_back(quantity(study.outcomes[i]).value(o));
  }
  return runs;
}

}  // namespace

std::string ensemble_table(const Study& study, const std::vector<outcome::Outcome>& outcomes) {
  const Runs runs = runs_of(study, outcomes);
  const Totals totals = totals_of(runs, study);
  const auto counted = static_cast<std::size_t>(totals.runs - totals.failed);
  std::string text =
      fmt::format("{} runs{}, each with a seed of its own: median, {}\n", totals.runs,
                  totals.failed > 0 ? fmt::format(", {} failed", totals.failed) : "", range_words(counted));
  for_each_cell(runs, study, nullptr, [&](const PointSpread& c) {
    const outcome::Quantity& q = quantity(c.outcome);
    const auto range = [&](bool shown) {
      const SpreadTexts t = texts_of(c.spread, unit_of(c.outcome), shown);
      return fmt::format("{:>11}  {:<28}", t.median, t.unit.empty() ? t.range : t.range + " " + t.unit);
    };
    std::string line = fmt::format("{:<44}", q.title) + range(false) + (q.per_shown == 1.0 ? "" : range(true));
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  });
  for (const std::string& warning : totals.warnings) text += "warning: " + warning + "\n";
  return text;
}

std::string ensemble_json(const Study& study, const std::vector<outcome::Outcome>& outcomes) {
  const Runs runs = runs_of(study, outcomes);
  const Totals totals = totals_of(runs, study);
  nlohmann::ordered_json j{
      {"title", study.title}, {"runs", totals.runs}, {"failed", totals.failed}, {"warnings", totals.warnings}};
  j["perturbation"] = nlohmann::ordered_json::parse(to_json(study)).at("perturbation");
  for_each_cell(runs, study, nullptr, [&](const PointSpread& c) {
    const Spread& s = c.spread;
    j["outcomes"][c.outcome] = {{"unit", quantity(c.outcome).unit},
                                {"runs", s.count},
                                {"mean", s.mean},
                                {"sd", s.sd},
                                {"q05", s.q05},
                                {"q25", s.q25},
                                {"median", s.median},
                                {"q75", s.q75},
                                {"q95", s.q95},
                                {"low", s.low},
                                {"high", s.high},
                                {"range", range_kind(s.count)}};
  });
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    if (outcomes[i].ended != outcome::Ended::running)
      j["seeds"].push_back(run_of(study, static_cast<std::int64_t>(i)).seed);
  }
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string ensemble_csv(const Study& study, const std::vector<outcome::Outcome>& outcomes) {
  std::string text = files::csv_row(journal_format(study).columns) + "\n";
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    if (outcomes[i].ended == outcome::Ended::running) continue;
    text += files::csv_row(journal_fields(run_of(study, static_cast<std::int64_t>(i)), outcomes[i])) + "\n";
  }
  return text;
}

}  // namespace train_derail::study
