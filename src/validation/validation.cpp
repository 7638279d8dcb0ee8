#include "train_derail/validation/validation.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "simulation/many_runs.hpp"
#include "study/warnings.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/study/journal.hpp"
#include "validation/member_text.hpp"

namespace train_derail::validation {

using inputs::InputError;

namespace {

Member compute(const study::Study& study, const Accident& accident, const study::Point& point, const study::Run& run,
               const std::atomic<bool>& stop) {
  Member m;
  m.seed = run.seed;
  try {
    const inputs::Scenario scenario = scenario_of(study::scenario_of(study, point, run), accident);
    simulation::Simulation simulation(scenario);
    simulation.run(&stop);
    m.outcome = simulation.outcome();
    m.derailed = count_derailed(scenario, simulation.snapshot());
    m.posture = {accident.speed_mph, m.outcome.posture.cars(), m.outcome.posture.over()};
  } catch (const InputError& e) {
    m.outcome.ended = outcome::Ended::integration_failed;
    m.outcome.message = e.what();
  }
  return m;
}

/// Some of the rows, column by column.
struct Columns {
  FitInputs inputs;
  std::vector<double> real, mean, low, median, high, crps;
};

Columns columns(const Validation& v, const std::function<bool(const Accident&)>& wanted) {
  Columns c;
  for (std::size_t i = 0; i < v.accidents.rows.size(); ++i) {
    const Accident& a = v.accidents.rows[i];
    if (!wanted(a)) continue;
    c.inputs.speed.push_back(a.speed_mph);
    c.inputs.tail.push_back(a.cars_from_pod_to_rear);
    c.inputs.tons.push_back(a.tons_per_car);
    c.real.push_back(a.cars_derailed);
    c.mean.push_back(v.predicted[i].mean);
    c.low.push_back(v.intervals[i].low);
    c.median.push_back(v.predicted[i].median);
    c.high.push_back(v.intervals[i].high);
    c.crps.push_back(v.crps[i]);
  }
  return c;
}

/// Of those that are numbers.
double mean_of(std::vector<double> values) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double x) { return std::isnan(x); }), values.end());
  return study::spread(std::move(values)).mean;
}

Group group(const std::string& name, const Columns& c) {
  Group g;
  g.name = name;
  g.rows = c.real.size();
  // The median is what makes the mean absolute error least; a few members in which the whole train buckles do not move
  // it.
  g.rated.push_back({"simulation", "none", score(c.real, c.median), coverage(c.real, c.low, c.high), mean_of(c.crps)});
  g.rated.push_back({"mean", "none", score(c.real, c.mean), {}, {}});
  g.rated.push_back({"stretched",
                     "the others",
                     score(c.real, c.median),
                     stretch(c.real, c.low, c.median, c.high, kIntervalShare).held_out,
                     {}});
  for (const FitKind kind : kFitKinds) {
    const Fit& f = g.fits.emplace_back(fit(kind, c.inputs, c.real));
    g.rated.push_back({to_string(kind), "these", score(c.real, f.fitted), {}, {}});
    g.rated.push_back({to_string(kind), "the others", score(c.real, f.left_out), {}, {}});
  }
  g.bands = by_speed(c.inputs.speed, c.real, c.median);
  g.exponent_real = speed_exponent(c.inputs.speed, c.real);
  g.exponent_predicted = speed_exponent(c.inputs.speed, c.median);
  return g;
}

/// Wind blows cars over that would else stand.
constexpr const char* kWind = "M105";

std::vector<PostureBand> score_posture(const AccidentTable& accidents, const Ensembles& ensembles) {
  std::vector<PostureCount> real, predicted;
  const auto counts = [](const Accident& a) {
    return a.over && a.cars_derailed >= kPostureCarsMin && a.cause != kWind;
  };
  for (const Accident& a : accidents.rows) {
    if (counts(a)) real.push_back({a.speed_mph, a.cars_derailed, *a.over});
  }
  for (const Member& m : ensembles.members) {
    const Accident& a = accidents.rows[m.row];
    if (counts(a) && m.outcome.ended != outcome::Ended::integration_failed) {
      predicted.push_back({a.speed_mph, m.posture.cars, m.posture.over});
    }
  }
  const bool known = std::any_of(predicted.begin(), predicted.end(), [](const PostureCount& c) { return c.cars > 0; });
  return known ? by_band(real, predicted) : std::vector<PostureBand>();
}

}  // namespace

