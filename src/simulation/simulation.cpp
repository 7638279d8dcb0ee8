#include "train_derail/simulation/simulation.hpp"

#include <chrono>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "train_derail/files/archive.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/warnings.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/model/derailment_model.hpp"
#include "train_derail/model/extended_model.hpp"
#include "train_derail/model/spatial_model.hpp"
#include "train_derail/model/step_limit.hpp"
#include "train_derail/outcome/monitor.hpp"
#include "train_derail/outcome/release.hpp"
#include "train_derail/outcome/trust.hpp"
#include "train_derail/solver/integrator.hpp"

namespace train_derail::simulation {

namespace {

constexpr double kEnergyInterval = 1.0;   // simulated [s], between two looks at the energy ledger
constexpr double kResidualBlownUp = 0.1;  // no use in going on
constexpr std::int64_t kStepsUnwatched = 64;
/// Moments no farther apart are one: 499 * 0.1 s and 2495 * 0.02 s are not the same number [s].
constexpr double kSameMoment = 1.0e-9;

/// The model as the solver sees it.
class TrainSystem final : public solver::OdeSystem {
 public:
  explicit TrainSystem(model::DerailmentModel& model) : model_(model) {}

  Eigen::Index size() const override { return model_.size(); }
  bool derivative(double, const double* y, double* dydt) override { return model_.derivative(y, dydt); }
  bool accelerations(double, const double* y, double* dydt) override { return model_.accelerations(y, dydt); }
  Eigen::Index position_count() const override { return (size() - quadrature_count()) / 2; }
  Eigen::Index quadrature_count() const override { return model_.quadrature_count(); }

  // One event function: where the foremost car on the track is. It crosses zero at the point of derailment.
  Eigen::Index event_count() const override { return 1; }
  void events(double, const double* y, double* values) override {
    const double place = model_.foremost_on_track(y);
    values[0] = std::isfinite(place) ? place : -1.0;
  }

  std::vector<Eigen::Index> band_positions() const override { return model_.band_positions(); }
  Eigen::Index band_lower() const override { return model::DerailmentModel::kBandLower; }
  Eigen::Index band_upper() const override { return model::DerailmentModel::kBandUpper; }
  void jacobian(double, const double* y, const SetEntry& set) override { model_.jacobian(y, set); }

 private:
  model::DerailmentModel& model_;
};

/// A model that is made for steps of fixed length, as the solver sees it.
template <class Model>
class SteppedModel final : public solver::SteppedSystem {
 public:
  explicit SteppedModel(Model& model) : model_(model) {}

  Eigen::Index size() const override { return model_.size(); }
  Eigen::Index position_count() const override { return model_.position_count(); }
  void accelerations(double t, double h, const double* y, double* result) override {
    model_.accelerations(t, h, y, result);
  }
  void settle(double t, double h, const double* before, double* y) override { model_.settle(t, h, before, y); }

 private:
  Model& model_;
};

/// The paper's model in steps of fixed length: cars pass the point of derailment at the end of a step.
class SteppedPaper final : public solver::SteppedSystem {
 public:
  explicit SteppedPaper(model::DerailmentModel& model) : model_(model), rate_(model.size()) {}

  Eigen::Index size() const override { return model_.size(); }
  Eigen::Index position_count() const override { return (size() - model_.quadrature_count()) / 2; }
  void accelerations(double, double, const double* y, double* result) override {
    if (!rate_known_)
      static_cast<void>(model_.derivative(y, rate_.data()));  // what is not finite is seen by the solver
    Eigen::Map<model::StateVector>(result, position_count()) = rate_.segment(position_count(), position_count());
    power_ = rate_.tail(model_.quadrature_count());
  }
  void settle(double, double h, const double*, double* y) override {
    static_cast<void>(model_.derivative(y, rate_.data()));
    Eigen::Map<model::StateVector> work(y + 2 * position_count(), model_.quadrature_count());
    work += 0.5 * h * (power_ + rate_.tail(model_.quadrature_count()));
    rate_known_ = model_.foremost_on_track(y) < 0.0;
    if (!rate_known_) model_.reach_pod(y);
  }

