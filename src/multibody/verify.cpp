#include "train_derail/multibody/verify.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>

#include <fmt/format.h>

#include "simulation/many_runs.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::multibody {

namespace {

constexpr double kInterval = 0.01;  // at which the two are compared [s]

/// What the ensembles are compared in.
constexpr std::array<std::string_view, 6> kJudged{"cars_past_pod",      "cars_off_track",     "closing_speed_max",
                                                  "relative_speed_max", "coupler_force_peak", "stop_time"};

const outcome::Quantity& quantity(std::string_view name) { return *outcome::find_quantity(name); }

/// The first `cars` of a train.
inputs::Scenario shortened(inputs::Scenario s, int cars) {
  std::vector<inputs::CarBlock> consist;
  for (inputs::CarBlock block : s.consist) {
    block.count = std::min(block.count, cars);
    cars -= block.count;
    if (block.count > 0) consist.push_back(block);
  }
  s.consist = consist;
  return s;
}

int car_count(const inputs::Scenario& s) {
  int cars = 0;
  for (const inputs::CarBlock& block : s.consist) cars += block.count;
  return cars;
}

Difference difference(const simulation::Snapshot& a, const Engine& b, double force_peak) {
  Difference d{a.time, 0.0, 0.0, 0.0, force_peak};
  const std::vector<BodyMotion> cars = b.cars();
  const std::vector<CouplerForce> forces = b.coupler_forces();
  for (std::size_t k = 0; k < cars.size(); ++k) {
    d.position = std::max(d.position, std::hypot(cars[k].x - a.cars[k].x, cars[k].y - a.cars[k].y));
    d.heading = std::max(d.heading, std::abs(cars[k].theta - a.cars[k].theta));
  }
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const simulation::CouplerSnapshot& c = a.couplers[i];
    d.force = std::max(d.force, std::hypot(forces[i].axial - c.axial_force, forces[i].lateral - c.lateral_force));
    d.force_peak = std::max(d.force_peak, std::hypot(c.axial_force, c.lateral_force));
  }
  return d;
}

double relative_difference(const outcome::Outcome& a, const outcome::Outcome& b) {
  double worst = 0.0;
  for (const char* name : {"closing_speed_max", "relative_speed_max", "coupler_force_peak", "stop_time"}) {
    const double va = quantity(name).value(a), vb = quantity(name).value(b),
                 larger = std::max(std::abs(va), std::abs(vb));
    if (larger > 0.0) worst = std::max(worst, std::abs(va - vb) / larger);
  }
  return worst;
}

double processor_time() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

template <class Run>
outcome::Outcome outcome_of(Run run, const std::atomic<bool>* stop) {
  run.run(stop);
  return run.outcome();
}

bool failed(const outcome::Outcome& o) { return o.ended == outcome::Ended::integration_failed; }

}  // namespace

const char* to_string(Verdict verdict) {
  return verdict == Verdict::agrees ? "agrees" : verdict == Verdict::differs ? "differs" : "not judged";
}

PairOfRuns follow(const inputs::Scenario& scenario, const VerifyOptions& options, double follow, double judged,
                  const std::atomic<bool>* stop) {
  const Criteria& c = options.criteria;
  inputs::Scenario tight = scenario;
  tight.initial.perturbation = {};
  tight.solver.method = inputs::Method::dormand_prince;
  tight.solver.fixed_step.reset();
  tight.solver.rtol = tight.solver.atol = options.accuracy;
  simulation::Simulation a(tight);
  Engine b(tight, {options.accuracy, false, options.fault});

  PairOfRuns pair;
  pair.cars = car_count(tight);
  double force_peak = 0.0;
  for (std::int64_t i = 0;; ++i) {
    const double t = static_cast<double>(i) * kInterval;
    if (t > follow) break;
    a.advance(t, stop);
    b.advance(t, stop);
    if (a.time() < t || b.time() < t) break;
    const Difference& d = pair.differences.emplace_back(difference(a.snapshot(), b, force_peak));
    force_peak = d.force_peak;
    if (t > judged) continue;
    pair.worst = {t, std::max(pair.worst.position, d.position), std::max(pair.worst.heading, d.heading),
                  std::max(pair.worst.force, d.force), force_peak};
    pair.force_share = std::max(pair.force_share, d.force / std::max(force_peak, c.force_least));
  }
  pair.purpose_built = a.outcome();
  pair.multibody = b.outcome();
  pair.relative = relative_difference(pair.purpose_built, pair.multibody);
  pair.counts_equal = pair.purpose_built.cars_past_pod == pair.multibody.cars_past_pod &&
                      pair.purpose_built.cars_off_track == pair.multibody.cars_off_track;
  if (failed(pair.purpose_built)) pair.failed = "purpose-built: " + pair.purpose_built.message;
  if (failed(pair.multibody)) pair.failed = "multibody: " + pair.multibody.message;

  const bool whole = judged >= follow;
  const bool close =
      whole ? pair.worst.position <= c.short_position && pair.relative <= c.short_relative && pair.counts_equal
            : pair.worst.position <= c.position && pair.force_share <= c.force;
  pair.verdict = pair.failed.empty() && close ? Verdict::agrees : Verdict::differs;
  return pair;
}

