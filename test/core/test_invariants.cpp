// What stays constant: energy and momenta without ground force, the ledger with it, and the mirror image.
#include <gtest/gtest.h>

#include "fixtures.hpp"

namespace train_derail {
namespace {

using inputs::Method;
using inputs::OnTrackLaw;
using test::CarMotion;

/// Cars that run into and away from each other and turn, hard enough to load couplers to millions of newtons.
model::StateVector brawl(const inputs::Scenario& s, int cars) {
  test::Random random(41);
  std::vector<CarMotion> motion;
  for (int k = 0; k < cars; ++k)
    motion.push_back({-k * (s.consist[0].length + s.coupler.length), 0.0, 0.0, 15.0 + random.uniform(-3.0, 3.0),
                      random.uniform(-1.5, 1.5), random.uniform(-0.3, 0.3)});
  return test::state_of(motion);
}

class Methods : public testing::TestWithParam<Method> {};

TEST_P(Methods, KeepEnergyAndMomentaWithoutGround) {
  const int cars = 8;
  inputs::Scenario s = test::baseline(cars);
  s.solver.method = GetParam();
  test::set_friction(s, 0.0, 0.0);
  test::set_tolerance(s, GetParam() == Method::bdf ? 1e-12 : 1e-11);
  s.coupler.swing_stiffness = 2e7;  // so that swing energy has its share
  const model::DerailmentModel reference(s);
  simulation::Simulation sim(s, brawl(s, cars));
  const double energy = reference.energy(sim.state().data()).total();
  const model::Momentum start = reference.momentum(sim.state().data());
  double size = 0.0;  // of angular momentum: sum of |r| m |v|
  const auto q = model::motion(sim.state().data(), cars);
  for (int k = 0; k < cars; ++k) size += sim.cars()[0].mass * (std::abs(q(k, model::X)) + 10.0) * 15.0;
  double axial = 0.0, swing = 0.0;
  // Often enough to meet the peaks of the short pushes.
  for (int i = 1; i <= 400; ++i) {
    sim.advance(0.005 * i);
    const model::EnergyLedger e = reference.energy(sim.state().data());
    const model::Momentum p = reference.momentum(sim.state().data());
    // 1e-8 relative is a thousand steps' worth of the tolerance, the dense output included.
    ASSERT_NEAR(e.total() / energy, 1.0, 1e-8) << sim.time();
    ASSERT_NEAR(p.x / start.x, 1.0, 1e-8);
    ASSERT_NEAR((p.y - start.y) / start.x, 0.0, 1e-8);
    ASSERT_NEAR((p.angular - start.angular) / size, 0.0, 1e-8);
    EXPECT_EQ(e.work_on_track + e.work_off_track, 0.0);
    axial = std::max(axial, e.coupler_axial / energy);
    swing = std::max(swing, e.coupler_swing / energy);
  }
  EXPECT_EQ(sim.outcome().ended, outcome::Ended::running);
  // It was a brawl: thousandths of the whole kinetic energy went through the couplers.
  EXPECT_GT(axial, 1e-3);
  EXPECT_GT(swing, 1e-3);
}

TEST_P(Methods, MirrorTheRunExactlyWhenTheYawIsMirrored) {
  inputs::Scenario left = test::baseline(12);
  left.solver.method = GetParam();
  left.stop.time_max = 4.0;
  inputs::Scenario right = left;
  right.initial.yaw_rate = -left.initial.yaw_rate;
  simulation::Simulation a(left), b(right);
  for (int i = 1; i <= 40; ++i) {
    a.advance(0.1 * i);
    b.advance(0.1 * i);
    const simulation::Snapshot p = a.snapshot(), q = b.snapshot();
    for (std::size_t k = 0; k < p.cars.size(); ++k) {
      // Every operation on a mirrored number is exact: equal, not nearly equal.
      ASSERT_EQ(p.cars[k].x, q.cars[k].x) << "car " << k + 1 << " at " << p.time;
      ASSERT_EQ(p.cars[k].y, -q.cars[k].y);
      ASSERT_EQ(p.cars[k].theta, -q.cars[k].theta);
      ASSERT_EQ(p.cars[k].vx, q.cars[k].vx);
      ASSERT_EQ(p.cars[k].vy, -q.cars[k].vy);
      ASSERT_EQ(p.cars[k].omega, -q.cars[k].omega);
    }
  }
  EXPECT_GT(std::abs(a.snapshot().cars[1].y), 0.1);  // something did happen
  EXPECT_EQ(a.outcome().coupler_buff_peak.force, b.outcome().coupler_buff_peak.force);
  EXPECT_EQ(a.outcome().cars_off_track, b.outcome().cars_off_track);
}

INSTANTIATE_TEST_SUITE_P(All, Methods, testing::Values(Method::cash_karp, Method::dormand_prince, Method::bdf),
                         testing::PrintToStringParamName());

class Readings : public testing::TestWithParam<OnTrackLaw> {};

TEST_P(Readings, KeepTheLedgerBalanced) {
  inputs::Scenario s = test::baseline(15);
  s.ground.on_track_law = GetParam();
  test::set_tolerance(s, 1e-9);
  const model::DerailmentModel reference(s);
  simulation::Simulation sim(s);
  const double energy = reference.energy(sim.state().data()).total();
  model::EnergyLedger before;
  while (!sim.ended()) {
    sim.advance(sim.time() + 0.05);
    const model::EnergyLedger e = reference.energy(sim.state().data());
    // Energy is a sum over the state: its error is that of the state, rtol 1e-9 times thousands of steps. In between
    // the steps it is the dense output's.
    ASSERT_NEAR(e.total() / energy, 1.0, 1e-6) << sim.time();
    ASSERT_GE(e.work_on_track, before.work_on_track * (1.0 - 1e-12));  // friction never gives back
    ASSERT_GE(e.work_off_track, before.work_off_track * (1.0 - 1e-12));
    before = e;
  }
  const outcome::Outcome o = sim.outcome();
  EXPECT_EQ(o.ended, outcome::Ended::at_rest);
  EXPECT_LT(o.energy_residual, 1e-6);
  EXPECT_NEAR(o.energy_initial / energy, 1.0, 1e-12);
  EXPECT_NEAR(o.energy_residual, std::abs(o.energy.total() - o.energy_initial) / o.energy_initial, 1e-12);
  // Both kinds of ground took their share.
  EXPECT_GT(o.energy.work_on_track, 0.05 * energy);
  EXPECT_GT(o.energy.work_off_track, 0.05 * energy);
}

INSTANTIATE_TEST_SUITE_P(All, Readings,
                         testing::Values(OnTrackLaw::isotropic, OnTrackLaw::along_track, OnTrackLaw::guided),
                         testing::PrintToStringParamName());

TEST(Ledger, ResidualAtDefaultToleranceIsSmall) {
  simulation::Simulation sim(test::baseline(20));
  sim.run();
  EXPECT_LT(sim.outcome().energy_residual, 1e-3);  // what a user sees with rtol 1e-5
}

}  // namespace
}  // namespace train_derail
