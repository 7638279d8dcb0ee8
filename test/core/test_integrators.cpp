// The integrators behind their interface: events, dense output, agreement, failure.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "fixtures.hpp"

namespace train_derail {
namespace {

using inputs::Method;
using test::CarMotion;

/// A stone thrown up: y'' = -g; its event functions are height and the time 0.75 s.
class Stone : public solver::OdeSystem {
 public:
  Eigen::Index size() const override { return 2; }
  bool derivative(double /*t*/, const double* y, double* d) override {
    d[0] = y[1];
    d[1] = -10.0;
    return true;
  }
  Eigen::Index event_count() const override { return 3; }
  void events(double t, const double* y, double* values) override {
    values[0] = y[0];
    values[1] = t - 0.75;
    values[2] = 1.0;  // switched off
  }
  std::vector<Eigen::Index> band_positions() const override { return {0, 1}; }
  Eigen::Index band_lower() const override { return 1; }
  Eigen::Index band_upper() const override { return 1; }
  void jacobian(double /*t*/, const double* /*y*/, const SetEntry& set) override { set(0, 1, 1.0); }
};

/// y' = y^2 from 1: infinite at t = 1.
class BlowUp : public solver::OdeSystem {
 public:
  Eigen::Index size() const override { return 1; }
  bool derivative(double /*t*/, const double* y, double* d) override {
    d[0] = y[0] * y[0];
    return std::isfinite(d[0]);
  }
  std::vector<Eigen::Index> band_positions() const override { return {0}; }
  Eigen::Index band_lower() const override { return 0; }
  Eigen::Index band_upper() const override { return 0; }
  void jacobian(double /*t*/, const double* y, const SetEntry& set) override { set(0, 0, 2.0 * y[0]); }
};

/// y' = 1e308: its derivative stays finite when y does not.
class Overflow : public BlowUp {
 public:
  bool derivative(double /*t*/, const double* /*y*/, double* d) override {
    d[0] = 1e308;
    return true;
  }
  void jacobian(double /*t*/, const double* /*y*/, const SetEntry& set) override { set(0, 0, 0.0); }
};

/// Two oscillators of 1 and 20 rad/s, their components shuffled against the band order.
class Oscillators : public solver::OdeSystem {
 public:
  Eigen::Index size() const override { return 4; }
  bool derivative(double /*t*/, const double* y, double* d) override {
    d[0] = y[2];
    d[1] = y[3];
    d[2] = -y[0];
    d[3] = -400.0 * y[1];
    return true;
  }
  std::vector<Eigen::Index> band_positions() const override { return {0, 2, 1, 3}; }
  Eigen::Index band_lower() const override { return 1; }
  Eigen::Index band_upper() const override { return 1; }
  void jacobian(double /*t*/, const double* /*y*/, const SetEntry& set) override {
    set(0, 1, 1.0);
    set(1, 0, -1.0);
    set(2, 3, 1.0);
    set(3, 2, -400.0);
  }
};

inputs::Solver options(Method method, double tolerance) {
  inputs::Solver o;
  o.method = method;
  o.rtol = o.atol = tolerance;
  return o;
}

class Integrator : public testing::TestWithParam<Method> {};

TEST_P(Integrator, LocatesEventsInOrder) {
  Stone stone;
  const auto integrator = solver::make_integrator(options(GetParam(), 1e-10), stone, 0.0, Eigen::Vector2d(1.0, 4.0));
  // Lands at 10 t^2 / 2 - 4 t - 1 = 0.
  const double landing = 0.4 + std::sqrt(0.16 + 0.2);
  std::vector<double> times;
  std::vector<Eigen::Index> which;
  for (int i = 0; i < 100000 && integrator->time() < 2.0; ++i) {
    const solver::StepResult r = integrator->step();
    ASSERT_NE(r.status, solver::StepStatus::failed) << r.message;
    EXPECT_EQ(r.status == solver::StepStatus::event, !r.events.empty());
    if (r.status != solver::StepStatus::event) continue;
    ASSERT_EQ(r.events.size(), 1U);
    times.push_back(integrator->time());
    which.push_back(r.events[0]);
    if (r.events[0] == 0) {
      EXPECT_NEAR(integrator->state()(0), 0.0, 1e-8);
    }
  }
  ASSERT_EQ(times.size(), 2U);
  EXPECT_EQ(which[0], 1);
  EXPECT_NEAR(times[0], 0.75, 1e-12);
  EXPECT_EQ(which[1], 0);
  EXPECT_NEAR(times[1], landing, 1e-8);  // tolerance 1e-10 over the flight, some tens of steps
}

TEST_P(Integrator, DenseOutputMeetsTheStepsAndTheTruth) {
  Oscillators system;
  VectorX start(4), y(4), previous;
  start << 1.0, 0.5, 0.0, 0.0;
  const auto integrator = solver::make_integrator(options(GetParam(), 1e-8), system, 0.0, start);
  previous = start;
  double worst = 0.0;
  for (int i = 0; i < 100000 && integrator->time() < 3.0; ++i) {
    ASSERT_EQ(integrator->step().status, solver::StepStatus::stepped);
    const double a = integrator->previous_time(), b = integrator->time();
    ASSERT_LT(a, b);
    integrator->interpolate(a, y);
    EXPECT_LT((y - previous).norm(), 1e-6);
    integrator->interpolate(b, y);
    EXPECT_LT((y - integrator->state()).norm(), 1e-12);
    for (double f = 0.1; f < 1.0; f += 0.2) {
      const double t = a + f * (b - a);
      integrator->interpolate(t, y);
      worst = std::max({worst, std::abs(y(0) - std::cos(t)), std::abs(y(1) - 0.5 * std::cos(20.0 * t)) / 10.0});
    }
    previous = integrator->state();
  }
  // Between the steps no worse than some hundred times the tolerance: the dense output is not the weak link.
  EXPECT_LT(worst, 2e-6);
  EXPECT_GT(integrator->statistics().steps, 10);
  EXPECT_GE(integrator->statistics().rhs_evaluations, integrator->statistics().steps);
  if (GetParam() == Method::bdf) {
    EXPECT_GT(integrator->statistics().jacobian_evaluations, 0);
  }
}

TEST_P(Integrator, RestartChangesNothingWhereNothingJumps) {
  Oscillators system;
  VectorX start(4), y(4);
  start << 1.0, 0.5, 0.0, 0.0;
  const auto integrator = solver::make_integrator(options(GetParam(), 1e-9), system, 0.0, start);
  for (int i = 0; i < 100000 && integrator->time() < 2.0; ++i) {
    ASSERT_EQ(integrator->step().status, solver::StepStatus::stepped);
    if (i % 20 == 19) integrator->restart();
  }
  integrator->interpolate(2.0, y);
  EXPECT_NEAR(y(0), std::cos(2.0), 1e-6);
  EXPECT_NEAR(y(1), 0.5 * std::cos(40.0), 1e-5);
}

TEST_P(Integrator, FailureIsAValueAndTheLastGoodStateIsKept) {
  BlowUp system;
  inputs::Solver o = options(GetParam(), 1e-6);
  o.steps_max = 3000;
  const auto integrator = solver::make_integrator(o, system, 0.0, VectorX::Ones(1));
  double time = 0.0;
  VectorX state = VectorX::Ones(1);
  solver::StepResult r;
  for (int i = 0; i < 10000; ++i) {
    r = integrator->step();
    if (r.status == solver::StepStatus::failed) break;
    time = integrator->time();
    state = integrator->state();
  }
  ASSERT_EQ(r.status, solver::StepStatus::failed);
  EXPECT_FALSE(r.message.empty());
  EXPECT_EQ(integrator->time(), time);
  EXPECT_EQ(integrator->state()(0), state(0));
  EXPECT_TRUE(std::isfinite(state(0)));
  EXPECT_NEAR(time, 1.0, 1e-3);
}

TEST_P(Integrator, StepIntoInfinityIsTakenBack) {
  Overflow system;
  inputs::Solver o = options(GetParam(), 1e-6);
  o.steps_max = 3000;
  const auto integrator = solver::make_integrator(o, system, 0.0, VectorX::Constant(1, 1e308));
  double time = 0.0, state = 1e308;
  solver::StepResult r;
  for (int i = 0; i < 10000; ++i) {
    r = integrator->step();
    if (r.status == solver::StepStatus::failed) break;
    time = integrator->time();
    state = integrator->state()(0);
  }
  ASSERT_EQ(r.status, solver::StepStatus::failed);
  EXPECT_FALSE(r.message.empty());
  EXPECT_EQ(integrator->time(), time);
  EXPECT_EQ(integrator->state()(0), state);
  EXPECT_TRUE(std::isfinite(state));
}

TEST_P(Integrator, SimulationThatRunsOutOfStepsSaysSo) {
  inputs::Scenario s = test::baseline(10);
  s.solver.method = GetParam();
  s.solver.steps_max = 50;
  simulation::Simulation sim(s);
  ASSERT_NO_THROW(sim.run());
  const outcome::Outcome o = sim.outcome();
  EXPECT_TRUE(sim.ended());
  EXPECT_EQ(o.ended, outcome::Ended::integration_failed);
  EXPECT_FALSE(o.message.empty());
  EXPECT_LE(o.solver.steps, 50);
  EXPECT_GT(sim.time(), 0.0);
  EXPECT_EQ(o.stop_time, sim.time());
  EXPECT_TRUE(sim.state().allFinite());
  EXPECT_LT(o.energy_residual, 1e-3);  // the state kept is a good one
  const double time = sim.time();
  sim.advance(time + 1.0);  // nothing more happens
  EXPECT_EQ(sim.time(), time);
}

TEST_P(Integrator, CrossingOfThePointOfDerailmentIsLocated) {
  // The second car, free of the first, slides 30 m on the track and crosses x = 0 at a time known in closed form.
  inputs::Scenario s = test::baseline(2);
  test::uncouple(s);
  s.solver.method = GetParam();
  test::set_tolerance(s, 1e-13);
  const double speed = 15.0, way = 30.0, e = s.ground.regularization_speed;
  const double a = s.ground.on_track_friction * inputs::kStandardGravity;
  // Speed at the crossing: slide_distance(v) = slide_distance(15) - a way, by Newton's rule.
  double v = speed;
  for (int i = 0; i < 50; ++i)
    v -= (test::slide_distance(v, e) - test::slide_distance(speed, e) + a * way) / std::sqrt(v * v + e * e);
  const double crossing = (test::slide_time(speed, e) - test::slide_time(v, e)) / a;
  const model::StateVector start =
      test::state_of({CarMotion{80.0, 0.0, 0.0, 0.0, 0.0, 0.0}, CarMotion{-way, 0.0, 0.0, speed, 0.0, 0.0}});
  simulation::Simulation sim(s, start);
  sim.advance(crossing - 1e-9);
  EXPECT_FALSE(sim.snapshot().cars[1].past_pod);
  EXPECT_EQ(sim.outcome().cars_past_pod, 1);
  EXPECT_NEAR(sim.snapshot().cars[1].x, 0.0, 1e-7);
  sim.advance(crossing + 1e-9);
  EXPECT_TRUE(sim.snapshot().cars[1].past_pod);
  sim.advance(crossing + 0.5);  // and is braked by the off-track friction from there on
  const double b = s.ground.off_track_friction * inputs::kStandardGravity;
  EXPECT_NEAR((test::slide_time(v, e) - test::slide_time(sim.snapshot().cars[1].vx, e)) / b, 0.5, 1e-8);
  // Each ground has its own account.
  const double mass = sim.cars()[1].mass;
  const model::EnergyLedger ledger = model::DerailmentModel(s).energy(sim.state().data());
  EXPECT_NEAR(ledger.work_on_track / (0.5 * mass * (speed * speed - v * v)), 1.0, 1e-8);
  EXPECT_NEAR(ledger.work_off_track / (0.5 * mass * (v * v - std::pow(sim.snapshot().cars[1].vx, 2))), 1.0, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Methods, Integrator, testing::Values(Method::cash_karp, Method::dormand_prince, Method::bdf),
                         testing::PrintToStringParamName());

TEST(Integrators, AgreeOnTheBaseline) {
  const double until = 1.0, interval = 0.01;  // the first couplers close after 0.4 s
  std::vector<std::vector<simulation::Snapshot>> runs;
  std::vector<double> peaks;
  for (const Method method : {Method::dormand_prince, Method::cash_karp, Method::bdf}) {
    inputs::Scenario s = test::baseline(60);
    s.solver.method = method;
    test::set_tolerance(s, method == Method::bdf ? 1e-10 : 1e-9);
    simulation::Simulation sim(s);
    runs.emplace_back();
    for (int i = 1; i * interval < until + 1e-9; ++i) {
      sim.advance(i * interval);
      runs.back().push_back(sim.snapshot());
    }
    peaks.push_back(sim.outcome().coupler_force_peak());
  }
  for (std::size_t run = 1; run < runs.size(); ++run) {
    for (std::size_t i = 0; i < runs[0].size(); ++i) {
      for (std::size_t k = 0; k < runs[0][i].cars.size(); ++k) {
        const simulation::CarSnapshot &a = runs[0][i].cars[k], &b = runs[run][i].cars[k];
        ASSERT_NEAR(a.x, b.x, 1e-3) << "run " << run << ", car " << k + 1 << ", time " << runs[0][i].time;
        ASSERT_NEAR(a.y, b.y, 1e-3);
        ASSERT_NEAR(a.theta * 9.0, b.theta * 9.0, 1e-3);  // car ends, some 9 m from the centre
      }
    }
    EXPECT_NEAR(peaks[run] / peaks[0], 1.0, 0.02);
  }
  EXPECT_GT(peaks[0], 1e6);  // the run into the first car's coupler is in it
}

TEST(Integrators, WhatIsSampledDoesNotDependOnTheSteps) {
  // Two tolerances take other steps; the samples between them differ by the looser one's error alone, which impacts
  // between couplers have magnified by some thousands.
  std::vector<simulation::Snapshot> ends;
  for (const double tolerance : {1e-10, 1e-12}) {
    inputs::Scenario s = test::baseline(8);
    test::set_tolerance(s, tolerance);
    simulation::Simulation sim(s);
    sim.advance(0.777);
    EXPECT_EQ(sim.time(), 0.777);
    ends.push_back(sim.snapshot());
  }
  for (std::size_t k = 0; k < 8; ++k) {
    EXPECT_NEAR(ends[0].cars[k].x, ends[1].cars[k].x, 1e-5);
    EXPECT_NEAR(ends[0].cars[k].y, ends[1].cars[k].y, 1e-5);
    EXPECT_NEAR(ends[0].couplers[k % 7].gap, ends[1].couplers[k % 7].gap, 1e-5);
  }
}

}  // namespace
}  // namespace train_derail
