// Simulation: advance() and snapshots, the three readings as a user meets them, long and short trains, reset.
#include <algorithm>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/simulation/output_grid.hpp"

namespace train_derail {
namespace {

using inputs::Method;
using inputs::OnTrackLaw;
using test::CarMotion;

inputs::Scenario short_run(Method method = Method::dormand_prince) {
  inputs::Scenario s = test::baseline(12);
  s.solver.method = method;
  s.stop.time_max = 2.5;
  return s;
}

void expect_same(const outcome::Outcome& a, const outcome::Outcome& b) {
  EXPECT_EQ(a.cars_past_pod, b.cars_past_pod);
  EXPECT_EQ(a.cars_off_track, b.cars_off_track);
  EXPECT_EQ(a.touches, b.touches);
  EXPECT_EQ(a.closing_speed_max.speed, b.closing_speed_max.speed);
  EXPECT_EQ(a.closing_speed_max.speed_normal, b.closing_speed_max.speed_normal);
  EXPECT_EQ(a.closing_speed_max.time, b.closing_speed_max.time);
  EXPECT_EQ(a.relative_speed_max.speed, b.relative_speed_max.speed);
  EXPECT_EQ(a.relative_speed_max.coupler, b.relative_speed_max.coupler);
  EXPECT_EQ(a.coupler_buff_peak.force, b.coupler_buff_peak.force);
  EXPECT_EQ(a.coupler_buff_peak.time, b.coupler_buff_peak.time);
  EXPECT_EQ(a.coupler_draft_peak.force, b.coupler_draft_peak.force);
  EXPECT_EQ(a.stop_time, b.stop_time);
  EXPECT_EQ(a.pile_up.length, b.pile_up.length);
  EXPECT_EQ(a.pile_up.width, b.pile_up.width);
  EXPECT_EQ(a.energy.total(), b.energy.total());
  EXPECT_EQ(a.energy_residual, b.energy_residual);
  EXPECT_EQ(a.ended, b.ended);
  EXPECT_EQ(a.solver.steps, b.solver.steps);
  EXPECT_EQ(a.solver.rhs_evaluations, b.solver.rhs_evaluations);
}

class Advance : public testing::TestWithParam<Method> {};

TEST_P(Advance, DoesNotChangeTheResultByABit) {
  simulation::Simulation whole(short_run(GetParam())), parts(short_run(GetParam())), twice(short_run(GetParam()));
  test::Random random(51);
  twice.advance(1.2345);
  double t = 0.0;
  while (t < 1.2345) {
    t = std::min(t + random.uniform(0.0, 0.02), 1.2345);
    parts.advance(t);
    EXPECT_EQ(parts.time(), t);
    parts.advance(0.5 * t);  // the past: nothing happens
    EXPECT_EQ(parts.time(), t);
    parts.snapshot();
    parts.outcome();
  }
  EXPECT_EQ((parts.state() - twice.state()).norm(), 0.0);
  expect_same(parts.outcome(), twice.outcome());
  whole.run();
  parts.run();
  twice.advance(1e9);
  EXPECT_TRUE(whole.ended());
  EXPECT_TRUE(twice.ended());
  EXPECT_EQ(whole.time(), parts.time());
  EXPECT_EQ((whole.state() - parts.state()).norm(), 0.0);
  EXPECT_EQ((whole.state() - twice.state()).norm(), 0.0);
  expect_same(whole.outcome(), parts.outcome());
  expect_same(whole.outcome(), twice.outcome());
}

TEST_P(Advance, SnapshotsFollowFromTheState) {
  const inputs::Scenario s = short_run(GetParam());
  simulation::Simulation sim(s);
  std::vector<bool> past(12, false), off(12, false);
  past[0] = true;
  int loaded = 0, bent = 0;
  for (int i = 1; i <= 250; ++i) {
    sim.advance(0.01 * i);
    const simulation::Snapshot shot = sim.snapshot();
    const auto q = model::motion(sim.state().data(), 12);
    EXPECT_EQ(shot.time, sim.time());
    ASSERT_EQ(shot.cars.size(), 12U);
    ASSERT_EQ(shot.couplers.size(), 11U);
    for (std::size_t k = 0; k < 12; ++k) {
      const simulation::CarSnapshot& c = shot.cars[k];
      const auto row = q.row(static_cast<Eigen::Index>(k));
      const double arm = 0.5 * sim.cars()[k].truck_spacing;
      EXPECT_TRUE(c.x == row(0) && c.y == row(1) && c.theta == row(2) && c.vx == row(3) && c.vy == row(4) &&
                  c.omega == row(5));
      EXPECT_NEAR(c.front_truck.offset, c.y + arm * std::sin(c.theta), 1e-12);
      EXPECT_NEAR(c.rear_truck.offset, c.y - arm * std::sin(c.theta), 1e-12);
      if (c.x > 1e-9) past[k] = true;
      if (std::abs(c.x) > 1e-9) {
        EXPECT_EQ(c.past_pod, past[k]) << "car " << k + 1 << " at " << shot.time;
      }
      const double sideways = std::max(std::abs(c.front_truck.offset), std::abs(c.rear_truck.offset));
      if (sideways > s.outcome.off_track_threshold) off[k] = true;
      EXPECT_EQ(c.off_track, off[k]) << "car " << k + 1 << " at " << shot.time;
    }
    for (std::size_t i2 = 0; i2 < 11; ++i2) {
      const simulation::CouplerSnapshot& b = shot.couplers[i2];
      const simulation::CarSnapshot &lead = shot.cars[i2], &trail = shot.cars[i2 + 1];
      const double half = 0.5 * sim.cars()[0].length;
      const double dx = lead.x - half * std::cos(lead.theta) - trail.x - half * std::cos(trail.theta);
      const double dy = lead.y - half * std::sin(lead.theta) - trail.y - half * std::sin(trail.theta);
      EXPECT_NEAR(b.gap, std::hypot(dx, dy), 1e-12);
      EXPECT_NEAR(b.angle, std::atan2(dy, dx), 1e-12);
      EXPECT_EQ(b.axial_force, model::axial_force(s.coupler, b.gap));
      EXPECT_NEAR(std::remainder(b.swing_lead - (b.angle - lead.theta), 2.0 * test::kPi), 0.0, 1e-12);
      EXPECT_NEAR(std::remainder(b.swing_trail - (b.angle - trail.theta), 2.0 * test::kPi), 0.0, 1e-12);
      EXPECT_EQ(b.moment_lead, model::swing_moment(s.coupler, b.swing_lead));
      EXPECT_EQ(b.moment_trail, model::swing_moment(s.coupler, b.swing_trail));
      EXPECT_DOUBLE_EQ(b.lateral_force, (b.moment_lead + b.moment_trail) / b.gap);
      loaded += b.axial_force != 0.0;
      bent += b.lateral_force != 0.0;
    }
    const outcome::Outcome o = sim.outcome();
    EXPECT_EQ(o.cars_past_pod,
              std::count_if(shot.cars.begin(), shot.cars.end(), [](const auto& c) { return c.past_pod; }));
    EXPECT_EQ(o.cars_off_track,
              std::count_if(shot.cars.begin(), shot.cars.end(), [](const auto& c) { return c.off_track; }));
  }
  EXPECT_GT(loaded, 100);
  EXPECT_GT(bent, 100);
}

INSTANTIATE_TEST_SUITE_P(Methods, Advance, testing::Values(Method::cash_karp, Method::dormand_prince, Method::bdf),
                         testing::PrintToStringParamName());

TEST(OnTrackReadings, GuidedCarsStayOnTheRailsUntilThePointOfDerailment) {
  inputs::Scenario s = test::baseline(10);
  s.ground.on_track_law = OnTrackLaw::guided;
  for (const Method method : {Method::dormand_prince, Method::bdf}) {
    s.solver.method = method;
    simulation::Simulation sim(s);
    while (!sim.ended()) {
      sim.advance(sim.time() + 0.02);
      for (const simulation::CarSnapshot& c : sim.snapshot().cars) {
        if (c.past_pod) continue;
        // Exactly where the rails are; BDF's linear solver may leave the rounding of a zero.
        const double off = std::max({std::abs(c.y), std::abs(c.theta), std::abs(c.vy), std::abs(c.omega)});
        ASSERT_LE(off, method == Method::bdf ? 1e-15 : 0.0) << sim.time();
        EXPECT_FALSE(c.off_track);
      }
    }
    const simulation::CarSnapshot second = sim.snapshot().cars[1];
    EXPECT_TRUE(second.past_pod);
    EXPECT_NE(second.y, 0.0);  // let go past the point
    EXPECT_FALSE(sim.snapshot().cars[9].past_pod);
    EXPECT_LE(sim.outcome().cars_off_track, sim.outcome().cars_past_pod);
  }
}

/// The second of two free cars on the track, sliding askew; the first is far away.
simulation::CarSnapshot askew(OnTrackLaw law) {
  inputs::Scenario s = test::baseline(2);
  s.ground.on_track_law = law;
  test::uncouple(s);
  simulation::Simulation sim(s, test::state_of({CarMotion{20.0, 0, 0, 0, 0, 0}, CarMotion{-70.0, 0, 0, 12.0, 1.5, 0}}));
  sim.advance(1.0);
  return sim.snapshot().cars[1];
}

TEST(OnTrackReadings, AlongTrackLeavesTheCarFreeSideways) {
  const simulation::CarSnapshot car = askew(OnTrackLaw::along_track);
  EXPECT_EQ(car.vy, 1.5);
  EXPECT_NEAR(car.y, 1.5, 1e-12);
  EXPECT_EQ(car.omega, 0.0);
  // 0.15 g, 0.1 % less by the regularisation.
  EXPECT_NEAR(car.vx, 12.0 - 0.15 * inputs::kStandardGravity, 2e-3);
}

TEST(OnTrackReadings, IsotropicOpposesTheWholeVelocity) {
  const simulation::CarSnapshot car = askew(OnTrackLaw::isotropic);
  EXPECT_NEAR(car.vy / car.vx, 1.5 / 12.0, 1e-6);  // a straight line
  EXPECT_NEAR(std::hypot(car.vx, car.vy), std::hypot(12.0, 1.5) - 0.15 * inputs::kStandardGravity, 2e-3);
}

TEST(TrainLength, OneCarRuns) {
  simulation::Simulation sim(test::baseline(1));
  sim.run();
  EXPECT_TRUE(sim.ended());
  EXPECT_EQ(sim.snapshot().couplers.size(), 0U);
  EXPECT_EQ(sim.outcome().ended, outcome::Ended::at_rest);
  EXPECT_EQ(sim.outcome().coupler_force_peak(), 0.0);
  EXPECT_EQ(sim.outcome().relative_speed_max.coupler, 0);
  EXPECT_EQ(sim.outcome().closing_speed_max.car_a, 0);
}

TEST(TrainLength, AThousandCarsRun) {
  for (const Method method : {Method::dormand_prince, Method::bdf}) {
    inputs::Scenario s = test::baseline(1000);
    s.solver.method = method;
    s.stop.time_max = 0.3;
    simulation::Simulation sim(s);
    sim.run();
    EXPECT_EQ(sim.outcome().ended, outcome::Ended::time_max);
    EXPECT_EQ(sim.outcome().cars, 1000);
    // What happens at the front has not reached the rear: those cars brake as lone ones do, 0.15 g at full speed.
    const simulation::CarSnapshot last = sim.snapshot().cars[999];
    const double a = 0.15 * inputs::kStandardGravity, e = s.ground.regularization_speed;
    EXPECT_NEAR(test::slide_time(s.initial.speed, e) - test::slide_time(last.vx, e), 0.3 * a, 1e-4);
  }
}

TEST(OutputGrid, LastPointIsTheEndAndNotASecondOne) {
  // 3 * 0.1 s is a rounding more than 15 * 0.02 s: the run ended that much after its last point.
  constexpr double kEnd = 3 * 0.1;
  ASSERT_GT(kEnd, 15 * 0.02);
  inputs::Scenario at_rest = test::baseline(1);
  at_rest.initial.speed = 10.0;
  at_rest.initial.yaw_rate = 0.0;
  at_rest.ground.on_track_law = OnTrackLaw::isotropic;
  at_rest.ground.on_track_friction = at_rest.ground.off_track_friction = 0.5;  // slower by 0.49 m/s a sample
  at_rest.outcome.sample_interval = 0.1;
  at_rest.output.interval = 0.02;
  at_rest.stop.speed = 8.7;
  inputs::Scenario out_of_time = at_rest;
  out_of_time.stop.speed = 1e-3;
  out_of_time.stop.time_max = kEnd;
  for (const auto& [scenario, ended] :
       {std::pair(at_rest, outcome::Ended::at_rest), std::pair(out_of_time, outcome::Ended::time_max)}) {
    simulation::Simulation run(scenario), whole(scenario);
    simulation::OutputGrid grid(run);
    std::vector<double> times{run.time()};
    while (!run.ended()) {
      ASSERT_TRUE(grid.advance());
      times.push_back(run.time());
    }
    ASSERT_EQ(times.size(), 16U);
    for (int i = 0; i < 15; ++i) EXPECT_EQ(times[static_cast<std::size_t>(i)], i * 0.02);
    EXPECT_EQ(run.outcome().ended, ended);
    EXPECT_EQ(run.outcome().stop_time, kEnd);
    whole.run();
    expect_same(run.outcome(), whole.outcome());
  }
}

TEST(Reset, StartsAnew) {
  simulation::Simulation used(test::baseline(5)), fresh(short_run());
  used.run();
  used.reset(short_run());
  EXPECT_EQ(used.time(), 0.0);
  EXPECT_FALSE(used.ended());
  EXPECT_EQ(used.scenario().stop.time_max, 2.5);
  EXPECT_EQ(used.cars().size(), 12U);
  used.run();
  fresh.run();
  EXPECT_EQ((used.state() - fresh.state()).norm(), 0.0);
  expect_same(used.outcome(), fresh.outcome());
}

TEST(Reset, LeavesTheRunAloneIfTheScenarioIsNotValid) {
  simulation::Simulation disturbed(short_run()), quiet(short_run());
  disturbed.advance(0.5);
  inputs::Scenario bad = short_run();
  bad.consist[0].length = -1.0;
  EXPECT_THROW(disturbed.reset(bad), inputs::InputError);
  EXPECT_THROW(simulation::Simulation{bad}, inputs::InputError);
  bad.consist.clear();
  EXPECT_THROW(disturbed.reset(bad), inputs::InputError);
  EXPECT_EQ(disturbed.time(), 0.5);
  disturbed.run();
  quiet.run();
  EXPECT_EQ((disturbed.state() - quiet.state()).norm(), 0.0);
  expect_same(disturbed.outcome(), quiet.outcome());
}

TEST(Reset, MovedSimulationGoesOn) {
  simulation::Simulation a(short_run()), quiet(short_run());
  a.advance(0.7);
  simulation::Simulation b(std::move(a));
  b.run();
  quiet.run();
  EXPECT_EQ((b.state() - quiet.state()).norm(), 0.0);
}

}  // namespace
}  // namespace train_derail