 private:
  model::DerailmentModel& model_;
  model::StateVector rate_, power_;
  bool rate_known_ = false;  // rate_ belongs to the next step
};

/// A model and what integrates it.
class Motion {
 public:
  virtual ~Motion() = default;
  virtual const model::TrainModel& model() const = 0;
  virtual void start(const inputs::Solver& options, const model::StateVector& state) = 0;
  solver::Integrator& integrator() { return *integrator_; }
  /// What has to be done before the next step after one that ended with an event.
  virtual void handle_event() {}
  /// Saves or restores model and integrator, after start(). Only if the integrator can be saved.
  void walk(files::Archive& archive) {
    archive.group("solver", [&] { integrator_->walk(archive); });
    archive.group("model", [&] { walk_model(archive); });
  }

 protected:
  virtual void walk_model(files::Archive& archive) = 0;
  std::unique_ptr<solver::Integrator> integrator_;
};

/// The paper's model, smooth but for the passing of the point of derailment, which is located; or in fixed steps.
class PaperMotion final : public Motion {
 public:
  explicit PaperMotion(const inputs::Scenario& scenario) : model_(scenario), smooth_(model_), stepped_(model_) {}

  const model::TrainModel& model() const override { return model_; }
  void start(const inputs::Solver& options, const model::StateVector& state) override {
    model_.start(state.data());
    integrator_ = options.method == inputs::Method::semi_implicit
                      ? solver::make_integrator(options, stepped_, 0.0, state)
                      : solver::make_integrator(options, smooth_, 0.0, state);
  }
  void handle_event() override {
    model_.reach_pod(integrator_->state().data());
    integrator_->restart();
  }

 private:
  void walk_model(files::Archive& archive) override { model_.walk(archive); }

  model::DerailmentModel model_;
  TrainSystem smooth_;
  SteppedPaper stepped_;
};

template <class Model>
class SteppedMotion final : public Motion {
 public:
  explicit SteppedMotion(const inputs::Scenario& scenario) : model_(scenario), system_(model_) {}

  const model::TrainModel& model() const override { return model_; }
  void start(const inputs::Solver& options, const model::StateVector& state) override {
    model_.start(state.data());
    integrator_ = solver::make_integrator(options, system_, 0.0, state);
  }

 private:
  void walk_model(files::Archive& archive) override {
    model_.walk(integrator_->time(), integrator_->state().data(), archive);
  }

  Model model_;
  SteppedModel<Model> system_;
};

std::unique_ptr<Motion> make_motion(const inputs::Scenario& scenario) {
  switch (inputs::model_of(scenario)) {
    case inputs::Model::extended: return std::make_unique<SteppedMotion<model::ExtendedModel>>(scenario);
    case inputs::Model::spatial: return std::make_unique<SteppedMotion<model::SpatialModel>>(scenario);
    default: return std::make_unique<PaperMotion>(scenario);
  }
}

void require_fixed_steps(const solver::Integrator& integrator) {
  if (integrator.can_be_saved()) return;
  throw inputs::InputError("scenario", "solver.method", "", "the history that error control keeps cannot be saved",
                           "semi_implicit");
}

inputs::Scenario checked(const inputs::Scenario& scenario) {
  inputs::validate(scenario);
  model::check_step(scenario);
  return scenario;
}

}  // namespace

struct Simulation::Impl {
  Impl(const inputs::Scenario& s, const model::StateVector* initial)
      : scenario(checked(s)),
        motion(make_motion(scenario)),
        model(motion->model()),
        state(initial != nullptr ? *initial : model.initial_state()),
        monitor(model, scenario.outcome, 0.0, state) {
    for (const inputs::Warning& w : inputs::warnings(scenario)) warnings.push_back(to_string(w));
    motion->start(scenario.solver, state);
    integrator = &motion->integrator();
    if (scenario.solver.fixed_step) strictest = model::step_limits(scenario).front();
  }

  const inputs::Scenario scenario;
  const std::unique_ptr<Motion> motion;
  std::optional<model::StepLimit> strictest;  // of a fixed step
  const model::TrainModel& model;
  model::StateVector state;  // at time
  outcome::Monitor monitor;
  solver::Integrator* integrator = nullptr;  // of motion
  double time = 0.0;
  bool interrupted = false;  // the last call of advance(), by its `stop`: the next one is the rest of it
  std::int64_t next_sample = 0;
  bool pending = false;  // a car reaches the point of derailment at integrator->time()
  outcome::Ended ended = outcome::Ended::running;
  std::string message;
  std::vector<std::string> warnings;
  double wall_time = 0.0;                         // of the calls of advance() before this one
  std::chrono::steady_clock::time_point started;  // this one
  std::int64_t steps_unwatched = 0;
  double energy_due = kEnergyInterval;

