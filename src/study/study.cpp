#include "train_derail/study/study.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>

#include <nlohmann/json.hpp>

#include "inputs/checker.hpp"
#include "inputs/tree_reader.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/study/counts.hpp"

namespace train_derail::study {

namespace {

using inputs::InputError;
using inputs::Names;

constexpr std::array<Names<Plan>, 5> kPlans{{{"one_at_a_time", Plan::one_at_a_time},
                                             {"grid", Plan::grid},
                                             {"latin_hypercube", Plan::latin_hypercube},
                                             {"sobol", Plan::sobol},
                                             {"saltelli", Plan::saltelli}}};
constexpr std::array<Names<Distribution>, 3> kDistributions{
    {{"uniform", Distribution::uniform}, {"log_uniform", Distribution::log_uniform}, {"normal", Distribution::normal}}};

const inputs::Range kSpreads = inputs::between(0.01, 100.0);

/// A factor and a study as they are written in the file, before units are converted.
struct FactorEntry {
  std::string key, label, low, high;
  std::vector<std::string> values, scale;
  Distribution distribution = Distribution::uniform;
};
struct StudyEntry {
  std::string title, base, scenario, fitted_on;
  YAML::Node own_scenario;  // a map if the scenario stands in the study itself
  std::vector<FactorEntry> factors;
  Plan plan = Plan::one_at_a_time;
  int samples = 0, replicates = 1;
  double spread = 1.0;
  inputs::Perturbation perturbation;
  std::vector<std::string> outcomes;
  std::int64_t seed = 1;
};

template <class V>
void describe_study(V& v, StudyEntry& s) {
  v.text("title", s.title, "One line for tables and pictures.");
  v.text("base", s.base, "Study that this one changes, a path relative to this file: what is left out is as there.");
  v.text_or_group("scenario", s.scenario, s.own_scenario,
                  "Base scenario: a path relative to this file, or the scenario itself.");
  v.text("fitted_on", s.fitted_on,
         "For derail validate: the accidents that the base was fitted on, a path relative to this file.");
  v.list(
      "factors", s.factors,
      [](auto& w, auto& f) {
        w.value("key", f.key, "Key of the scenario.");
        w.text("label", f.label, "For pictures.");
        w.texts("values", f.values, "Values of the plans one_at_a_time and grid.");
        w.texts("scale", f.scale, "Values as multiples of the base value.");
        w.choice("distribution", f.distribution, kDistributions, "Distribution, for random plans.");
        w.value("low", f.low, "Lower end of the range; of normal the 5 % point.");
        w.value("high", f.high, "Upper end of the range; of normal the 95 % point.");
      },
      "Inputs that vary; [] for an ensemble of the scenario itself.", false);
  v.choice("plan", s.plan, kPlans, "How points are chosen.");
  v.integer("samples", s.samples, inputs::between(0, 1e7), false, "Points of a random plan.");
  v.number("spread", s.spread, {"1", "", kSpreads},
           "Factor on the half-width of every range of a random plan; the middles stay.");
  v.integer("replicates", s.replicates, inputs::between(kReplicates.least, kReplicates.most), false,
            "Runs for each point.");
  v.group(
      "perturbation", s.perturbation, [](auto& w, auto& p) { inputs::describe_perturbation_sizes(w, p); },
      "Sizes of the perturbation; every run has a seed of its own.");
  v.texts("outcomes", s.outcomes, "Outcomes that are summarised and drawn.");
  v.integer("seed", s.seed, inputs::between(0, 9007199254740992.0), false, "Seed of points and perturbations.");
}

bool random(Plan plan) { return plan != Plan::one_at_a_time && plan != Plan::grid; }

/// Returns a text in YAML quotes, so that it is read as this text whatever it holds.
std::string yaml_text(const std::string& text) {
  YAML::Emitter out;
  out << YAML::DoubleQuoted << text;
  return out.c_str();
}

/// Returns the value `text`, with its unit, in the SI unit of the key. The reader of scenarios converts and checks it.
std::string si_text(const YAML::Node& tree, const inputs::KeyValue& now, const std::string& text,
                    const std::string& where) {
  const std::string& key = now.key;
  try {
    return inputs::key_value(inputs::read_scenario(tree, where, {{key, now.unit.empty() ? yaml_text(text) : text}}),
                             key)
        .value;
  } catch (const InputError& e) {
    throw InputError(where, e.key(), text, e.problem(), e.allowed());
  }
}

/// Returns the value of a KeyValue that is a number.
double number_of(const std::string& si) { return si == ".inf" ? inputs::kInfinity : files::number<double>(si).value(); }

/// Returns a number for people, in the unit that they read: "30 mph".
std::string shown(const inputs::KeyValue& key, double si) {
  if (key.whole) return fmt::format("{}", si);
  if (key.shown_unit.empty()) return fmt::format("{:.6g}{}", si, key.unit == "1" ? "" : " " + key.unit);
  return fmt::format("{:.6g} {}", inputs::from_si(si, key.unit, key.shown_unit), key.shown_unit);
}

Factor resolve(const FactorEntry& entry, const StudyEntry& study, const inputs::Scenario& base, const YAML::Node& tree,
               const std::string& where) {
  Factor f;
  f.key = entry.key;
  f.label = entry.label.empty() ? entry.key : entry.label;
  f.distribution = entry.distribution;
  const inputs::KeyValue now = [&] {
    try {
      return inputs::key_value(base, entry.key);
    } catch (const InputError& e) {
      throw InputError(where, "factors.key", entry.key, e.problem(), e.allowed());
    }
  }();
  f.unit = now.unit;
  f.shown_unit = now.shown_unit;
  if (random(study.plan)) {
    if (entry.low.empty() || entry.high.empty()) {
      throw InputError(where, entry.key, "", "the plan needs low and high", "low: value, high: value");
    }
    if (now.unit.empty()) throw InputError(where, entry.key, now.value, "not a number, cannot be sampled", "a number");
    f.low = number_of(si_text(tree, now, entry.low, where));
    f.high = number_of(si_text(tree, now, entry.high, where));
    for (const auto& [end, text] : {std::pair(f.low, entry.low), std::pair(f.high, entry.high)}) {
      if (!std::isfinite(end))
        throw InputError(where, entry.key, text, "not a finite number, cannot be sampled", "a number");
    }
    if (!(f.low < f.high))
      throw InputError(where, entry.key, entry.low, "low is not below high", "low < " + entry.high);
    if (f.distribution == Distribution::log_uniform && f.low <= 0.0) {
      throw InputError(where, entry.key, entry.low, "log_uniform needs a positive range", "low > 0");
    }
    return f;
  }
  if (entry.values.empty() == entry.scale.empty()) {
    throw InputError(where, entry.key, "", "the plan needs either values or scale", "values: [...] or scale: [...]");
  }
  for (const std::string& text : entry.values) f.values.push_back(si_text(tree, now, text, where));
  f.shown = entry.values;
  for (const std::string& text : entry.scale) {
    if (now.unit.empty())
      throw InputError(where, entry.key, now.value, "not a number, cannot be scaled", "values: [...]");
    if (now.value == ".inf")
      throw InputError(where, entry.key, now.value, "the base value is infinite, cannot be scaled", "values: [...]");
    double scaled = 0.0;
    try {
      scaled = inputs::to_si(text, "1") * number_of(now.value);
    } catch (const std::invalid_argument& e) {
      throw InputError(where, entry.key, text, e.what(), "a number");
    }
    constexpr double kWholeMax = 9e15;
    const bool whole = now.whole && std::abs(scaled) < kWholeMax;
    f.values.push_back(
        si_text(tree, now, whole ? fmt::format("{}", std::llround(scaled)) : fmt::format("{}", scaled), where));
    f.shown.push_back(shown(now, number_of(f.values.back())));
  }
  return f;
}

/// Throws InputError if a factor has no effect: if neither the laws of the base scenario nor those that another factor
/// chooses use it.
void refuse_idle(const Study& study, const Factor& f, const std::string& where) {
  inputs::Scenario base = study.base;
  base.initial.perturbation = study.perturbation;
  const std::string acts_with = inputs::key_value(base, f.key).acts_with;
  if (acts_with.empty()) return;
  for (const Factor& other : study.factors) {
    for (const std::string& value : other.values) {
      try {
        if (inputs::key_value(inputs::with_values(base, {{other.key, value}}), f.key).acts_with.empty()) return;
      } catch (const InputError&) {  // not a valid scenario, or one without this key
      }
    }
  }
  throw InputError(where, f.key, "", "has no effect in this scenario", "with " + acts_with);
}

/// All texts are written to tables and JSON. So a text that is not UTF-8 is refused before anything is computed.
void require_utf8(const std::string& where, const std::string& key, const std::string& text) {
  if (!files::is_utf8(text)) throw InputError(where, key, "", "not UTF-8", "text in UTF-8");
}

Study read_study(const YAML::Node& root, const std::string& path, const std::vector<inputs::Override>& overrides,
                 std::optional<double> spread, std::size_t depth);

/// Returns the study that the key `base` names, if there is one.
std::optional<Study> base_of(const YAML::Node& root, const std::string& path,
                             const std::vector<inputs::Override>& overrides, std::optional<double> spread,
                             std::size_t depth) {
  const YAML::Node base = root.IsMap() ? root["base"] : YAML::Node(YAML::NodeType::Undefined);
  if (!base || !base.IsScalar()) return {};  // what else it is, is refused with the other keys
  const std::string where = inputs::located(path, base.Mark());
  if (depth == inputs::kBasesMax) {
    throw InputError(where, "base", base.Scalar(),
                     "too many studies one behind the other, or one that leads back to itself",
                     fmt::format("at most {}", inputs::kBasesMax));
  }
  const std::string file = (std::filesystem::path(path).parent_path() / base.Scalar()).string();
  return read_study(inputs::load_file(file), file, overrides, spread, depth + 1);
}

/// What a study file that leaves everything out says.
StudyEntry entry_of(const Study& base) {
  StudyEntry entry;
  entry.title = base.title;
  entry.plan = base.plan;
  entry.samples = base.samples;
  entry.replicates = base.replicates;
  entry.perturbation = base.perturbation;
  entry.outcomes = base.outcomes;
  entry.seed = base.seed;
  return entry;
}

/// Factors of the base, each replaced by the own one of its key, and then the other own ones.
std::vector<Factor> joined(std::vector<Factor> base, const std::vector<Factor>& own) {
  for (const Factor& f : own) {
    const auto same = std::find_if(base.begin(), base.end(), [&](const Factor& b) { return b.key == f.key; });
    if (same == base.end()) base.push_back(f);
    else *same = f;
  }
  return base;
}

Study read_study(const YAML::Node& root, const std::string& path, const std::vector<inputs::Override>& overrides,
                 std::optional<double> spread, std::size_t depth) {
  inputs::KeyPlaces places;
  const std::vector<inputs::Override> none;
  const std::optional<Study> base = base_of(root, path, overrides, spread, depth);
  StudyEntry entry = base ? entry_of(*base) : StudyEntry();
  inputs::TreeReader reader(root, "", path, none, places);
  describe_study(reader, entry);
  reader.finish();

  const auto where = [&](const std::string& key) {
    const auto place = places.find(key);
    return place == places.end() ? path : place->second.where;
  };
  if (spread && !kSpreads.contains(*spread)) {
    throw InputError("command line", "--spread", fmt::format("{}", *spread), "out of range", kSpreads.text("1"));
  }
  const bool own_scenario = entry.own_scenario.IsMap();
  if (entry.scenario.empty() && !own_scenario && !base)
    throw InputError(path, "scenario", "", "missing", "a path relative to this file, or the scenario itself");
  if (places.count("factors") == 0 && !base) {
    throw InputError(inputs::located(path, root.Mark()), "factors", "", "missing",
                     "a list of groups; [] for an ensemble of the scenario itself");
  }
  if (entry.factors.empty() && random(entry.plan) && !(base && !base->factors.empty())) {
    throw InputError(where("factors"), "factors", "[]", "this plan samples inputs, but there are no factors",
                     "at least one, or another plan");
  }
  if (entry.factors.size() > kFactorsMax) {
    throw InputError(where("factors"), "factors", "", fmt::format("{} factors", entry.factors.size()),
                     fmt::format("at most {}", kFactorsMax));
  }
  require_utf8(where("title"), "title", entry.title);
  std::size_t values = 0;
  std::set<std::string> keys, names;
  for (std::size_t i = 0; i < entry.factors.size(); ++i) {
    const FactorEntry& f = entry.factors[i];
    const auto at = [&](const char* key) { return where(fmt::format("factors[{}].{}", i, key)); };
    require_utf8(at("key"), "factors.key", f.key);
    require_utf8(at("label"), "factors.label", f.label);
    for (const std::string& value : f.values) require_utf8(at("values"), "factors.values", value);
    if (!keys.insert(f.key).second) throw InputError(at("key"), "factors.key", f.key, "given twice", "every key once");
    values += f.values.size() + f.scale.size();
  }
  if (values > kValuesMax) {
    throw InputError(where("factors"), "factors", "", fmt::format("{} values in all", values),
                     fmt::format("at most {}", kValuesMax));
  }
  for (const std::string& name : entry.outcomes) {
    if (!names.insert(name).second)
      throw InputError(where("outcomes"), "outcomes", name, "given twice", "every name once");
  }
  if (random(entry.plan) && entry.samples < 1) {
    throw InputError(where("samples"), "samples", fmt::format("{}", entry.samples), "the plan needs samples", ">= 1");
  }

  inputs::Checker checker("");
  try {
    describe_study(checker, entry);
  } catch (const InputError& e) {
    throw InputError(where(e.key()), e.key(), e.value(), e.problem(), e.allowed());
  }
  if (!random(entry.plan) && entry.spread != 1.0) {
    throw InputError(where("spread"), "spread", fmt::format("{}", entry.spread),
                     "this plan has no ranges to make wider", "1");
  }

  Study study;
  study.source = path;
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  if (own_scenario) {
    study.base = inputs::read_scenario(inputs::layers(entry.own_scenario, path, folder), path, overrides);
  } else if (!entry.scenario.empty()) {
    study.base = inputs::read_scenario_file((folder / entry.scenario).string(), overrides);
  } else {
    study.base = base->base;
  }
  if (!entry.fitted_on.empty()) study.fitted_on = (folder / entry.fitted_on).string();
  else if (base) study.fitted_on = base->fitted_on;
  study.title = entry.title;
  study.plan = entry.plan;
  study.samples = entry.samples;
  study.replicates = entry.replicates;
  study.perturbation = places.count("perturbation") > 0 || base ? entry.perturbation : study.base.initial.perturbation;
  study.seed = entry.seed;
  for (const inputs::KeyValue& v : inputs::key_values(study.base))
    require_utf8(own_scenario ? path : entry.scenario, v.key, v.value);
  const YAML::Node tree = YAML::Load(inputs::to_yaml(study.base));
  study.base = inputs::read_scenario(tree, path);  // now with all defaults filled in
  for (std::size_t i = 0; i < entry.factors.size(); ++i) {
    study.factors.push_back(
        resolve(entry.factors[i], entry, study.base, tree, where(fmt::format("factors[{}].key", i))));
  }
  if (random(study.plan)) study = widened(std::move(study), spread.value_or(entry.spread));
  const std::vector<Factor> own = study.factors;
  if (base) study.factors = joined(base->factors, own);
  for (const Factor& f : study.factors) {
    const auto at = std::find_if(own.begin(), own.end(), [&](const Factor& o) { return o.key == f.key; });
    refuse_idle(study, f, where(at == own.end() ? "base" : fmt::format("factors[{}].key", at - own.begin())));
  }
  study.outcomes = entry.outcomes;
  std::string known;
  for (const auto& q : outcome::quantities()) known += (known.empty() ? "" : ", ") + std::string(q.name);
  if (study.outcomes.empty()) {
    for (const auto& q : outcome::quantities()) study.outcomes.emplace_back(q.name);
  }
  for (const std::string& name : study.outcomes) {
    if (outcome::find_quantity(name) == nullptr) {
      throw InputError(where("outcomes"), "outcomes", name, "unknown outcome", known);
    }
  }
  run_count(study);
  return study;
}

}  // namespace

Study ensemble_of(const inputs::Scenario& scenario, int replicates) {
  Study study;
  study.source = "ensemble";
  study.title = scenario.title;
  study.base = scenario;
  study.replicates = replicates;
  study.perturbation = scenario.initial.perturbation;
  study.seed = scenario.initial.perturbation.seed;
  for (const auto& q : outcome::quantities()) study.outcomes.emplace_back(q.name);
  return study;
}

Study read_study_file(const std::string& path, const std::vector<inputs::Override>& overrides,
                      std::optional<double> spread) {
  return read_study(inputs::load_file(path), path, overrides, spread, 0);
}

Study read_study_text(const std::string& text, const std::string& path) {
  return read_study(inputs::load_text(text, path), path, {}, {}, 0);
}

Study widened(Study study, double factor) {
  if (factor == 1.0) return study;  // without any rounding
  for (Factor& f : study.factors) {
    if (f.distribution == Distribution::log_uniform) {
      const double middle = std::sqrt(f.low * f.high), half = std::pow(f.high / middle, factor);
      f.low = middle / half;
      f.high = middle * half;
    } else {
      const double middle = 0.5 * (f.low + f.high), half = factor * 0.5 * (f.high - f.low);
      const bool positive = f.low > 0.0;
      f.low = positive ? std::max(middle - half, 0.05 * middle) : middle - half;
      f.high = middle + half;
    }
    for (const double end : {f.low, f.high}) inputs::with_values(study.base, {{f.key, fmt::format("{}", end)}});
  }
  return study;
}

std::string to_string(Plan plan) { return inputs::name_of(kPlans, plan); }

std::string to_json(const Study& s) {
  nlohmann::ordered_json j;
  j["title"] = s.title;
  j["plan"] = to_string(s.plan);
  j["engine"] = to_string(s.engine);
  j["samples"] = s.samples;
  j["replicates"] = s.replicates;
  j["perturbation"] = {{"spacing", s.perturbation.spacing},
                       {"yaw_rate", s.perturbation.yaw_rate},
                       {"kick", s.perturbation.kick},
                       {"alignment", s.perturbation.alignment}};
  j["seed"] = s.seed;
  j["outcomes"] = s.outcomes;
  j["factors"] = nlohmann::ordered_json::array();
  for (const Factor& f : s.factors) {
    nlohmann::ordered_json g{{"key", f.key}, {"label", f.label}, {"unit", f.unit}, {"shown_unit", f.shown_unit}};
    if (random(s.plan)) {
      g["distribution"] = inputs::name_of(kDistributions, f.distribution);
      g["low"] = f.low;
      g["high"] = f.high;
    } else {
      g["values"] = f.values;
    }
    j["factors"].push_back(g);
  }
  for (const inputs::KeyValue& v : inputs::key_values(s.base)) j["scenario"][v.key] = v.value;
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace train_derail::study