Ensemble compare_ensembles(const inputs::Scenario& scenario, const VerifyOptions& options,
                           const std::function<void(double, const std::string&)>& on_progress,
                           const std::atomic<bool>* stop) {
  Ensemble ensemble;
  ensemble.runs = options.runs;
  std::vector<outcome::Outcome> a(static_cast<std::size_t>(options.runs)), b(a.size());
  const auto compute = [&](std::size_t i) {
    inputs::Scenario s = scenario;
    s.initial.perturbation = {options.spacing, options.yaw_rate,
                              scenario.initial.perturbation.seed + static_cast<std::int64_t>(i) + 1};
    if (i < a.size()) return outcome_of(Engine(s, {0.0, false, options.fault}), stop);  // the long ones first
    return outcome_of(simulation::Simulation(s), stop);
  };
  const auto put = [&](std::size_t i, outcome::Outcome outcome) {
    (i < a.size() ? b[i] : a[i - a.size()]) = std::move(outcome);
  };
  const auto say = [&](const simulation::Progress& progress) {
    on_progress(static_cast<double>(progress.done) / static_cast<double>(progress.total), "ensembles");
  };
  const std::atomic<bool> never{false};
  simulation::Progress progress;
  progress.total = static_cast<std::int64_t>(2 * a.size());
  simulation::run_many(2 * a.size(), options.jobs, progress, compute, put, say, stop != nullptr ? *stop : never);

  const Criteria& c = options.criteria;
  const auto keep = [&](std::vector<outcome::Outcome>& runs) {
    const auto end = std::remove_if(runs.begin(), runs.end(), failed);
    ensemble.failed += static_cast<int>(runs.end() - end);
    runs.erase(end, runs.end());
  };
  keep(a);
  keep(b);
  if (ensemble.failed > 0) ensemble.verdict = Verdict::differs;
  if (a.empty() || b.empty()) return ensemble;
  std::vector<double> p;
  for (const std::string_view name : kJudged) {
    QuantityComparison& q = ensemble.quantities.emplace_back();
    q.name = name;
    for (const outcome::Outcome& o : a) q.purpose_built.push_back(quantity(name).value(o));
    for (const outcome::Outcome& o : b) q.multibody.push_back(quantity(name).value(o));
    q.test = compare(q.purpose_built, q.multibody);
    q.mean = mean_difference(q.purpose_built, q.multibody, 0.95);
    p.push_back(q.test.p_distance);
    p.push_back(q.test.p_precedence);
  }
  const std::vector<double> adjusted = holm(p);
  const double shift = detectable_shift(std::min(a.size(), b.size()), c.alpha / static_cast<double>(p.size()), c.power);
  bool told_apart = false;
  for (std::size_t i = 0; i < ensemble.quantities.size(); ++i) {
    QuantityComparison& q = ensemble.quantities[i];
    q.p_distance = adjusted[2 * i];
    q.p_precedence = adjusted[2 * i + 1];
    const double sd = pooled_deviation(q.purpose_built, q.multibody);
    q.detectable = sd > 0.0 ? shift * sd : 0.0;
    told_apart |= std::min(q.p_distance, q.p_precedence) < c.alpha;
  }
  if (options.runs >= c.runs_least && ensemble.failed == 0)
    ensemble.verdict = told_apart ? Verdict::differs : Verdict::agrees;
  return ensemble;
}

Verification verify(const inputs::Scenario& scenario, const VerifyOptions& options,
                    const std::function<void(double, const std::string&)>& on_progress, const std::atomic<bool>* stop) {
  require();
  inputs::validate(scenario);
  require_paper(scenario);
  if (scenario.stop.time_max < options.criteria.early) {
    throw inputs::InputError("verify", "stop.time_max", fmt::format("{:g}", scenario.stop.time_max),
                             "too short to compare anything", fmt::format(">= {:g} s", options.criteria.early));
  }
  Verification v;
  v.scenario = scenario;
  v.options = options;
  on_progress(0.0, "point by point");
  v.early = follow(scenario, options, options.follow, options.criteria.early, stop);
  for (const int cars : {1, 2, 3}) {
    on_progress(0.05 + 0.02 * cars, "short trains");
    if (cars <= car_count(scenario))
      v.short_trains.push_back(follow(shortened(scenario, cars), options, inputs::kInfinity, inputs::kInfinity, stop));
  }
  on_progress(0.12, "one run of each");
  const double start = processor_time();
  v.purpose_built = outcome_of(simulation::Simulation(scenario), stop);
  const double between = processor_time();
  v.multibody = outcome_of(Engine(scenario, {0.0, false, options.fault}), stop);
  v.purpose_built_seconds = between - start;
  v.multibody_seconds = processor_time() - between;
  v.ensemble = compare_ensembles(
      scenario, options, [&](double done, const std::string& what) { on_progress(0.15 + 0.85 * done, what); }, stop);
  return v;
}

Verdict Verification::verdict() const {
  bool differs = early.verdict == Verdict::differs || ensemble.verdict == Verdict::differs;
  for (const PairOfRuns& pair : short_trains) differs |= pair.verdict == Verdict::differs;
  return differs ? Verdict::differs : Verdict::agrees;
}

}  // namespace train_derail::multibody
