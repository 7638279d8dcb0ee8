// Contact of car bodies: the law, central hits, crushing, friction, and what the record says of an impact.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/model/contact_law.hpp"
#include "train_derail/model/footprint.hpp"

namespace train_derail {
namespace {

using model::Face;
using test::CarMotion;
using test::Train;

TEST(ContactLaw, LoadsWithItsStiffnessAndUnloadsWithLess) {
  inputs::Contact c;
  c.stiffness = 4e7;
  c.restitution = 0.3;
  double crushed = 0.0;
  EXPECT_DOUBLE_EQ(model::contact_force(c, 0.05, 1.0, crushed), 2e6);
  EXPECT_DOUBLE_EQ(model::contact_force(c, 0.05, -1.0, crushed), 0.09 * 2e6);
  EXPECT_EQ(crushed, 0.0);
}

TEST(ContactLaw, YieldsAtTheCrushForce) {
  inputs::Contact c;
  c.stiffness = 4e7;
  c.restitution = 0.5;
  c.crush_force = 3e6;
  double crushed = 0.0;
  EXPECT_DOUBLE_EQ(model::contact_force(c, 0.07, 1.0, crushed), 2.8e6);
  EXPECT_EQ(crushed, 0.0);
  EXPECT_NEAR(model::contact_force(c, 0.2, 1.0, crushed), 3e6, 1e-6);
  EXPECT_NEAR(crushed, 0.2 - 0.075, 1e-12);
  EXPECT_NEAR(model::contact_force(c, 0.2, -1.0, crushed), 0.25 * 3e6, 1e-6);
  EXPECT_NEAR(model::contact_force(c, 0.15, -1.0, crushed), 0.25 * 4e7 * 0.025, 1e-6);
  EXPECT_EQ(model::contact_force(c, 0.12, -1.0, crushed), 0.0);         // what has yielded does not push
  EXPECT_NEAR(model::contact_force(c, 0.15, 1.0, crushed), 1e6, 1e-6);  // hit again
  EXPECT_NEAR(crushed, 0.125, 1e-12);
}

TEST(ContactLaw, QuietDampingIsItsChangeWithTheRate) {
  inputs::Contact c;
  c.stiffness = 4e7;
  c.restitution = 0.3;
  const double depth = 0.03, quiet = 0.2, rate = 1e-6;
  double crushed = 0.0;
  const double change = model::quiet_contact_force(c, depth, rate, quiet, crushed) -
                        model::quiet_contact_force(c, depth, -rate, quiet, crushed);
  EXPECT_NEAR(model::quiet_damping(c, depth, quiet) / (change / (2.0 * rate)), 1.0, 1e-6);
}

/// Two free cars with nothing but contact.
inputs::Scenario bodies(double step, int cars = 2) {
  inputs::Scenario s = test::bare(cars, step);
  s.contact.law = inputs::ContactLaw::elastic;
  return s;
}

constexpr double kLength = 55.0 * inputs::kFoot, kWidth = 10.0 * inputs::kFoot;

/// Car 0 ahead of car 1, which runs into it with `closing`; 1 cm of gap; both in motion as a whole.
Train central_hit(const inputs::Scenario& s, double closing) {
  return Train(s, {CarMotion{100.0, 0.0, 0.0, 3.0 - 0.5 * closing, 1.0, 0.0},
                   CarMotion{100.0 - kLength - 0.01, 0.0, 0.0, 3.0 + 0.5 * closing, 1.0, 0.0}});
}

class Restitution : public testing::TestWithParam<double> {};

TEST_P(Restitution, IsWhatACentralHitReturns) {
  const double e = GetParam();
  for (const double closing : {1.0, 8.0}) {
    for (int i = 0; i < 3; ++i) {
      // At eight times the speed the gap takes an eighth of the time.
      inputs::Scenario s = bodies(2e-3 / (1 << (2 * i)));
      s.contact.restitution = e;
      Train train = central_hit(s, closing);
      const model::Momentum p = train.momentum();
      train.to(3.0);
      const double parting = train.car(0).vx - train.car(1).vx;
      // One step on a spring of w rad/s blurs the speed by w h: smaller steps, smaller error.
      const double w = std::sqrt(2.0 * s.contact.stiffness / train.model().cars()[0].mass);
      EXPECT_LT(std::abs(parting / closing - e), 1.5 * w * *s.solver.fixed_step) << closing;
      EXPECT_NEAR(train.momentum().x / p.x, 1.0, 1e-13);
      EXPECT_EQ(train.car(0).vy, 1.0);
      EXPECT_EQ(train.car(0).omega, 0.0);

      ASSERT_EQ(train.incidents().impacts.size(), 1u);
      const model::Impact& hit = train.incidents().impacts[0];
      const double mass = train.model().cars()[0].mass;
      // The impulse is the change of momentum, exactly.
      EXPECT_NEAR(hit.impulse / (mass * (train.car(0).vx - (3.0 - 0.5 * closing))), 1.0, 1e-11);
      EXPECT_NEAR(hit.closing_speed / closing, 1.0, 1e-12);
      EXPECT_NEAR(hit.closing_speed_normal / closing, 1.0, 1e-12);
      EXPECT_NEAR(hit.time, 0.01 / closing, 1.01 * *s.solver.fixed_step);
      EXPECT_EQ(hit.car_a, 0);
      EXPECT_EQ(hit.car_b, 1);
      EXPECT_EQ(hit.face_a, Face::rear);
      EXPECT_EQ(hit.face_b, Face::front);
      EXPECT_NEAR(hit.along_a, -0.5 * kLength, 0.02);
      EXPECT_NEAR(hit.along_b, 0.5 * kLength, 0.02);
      EXPECT_EQ(hit.z, 0.0);
      // The top of the force is that of the spring that takes the speed.
      const double top = closing * std::sqrt(s.contact.stiffness * 0.5 * mass);
      EXPECT_NEAR(hit.peak_force / top, 1.0, 30.0 * *s.solver.fixed_step);
      EXPECT_NEAR(train.incidents().overlap_max * s.contact.stiffness / top, 1.0, 30.0 * *s.solver.fixed_step);
      // And the energy that it does not return.
      EXPECT_NEAR(train.energy().work_impact_normal, 0.25 * mass * (closing * closing - parting * parting),
                  1e-8 * mass * closing * closing);
      EXPECT_EQ(train.energy().work_impact_friction, 0.0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Elasticity, Restitution, testing::Values(0.0, 0.2, 0.5, 1.0));

TEST(Contact, UnequalCarsShareTheImpulse) {
  inputs::Scenario s = bodies(1e-4);
  s.contact.restitution = 0.4;
  s.consist.push_back(s.consist[0]);
  s.consist[0].count = s.consist[1].count = 1;
  s.consist[1].weight *= 0.25;
  Train train = central_hit(s, 4.0);
  train.to(2.0);
  const double centre = (1.0 * 1.0 + 0.25 * 5.0) / 1.25;  // of velocities 1 and 5 m/s
  EXPECT_NEAR(train.car(0).vx, centre + 0.2 * 0.4 * 4.0, 0.01);
  EXPECT_NEAR(train.car(1).vx, centre - 0.8 * 0.4 * 4.0, 0.01);
}

TEST(Contact, CrushesAtItsPlateauAndAbsorbsForceTimesWay) {
  inputs::Scenario s = bodies(1e-4);
  s.contact.crush_force = 4e6;
  s.contact.restitution = 0.5;
  const double closing = 6.0;
  Train train = central_hit(s, closing);
  const double mass = train.model().cars()[0].mass, energy = 0.25 * mass * closing * closing;
  double deepest = 0.0;
  while (train.time() < 2.0) {
    train.step();
    deepest = std::max(deepest, train.car(1).x + kLength - train.car(0).x);
  }
  const double elastic = s.contact.crush_force / s.contact.stiffness;
  const double depth = elastic + (energy - 0.5 * s.contact.crush_force * elastic) / s.contact.crush_force;
  EXPECT_NEAR(deepest / depth, 1.0, 2e-3);
  EXPECT_NEAR(train.incidents().impacts[0].peak_force / s.contact.crush_force, 1.0, 1e-9);
  EXPECT_NEAR(train.incidents().overlap_max / elastic, 1.0, 1e-9);  // beyond what is crushed
  // Only the elastic part is returned, e^2 of it.
  const double parting = s.contact.restitution * s.contact.crush_force / std::sqrt(s.contact.stiffness * 0.5 * mass);
  EXPECT_NEAR((train.car(0).vx - train.car(1).vx) / parting, 1.0, 5e-3);
  EXPECT_NEAR(train.energy().work_impact_normal / (energy - 0.25 * mass * parting * parting), 1.0, 1e-3);
}

/// Car 1 slides along the side of car 0 and leans into it: a long sideswipe, no rotation (both trucks bear alike).
struct Swipe {
  double normal, tangential;  // impulses on car 0 [N s]
};
Swipe swipe(double friction, double along, double closing, double step) {
  inputs::Scenario s = bodies(step);
  s.contact.friction = friction;
  s.ground.regularization_speed = 1e-3;
  Train train(s,
              {CarMotion{100.0, 0.0, 0.0, 0.0, 0.0, 0.0}, CarMotion{100.0, -kWidth - 1e-3, 0.0, along, closing, 0.0}});
  train.to(1.5);
  const double mass = train.model().cars()[0].mass;
  EXPECT_NEAR(train.incidents().impacts.at(0).impulse / (mass * train.car(0).vy), 1.0, 0.05);
  return {train.incidents().impacts.at(0).impulse, mass * train.car(0).vx};
}

TEST(ContactFriction, StaysWithinItsCone) {
  for (const double along : {5.0, -5.0, 0.5, 0.05, 0.0}) {
    const Swipe s = swipe(0.3, along, 1.0, 5e-4);
    EXPECT_LE(std::abs(s.tangential), 0.3 * s.normal * (1.0 + 1e-12)) << along;
    EXPECT_GE(s.tangential * along, 0.0);
  }
  // While it slides fast all of it is used.
  const Swipe fast = swipe(0.3, 5.0, 1.0, 5e-4);
  EXPECT_NEAR(fast.tangential / fast.normal, 0.3, 3e-3);
  const Swipe smooth = swipe(0.0, 5.0, 1.0, 5e-4);
  EXPECT_LT(std::abs(smooth.tangential), 1e-4 * smooth.normal);  // the side turns a little
}

TEST(ContactFriction, NeverDrivesTheSlipRound) {
  // Slow slip: friction could stop it many times over; it does not go the other way.
  inputs::Scenario s = bodies(1e-3);
  s.contact.friction = 0.5;
  Train train(s, {CarMotion{100.0, 0.0, 0.0, 0.0, 0.0, 0.0}, CarMotion{100.0, -kWidth - 1e-3, 0.0, 0.05, 1.0, 0.0}});
  double slip = 0.05;
  while (train.time() < 1.0) {
    train.step();
    const double now = train.car(1).vx - train.car(0).vx;
    EXPECT_GE(now, -1e-9);
    EXPECT_LE(now, slip + 2e-3);  // the bodies turn a little
    slip = now;
  }
  EXPECT_GE(train.energy().work_impact_friction, 0.0);
}

TEST(Contact, EachFaceIsNamed) {
  struct Case {
    CarMotion hit;
    Face face;
  };
  const double half = 0.5 * (kLength + kWidth) + 0.01;
  // Car 1 comes end-on from four sides at car 0, which looks along x.
  const std::vector<Case> cases{{{100.0 - kLength - 0.01, 0.0, 0.0, 2.0, 0.0, 0.0}, Face::rear},
                                {{100.0 + kLength + 0.01, 0.0, test::kPi, -2.0, 0.0, 0.0}, Face::front},
                                {{100.0, half, -0.5 * test::kPi, 0.0, -2.0, 0.0}, Face::left},
                                {{100.0, -half, 0.5 * test::kPi, 0.0, 2.0, 0.0}, Face::right}};
  for (const Case& c : cases) {
    Train train(bodies(1e-3), {CarMotion{100.0, 0.0, 0.0, 0.0, 0.0, 0.0}, c.hit});
    train.to(1.0);
    ASSERT_EQ(train.incidents().impacts.size(), 1u);
    EXPECT_EQ(train.incidents().impacts[0].face_a, c.face);
    EXPECT_EQ(train.incidents().impacts[0].face_b, Face::front);
    EXPECT_NEAR(train.incidents().impacts[0].closing_speed_normal, 2.0, 1e-9);
  }
}

TEST(Contact, OffCentreHitTurnsBothCarsAndKeepsTheMomenta) {
  for (const double side : {1.0, -1.0}) {
    Train train(bodies(1e-3),
                {CarMotion{100.0, 0.0, 0.0, 0.0, 0.0, 0.0}, CarMotion{95.0, side * (0.5 * (kLength + kWidth) + 0.01),
                                                                      side * -0.5 * test::kPi, 0.0, side * -3.0, 0.0}});
    const model::Momentum before = train.momentum();
    train.to(2.0);
    const model::Momentum after = train.momentum();
    const double scale = train.model().cars()[0].mass * 3.0;
    EXPECT_NEAR((after.x - before.x) / scale, 0.0, 1e-12);
    EXPECT_NEAR((after.y - before.y) / scale, 0.0, 1e-12);
    EXPECT_NEAR((after.angular - before.angular) / (100.0 * scale), 0.0, 1e-12);
    EXPECT_GT(side * train.car(0).omega, 0.05);  // pushed down behind its centre: the nose comes up
  }
}

TEST(Contact, WhatComesFastIsMetWhenItArrives) {
  // The list of pairs has to know of it beforehand, wherever between two lists the hit falls.
  for (const double gap : {20.0, 21.0, 22.0, 23.0, 24.0}) {
    Train train(bodies(1e-3), {CarMotion{100.0, 0.0, 0.0, -15.0, 1.0, 0.0},
                               CarMotion{100.0 - kLength - gap, 0.0, 0.0, 25.0, 1.0, 0.0}});
    train.to(gap / 40.0 + 0.1);
    ASSERT_EQ(train.incidents().impacts.size(), 1U) << gap;
    EXPECT_NEAR(train.incidents().impacts.front().time, gap / 40.0, 2e-3) << gap;
  }
}

TEST(Contact, AllPairsAreSeen) {
  // A hundred cars abreast in shuffled order, thrown together: the last is as far from the first in the train as it can
  // be.
  const int n = 30;
  inputs::Scenario s = bodies(1e-3, n);
  std::vector<CarMotion> cars(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) {
    const int place = (k * 7) % n;  // 7 and 30 have no common divisor
    cars[static_cast<std::size_t>(k)] = {200.0 + place * (kWidth + 0.05),
                                         3.0 * std::sin(place),
                                         0.5 * test::kPi,
                                         -2.0 * (place - 0.5 * n) / n,
                                         0.0,
                                         0.0};
  }
  Train train(s, cars);
  const model::Momentum p = train.momentum();
  double overlap = 0.0;
  while (train.time() < 4.0) {
    train.to(train.time() + 0.02);
    for (int i = 0; i < n; ++i) {
      for (int j = i + 1; j < n; ++j) {
        const auto f = [&](int k) {
          const CarMotion c = train.car(k);
          return model::Footprint{{c.x, c.y}, {std::cos(c.theta), std::sin(c.theta)}, 0.5 * kLength, 0.5 * kWidth};
        };
        if (const auto t = model::touch(f(i), f(j))) overlap = std::max(overlap, t->depth);
      }
    }
  }
  EXPECT_GT(overlap, 1e-3);
  EXPECT_LT(overlap, 0.1);
  EXPECT_GE(train.incidents().impacts.size(), static_cast<std::size_t>(n - 1));
  const double scale = n * train.model().cars()[0].mass * 2.0;
  EXPECT_NEAR((train.momentum().x - p.x) / scale, 0.0, 1e-12);
  EXPECT_NEAR((train.momentum().y - p.y) / scale, 0.0, 1e-12);
  EXPECT_NEAR((train.momentum().angular - p.angular) / (300.0 * scale), 0.0, 1e-12);
}

}  // namespace
}  // namespace train_derail
