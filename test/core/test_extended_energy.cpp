// Whole accidents: where the energy goes, that bodies do not pass through each other, that runs repeat, and that the
// step does not matter for what is counted.
#include <algorithm>
#include <regex>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/model/footprint.hpp"

namespace train_derail {
namespace {

using model::EnergyLedger;
using test::Train;

TEST(Accident, OfTheTestsIsTheOneFromSources) {
  const inputs::Scenario s =
      inputs::read_scenario_file(std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/variants/accident_sources.yaml");
  inputs::Scenario mine = test::accident(100);  // but for the train, and when the brakes are applied
  mine.title = s.title;
  mine.consist = s.consist;
  mine.brakes.emergency_time = s.brakes.emergency_time;
  mine.initial.cars_ahead = s.initial.cars_ahead;
  const std::regex last_digits("(\\.[0-9]{4})[0-9]+");  // differ with the order of conversion
  const auto rounded = [&](const inputs::Scenario& x) {
    return std::regex_replace(inputs::to_yaml(x), last_digits, "$1");
  };
  EXPECT_EQ(rounded(mine), rounded(s));
}

/// Grade and a curve on top of what accident() has.
inputs::Scenario everything(int cars, double step) {
  inputs::Scenario s = test::accident(cars);
  s.track.grade = -0.01;
  s.contact.crush_force = 1.2e6 * inputs::kPoundForce;
  s.initial.cars_ahead = 5;
  s.initial.perturbation.seed = 4;
  s.coupler.break_moment = 3e6;
  s.solver.fixed_step = step;
  return s;
}

TEST(Energy, OfAWholeRunIsAccountedFor) {
  double residual[3];
  for (int i = 0; i < 3; ++i) {
    simulation::Simulation sim(everything(30, 2e-3 / (1 << (2 * i))));
    sim.run();
    const outcome::Outcome o = sim.outcome();
    EXPECT_EQ(o.ended, outcome::Ended::at_rest);
    residual[i] = o.energy_residual;
    const EnergyLedger& e = o.energy;
    const double all = o.energy_initial;
    // Nothing moves any more; each mechanism has taken its share.
    EXPECT_LT(e.kinetic() / all, 1e-5);
    EXPECT_GT(e.work_on_track / all, 0.05);
    EXPECT_GT(e.work_off_track / all, 0.05);
    EXPECT_GT(e.work_coupler_damping / all, 1e-4);
    EXPECT_GT(e.work_coupler_break / all, 1e-5);
    EXPECT_GT(e.work_impact_normal / all, 1e-4);
    EXPECT_GT(e.work_impact_friction / all, 1e-5);
    EXPECT_GE(e.coupler_axial, 0.0);
    EXPECT_GE(e.coupler_swing, 0.0);
    EXPECT_LT(e.work_grade, 0.0);  // downhill
    EXPECT_NE(e.work_kicks, 0.0);
    EXPECT_NE(e.work_rails, 0.0);
  }
  EXPECT_LT(residual[0], 2e-2);
  EXPECT_LT(residual[1], 0.6 * residual[0]);
  EXPECT_LT(residual[2], 2e-3);
}

TEST(Energy, WhatDissipatesOnlyEverTakes) {
  inputs::Scenario s = everything(30, 5e-4);
  Train train(s);
  EnergyLedger before = train.energy();
  const double all = before.total();
  for (int i = 1; i <= 400; ++i) {
    train.to(0.05 * i);
    const EnergyLedger e = train.energy();
    const double rounding = 1e-12 * all;
    EXPECT_GE(e.work_on_track, before.work_on_track - rounding);
    EXPECT_GE(e.work_off_track, before.work_off_track - rounding);
    EXPECT_GE(e.work_coupler_damping, before.work_coupler_damping - 1e-6 * all);  // by the step's order
    EXPECT_GE(e.work_coupler_break, before.work_coupler_break);
    EXPECT_GE(e.work_impact_friction, before.work_impact_friction - 1e-6 * all);
    EXPECT_GE(e.work_impact_normal, 0.0);  // holds what is stored in a touch, too
    EXPECT_NEAR(e.total() / all, 1.0, 5e-3);
    before = e;
  }
}

TEST(Accident, BodiesOverlapByLessThanHalfAFoot) {
  for (const std::int64_t seed : {1, 2, 3}) {
    inputs::Scenario s = test::accident(60, 48.0);
    s.initial.perturbation.seed = seed;
    s.contact.crush_force = 1450.0 * inputs::kKip;  // as config/accident.yaml; what has crushed is no overlap
    Train train(s);
    double deepest = 0.0;
    for (int i = 1; i <= 300; ++i) {
      train.to(0.1 * i);
      std::vector<model::Footprint> f;
      for (Eigen::Index k = 0; k < 60; ++k) {
        const model::CarMotion c = train.model().car_motion(train.data(), k);
        const model::Car& car = train.model().cars()[static_cast<std::size_t>(k)];
        f.push_back({c.centre, c.axis, 0.5 * car.length, 0.5 * car.width});
      }
      for (std::size_t a = 0; a < f.size(); ++a) {
        for (std::size_t b = a + 1; b < f.size(); ++b) {
          if ((f[a].centre - f[b].centre).norm() > 18.0) continue;
          if (const auto t = model::touch(f[a], f[b])) deepest = std::max(deepest, t->depth);
        }
      }
    }
    EXPECT_GT(train.incidents().impacts.size(), 20u);
    EXPECT_GT(deepest, 0.01);
    EXPECT_LE(train.incidents().overlap_max, 0.5 * inputs::kFoot) << seed;
    // With what has crushed, 1.1 to 2.2 m; bodies that pass through each other overlap by their whole width of 3.05 m.
    EXPECT_LT(deepest, 2.6) << seed;
  }
}

TEST(Accident, RepeatsBitForBitAndDiffersBySeed) {
  inputs::Scenario s = test::accident(40);
  s.stop.time_max = 15.0;
  simulation::Simulation a(s), b(s);
  a.run();
  for (double t = 0.0; t < 15.0; t += 0.037) b.advance(t);  // however it is cut up
  b.run();
  EXPECT_TRUE((a.state().array() == b.state().array()).all());
  EXPECT_EQ(a.outcome().cars_derailed, b.outcome().cars_derailed);
  EXPECT_EQ(a.outcome().energy_residual, b.outcome().energy_residual);
  EXPECT_EQ(a.outcome().impacts.peak_force, b.outcome().impacts.peak_force);
  s.initial.perturbation.seed = 1;
  simulation::Simulation c(s);
  c.run();
  EXPECT_FALSE((a.state().array() == c.state().array()).all());
  b.reset(s);
  b.run();
  EXPECT_TRUE((b.state().array() == c.state().array()).all());
}

TEST(Accident, ReportsWhatHappened) {
  inputs::Scenario s = test::accident(40);
  simulation::Simulation sim(s);
  sim.run();
  const outcome::Outcome o = sim.outcome();
  EXPECT_EQ(o.ended, outcome::Ended::at_rest);
  EXPECT_EQ(o.derailed_by.pod + o.derailed_by.lateral + o.derailed_by.torn_track, o.cars_derailed);
  EXPECT_GT(o.derailed_by.pod, 0);
  EXPECT_GT(o.cars_derailed, 5);
  EXPECT_LT(o.cars_derailed, 40);
  EXPECT_GE(o.cars_derailed, o.cars_past_pod);
  EXPECT_GT(o.impacts.count, 0);
  EXPECT_GT(o.couplers_broken, 0);
  EXPECT_LE(o.coupler_draft_peak.force, s.coupler.break_draft);
  EXPECT_GT(o.blockage_force, 0.0);
  EXPECT_LT(o.blockage_force, o.coupler_buff_peak.force);
}

/// Mean and standard error of the cars derailed in runs that differ by their seeds.
struct Mean {
  double value, error;
};
Mean derailed(double step, int seeds) {
  double sum = 0.0, squares = 0.0;
  for (int seed = 0; seed < seeds; ++seed) {
    inputs::Scenario s = test::accident(40, 30.0);
    s.initial.perturbation.seed = seed;
    s.solver.fixed_step = step;
    simulation::Simulation sim(s);
    sim.run();
    EXPECT_EQ(sim.outcome().ended, outcome::Ended::at_rest) << step << " " << seed;
    sum += sim.outcome().cars_derailed;
    squares += std::pow(sim.outcome().cars_derailed, 2);
  }
  const double mean = sum / seeds;
  return {mean, std::sqrt((squares / seeds - mean * mean) / (seeds - 1))};
}

TEST(Steps, DoNotChangeWhatIsCounted) {
  const int seeds = 24;
  const Mean reference = derailed(1e-3, seeds);
  EXPECT_GT(reference.value, 8.0);
  EXPECT_LT(reference.value, 36.0);
  for (const double step : {2e-3, 4e-3}) {
    const Mean m = derailed(step, seeds);
    EXPECT_NEAR(m.value, reference.value, 3.0 * std::hypot(m.error, reference.error)) << step;
    RecordProperty("mean_" + std::to_string(step), std::to_string(m.value) + " +- " + std::to_string(m.error));
  }
  // Fine enough a test: three standard errors are less than an eighth of the count.
  EXPECT_LT(3.0 * reference.error, 0.125 * reference.value);
}

}  // namespace
}  // namespace train_derail