  void walk(files::Archive& archive) {
    archive.group("motion", [&] { motion->walk(archive); });
    archive.group("monitor", [&] { monitor.walk(archive); });
    archive.value("time", time);
    archive.column("state", state);
    archive.value("interrupted", interrupted);
    archive.value("next_sample", next_sample);
    archive.value("ended", ended);
    archive.value("message", message);
    archive.value("wall_time", wall_time);
    archive.value("energy_due", energy_due);
  }

  double elapsed() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count(); }

  void advance(double target, const std::atomic<bool>* stop) {
    started = std::chrono::steady_clock::now();
    advance_by_steps(target, stop);
    wall_time += elapsed();
  }

  void fail(const std::string& why) {
    ended = outcome::Ended::integration_failed;
    message = why;
  }

  void advance_by_steps(double target, const std::atomic<bool>* stop) {
    if (target > scenario.stop.time_max - kSameMoment) target = scenario.stop.time_max;
    if (ended != outcome::Ended::running || time >= target) return;
    if (!interrupted) monitor.forget_peaks();
    advance_to(target, stop);
    interrupted = ended == outcome::Ended::running && time < target;
    // The step that ends here belongs to what has been run through; seen again it changes nothing.
    if (integrator->time() <= time) monitor.step(integrator->time(), integrator->state().data());
  }

  void advance_to(double target, const std::atomic<bool>* stop) {
    while (ended == outcome::Ended::running && time < target) {
      if (stop != nullptr && stop->load(std::memory_order_relaxed)) return;
      const double reached = integrator->time();
      const double sample_time = static_cast<double>(next_sample) * scenario.outcome.sample_interval;
      const bool sample_is_due = sample_time <= target + kSameMoment;
      if (sample_is_due && sample_time <= reached) {
        sample(sample_time);
        if (ended == outcome::Ended::running && time > target) go_to(target);
      } else if (!sample_is_due && reached >= target) {
        go_to(target);
      } else {
        step();
      }
    }
    if (ended == outcome::Ended::running && time >= scenario.stop.time_max) ended = outcome::Ended::time_max;
  }

  void go_to(double t) {
    integrator->interpolate(t, state);
    time = t;
  }

  void sample(double t) {
    go_to(t);
    ++next_sample;
    monitor.sample(t, state.data());
    if (monitor.truck_speed_max() < scenario.stop.speed) ended = outcome::Ended::at_rest;
    else if (nothing_left()) ended = outcome::Ended::rolled_away;
    if (t < energy_due) return;
    energy_due = t + kEnergyInterval;
    const double residual = monitor.energy_residual(model.energy(state.data()));
    if (!(residual <= kResidualBlownUp))
      fail(fmt::format("the motion has blown up by t = {:.3g} s: {}", t, outcome::residual_text(residual)));
  }

  /// All cars but those that roll away for good are at rest, in the state of the sample.
  bool nothing_left() const {
    const Eigen::Index head = model.gone(state.data());
    return head > 0 && monitor.truck_speed_max_behind(head, state.data()) < scenario.stop.speed;
  }

  /// The clock is looked at now and then: it costs a hundredth of a step of a short train.
  void watch_clock() {
    if (++steps_unwatched < kStepsUnwatched) return;
    steps_unwatched = 0;
    if (const double spent = wall_time + elapsed(); spent > scenario.solver.wall_time_max) {
      const double t = integrator->time();
      fail(
          fmt::format("solver.wall_time_max = {} s of computing are used up at t = {:.4g} s of at most {} s, after {} "
                      "steps of {:.2g} s on "
                      "average; the stiffest part is {}",
                      scenario.solver.wall_time_max, t, scenario.stop.time_max, integrator->statistics().steps,
                      t / static_cast<double>(std::max<std::int64_t>(integrator->statistics().steps, 1)),
                      model::step_limits(scenario).front().key));
    }
  }

  void step() {
    monitor.step(integrator->time(), integrator->state().data());
    if (pending) {
      pending = false;
      motion->handle_event();
    }
    const solver::StepResult result = integrator->step();
    if (result.status == solver::StepStatus::failed) {
      fail(result.message);
      time = integrator->time();
      state = integrator->state();
      return;
    }
    pending = result.status == solver::StepStatus::event;
    watch_clock();
  }
};

Simulation::Simulation(const inputs::Scenario& scenario) : impl_(std::make_unique<Impl>(scenario, nullptr)) {}
Simulation::Simulation(const inputs::Scenario& scenario, const model::StateVector& initial)
    : impl_(std::make_unique<Impl>(scenario, &initial)) {}
