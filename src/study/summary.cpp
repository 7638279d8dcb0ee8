#include "train_derail/study/summary.hpp"

#include <sys/utsname.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "train_derail/inputs/units.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/study/journal.hpp"
#include "train_derail/study/statistics.hpp"

namespace train_derail::study {

namespace {

/// One run as numbers: outcome::kQuantities in their order.
struct Row {
  std::int64_t point;
  bool failed;
  std::array<double, outcome::kQuantities.size()> values;
};

std::vector<Row> read_runs(const std::string& folder, const Study& study) {
  const std::string path = (std::filesystem::path(folder) / "runs.csv").string();
  std::ifstream file(path);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  std::vector<Row> rows;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::vector<std::string> fields;
    std::size_t begin = 0;
    const std::size_t wanted = 4 + study.factors.size() + outcome::kQuantities.size() + 1;
    while (fields.size() < wanted) {
      const std::size_t end = line.find(',', begin);
      if (end == std::string::npos) throw std::runtime_error(path + ": a row is too short: " + line);
      fields.push_back(line.substr(begin, end - begin));
      begin = end + 1;
    }
    Row row{std::stoll(fields[1]), fields.back() == outcome::to_string(outcome::Ended::integration_failed), {}};
    for (std::size_t i = 0; i < outcome::kQuantities.size(); ++i) {
      row.values[i] = std::strtod(fields[4 + study.factors.size() + i].c_str(), nullptr);
    }
    rows.push_back(row);
  }
  return rows;
}

const outcome::Quantity& quantity(const std::string& name, std::size_t& index) {
  for (index = 0; index < outcome::kQuantities.size(); ++index) {
    if (outcome::kQuantities[index].name == name) break;
  }
  return outcome::kQuantities.at(index);
}

bool by_point(const Study& s) { return s.plan == Plan::one_at_a_time || s.plan == Plan::grid; }

/// "initial.speed=24.8" of a point, or "base".
std::string point_name(const Study& s, const Point& p) {
  if (s.plan == Plan::one_at_a_time) {
    if (p.factor < 0) return "base";
    const auto i = static_cast<std::size_t>(p.factor);
    return s.factors[i].key + "=" + p.values[i];
  }
  std::string name;
  for (std::size_t i = 0; i < s.factors.size(); ++i) name += (i == 0 ? "" : "; ") + s.factors[i].key + "=" + p.values[i];
  return name;
}

struct Cell {
  std::int64_t point;  // -1: all points of a random plan
  std::string name;
  std::string outcome;
  Spread spread;
  std::int64_t failed;
};

std::vector<Cell> cells(const std::string& folder, const Study& study) {
  const std::vector<Row> rows = read_runs(folder, study);
  const std::vector<Point> all = points(study);
  const std::size_t groups = by_point(study) ? all.size() : 1;
  std::vector<std::vector<const Row*>> of_group(groups);
  for (const Row& row : rows) of_group[by_point(study) ? static_cast<std::size_t>(row.point) : 0].push_back(&row);
  std::vector<Cell> out;
  for (std::size_t g = 0; g < groups; ++g) {
    for (const std::string& name : study.outcomes) {
      std::size_t index = 0;
      quantity(name, index);
      std::vector<double> sample;
      std::int64_t failed = 0;
      for (const Row* row : of_group[g]) {
        if (row->failed) ++failed;
        else sample.push_back(row->values[index]);
      }
      out.push_back({by_point(study) ? static_cast<std::int64_t>(g) : -1,
                     by_point(study) ? point_name(study, all[g]) : "all points", name, spread(std::move(sample)), failed});
    }
  }
  return out;
}

void save(const std::string& folder, const char* name, const std::string& text) {
  const std::string path = (std::filesystem::path(folder) / name).string();
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

void write_sobol(const std::string& folder, const Study& study) {
  const std::size_t d = study.factors.size(), stride = d + 2;
  const std::vector<Row> rows = read_runs(folder, study);
  std::string text = "outcome,factor,first,first_low,first_high,total,total_low,total_high,samples\n";
  for (const std::string& name : study.outcomes) {
    std::size_t index = 0;
    quantity(name, index);
    // Mean over the replicates of each point; a sample counts only if all of its points are there.
    std::vector<double> sum(stride * static_cast<std::size_t>(study.samples), 0.0);
    std::vector<int> count(sum.size(), 0);
    for (const Row& row : rows) {
      if (row.failed) continue;
      sum[static_cast<std::size_t>(row.point)] += row.values[index];
      ++count[static_cast<std::size_t>(row.point)];
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
    const std::vector<SobolIndex> indices = sobol_indices(a, b, ab);
    for (std::size_t i = 0; i < d; ++i) {
      const SobolIndex& x = indices[i];
      text += fmt::format("{},\"{}\",{},{},{},{},{},{},{}\n", name, study.factors[i].key, x.first, x.first_low, x.first_high,
                          x.total, x.total_low, x.total_high, a.size());
    }
  }
  save(folder, "sobol.csv", text);
}

/// Titles and units of the numbers in runs.csv, so that pictures and reports need to know none of them.
nlohmann::ordered_json columns(const Study& study) {
  nlohmann::ordered_json j;
  for (const Factor& f : study.factors) {
    const bool converted = !f.shown_unit.empty();
    j[f.key] = {{"title", f.label},
                {"unit", f.unit},
                {"shown_unit", converted ? f.shown_unit : f.unit == "1" ? "" : f.unit},
                {"per_shown", converted ? inputs::to_si("1 " + f.shown_unit, f.unit) : 1.0}};
  }
  for (const auto& q : outcome::kQuantities) {
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

void write_summary(const std::string& folder, const Study& study) {
  std::string text = "point,name,outcome,unit,runs,failed,mean,sd,q05,q25,median,q75,q95\n";
  for (const Cell& c : cells(folder, study)) {
    std::size_t index = 0;
    text += fmt::format("{},\"{}\",{},{},{},{},{},{},{},{},{},{},{}\n", c.point, c.name, c.outcome,
                        quantity(c.outcome, index).unit, c.spread.count, c.failed, c.spread.mean, c.spread.sd, c.spread.q05,
                        c.spread.q25, c.spread.median, c.spread.q75, c.spread.q95);
  }
  save(folder, "summary.csv", text);
  if (study.plan == Plan::saltelli) write_sobol(folder, study);
}

void write_about(const std::string& folder, const Study& study, std::int64_t runs, std::int64_t failed, double wall_time) {
  nlohmann::ordered_json j;
  j["study"] = nlohmann::ordered_json::parse(to_json(study));
  j["columns"] = columns(study);
  j["version"] = TRAIN_DERAIL_VERSION;
  utsname name{};
  uname(&name);
  j["machine"] = {{"system", fmt::format("{} {} {}", name.sysname, name.release, name.machine)},
                  {"processor", cpu_model()},
                  {"cores", std::thread::hardware_concurrency()}};
  j["runs"] = runs;
  j["failed"] = failed;
  j["wall_time"] = wall_time;
  save(folder, "about.json", j.dump(2) + "\n");
}

std::int64_t write_results(const std::string& folder, const Study& study, std::int64_t failed, double wall_time) {
  const std::int64_t runs = write_runs(folder, study);
  write_summary(folder, study);
  write_about(folder, study, runs, failed, wall_time);
  return runs;
}

std::string to_table(const std::string& folder, const Study& study) {
  std::string text;
  std::string last;
  for (const Cell& c : cells(folder, study)) {
    if (c.name != last) text += fmt::format("{} ({} runs{})\n", c.name, c.spread.count, c.failed > 0 ? fmt::format(", {} failed", c.failed) : "");
    last = c.name;
    std::size_t index = 0;
    const outcome::Quantity& q = quantity(c.outcome, index);
    text += fmt::format("    {:<38}{:>9.4g} {:<5} 5-95 %: {:.4g} to {:.4g}\n", q.title, c.spread.median / q.per_shown,
                        q.shown_unit, c.spread.q05 / q.per_shown, c.spread.q95 / q.per_shown);
  }
  return text;
}

}  // namespace train_derail::study
