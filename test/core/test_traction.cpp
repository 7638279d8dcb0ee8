// Locomotives that go on as before: what they hold, what they pull at lower speeds, and what ends it.
#include <cmath>

#include <gtest/gtest.h>

#include "ties_fixtures.hpp"
#include "train_derail/model/traction_law.hpp"

namespace train_derail {
namespace {

using inputs::kStandardGravity;
using test::Train;

using test::weight_of;

constexpr double kResistance = test::kHeldResistance;

inputs::Scenario held(double grade, double drag) {
  inputs::Scenario s = test::on_rails(1, 5e-3);
  test::hold_by_a_locomotive(s, grade, drag);
  s.ground.regularization_speed = 1e-4;
  return s;
}

double speed_of(const Train& train, const inputs::Scenario& s) {
  return train.momentum().x * kStandardGravity / weight_of(s);
}

TEST(TractionLaw, KeepsThePowerOfAPullAndTheForceOfAHold) {
  EXPECT_DOUBLE_EQ(model::held_force(0.002, 0.0, 1e7), 2e4);
  EXPECT_DOUBLE_EQ(model::held_force(0.0, -0.75, 1e7), -6e6);  // sine 0.6
  EXPECT_DOUBLE_EQ(model::traction_force(2e4, 1e5, 6.0, 6.0), 2e4);
  EXPECT_DOUBLE_EQ(model::traction_force(2e4, 1e5, 6.0, 3.0), 4e4);
  EXPECT_DOUBLE_EQ(model::traction_force(2e4, 1e5, 6.0, 1.0), 1e5);
  EXPECT_DOUBLE_EQ(model::traction_force(2e4, 1e5, 6.0, 0.0), 1e5);
  EXPECT_DOUBLE_EQ(model::traction_force(-2e4, 1e5, 6.0, 3.0), -2e4);
  EXPECT_DOUBLE_EQ(model::traction_force(-2e5, 1e5, 6.0, 3.0), -1e5);
  EXPECT_EQ(model::traction_force(-2e4, 1e5, 6.0, 0.0), 0.0);
  EXPECT_EQ(model::traction_force(0.0, 1e5, 6.0, 0.0), 0.0);
}

TEST(Traction, HoldsTheTrainAtItsSpeedOnAnyGrade) {
  for (const double grade : {0.0, 0.006, -0.006}) {
    const inputs::Scenario s = held(grade, kResistance);
    Train train(s);
    const double energy = train.energy().total();
    train.to(30.0);
    EXPECT_NEAR(speed_of(train, s), 6.0, 2e-3) << grade;
    EXPECT_NEAR(train.energy().total(), energy, 1e-4 * energy) << grade;
  }
}

TEST(Traction, WithADragSettlesWherePowerAndResistanceAgree) {
  // (F_0 + D) v = F_0 v_0.
  const inputs::Scenario s = held(0.006, 0.05);
  Train train(s);
  const double energy = train.energy().total();
  train.to(400.0);
  const double f0 = model::held_force(kResistance, 0.006, weight_of(s)),
               drag = (0.05 - kResistance) * 0.5 * s.consist[1].weight;
  EXPECT_NEAR(speed_of(train, s), 6.0 * f0 / (f0 + drag), 0.02);
  EXPECT_NEAR(train.energy().total(), energy, 1e-3 * energy);
}

TEST(Traction, StallsWhereTheResistanceIsMoreThanAdhesionHolds) {
  inputs::Scenario s = held(0.006, 0.4);
  const double resistance =
      model::held_force(kResistance, 0.006, weight_of(s)) + (0.4 - kResistance) * 0.5 * s.consist[1].weight;
  const double of_weight = resistance / s.consist[0].weight;
  s.traction.adhesion = 1.1 * of_weight;
  Train goes_on(s);
  goes_on.to(120.0);
  EXPECT_GT(speed_of(goes_on, s), 0.1);
  s.traction.adhesion = 0.9 * of_weight;
  Train stalls(s);
  stalls.to(120.0);
  EXPECT_LT(speed_of(stalls, s), 0.01);
}

/// Nothing pulls from the time `from` on [s]: for 20 s it coasts uphill.
void coasts_from(double from, const inputs::Scenario& s) {
  Train train(s);
  train.to(from + 20.0);
  EXPECT_NEAR(speed_of(train, s), 6.0 - 20.0 * (0.006 + kResistance) * kStandardGravity, 0.02);
}

TEST(Traction, EndsWhenTheEmergencySignalComes) {
  inputs::Scenario s = held(0.006, kResistance);
  s.brakes.emergency_time = 10.0;
  coasts_from(10.0, s);
}

TEST(Traction, ADerailedLocomotivePullsNoMore) {
  inputs::Scenario s = held(0.006, kResistance);
  s.initial.cars_ahead = 0;
  coasts_from(0.0, s);
}

TEST(Traction, NeedsALocomotive) {
  inputs::Scenario s = held(0.006, kResistance);
  s.consist[0].name = "car";
  coasts_from(0.0, s);
}

}  // namespace
}  // namespace train_derail
