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
#include "train_derail/validation/drawn_train.hpp"
#include "validation/member_text.hpp"

namespace train_derail::validation {

using inputs::InputError;

namespace {

Member compute(const study::Study& study, const Accident& accident, const study::Point& point, const study::Run& run,
               const std::atomic<bool>& stop) {
  Member m;
  m.seed = run.seed;
  try {
    const inputs::Scenario scenario =
        scenario_of(study::scenario_of(study, point, run), accident, static_cast<std::uint64_t>(run.seed));
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

/// Calls `check` with the scenario of each way of an accident. An InputError of it gets the line.
void with_scenarios(const Plan& plan, const AccidentTable& accidents, const Accident& a,
                    const std::function<void(const Way&, inputs::Scenario)>& check) {
  for (const Way& w : plan.ways_of(a)) {
    try {
      check(w, scenario_of(w.study.base, a));
    } catch (const InputError& e) {
      throw InputError(fmt::format("{}:{}: scenario", accidents.path, a.line), e.key(), e.value(), e.problem(),
                       e.allowed());
    }
  }
}

/// Also what is to be said of rows. Throws InputError that names the line.
std::vector<std::string> check_rows(const Plan& plan, const AccidentTable& accidents) {
  const std::int64_t members = members_a_row(plan), rows = static_cast<std::int64_t>(accidents.rows.size());
  if (members > kMembersMax / std::max<std::int64_t>(rows, 1)) {
    throw InputError("study", "samples", fmt::format("{}", members),
                     fmt::format("{} rows with so many members each are too many runs", rows),
                     fmt::format("at most {} runs in all", kMembersMax));
  }
  std::int64_t equal = 0;
  std::string first, why;
  for (const Accident& a : accidents.rows) {
    std::string of_row;  // why its members cannot differ, in the first way in which they cannot
    with_scenarios(plan, accidents, a, [&](const Way& w, inputs::Scenario scenario) {
      scenario.initial.perturbation = w.study.perturbation;
      inputs::validate(scenario);
      const bool only_seeds = w.study.factors.empty() ? members > 1 : w.study.replicates > 1;
      if (only_seeds && of_row.empty()) of_row = study::why_equal(scenario, w.study.engine);
    });
    if (!of_row.empty() && equal++ == 0) {
      first = fmt::format("{}:{}", accidents.path, a.line);
      why = of_row;
    }
  }
  if (equal == 0) return {};
  if (equal == rows) {
    throw InputError(plan.source, "replicates", fmt::format("{}", plan.first().replicates),
                     "members that differ by their seed alone cannot differ: " + why, "1, or a perturbation that acts");
  }
  return {fmt::format("{} of {} rows have members that cannot differ, {} is the first: {}", equal, rows, first, why)};
}

/// What the members of a row are made from.
struct RowPlan {
  std::vector<const Way*> ways;                // of each member
  std::map<const Way*, study::Points> points;  // of each way that has members
};

RowPlan plan_of(const Plan& plan, const Accident& a, std::int64_t members) {
  RowPlan row;
  for (std::int64_t m = 0; m < members; ++m) {
    const Way* way = &plan.way_of(a, m);
    row.ways.push_back(way);
    if (row.points.count(way) == 0) row.points.emplace(way, points_of(way->study, a));
  }
  return row;
}

Ensembles run(const Plan& plan, const AccidentTable& accidents, int jobs, Kept kept,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop) {
  const std::int64_t members = members_a_row(plan);
  const auto per_row = static_cast<std::size_t>(members);
  std::vector<RowPlan> rows;
  for (const Accident& a : accidents.rows) rows.push_back(plan_of(plan, a, members));
  Ensembles e;
  e.members.resize(accidents.rows.size() * per_row);
  std::vector<std::size_t> missing;
  study::Progress progress;
  progress.total = static_cast<std::int64_t>(e.members.size());
  const auto number_of = [&](std::size_t i) {
    return run_number(accidents.rows[i / per_row], members, static_cast<std::int64_t>(i % per_row));
  };
  const auto way_of = [&](std::size_t i) -> const Way& { return *rows[i / per_row].ways[i % per_row]; };
  const auto point_of = [&](std::size_t i) {
    const Way& way = way_of(i);
    return rows[i / per_row].points.at(&way)[static_cast<std::int64_t>(i % per_row) / way.study.replicates];
  };
  const auto accident_of = [&](std::size_t i) {
    return plan.seen_by(accidents.rows[i / per_row], static_cast<std::int64_t>(i % per_row));
  };
  const auto place = [&](std::size_t i, Member m, const std::vector<std::string>& fields) {
    m.row = i / per_row;
    m.member = static_cast<std::int64_t>(i % per_row);
    m.way = way_of(i).name;
    m.text = line_of(fields, plan, way_of(i), point_of(i), accident_of(i));
    e.members[i] = std::move(m);
  };
  for (std::size_t i = 0; i < e.members.size(); ++i) {
    const auto found = kept.finished.find(number_of(i));
    if (found == kept.finished.end()) missing.push_back(i);
    else place(i, member_from(found->second), found->second);
  }
  progress.done = progress.total - static_cast<std::int64_t>(missing.size());

  const auto computed = [&](std::size_t k) {
    const std::size_t i = missing[k];
    return compute(way_of(i).study, accident_of(i), point_of(i), study::run_of(plan.first(), number_of(i)), stop);
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

std::optional<InputError> wrong_scenario(const Plan& plan, const AccidentTable& accidents, const Accident& a) {
  try {
    with_scenarios(plan, accidents, a, [](const Way&, const inputs::Scenario& s) { inputs::validate(s); });
    return {};
  } catch (const InputError& e) {
    return e;
  }
}

nlohmann::ordered_json description_by_cause(const Plan& plan) {
  nlohmann::ordered_json j;
  j["title"] = plan.title();
  j["positions_counting_locomotives"] = plan.positions_counting_locomotives;
  for (const CauseGroups::Group& g : plan.causes().groups) {
    nlohmann::ordered_json group{{"name", g.name}, {"codes", g.codes}, {"families", g.families}};
    for (const Way& w : plan.ways_of_group(g.name)) {
      group["ways"].push_back({{"name", w.name},
                               {"share", w.share},
                               {"speed_exponent", w.speed_exponent},
                               {"study", nlohmann::ordered_json::parse(study::to_json(w.study))}});
    }
    j["groups"].push_back(group);
  }
  for (const auto& [path, way] : plan.class_ways())
    j["classes"].push_back({{"class", path}, {"study", nlohmann::ordered_json::parse(study::to_json(way->study))}});
  return j;
}

/// The plan and the rows asked for, as they stand in the table.
std::string description(const Plan& plan, const AccidentTable& accidents) {
  nlohmann::ordered_json j = nlohmann::ordered_json::parse(described(plan));
  j["points"] = "of each row";
  j["accidents"]["columns"] = accidents.columns;
  for (const Accident& a : accidents.rows) j["accidents"]["rows"][fmt::format("{}", a.line)] = a.fields;
  return j.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// What is to be said of rows and class.
void judge(Validation& v) {
  const AccidentTable& table = v.accidents;
  if (!v.plan.fitted_on.empty()) v.fitted = read_fitted_class(v.plan.fitted_on);
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

std::string described(const Plan& plan) {
  return plan.by_cause() ? description_by_cause(plan).dump() : study::to_json(plan.first());
}

void check_scenarios(const Plan& plan, AccidentTable& accidents, bool skip_invalid) {
  std::vector<InputError> errors;
  std::vector<Accident> good;
  for (const Accident& a : accidents.rows) {
    if (auto wrong = wrong_scenario(plan, accidents, a)) {
      if (skip_invalid) accidents.left_out.push_back({a.line, wrong->what(), "no valid scenario"});
      errors.push_back(std::move(*wrong));
    } else {
      good.push_back(a);
    }
  }
  if (!skip_invalid || good.empty()) refuse(accidents.path, accidents.rows.size(), errors);
  accidents.rows = std::move(good);
}

Ensembles run(const Plan& plan, const AccidentTable& accidents, int jobs,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop) {
  std::vector<std::string> warnings = check_rows(plan, accidents);
  Ensembles e = run(plan, accidents, jobs, Kept{}, on_progress, stop);
  e.warnings.insert(e.warnings.begin(), warnings.begin(), warnings.end());
  return e;
}

Ensembles run(const Plan& plan, const AccidentTable& accidents, const ValidationOptions& options,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop) {
  std::vector<std::string> warnings = check_rows(plan, accidents);
  const study::JournalFormat format = journal_format(plan, accidents, description(plan, accidents));
  study::claim_folder(options.folder, format.identity);
  Kept kept;
  study::Journal journal(options.folder, format, {}, options.resume,
                         [&](const study::JournalRow& row) { kept.finished[row.run] = row.fields; });
  kept.keep = [&](const std::vector<std::string>& fields, double wall_time) { journal.append(fields, wall_time); };
  Ensembles e = run(plan, accidents, options.jobs, std::move(kept), on_progress, stop);
  e.warnings.insert(e.warnings.begin(), warnings.begin(), warnings.end());
  e.problems = journal.problems();
  return e;
}

Validation evaluate(const Plan& plan, const AccidentTable& accidents, const Ensembles& ensembles) {
  Validation v{accidents, plan, members_a_row(plan), ensembles.failed, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}};
  v.posture = score_posture(accidents, ensembles);
  v.warnings = ensembles.warnings;
  if (plan.by_cause()) {
    for (const std::string& remark : unlisted_causes(plan.causes(), accidents)) v.warnings.push_back(remark);
  }
  const auto drawn = std::count_if(accidents.rows.begin(), accidents.rows.end(),
                                   [](const Accident& a) { return draw_train(a, 0).has_value(); });
  if (drawn > 0) {
    v.warnings.push_back(
        fmt::format("{} rows do not tell all of their trains (order of loads and empties, weight and kind of each): "
                    "each member has a draw of its own",
                    drawn));
  }
  std::vector<std::vector<double>> counts(accidents.rows.size());
  std::vector<std::vector<std::string>> ways(accidents.rows.size());
  for (const Member& m : ensembles.members) {
    if (m.outcome.ended == outcome::Ended::integration_failed) continue;
    counts[m.row].push_back(m.derailed.cars);
    ways[m.row].push_back(m.way);
  }
  for (std::size_t i = 0; i < counts.size(); ++i)
    v.crps.push_back(crps(accidents.rows[i].cars_derailed, counts[i], ways[i]));
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
  for (const CauseGroups::Group& g : plan.causes().groups)
    add("cause: " + g.title, [&](const Accident& a) { return plan.group_of(a) == g.name; });
  const Columns all = columns(v, [](const Accident&) { return true; });
  v.stretched = stretch(all.real, all.low, all.median, all.high, kIntervalShare);
  v.fits = v.groups.empty() ? std::vector<Fit>{} : v.groups.front().fits;
  return v;
}

}  // namespace train_derail::validation