study::Study seeds_only(study::Study study) {
  study.replicates = static_cast<int>(members_a_row(study));
  study.factors.clear();
  study.plan = study::Plan::grid;
  return study;
}

std::int64_t members_a_row(const study::Study& study) {
  const bool sampled = study.plan == study::Plan::latin_hypercube;
  if (!sampled && !study.factors.empty()) {
    throw InputError("study", "plan", "", "every row needs a random sample of its own",
                     to_string(study::Plan::latin_hypercube));
  }
  if (study.engine != study::EngineChoice::purpose_built)
    throw InputError("study", "engine", to_string(study.engine), "knows no rails",
                     to_string(study::EngineChoice::purpose_built));
  for (const study::Factor& f : study.factors) {
    if (row_decides(f.key)) {
      throw InputError("study", "factors.key", f.key, "the rows of the table decide it", "any other key");
    }
  }
  return static_cast<std::int64_t>(sampled ? study.samples : 1) * study.replicates;
}

study::Points points_of(study::Study study, const Accident& accident) {
  study.seed = study::run_of(study, -static_cast<std::int64_t>(accident.line)).seed;  // runs have numbers from 0 on
  return study::Points(study);
}

namespace {

/// Runs that are there already, by number, as rows of a journal; what is to be done with a new one.
struct Kept {
  std::map<std::int64_t, std::vector<std::string>> finished;
  std::function<void(const std::vector<std::string>&, double wall_time)> keep;
};

/// Also what is to be said of rows. Throws InputError that names the line.
std::vector<std::string> check_rows(const study::Study& study, const AccidentTable& accidents) {
  const std::int64_t members = members_a_row(study), rows = static_cast<std::int64_t>(accidents.rows.size());
  if (members > kMembersMax / std::max<std::int64_t>(rows, 1)) {
    throw InputError("study", "samples", fmt::format("{}", members),
                     fmt::format("{} rows with so many members each are too many runs", rows),
                     fmt::format("at most {} runs in all", kMembersMax));
  }
  std::int64_t equal = 0;
  std::string first, why;
  for (const Accident& a : accidents.rows) {
    const std::string where = fmt::format("{}:{}", accidents.path, a.line);
    try {
      inputs::Scenario scenario = scenario_of(study.base, a);
      scenario.initial.perturbation = study.perturbation;
      inputs::validate(scenario);
      const bool only_seeds = study.factors.empty() ? members > 1 : study.replicates > 1;
      const std::string now = only_seeds ? study::why_equal(scenario, study.engine) : "";
      if (!now.empty() && equal++ == 0) {
        first = where;
        why = now;
      }
    } catch (const InputError& e) {
      throw InputError(where + ": scenario", e.key(), e.value(), e.problem(), e.allowed());
    }
  }
  if (equal == 0) return {};
  if (equal == rows) {
    throw InputError(study.source, "replicates", fmt::format("{}", study.replicates),
                     "members that differ by their seed alone cannot differ: " + why, "1, or a perturbation that acts");
  }
  return {fmt::format("{} of {} rows have members that cannot differ, {} is the first: {}", equal, rows, first, why)};
}

Ensembles run(const study::Study& study, const AccidentTable& accidents, int jobs, Kept kept,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop) {
  const std::int64_t members = members_a_row(study);
  const auto per_row = static_cast<std::size_t>(members);
  std::vector<study::Points> points;
  for (const Accident& a : accidents.rows) points.push_back(points_of(study, a));
  Ensembles e;
  e.members.resize(accidents.rows.size() * per_row);
  std::vector<std::size_t> missing;
  study::Progress progress;
  progress.total = static_cast<std::int64_t>(e.members.size());
  const auto number_of = [&](std::size_t i) {
    return run_number(accidents.rows[i / per_row], members, static_cast<std::int64_t>(i % per_row));
  };
  const auto point_of = [&](std::size_t i) {
    return points[i / per_row][static_cast<std::int64_t>(i % per_row) / study.replicates];
  };
  const auto place = [&](std::size_t i, Member m, const std::vector<std::string>& fields) {
    m.row = i / per_row;
    m.member = static_cast<std::int64_t>(i % per_row);
    m.text = line_of(fields, point_of(i));
    e.members[i] = std::move(m);
  };
  for (std::size_t i = 0; i < e.members.size(); ++i) {
    const auto found = kept.finished.find(number_of(i));
    if (found == kept.finished.end()) missing.push_back(i);
    else place(i, member_from(found->second), found->second);
  }
  progress.done = progress.total - static_cast<std::int64_t>(missing.size());

  const auto accident_of = [&](std::size_t i) -> const Accident& { return accidents.rows[i / per_row]; };
  const auto computed = [&](std::size_t k) {
    const std::size_t i = missing[k];
    return compute(study, accident_of(i), point_of(i), study::run_of(study, number_of(i)), stop);
  };
  const auto keep = [&](std::size_t k, Member m) {
    const std::size_t i = missing[k];
    m.member = static_cast<std::int64_t>(i % per_row);
    const std::vector<std::string> fields = fields_of(accident_of(i), number_of(i), m);
    if (kept.keep) kept.keep(fields, m.outcome.wall_time);
    place(i, std::move(m), fields);
  };
  const auto runs = simulation::run_many(missing.size(), jobs, progress, computed, keep, on_progress, stop);
  study::WarningCount warnings;
  for (const Member& m : e.members) {
    e.failed += m.outcome.ended == outcome::Ended::integration_failed ? 1 : 0;
    warnings.add(study::warnings_field(m.outcome.warnings));
  }
  e.warnings = warnings.texts(progress.total);
  e.stopped = runs.progress.done < runs.progress.total;
  e.wall_time = runs.wall_time;
  return e;
}

std::optional<InputError> wrong_scenario(const study::Study& study, const AccidentTable& accidents, const Accident& a) {
  try {
    inputs::validate(scenario_of(study.base, a));
    return {};
  } catch (const InputError& e) {
    return InputError(fmt::format("{}:{}: scenario", accidents.path, a.line), e.key(), e.value(), e.problem(),
                      e.allowed());
  }
}

/// The study and the rows asked for, as they stand in the table.
std::string description(const study::Study& study, const AccidentTable& accidents) {
  nlohmann::ordered_json j = nlohmann::ordered_json::parse(study::to_json(study));
  j["points"] = "of each row";
  j["accidents"]["columns"] = accidents.columns;
  for (const Accident& a : accidents.rows) j["accidents"]["rows"][fmt::format("{}", a.line)] = a.fields;
  return j.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// What is to be said of rows and class.
void judge(Validation& v) {
  const AccidentTable& table = v.accidents;
  if (!v.study.fitted_on.empty()) v.fitted = read_fitted_class(v.study.fitted_on);
  if (!v.fitted.known()) {
    v.outside.assign(table.rows.size(), "not known");
    v.warnings.push_back(
        "the study does not say what its base was fitted on (fitted_on): whether these rows are like it is not known");
    return;
  }
  std::size_t count = 0;
  for (const Accident& a : table.rows) {
    v.outside.push_back(outside(v.fitted, a));
    if (v.outside.back().empty()) continue;
    ++count;
    constexpr std::size_t kNamed = 20;
    if (count <= kNamed)
      v.warnings.push_back(fmt::format("line {} is outside of the fitted class: {}", a.line, v.outside.back()));
  }
  if (count > 0) {
    v.warnings.insert(
        v.warnings.begin(),
        fmt::format("{} of {} rows lie outside of what the base was fitted on ({}): their counts are guesses; "
                    "rows.csv says of each in what",
                    count, table.rows.size(), v.fitted.title));
  }
  for (const std::string& name : not_told(v.fitted, table)) {
    v.warnings.push_back(
        fmt::format("the table does not tell {} of every row: whether it is of the fitted class ({}) is not known",
                    name, v.fitted.title));
  }
}

}  // namespace

void check_scenarios(const study::Study& study, AccidentTable& accidents, bool skip_invalid) {
  std::vector<InputError> errors;
  std::vector<Accident> good;
  for (const Accident& a : accidents.rows) {
    if (auto wrong = wrong_scenario(study, accidents, a)) {
      if (skip_invalid) accidents.left_out.push_back({a.line, wrong->what()});
      errors.push_back(std::move(*wrong));
    } else {
      good.push_back(a);
    }
  }
  if (!skip_invalid || good.empty()) refuse(accidents.path, accidents.rows.size(), errors);
  accidents.rows = std::move(good);
}

Ensembles run(const study::Study& study, const AccidentTable& accidents, int jobs,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop) {
  std::vector<std::string> warnings = check_rows(study, accidents);
  Ensembles e = run(study, accidents, jobs, Kept{}, on_progress, stop);
  e.warnings.insert(e.warnings.begin(), warnings.begin(), warnings.end());
  return e;
}

Ensembles run(const study::Study& study, const AccidentTable& accidents, const ValidationOptions& options,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop) {
  std::vector<std::string> warnings = check_rows(study, accidents);
  const study::JournalFormat format = journal_format(study, accidents, description(study, accidents));
  study::claim_folder(options.folder, format.identity);
  Kept kept;
  study::Journal journal(options.folder, format, {}, options.resume,
                         [&](const study::JournalRow& row) { kept.finished[row.run] = row.fields; });
  kept.keep = [&](const std::vector<std::string>& fields, double wall_time) { journal.append(fields, wall_time); };
  Ensembles e = run(study, accidents, options.jobs, std::move(kept), on_progress, stop);
  e.warnings.insert(e.warnings.begin(), warnings.begin(), warnings.end());
  e.problems = journal.problems();
  return e;
}

Validation evaluate(const study::Study& study, const AccidentTable& accidents, const Ensembles& ensembles) {
  Validation v{accidents, study, members_a_row(study), ensembles.failed, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}};
  v.posture = score_posture(accidents, ensembles);
  v.warnings = ensembles.warnings;
  std::vector<std::vector<double>> counts(accidents.rows.size());
  for (const Member& m : ensembles.members) {
    if (m.outcome.ended == outcome::Ended::integration_failed) continue;
    counts[m.row].push_back(m.derailed.cars);
  }
  for (std::size_t i = 0; i < counts.size(); ++i) v.crps.push_back(crps(accidents.rows[i].cars_derailed, counts[i]));
  for (std::vector<double>& sample : counts) {
    v.intervals.push_back(study::predictive_interval(sample, kIntervalShare));
    v.predicted.push_back(study::spread(std::move(sample)));
  }

