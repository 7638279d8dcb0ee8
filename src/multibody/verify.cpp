#include "train_derail/multibody/verify.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "multibody/halving.hpp"
#include "simulation/many_runs.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/outcome/quantities.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::multibody {

namespace {

constexpr double kInterval = 0.01;  // at which the two are compared [s]

const outcome::Quantity& quantity(std::string_view name) { return *outcome::find_quantity(name); }

/// `cars` of a train, from the first one that derails on.
inputs::Scenario shortened(inputs::Scenario s, int cars) {
  int ahead = std::exchange(s.initial.cars_ahead, 0);
  std::vector<inputs::CarBlock> consist;
  for (inputs::CarBlock block : s.consist) {
    const int passed = std::min(block.count, ahead);
    ahead -= passed;
    block.count = std::min(block.count - passed, cars);
    cars -= block.count;
    if (block.count > 0) consist.push_back(block);
  }
  s.consist = consist;
  return s;
}

/// How many may derail.
int car_count(const inputs::Scenario& s) {
  int cars = -s.initial.cars_ahead;
  for (const inputs::CarBlock& block : s.consist) cars += block.count;
  return cars;
}

Frame frame_of(const simulation::Simulation& run) {
  Frame frame;
  const bool space = inputs::model_of(run.scenario()) == inputs::Model::spatial;
  const simulation::Snapshot shot = run.snapshot();
  for (std::size_t k = 0; k < shot.cars.size(); ++k) {
    const simulation::CarSnapshot& c = shot.cars[k];
    const double height = space ? run.cars()[k].centre_height : 0.0;
    frame.cars.push_back({{c.x, c.y, c.z + height},
                          Eigen::Quaterniond(c.qw, c.qx, c.qy, c.qz).toRotationMatrix(),
                          {c.vx, c.vy, c.vz},
                          {c.wx, c.wy, c.omega}});
  }
  for (const simulation::CouplerSnapshot& c : shot.couplers)
    frame.forces.push_back({c.axial_force, space ? 0.0 : c.lateral_force});
  return frame;
}
Frame frame_of(const Engine& run) { return {run.cars(), run.coupler_forces()}; }

/// What there is to compare at a time, without what is allowed. `force_peak`: of the times before.
Difference difference(double t, const Frame& a, const Frame& b, double force_peak) {
  const Apart cars = apart(a, b);
  Difference d{t, cars.position, cars.angle, 0.0, force_peak, inputs::kInfinity, inputs::kInfinity};
  for (std::size_t i = 0; i < a.forces.size(); ++i) {
    const CouplerForce &here = a.forces[i], &there = b.forces[i];
    d.force = std::max(d.force, std::hypot(there.axial - here.axial, there.lateral - here.lateral));
    d.force_peak = std::max(d.force_peak, std::hypot(here.axial, here.lateral));
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

const std::vector<std::string>& judged_quantities(inputs::Model model) {
  static const std::vector<std::string> plane{"cars_past_pod",      "cars_off_track",     "closing_speed_max",
                                              "relative_speed_max", "coupler_force_peak", "stop_time"};
  static const std::vector<std::string> space{
      "cars_derailed", "cars_off_track",    "cars_over",          "cars_upright",       "lateral_reach",
      "drop_max",      "closing_speed_max", "relative_speed_max", "coupler_force_peak", "stop_time"};
  return model == inputs::Model::spatial ? space : plane;
}

namespace {

/// Two runs side by side.
class Pair {
 public:
  explicit Pair(const Criteria& criteria) : criteria_(criteria) {}

  Difference& add(double t, const Frame& model, const Frame& engine) {
    const double so_far = pair_.differences.empty() ? 0.0 : pair_.differences.back().force_peak;
    return pair_.differences.emplace_back(difference(t, model, engine, so_far));
  }
  /// The last time that was added belongs to the part that is judged.
  void judge() {
    const Difference& d = pair_.differences.back();
    pair_.worst = {d.time,
                   std::max(pair_.worst.position, d.position),
                   std::max(pair_.worst.angle, d.angle),
                   std::max(pair_.worst.force, d.force),
                   d.force_peak,
                   d.position_allowed,
                   d.angle_allowed};
    pair_.force_share = std::max(pair_.force_share, d.force / std::max(d.force_peak, criteria_.force_least));
  }
  bool close() const {
    return pair_.worst.position <= pair_.worst.position_allowed && pair_.worst.angle <= pair_.worst.angle_allowed;
  }
  double force_share() const { return pair_.force_share; }
  double judged() const { return pair_.worst.time; }

  /// With what has come of both. `close`: they are, apart from outcomes, which are judged `to_the_end`.
  PairOfRuns ended(outcome::Outcome model, outcome::Outcome engine, bool to_the_end, bool close) {
    pair_.cars = model.cars;
    pair_.to_the_end = to_the_end;
    pair_.relative = relative_difference(model, engine);
    for (const char* name : {"cars_past_pod", "cars_off_track", "cars_over"})
      pair_.counts_equal &= quantity(name).value(model) == quantity(name).value(engine);
    if (failed(model)) pair_.failed = "purpose-built: " + model.message;
    if (failed(engine)) pair_.failed = "multibody: " + engine.message;
    close &= pair_.failed.empty();
    if (to_the_end) close &= pair_.relative <= criteria_.short_relative && pair_.counts_equal;
    pair_.verdict = close ? Verdict::agrees : Verdict::differs;
    pair_.purpose_built = std::move(model);
    pair_.multibody = std::move(engine);
    return std::move(pair_);
  }

 private:
  const Criteria& criteria_;
  PairOfRuns pair_;
};

/// Continues a run to time t; false if it has ended before.
template <class Run>
bool come_to(double t, Run& run, const std::atomic<bool>* stop) {
  run.advance(t, stop);
  return run.time() >= t;
}

PairOfRuns follow_in_plane(inputs::Scenario tight, const VerifyOptions& options, double follow, double judged,
                           const std::atomic<bool>* stop) {
  const Criteria& c = options.criteria;
  tight.solver.method = inputs::Method::dormand_prince;
  tight.solver.fixed_step.reset();
  tight.solver.rtol = tight.solver.atol = options.accuracy;
  simulation::Simulation model(tight);
  Engine engine(tight, {options.accuracy, false, options.fault});
  const bool whole = judged >= follow;
  Pair pair(c);
  for (std::int64_t i = 0;; ++i) {
    const double t = static_cast<double>(i) * kInterval;
    if (t > follow) break;
    const bool model_there = come_to(t, model, stop);
    if (!come_to(t, engine, stop) || !model_there) break;
    pair.add(t, frame_of(model), frame_of(engine)).position_allowed = whole ? c.short_position : c.position;
    if (t <= judged) pair.judge();
  }
  return pair.ended(model.outcome(), engine.outcome(), whole, pair.close() && (whole || pair.force_share() <= c.force));
}

/// Both programs with whole and half steps.
struct HalvedRuns {
  simulation::Simulation model_whole, model_half;
  Engine engine_whole, engine_half;

  HalvedRuns(const inputs::Scenario& s, const Steps& whole, Fault fault)
      : model_whole(stepped(s, whole)),
        model_half(stepped(s, whole.halved())),
        engine_whole(s, fine(whole, fault)),
        engine_half(s, fine(whole.halved(), fault)) {}

  /// False if a run has ended before.
  bool all_come_to(double t, const std::atomic<bool>* stop) {
    const bool model_whole_there = come_to(t, model_whole, stop), model_half_there = come_to(t, model_half, stop);
    return come_to(t, engine_whole, stop) && come_to(t, engine_half, stop) && model_whole_there && model_half_there;
  }
  Halves<Frame> frames() const {
    return {frame_of(model_whole), frame_of(model_half), frame_of(engine_whole), frame_of(engine_half)};
  }

 private:
  static inputs::Scenario stepped(inputs::Scenario s, const Steps& steps) {
    s.solver.fixed_step = steps.step;
    s.terrain.rest_speed = 0.0;  // no part of the motion
    return s;
  }
  static EngineOptions fine(const Steps& steps, Fault fault) {
    return {steps.accuracy, false, fault, steps.settle_time};
  }
};

PairOfRuns follow_in_space(inputs::Scenario tight, const VerifyOptions& options, double follow, double judged,
                           const std::atomic<bool>* stop) {
  const Criteria& c = options.criteria;
  HalvedRuns runs(tight, options.whole, options.fault);
  HalvedComparison compared;
  const bool whole = judged >= follow;
  bool worth = true;
  Pair pair(c);
  for (std::int64_t i = 0; worth || !whole; ++i) {  // of a whole run nothing is said once that is not worth it
    const double t = static_cast<double>(i) * kInterval;
    if (t > follow || !runs.all_come_to(t, stop)) break;
    const Halves<Frame> now = runs.frames();
    compared.extend(now);
    worth &= compared.worth(c.worth);
    Difference& d = pair.add(t, now.model_half, now.engine_half);
    d.position_allowed = whole ? c.short_position : std::max(compared.limit.position, c.least);
    d.angle_allowed = whole ? c.short_angle : std::max(compared.limit.angle, c.least);
    if (worth && t <= judged) pair.judge();
  }
  const double least_judged = std::min(c.early, runs.engine_half.time()) - kInterval;
  return pair.ended(runs.model_half.outcome(), runs.engine_half.outcome(), whole && worth,
                    pair.close() && pair.judged() >= least_judged);
}

}  // namespace

PairOfRuns follow(const inputs::Scenario& scenario, const VerifyOptions& options, double follow, double judged,
                  const std::atomic<bool>* stop) {
  inputs::Scenario calm = scenario;
  calm.initial.perturbation = {};
  const auto in = inputs::model_of(scenario) == inputs::Model::spatial ? follow_in_space : follow_in_plane;
  return in(std::move(calm), options, follow, judged, stop);
}

Ensemble compare_ensembles(const inputs::Scenario& scenario, const VerifyOptions& options,
                           const std::function<void(double, const std::string&)>& on_progress,
                           const std::atomic<bool>* stop) {
  Ensemble ensemble;
  ensemble.runs = options.runs;
  const bool space = inputs::model_of(scenario) == inputs::Model::spatial;
  std::vector<outcome::Outcome> a(static_cast<std::size_t>(options.runs)), b(a.size());
  const auto compute = [&](std::size_t i) {
    inputs::Scenario s = scenario;
    inputs::Perturbation& p = s.initial.perturbation;
    p.spacing = options.spacing;
    p.yaw_rate = space ? options.yaw_rate_in_space : options.yaw_rate;
    p.seed += static_cast<std::int64_t>(i) + 1;
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
  for (const std::string& name : judged_quantities(inputs::model_of(scenario))) {
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
  require_parts(scenario, options.source);
  if (scenario.stop.time_max < options.criteria.early) {
    throw inputs::InputError(options.source, "stop.time_max", fmt::format("{:g}", scenario.stop.time_max),
                             "too short to compare anything", fmt::format(">= {:g} s", options.criteria.early));
  }
  Verification v;
  v.scenario = scenario;
  v.options = options;
  on_progress(0.0, "point by point");
  const Criteria& c = options.criteria;
  const bool space = inputs::model_of(scenario) == inputs::Model::spatial;
  v.early = follow(scenario, options, options.follow, space ? c.early_in_space : c.early, stop);
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
