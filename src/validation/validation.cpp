#include "train_derail/validation/validation.hpp"

#include <chrono>
#include <cmath>
#include <mutex>

#include <fmt/format.h>

#include "study/parallel.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::validation {

using inputs::InputError;

namespace {

Member compute(const study::Study& study, const Accident& accident, const study::Point& point, const study::Run& run) {
  Member m;
  m.seed = run.seed;
  try {
    const inputs::Scenario scenario = scenario_of(study::scenario_of(study, point, run), accident);
    simulation::Simulation simulation(scenario);
    simulation.run();
    m.outcome = simulation.outcome();
    m.derailed = count_derailed(scenario, simulation.snapshot());
  } catch (const InputError& e) {
    m.outcome.ended = outcome::Ended::integration_failed;
    m.outcome.message = e.what();
  }
  return m;
}

/// Some of the rows, column by column.
struct Columns {
  FitInputs inputs;
  std::vector<double> real, mean, low, median, high;
  std::vector<std::vector<double>> counts;
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
    c.counts.push_back(v.counts[i]);
  }
  return c;
}

Group group(const std::string& name, const Columns& c) {
  Group g;
  g.name = name;
  g.rows = c.real.size();
  // The median is what makes the mean absolute error least; a few members in which the whole train buckles do not move it.
  g.rated.push_back({"simulation", "none", score(c.real, c.median), coverage(c.real, c.low, c.high)});
  g.rated.push_back({"mean", "none", score(c.real, c.mean), {}});
  g.rated.push_back({"stretched", "the others", score(c.real, c.median), stretch(c.real, c.low, c.median, c.high, kIntervalShare).held_out});
  g.rated.push_back({"best_member", "the others", score(c.real, best_of_the_others(c.real, c.counts)), {}});
  for (const FitKind kind : kFitKinds) {
    const Fit& f = g.fits.emplace_back(fit(kind, c.inputs, c.real));
    g.rated.push_back({to_string(kind), "these", score(c.real, f.fitted), {}});
    g.rated.push_back({to_string(kind), "the others", score(c.real, f.left_out), {}});
  }
  g.bands = by_speed(c.inputs.speed, c.real, c.median);
  g.exponent_real = speed_exponent(c.inputs.speed, c.real);
  g.exponent_predicted = speed_exponent(c.inputs.speed, c.median);
  return g;
}

}  // namespace

study::Study seeds_only(study::Study study) {
  study.replicates = static_cast<int>(members_a_row(study));
  study.factors.clear();
  study.plan = study::Plan::grid;
  return study;
}

std::int64_t members_a_row(const study::Study& study) {
  const bool sampled = study.plan == study::Plan::latin_hypercube || study.plan == study::Plan::sobol;
  if (!sampled && !study.factors.empty()) {
    throw InputError("study", "plan", "", "points of this plan are not a sample", "latin_hypercube, sobol");
  }
  if (study.engine != study::Engine::purpose_built) throw InputError("study", "engine", "multibody", "knows no rails", "purpose_built");
  for (const study::Factor& f : study.factors) {
    if (row_decides(f.key)) {
      throw InputError("study", "factors.key", f.key, "the rows of the table decide it", "any other key");
    }
  }
  return static_cast<std::int64_t>(sampled ? study.samples : 1) * study.replicates;
}

Ensembles run(const study::Study& study, const AccidentTable& accidents, int jobs,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop) {
  const std::int64_t members = members_a_row(study);
  const std::vector<study::Point> points = study::points(study);
  for (const Accident& a : accidents.rows) {
    try {
      inputs::validate(scenario_of(study.base, a));
    } catch (const InputError& e) {
      throw InputError(fmt::format("{}:{}: scenario", accidents.path, a.line), e.key(), e.value(), e.problem(), e.allowed());
    }
  }

  Ensembles e;
  e.members.resize(accidents.rows.size() * static_cast<std::size_t>(members));
  study::Progress progress;
  progress.total = static_cast<std::int64_t>(e.members.size());
  const auto start = std::chrono::steady_clock::now();
  const auto elapsed = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  std::mutex mutex;
  study::for_each_run(e.members.size(), jobs, [&](std::size_t i) {
    if (stop) return;
    const std::size_t row = i / static_cast<std::size_t>(members);
    const auto member = static_cast<std::int64_t>(i % static_cast<std::size_t>(members));
    const Accident& accident = accidents.rows[row];
    const study::Run of_line = study::run_of(study, static_cast<std::int64_t>(accident.line) * members + member);
    Member m = compute(study, accident, points[static_cast<std::size_t>(member / study.replicates)], of_line);
    m.row = row;
    m.member = member;
    const std::lock_guard<std::mutex> lock(mutex);
    ++progress.done;
    if (m.outcome.ended == outcome::Ended::integration_failed) {
      ++progress.failed;
      progress.message = m.outcome.message;
    }
    progress.rate = static_cast<double>(progress.done) / elapsed();
    e.members[i] = std::move(m);
    on_progress(progress);
  });
  e.failed = progress.failed;
  e.stopped = progress.done < progress.total;
  e.wall_time = elapsed();
  return e;
}

Validation evaluate(const study::Study& study, const AccidentTable& accidents, const Ensembles& ensembles) {
  Validation v{accidents, study, members_a_row(study), ensembles.failed, {}, {}, {}, {}, {}, {}};
  std::vector<std::vector<double>> counts(accidents.rows.size());
  v.counts.assign(accidents.rows.size(), std::vector<double>(static_cast<std::size_t>(v.members), std::nan("")));
  for (const Member& m : ensembles.members) {
    if (m.outcome.ended == outcome::Ended::integration_failed) continue;
    counts[m.row].push_back(m.derailed.cars);
    v.counts[m.row][static_cast<std::size_t>(m.member)] = m.derailed.cars;
  }
  for (std::vector<double>& sample : counts) {
    v.intervals.push_back(study::predictive_interval(sample, kIntervalShare));
    v.predicted.push_back(study::spread(std::move(sample)));
  }

  constexpr double kFast = 10.0;  // mph
  constexpr int kLongTail = 60;
  const auto add = [&](const std::string& name, const std::function<bool(const Accident&)>& wanted) {
    const Columns c = columns(v, wanted);
    if (!c.real.empty()) v.groups.push_back(group(name, c));
  };
  add("all rows", [](const Accident&) { return true; });
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