  judge(v);

  constexpr double kFast = 10.0;  // mph
  constexpr int kLongTail = 60;
  const auto add = [&](const std::string& name, const std::function<bool(const Accident&)>& wanted) {
    const Columns c = columns(v, wanted);
    if (!c.real.empty()) v.groups.push_back(group(name, c));
  };
  add("all rows", [](const Accident&) { return true; });
  const auto is_outside = [](const std::string& what) { return !what.empty(); };
  if (v.fitted.known() && std::any_of(v.outside.begin(), v.outside.end(), is_outside)) {
    add("inside of the fitted class", [&](const Accident& a) { return outside(v.fitted, a).empty(); });
    add("outside of the fitted class", [&](const Accident& a) { return !outside(v.fitted, a).empty(); });
  }
  add("10 mph or more", [](const Accident& a) { return a.speed_mph >= kFast; });
  add("tail of 60 cars or more", [](const Accident& a) { return a.cars_from_pod_to_rear >= kLongTail; });
  add("10 mph or more, tail of 60 cars or more",
      [](const Accident& a) { return a.speed_mph >= kFast && a.cars_from_pod_to_rear >= kLongTail; });
  const Columns all = columns(v, [](const Accident&) { return true; });
  v.stretched = stretch(all.real, all.low, all.median, all.high, kIntervalShare);
  v.fits = v.groups.empty() ? std::vector<Fit>{} : v.groups.front().fits;
  return v;
}

}  // namespace train_derail::validation
