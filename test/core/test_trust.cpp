// Numbers that can be believed: peaks between messages are peaks, limits hold within a step, steps that are too long
// are refused, runs that have blown up fail, and neighbours that have parted are not compared.
#include <atomic>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/step_limit.hpp"
#include "train_derail/outcome/trust.hpp"

namespace train_derail {
namespace {

using outcome::Ended;

inputs::Scenario short_accident() {
  inputs::Scenario s = test::accident(30);
  s.stop.time_max = 8.0;
  return s;
}

inputs::Scenario short_baseline() {
  inputs::Scenario s = test::baseline(20);
  s.stop.time_max = 5.0;
  return s;
}

class Peaks : public testing::TestWithParam<inputs::Scenario (*)()> {};

TEST_P(Peaks, OfMessagesAreThoseOfTheRun) {
  const inputs::Scenario s = GetParam()();
  simulation::Simulation sim(s);
  double buff = 0.0, draft = 0.0, sampled = 0.0, last = 0.0;
  for (int tick = 1; !sim.ended(); ++tick) {
    sim.advance(tick * s.output.interval);
    const simulation::Snapshot now = sim.snapshot();
    for (const simulation::CouplerSnapshot& b : now.couplers) {
      EXPECT_GE(b.buff_peak, b.axial_force);
      EXPECT_GE(b.draft_peak, -b.axial_force);
      EXPECT_LE(b.buff_peak_time, now.time);
      if (b.buff_peak > 0.0) {
        EXPECT_GE(b.buff_peak_time, last - 0.01);  // of a step that had begun before the last message
      }
      buff = std::max(buff, b.buff_peak);
      draft = std::max(draft, b.draft_peak);
      sampled = std::max(sampled, std::abs(b.axial_force));
    }
    last = now.time;
  }
  EXPECT_EQ(buff, sim.outcome().coupler_buff_peak.force);
  EXPECT_EQ(draft, sim.outcome().coupler_draft_peak.force);
  EXPECT_GT(std::max(buff, draft), sampled);  // which is why samples will not do
}

TEST_P(Peaks, ComeFromTheLastAdvanceAlone) {
  const inputs::Scenario s = GetParam()();
  simulation::Simulation whole(s), parts(s);
  whole.run();
  double buff = 0.0;
  for (const auto& b : whole.snapshot().couplers) buff = std::max(buff, b.buff_peak);
  EXPECT_EQ(buff, whole.outcome().coupler_buff_peak.force);
  parts.advance(0.5 * whole.time());
  parts.run();
  const double end = parts.time();
  for (const auto& b : parts.snapshot().couplers) {
    if (b.buff_peak > 0.0) {
      EXPECT_GE(b.buff_peak_time, 0.5 * end - 0.01);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, Peaks, testing::Values(&short_baseline, &short_accident));

// At any step: the limit is found within it.
TEST(Limits, NoCouplerBearsMoreThanItBreaksAt) {
  for (const double step : {0.004, 0.002, 0.0005}) {
    inputs::Scenario s = short_accident();
    s.coupler.break_draft = 250.0 * inputs::kKip;
    s.coupler.damping_ratio = 1.0;  // a damper that jumps in beyond the slack
    s.solver.fixed_step = step;
    simulation::Simulation sim(s);
    double draft = 0.0;
    for (int tick = 1; !sim.ended(); ++tick) {
      sim.advance(tick * 0.02);
      for (const auto& b : sim.snapshot().couplers) draft = std::max({draft, b.draft_peak, -b.axial_force});
    }
    EXPECT_EQ(draft, s.coupler.break_draft) << step;
    EXPECT_EQ(sim.outcome().coupler_draft_peak.force, s.coupler.break_draft) << step;
    int by_draft = 0;
    for (const model::BrokenCoupler& b : sim.incidents().broken) {
      EXPECT_GE(b.axial_force, -s.coupler.break_draft);
      if (b.by != model::BrokenCoupler::By::draft) continue;
      EXPECT_EQ(b.axial_force, -s.coupler.break_draft);
      ++by_draft;
    }
    EXPECT_GT(by_draft, 0);
    EXPECT_LT(sim.outcome().energy_residual, 1e-4) << step;
  }
}

TEST(Limits, BodiesBearNoMoreThanTheyAreCrushedAt) {
  inputs::Scenario s = short_accident();
  s.contact.crush_force = 800.0 * inputs::kKip;
  simulation::Simulation sim(s);
  sim.run();
  EXPECT_GT(sim.outcome().impacts.count, 0);
  EXPECT_LE(sim.outcome().impacts.peak_force, s.contact.crush_force * (1.0 + 1e-12));
}

// Two cars whose coupler gives way at once: the one behind brakes, the one ahead rolls on.
TEST(RelativeSpeed, EndsWhenTheCarsPart) {
  inputs::Scenario s = test::bare(2);
  s.coupler.stiffness = 2e7;
  s.ground.on_track_friction = 0.5;
  s.initial.speed = 20.0;
  s.stop.time_max = 3.0;
  s.coupler.break_draft = 1e5;
  simulation::Simulation sim(s);
  sim.run();
  const simulation::Snapshot end = sim.snapshot();
  ASSERT_TRUE(end.couplers[0].broken);
  EXPECT_GT(end.cars[0].vx - end.cars[1].vx, 4.0);
  const outcome::Outcome o = sim.outcome();
  EXPECT_GT(o.relative_speed_max.speed, 0.0);
  EXPECT_LT(o.relative_speed_max.speed, 1.0);
  EXPECT_LT(o.centre_speed_max.speed, 1.0);
  s.coupler.break_draft = inputs::kInfinity;
  simulation::Simulation held(s);
  held.run();
  EXPECT_FALSE(held.snapshot().couplers[0].broken);
}

std::string refusal(const inputs::Scenario& s) {
  try {
    simulation::Simulation sim(s);
    return "";
  } catch (const inputs::InputError& e) {
    return e.what();
  }
}

// Two cars on one spring swing with w^2 = 2 k / m: Euler's step may be 2 / w and no longer.
TEST(StepLimit, IsBelowTheStepAtWhichASpringBlowsUpAndNotFarBelow) {
  inputs::Scenario s = test::bare(2);
  s.coupler.slack = 0.0;
  s.coupler.stiffness = 1e8;
  s.initial.speed = 5.0;
  s.stop.time_max = 2.0;
  const double mass = s.consist[0].weight / inputs::kStandardGravity,
               exact = 2.0 / std::sqrt(2.0 * s.coupler.stiffness / mass);
  const model::StepLimit limit = model::step_limits(s).front();
  EXPECT_EQ(limit.key, "coupler.stiffness");
  EXPECT_LT(limit.step_max, exact);
  EXPECT_GT(limit.step_max, exact / 4.0);  // a coupler that has swung aside turns the cars as well
  s.solver.fixed_step = 1.01 * limit.step_max;
  EXPECT_NE(refusal(s).find("solver.fixed_step = '"), std::string::npos) << refusal(s);
  EXPECT_NE(refusal(s).find("coupler.stiffness"), std::string::npos) << refusal(s);

  const auto spread = [&](double step) {  // of the gap from an offset, after two seconds
    inputs::Scenario free = s;
    free.solver.fixed_step = step;
    std::vector<test::CarMotion> cars = test::in_line(2, 0.0, 5.0);
    cars[1].x -= 0.01;
    test::Train train(free, cars);
    double most = 0.0;
    for (int i = 1; i <= 200; ++i) {
      train.to(0.01 * i);
      most = std::max(most, std::abs(train.car(0).x - train.car(1).x - test::kPitch));
    }
    return most;
  };
  EXPECT_LT(spread(0.99 * limit.step_max), 0.03);
  EXPECT_GT(spread(1.05 * exact), 10.0);
}

TEST(StepLimit, NamesWhatIsTooStiffForTheStep) {
  const std::vector<std::pair<const char*, void (*)(inputs::Scenario&)>> cases{
      {"coupler.stiffness", [](inputs::Scenario& s) { s.coupler.stiffness = 1e12; }},
      {"coupler.draft_gear_stiffness", [](inputs::Scenario& s) { s.coupler.draft_gear_stiffness = 1e12; }},
      {"coupler.swing_stiffness", [](inputs::Scenario& s) { s.coupler.swing_stiffness = 1e12; }},
      {"rails.stiffness", [](inputs::Scenario& s) { s.rails.stiffness = 1e12; }},
      {"contact.stiffness", [](inputs::Scenario& s) { s.contact.stiffness = 1e12; }},
      {"ground.regularization_speed", [](inputs::Scenario& s) { s.ground.regularization_speed = 1e-6; }},
      {"ground.regularization_speed", [](inputs::Scenario& s) { s.solver.fixed_step = 0.5; }},
  };
  for (const auto& [key, change] : cases) {
    inputs::Scenario s = short_accident();
    EXPECT_EQ(refusal(s), "");
    change(s);
    EXPECT_NE(refusal(s).find(std::string("too long for ") + key), std::string::npos) << key << ": " << refusal(s);
  }
  // Steps under error control become as short as they must.
  inputs::Scenario free = test::baseline(3);
  free.coupler.stiffness = 1e11;
  EXPECT_EQ(refusal(free), "");
  free.solver.fixed_step = 1e-3;
  EXPECT_NE(refusal(free).find("coupler.stiffness"), std::string::npos);
}

TEST(StepLimit, LetsEveryShippedScenarioPass) {
  namespace fs = std::filesystem;
  int seen = 0;
  for (const char* folder : {"config", "config/accidents", "config/variants"}) {
    for (const auto& entry : fs::directory_iterator(fs::path(TRAIN_DERAIL_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".yaml") continue;
      ++seen;
      EXPECT_EQ(refusal(inputs::read_scenario_file(entry.path().string())), "") << entry.path();
    }
  }
  EXPECT_GT(seen, 25);
}

TEST(Judgement, ARunThatLosesItsEnergyHasFailed) {
  inputs::Scenario s = test::baseline();
  s.solver.rtol = 0.1;
  simulation::Simulation sim(s);
  sim.run();
  const outcome::Outcome o = sim.outcome();
  EXPECT_EQ(o.ended, Ended::integration_failed);
  EXPECT_NE(o.message.find("unaccounted for"), std::string::npos) << o.message;
  EXPECT_LT(o.stop_time, 60.0);  // not to its end, once it has blown up
}

TEST(Judgement, LooksAtNumbersAndAtTheResidual) {
  outcome::Outcome o;
  o.ended = Ended::at_rest;
  o.stop_time = 10.0;
  o.energy_residual = 0.9 * outcome::kResidualUnusual;
  judge(o);
  EXPECT_EQ(o.ended, Ended::at_rest);
  EXPECT_TRUE(o.warnings.empty());
  o.energy_residual = 1.1 * outcome::kResidualUnusual;
  judge(o);
  EXPECT_EQ(o.ended, Ended::at_rest);
  EXPECT_EQ(o.warnings.size(), 1u);
  o.energy_residual = 1.1 * outcome::kResidualTooLarge;
  judge(o);
  EXPECT_EQ(o.ended, Ended::integration_failed);
  EXPECT_FALSE(o.message.empty());
  outcome::Outcome wild;
  wild.ended = Ended::time_max;
  wild.pile_up.length = std::nan("");
  judge(wild);
  EXPECT_EQ(wild.ended, Ended::integration_failed);
  EXPECT_NE(wild.message.find("pile_up_length"), std::string::npos) << wild.message;
}

TEST(Judgement, ATrainThatStandsFromTheStartIsSaid) {
  inputs::Scenario s = test::baseline(3);
  s.initial.speed = s.initial.yaw_rate = 0.0;
  simulation::Simulation sim(s);
  sim.run();
  ASSERT_FALSE(sim.outcome().warnings.empty());
  EXPECT_NE(sim.outcome().warnings.back().find("nothing moved"), std::string::npos);
}

TEST(Bounds, ComputingTimeIsOneAndSaysWhatItWaitedFor) {
  for (inputs::Scenario s : {short_baseline(), short_accident()}) {
    s.solver.wall_time_max = 1e-6;
    simulation::Simulation sim(s);
    sim.run();
    const outcome::Outcome o = sim.outcome();
    EXPECT_EQ(o.ended, Ended::integration_failed);
    EXPECT_EQ(o.message.rfind("solver.wall_time_max = 1e-06 s", 0), 0u) << o.message;
    EXPECT_NE(o.message.find("stiffest part is "), std::string::npos) << o.message;
  }
}

TEST(Bounds, ARunCanBeStoppedAndGoesOnAsIfItHadNotBeen) {
  for (const inputs::Scenario& s : {short_baseline(), short_accident()}) {
    simulation::Simulation whole(s), stopped(s);
    whole.run();
    std::atomic<bool> stop{true};
    stopped.advance(1.0, &stop);
    EXPECT_LT(stopped.time(), 0.1);
    EXPECT_FALSE(stopped.ended());
    EXPECT_EQ(stopped.outcome().ended, Ended::running);
    stop = false;
    stopped.run(&stop);
    EXPECT_TRUE(stopped.ended());
    EXPECT_EQ(stopped.outcome().energy_residual, whole.outcome().energy_residual);
    EXPECT_EQ(stopped.outcome().coupler_buff_peak.force, whole.outcome().coupler_buff_peak.force);
    EXPECT_TRUE((stopped.state().array() == whole.state().array()).all());
  }
}

}  // namespace
}  // namespace train_derail