Simulation::Simulation(const inputs::Scenario& scenario, const Checkpoint& checkpoint)
    : impl_(std::make_unique<Impl>(scenario, nullptr)) {
  const inputs::Scenario saved =
      inputs::read_scenario(inputs::load_text(checkpoint.scenario, checkpoint.source), checkpoint.source);
  const auto refuse = [&checkpoint](const char* key, const std::string& problem, const char* allowed) {
    throw inputs::InputError(checkpoint.source, key, "", problem, allowed);
  };
  if (model::expand(saved.consist) != impl_->model.cars())
    refuse("consist", "another train", "the train that was saved");
  if (inputs::model_of(saved) != inputs::model_of(scenario))
    refuse("model", "another model", "the model that was saved");
  require_fixed_steps(impl_->motion->integrator());
  try {
    files::Archive archive(checkpoint.bytes);
    impl_->walk(archive);
  } catch (const files::ArchiveError& e) {
    throw inputs::InputError(checkpoint.source, e.name(), "", e.problem(), "what fits the scenario");
  }
  // More time may have been given to a run that had none left.
  if (impl_->ended == outcome::Ended::time_max && impl_->time < scenario.stop.time_max)
    impl_->ended = outcome::Ended::running;
}
Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;
Simulation& Simulation::operator=(Simulation&&) noexcept = default;

void Simulation::reset(const inputs::Scenario& scenario) { impl_ = std::make_unique<Impl>(scenario, nullptr); }

void Simulation::advance(double t, const std::atomic<bool>* stop) { impl_->advance(t, stop); }

void Simulation::run(const std::atomic<bool>* stop) { advance(inputs::kInfinity, stop); }

const inputs::Scenario& Simulation::scenario() const { return impl_->scenario; }
const std::vector<model::Car>& Simulation::cars() const { return impl_->model.cars(); }
double Simulation::time() const { return impl_->time; }
bool Simulation::ended() const { return impl_->ended != outcome::Ended::running; }
const model::StateVector& Simulation::state() const { return impl_->state; }

Snapshot Simulation::snapshot() const {
  const model::Observation seen = impl_->model.observe(impl_->state.data());
  Snapshot s;
  s.time = impl_->time;
  s.cars.reserve(seen.cars.size());
  for (std::size_t k = 0; k < seen.cars.size(); ++k) {
    const auto car = static_cast<Eigen::Index>(k);
    s.cars.push_back(
        {seen.cars[k], impl_->monitor.off_track(car), impl_->monitor.lateral_reach(impl_->state.data(), car)});
  }
  s.couplers.reserve(seen.couplers.size());
  for (std::size_t i = 0; i < seen.couplers.size(); ++i) {
    const auto coupler = static_cast<Eigen::Index>(i);
    const double now = seen.couplers[i].axial_force;
    const outcome::PeakForce buff = impl_->monitor.buff_peak(coupler, s.time, now);
    const outcome::PeakForce draft = impl_->monitor.draft_peak(coupler, s.time, now);
    s.couplers.push_back({seen.couplers[i], buff.force, draft.force, buff.time, draft.time});
  }
  return s;
}

outcome::Outcome Simulation::outcome() const {
  outcome::Outcome o;
  impl_->monitor.report(impl_->time, impl_->state.data(), o);
  if (const model::Incidents* incidents = impl_->model.incidents())
    o.released = outcome::released(impl_->scenario, *incidents);
  o.ended = impl_->ended;
  o.message = impl_->message;
  o.warnings = impl_->warnings;
  o.solver = impl_->integrator->statistics();
  if (impl_->strictest) {
    o.step = *impl_->scenario.solver.fixed_step;
    o.step_max = impl_->strictest->step_max;
    o.step_limited_by = impl_->strictest->key;
  }
  o.wall_time = impl_->wall_time;
  outcome::judge(o);
  return o;
}

Checkpoint Simulation::checkpoint() const {
  require_fixed_steps(*impl_->integrator);
  Checkpoint c;
  c.scenario = inputs::to_yaml(impl_->scenario);
  c.time = impl_->time;
  files::Archive archive;
  impl_->walk(archive);
  c.bytes = archive.bytes();
  return c;
}

const std::vector<outcome::FirstTouch>& Simulation::touches() const { return impl_->monitor.touches(); }

const model::Incidents& Simulation::incidents() const {
  static const model::Incidents none;
  const model::Incidents* incidents = impl_->model.incidents();
  return incidents != nullptr ? *incidents : none;
}

}  // namespace train_derail::simulation
