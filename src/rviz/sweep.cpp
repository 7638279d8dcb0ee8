#include "rviz/sweep.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include "rviz/input_table.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail::rviz_panel {

namespace {

using inputs::InputError;

constexpr char kWhere[] = "sweep";
constexpr char kSeed[] = "initial.perturbation.seed";  // every run of a study has its own
constexpr int kPointsMin = 2, kPointsMax = 200, kRunsMax = 1000;
constexpr char kDefaultPerturbation[] = "{spacing: 0.01 ft, yaw_rate: 1.0e-3}";

void check_count(const char* key, int value, int least, int most) {
  if (value < least || value > most)
    throw InputError(kWhere, key, fmt::format("{}", value), "out of range", fmt::format("{} to {}", least, most));
}

std::string shown_unit(const inputs::KeyValue& key) {
  if (!key.shown_unit.empty()) return key.shown_unit;
  return key.unit == "1" ? "" : key.unit;
}

double shown(const inputs::KeyValue& key, double si) {
  return key.shown_unit.empty() ? si : inputs::from_si(si, key.unit, key.shown_unit);
}

/// An end of the sweep in SI.
double end_of(const YAML::Node& tree, const InputTable& table, const std::string& key, const std::string& typed) {
  const std::string text = check_input(tree, table, key, typed).text;
  const std::string value = inputs::key_value(inputs::read_scenario(tree, kWhere, {{key, text}}), key).value;
  const auto number = files::number<double>(value);
  if (!number || !std::isfinite(*number)) throw InputError(kWhere, key, typed, "not a finite number", "a number");
  return *number;
}

std::string quoted(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

}  // namespace

std::vector<std::string> sweep_keys(const inputs::Scenario& scenario) {
  std::vector<std::string> keys;
  for (const inputs::KeyValue& v : inputs::key_values(scenario)) {
    if (!v.unit.empty() && v.acts_with.empty() && v.key != kSeed) keys.push_back(v.key);
  }
  return keys;
}

std::string sweep_study(const inputs::Scenario& scenario, const Sweep& sweep) {
  check_count("points", sweep.points, kPointsMin, kPointsMax);
  check_count("runs per point", sweep.runs_per_point, 1, kRunsMax);
  const std::string yaml = inputs::to_yaml(scenario);
  const YAML::Node tree = YAML::Load(yaml);
  const InputTable table = make_input_table(scenario);
  const double from = end_of(tree, table, sweep.key, sweep.from), to = end_of(tree, table, sweep.key, sweep.to);
  if (!(from < to))
    throw InputError(kWhere, sweep.key, sweep.from, "the lower end is not below the upper one",
                     "less than " + sweep.to);

  const inputs::KeyValue key = inputs::key_value(scenario, sweep.key);
  std::vector<std::string> values;
  for (int i = 0; i < sweep.points; ++i) {
    const double si = from + (to - from) * i / (sweep.points - 1);
    const std::string unit = shown_unit(key);
    std::string value = key.whole ? fmt::format("{}", std::llround(si))
                                  : fmt::format("{:.6g}{}", shown(key, si), unit.empty() ? "" : " " + unit);
    if (values.empty() || values.back() != value) values.push_back(std::move(value));
  }
  std::string list;
  for (const std::string& value : values) list += (list.empty() ? "" : ", ") + quoted(value);
  std::string text =
      fmt::format("title: {}\nplan: grid\nfactors:\n  - {{key: {}, values: [{}]}}\nreplicates: {}\nseed: {}\n",
                  quoted("Sweep of " + sweep.key + ": " + scenario.title), quoted(sweep.key), list,
                  sweep.runs_per_point, scenario.initial.perturbation.seed);
  if (sweep.runs_per_point > 1 && !study::why_equal(scenario, study::EngineChoice::purpose_built).empty())
    text += fmt::format("perturbation: {}\n", kDefaultPerturbation);
  text += "scenario:\n  ";
  for (const char c : yaml) text += c == '\n' ? std::string("\n  ") : std::string(1, c);
  text += "\n";
  static_cast<void>(study::read_study_text(text, kWhere));  // what is wrong is said before anything is sent
  return text;
}

SweepResult read_sweep(const std::string& study_text, const std::string& folder) {
  const study::Study study = study::read_study_text(study_text, kWhere);
  const study::Factor& factor = study.factors.at(0);
  const inputs::KeyValue key = inputs::key_value(study.base, factor.key);
  SweepResult result;
  result.key = result.label = factor.key;
  result.unit = shown_unit(key);
  for (const std::string& value : factor.values)
    result.values.push_back(shown(key, files::number<double>(value).value()));
  result.outcomes = study.outcomes;
  result.spreads = study::spreads(folder, study);
  return result;
}

}  // namespace train_derail::rviz_panel
