// Cars that lie still in the extended model, and runs that end because what still moves rolls away for good.
#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "same_ensembles.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/outcome/report.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail {
namespace {

using test::CarMotion;
using test::Train;

constexpr double kLength = 55.0 * inputs::kFoot;

/// Cars on the ground, without couplers; those past x = 0 are off the track.
inputs::Scenario on_ground(int cars, double friction) {
  inputs::Scenario s = test::bare(cars, 2e-3);
  test::set_friction(s, 0.0, friction);
  s.contact.law = inputs::ContactLaw::elastic;
  s.contact.friction = 0.0;
  return s;
}

bool stands(const Train& train, Eigen::Index car) {
  const CarMotion q = train.car(car);
  return q.vx == 0.0 && q.vy == 0.0 && q.omega == 0.0;
}

TEST(PlanarRest, AHitCarWakesAndGetsTheMomentumThatAnAwakeOneGets) {
  inputs::Scenario s = on_ground(3, 0.5);
  const auto run = [&s](double rest_speed) {
    s.ground.rest_speed = rest_speed;
    // Two cars creep, end to end; a third one comes, a little off their axis.
    Train train(
        s, {CarMotion{300.0, 0.0, 0.0, 1e-3, 0.0, 0.0}, CarMotion{300.0 - kLength - 0.01, 0.0, 0.0, 1e-3, 0.0, 0.0},
            CarMotion{300.0 - 2.0 * kLength - 20.0, 0.4, 0.0, 20.0, 0.0, 0.0}});
    train.to(0.8);
    EXPECT_EQ(stands(train, 0) && stands(train, 1), rest_speed > 0.0);
    while (train.incidents().impacts.empty()) train.step();
    train.to(train.time() + 0.3);
    std::vector<double> seen;
    for (Eigen::Index k = 0; k < 3; ++k) seen.push_back(train.car(k).vx);
    train.to(20.0);
    for (Eigen::Index k = 0; k < 3; ++k) seen.push_back(train.car(k).x);
    return seen;
  };
  const std::vector<double> woken = run(0.1), free = run(0.0);
  EXPECT_GT(free[0], 3.0);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(woken[k], free[k], 0.02 * free[0]) << k;
  for (std::size_t k = 3; k < 6; ++k) EXPECT_NEAR(woken[k], free[k], 0.2) << k;
}

TEST(PlanarRest, ASlopeIsHeldUpToTheFrictionThereIs) {
  // The sine of the slope over the friction coefficient: below 1 friction holds the car, above it runs.
  for (const double share : {0.9, 1.05}) {
    inputs::Scenario s = on_ground(1, 0.5);
    const double sine = 0.5 * share;
    s.track.grade = -sine / std::sqrt(1.0 - sine * sine);
    Train train(s, {CarMotion{300.0, 0.0, 0.0, 0.01, 0.0, 0.0}});
    train.to(10.0);
    if (share < 1.0) {
      EXPECT_TRUE(stands(train, 0));
      continue;
    }
    const double pull = inputs::kStandardGravity * 0.5 * (share - 1.0);
    EXPECT_NEAR(train.car(0).vx, pull * 10.0, 0.15 * pull * 10.0);
  }
}

TEST(PlanarRest, ACarOnRailsRunsDownTheGentlestSlope) {
  inputs::Scenario s = test::on_rails(1, 2e-3);
  s.track.grade = -1e-4;
  Train train(s, {CarMotion{-300.0, 0.0, 0.0, 0.0, 0.0, 0.0}});
  train.to(30.0);
  EXPECT_NEAR(train.car(0).vx, 1e-4 * inputs::kStandardGravity * 30.0, 1e-4);
}

TEST(PlanarRest, WhatGlidesWithoutFrictionDoesNotStop) {
  inputs::Scenario s = on_ground(1, 0.0);
  Train train(s, {CarMotion{300.0, 0.0, 0.0, 0.05, 0.0, 0.0}});
  train.to(5.0);
  EXPECT_NEAR(train.car(0).vx, 0.05, 1e-12);
}

TEST(PlanarRest, ACouplerThatPullsWakesACar) {
  // The slack between them is taken up after the car in front has lain for a while.
  inputs::Scenario s = on_ground(2, 0.3);
  s.coupler.stiffness = 2e7;
  s.coupler.slack = 0.6;
  const auto run = [&s](double rest_speed) {
    s.ground.rest_speed = rest_speed;
    Train train(s,
                {CarMotion{340.0 + test::kPitch, 0.0, 0.0, 4.0, 0.0, 0.0}, CarMotion{340.0, 0.0, 0.0, 1e-3, 0.0, 0.0}});
    train.to(12.0);
    return std::array<double, 2>{train.car(0).x, train.car(1).x};
  };
  const auto woken = run(0.1), free = run(0.0);
  EXPECT_GT(free[1], 340.1);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(woken[k], free[k], 0.05) << k;
}

TEST(PlanarRest, APileIsHeldAndTheLedgerCloses) {
  inputs::Scenario s = test::accident(40);
  s.track.curves = {{-200.0, 500.0, 0.002}};
  Train train(s);
  const double at_start = train.energy().total();
  train.to(35.0);
  int held = 0;
  std::vector<double> places;
  for (Eigen::Index k = 0; k < 40; ++k) {
    held += stands(train, k) ? 1 : 0;
    places.push_back(train.car(k).x);
  }
  EXPECT_GT(held, 5);
  train.to(45.0);
  for (Eigen::Index k = 0; k < 40; ++k) {
    if (!stands(train, k)) continue;
    EXPECT_NEAR(train.car(k).x, places[static_cast<std::size_t>(k)], 0.5) << k;
  }
  EXPECT_NEAR(train.energy().total() / at_start, 1.0, 1e-5);
}

TEST(PlanarRest, ARunThatIsSavedWhileCarsLieGoesOnBitForBit) {
  inputs::Scenario s = test::accident(40);
  s.track.curves = {{-200.0, 500.0, 0.002}};
  simulation::Simulation whole(s), first(s);
  first.advance(14.0);
  int lie = 0;
  for (const simulation::CarSnapshot& car : first.snapshot().cars) lie += car.vx == 0.0 && car.vy == 0.0 ? 1 : 0;
  EXPECT_GT(lie, 0);
  simulation::Simulation second(s, first.checkpoint());
  for (simulation::Simulation* run : {&whole, &second}) run->run();
  EXPECT_EQ(whole.time(), second.time());
  EXPECT_TRUE(whole.state() == second.state());
}

TEST(PlanarRest, ChangesNoOutcomeBeyondNoise) {
  const double p = test::least_p_without(
      40, [] { return test::accident(30); }, [](inputs::Scenario& s) { s.ground.rest_speed = 0.0; },
      [](const outcome::Outcome& o) {
        return std::array<double, 4>{static_cast<double>(o.cars_derailed), o.closing_speed_max.speed, o.pile_up.width,
                                     o.pile_up.length};
      });
  EXPECT_GT(p, 0.01);
}

/// A runaway: the cars ahead of the point of derailment have no brakes.
inputs::Scenario runaway(double grade) {
  inputs::Scenario s = test::accident(16, 40.0);
  s.consist.insert(s.consist.begin(), s.consist.front());
  s.consist[0].count = 4;
  s.consist[0].brake_share = 0.0;
  s.consist[1].count = 12;
  s.initial.cars_ahead = 4;
  s.track.grade = grade;
  s.coupler.break_draft = 390.0 * inputs::kKip;
  s.stop.time_max = 300.0;
  return s;
}

TEST(RolledAway, ARunEndsWhenWhatStillMovesRollsAwayForGood) {
  simulation::Simulation down(runaway(-0.02));
  down.run();
  const outcome::Outcome o = down.outcome();
  EXPECT_EQ(o.ended, outcome::Ended::rolled_away);
  EXPECT_LT(o.stop_time, 100.0);
  EXPECT_GT(o.cars_derailed, 3);
  const auto cars = down.snapshot().cars;
  EXPECT_GT(cars[3].x - cars[4].x, 2.5 * kLength);
  for (std::size_t k = 0; k < 16; ++k) {
    if (k < 4) EXPECT_GT(cars[k].vx, 5.0) << k;
    else EXPECT_LT(std::hypot(cars[k].vx, cars[k].vy), 0.06) << k;
  }
}

TEST(RolledAway, NotWhileACurveIsAhead) {
  inputs::Scenario s = runaway(-0.02);
  s.track.curves = {{1500.0, 500.0, 1e-4}};
  simulation::Simulation run(s);
  run.run();
  EXPECT_EQ(run.outcome().ended, outcome::Ended::rolled_away);
  EXPECT_GT(run.snapshot().cars[3].x, 1990.0);
}

TEST(RolledAway, NotIfTheyWillStop) {
  simulation::Simulation level(runaway(0.0));
  level.run();
  EXPECT_NE(level.outcome().ended, outcome::Ended::rolled_away);
}

TEST(Footprint, GapOfBoxesApart) {
  const model::Footprint a{{0.0, 0.0}, {1.0, 0.0}, 8.0, 1.5}, b{{20.0, 1.0}, {1.0, 0.0}, 8.0, 1.5};
  EXPECT_DOUBLE_EQ(model::gap(a, b), 4.0);
  const model::Footprint c{{0.0, 6.0}, {0.0, 1.0}, 4.0, 1.5};
  EXPECT_DOUBLE_EQ(model::gap(a, c), 0.5);
  const model::Footprint d{{0.0, 5.0}, {0.0, 1.0}, 4.0, 1.5};
  EXPECT_DOUBLE_EQ(model::gap(a, d), 0.0);
  // Never more than the real distance, however they are turned.
  for (double angle = 0.0; angle < 3.0; angle += 0.1) {
    const model::Footprint e{{11.0, 7.0}, {std::cos(angle), std::sin(angle)}, 5.0, 1.0};
    double distance = 1e9;
    for (double u = -1.0; u <= 1.0; u += 0.02) {
      for (const double v : {-1.0, 1.0}) {
        for (const Vector2& p : {Vector2(e.centre + u * e.half_length * e.axis + v * e.half_width * e.side()),
                                 Vector2(e.centre + v * e.half_length * e.axis + u * e.half_width * e.side())}) {
          const double x = std::max(std::abs(p.x()) - 8.0, 0.0), y = std::max(std::abs(p.y()) - 1.5, 0.0);
          distance = std::min(distance, std::hypot(x, y));
        }
      }
    }
    EXPECT_LE(model::gap(a, e), distance + 1e-9) << angle;
  }
}

}  // namespace
}  // namespace train_derail
