// Ground friction by slip and by patch, and the ground under a moving car.
#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/model/ground_law.hpp"

namespace train_derail {
namespace {

using test::CarMotion;
using test::Train;

constexpr double kHalfGauge = 0.5 * 1.435;

inputs::Ground ground() {
  inputs::Ground g;
  g.in_line_friction = 0.2;
  g.broadside_friction = 0.8;
  g.slip_ratio = 0.4;
  g.far_distance = 2.0;
  return g;
}

TEST(SlipFriction, RunsFromInLineToBroadside) {
  const inputs::Ground g = ground();
  EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 0.0, 0.0), 0.2);
  EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 4.0, 0.0), 0.8);
  EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 10.0, 0.0), 0.8);
  EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 2.0, 0.0), 0.5);  // smoothstep(1/2) = 1/2
  EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 1.0, 0.0), 0.2 + 0.6 * (3.0 / 16.0 - 2.0 / 64.0));
  EXPECT_DOUBLE_EQ(model::slip_friction(g, 0.0, 0.0, 0.0), 0.2);  // at rest
  double before = 0.0;
  for (double across = 0.0; across <= 10.0; across += 0.05) {
    const double mu = model::slip_friction(g, 100.0, across, 0.0);
    EXPECT_GE(mu, before);
    EXPECT_DOUBLE_EQ(mu, model::slip_friction(g, 100.0, -across, 0.0));
    EXPECT_DOUBLE_EQ(mu, model::slip_friction(g, 1.0, 0.1 * across, 0.0));  // a matter of the angle, not of the speed
    before = mu;
  }
}

TEST(SlipFriction, GrowsBeyondTheRail) {
  const inputs::Ground g = ground();
  for (const double side : {1.0, -1.0}) {
    EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 0.0, side * kHalfGauge), 0.2);
    EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 0.0, side * (kHalfGauge + 0.5)), 0.35);
    EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 0.0, side * (kHalfGauge + 2.0)), 0.8);
    EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 0.0, side * 50.0), 0.8);
    // The larger of both counts.
    EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 2.0, side * (kHalfGauge + 0.5)), 0.5);
    EXPECT_DOUBLE_EQ(model::slip_friction(g, 100.0, 2.0, side * (kHalfGauge + 1.5)), 0.65);
  }
}

TEST(Patches, MultiplyWhereTheyOverlap) {
  const std::vector<inputs::GroundPatch> patches{{0.0, 10.0, -5.0, 5.0, 2.0}, {5.0, 20.0, 0.0, 5.0, 0.25}};
  EXPECT_EQ(model::patch_factor({}, 1.0, 1.0), 1.0);
  EXPECT_EQ(model::patch_factor(patches, 1.0, 1.0), 2.0);
  EXPECT_EQ(model::patch_factor(patches, 6.0, 1.0), 0.5);
  EXPECT_EQ(model::patch_factor(patches, 15.0, 1.0), 0.25);
  EXPECT_EQ(model::patch_factor(patches, 15.0, -1.0), 1.0);
  EXPECT_EQ(model::patch_factor(patches, 0.0, -5.0), 2.0);  // from belongs to it, to does not
  EXPECT_EQ(model::patch_factor(patches, 10.0, -1.0), 1.0);
  EXPECT_EQ(model::patch_factor(patches, -0.1, 0.0), 1.0);
}

/// A derailed car that slides: cars past the point of derailment without rails.
inputs::Scenario sliding() {
  inputs::Scenario s = test::bare(1);
  const double v_eps = 1e-6;
  s.ground = ground();
  s.ground.off_track_law = inputs::OffTrackLaw::by_slip;
  s.ground.regularization_speed = v_eps;
  return s;
}

TEST(SlidingCar, InLineOnTheBedSlowsWithTheSmallCoefficient) {
  Train train(sliding(), {CarMotion{50.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
  train.to(2.0);
  EXPECT_NEAR(train.car(0).vx, 20.0 - 2.0 * 0.2 * inputs::kStandardGravity, 1e-9);
  EXPECT_EQ(train.car(0).y, 0.0);
}

TEST(SlidingCar, BroadsideOrFarSlowsWithTheLargeOne) {
  for (const auto& start :
       {CarMotion{50.0, 0.0, 0.5 * test::kPi, 20.0, 0.0, 0.0}, CarMotion{50.0, -9.0, 0.0, 20.0, 0.0, 0.0},
        CarMotion{50.0, 9.0, test::kPi, 20.0, 0.0, 0.0}}) {
    Train train(sliding(), {start});
    train.to(2.0);
    EXPECT_NEAR(train.car(0).vx, 20.0 - 2.0 * 0.8 * inputs::kStandardGravity, 1e-9);
  }
}

TEST(SlidingCar, FeelsThePatchUnderEachTruck) {
  inputs::Scenario s = sliding();
  s.ground.off_track_law = inputs::OffTrackLaw::coulomb;
  s.ground.off_track_friction = 0.4;
  s.ground.patches = {{0.0, 50.0, -5.0, 5.0, 0.5}};  // under the rear truck alone
  Train train(s, {CarMotion{50.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
  EXPECT_NEAR(train.rates_over_a_step(0).vx, -0.5 * (0.4 + 0.2) * inputs::kStandardGravity, 1e-9);
  // Across the axis the weaker rear swings ahead.
  Train across(s, {CarMotion{50.0, 0.0, 0.0, 0.0, 20.0, 0.0}});
  const model::Car& car = across.model().cars()[0];
  const double moment = 0.5 * car.truck_spacing * 0.5 * car.weight * (0.2 - 0.4);  // front (+) slowed more than rear
  EXPECT_NEAR(across.rates_over_a_step(0).omega * car.yaw_inertia / moment, 1.0, 1e-9);
}

TEST(SlidingCar, FindsPatchesAlongTheTrackInCurves) {
  // Radius 100 m to the left from the point of derailment on; the car has gone straight on for 60 m: 16.6 m right of
  // the track, and 54 m along it.
  inputs::Scenario s = sliding();
  s.ground.off_track_law = inputs::OffTrackLaw::coulomb;
  s.ground.off_track_friction = 0.4;
  s.track.curves = {{0.0, 300.0, 1.0 / 100.0}};
  const std::vector<CarMotion> start{CarMotion{60.0, 0.0, 0.0, 20.0, 0.0, 0.0}};
  const auto slowed = [&](const inputs::GroundPatch& patch) {
    s.ground.patches = {patch};
    return -Train(s, start).rates_over_a_step(0).vx / inputs::kStandardGravity;
  };
  EXPECT_NEAR(slowed({40.0, 62.0, -25.0, -10.0, 0.5}), 0.2, 1e-9);  // trucks at 49 and 59 m along the track
  EXPECT_NEAR(slowed({0.0, 100.0, -5.0, 5.0, 0.5}), 0.4, 1e-9);     // on the track, where the car is not
}

TEST(CarsOnCurves, TruckPlacesAreSeenFromTheTrack) {
  inputs::Scenario s = test::on_rails(3);
  s.track.curves = {{-500.0, 1000.0, 1.0 / 200.0}};
  const Train train(s);
  const model::Observation seen = train.model().observe(train.data());
  const model::Car& car = train.model().cars()[0];
  for (const model::CarObservation& c : seen.cars) {
    EXPECT_NEAR(c.front_truck.offset, 0.0, 1e-3);
    EXPECT_NEAR(c.rear_truck.offset, 0.0, 1e-3);
    EXPECT_NEAR(c.front_truck.s - c.rear_truck.s, car.truck_spacing, 0.01);  // arc against chord
    EXPECT_EQ(c.front_truck.load, 0.5 * car.weight);
    EXPECT_NEAR(c.qw * c.qw + c.qz * c.qz, 1.0, 1e-15);
  }
  EXPECT_GT(std::abs(seen.cars[2].y), 1.0);  // which is no distance from the track
}

// Grade: rolls with g sin on rails without resistance, and no faster than resistance allows.
class Grade : public testing::TestWithParam<double> {};

TEST_P(Grade, PullsWithItsSine) {
  const double grade = GetParam(), sine = grade / std::sqrt(1.0 + grade * grade);
  inputs::Scenario s = test::on_rails(3);
  s.track.grade = grade;
  Train train(s, test::in_line(3, -400.0, 20.0));
  const double energy = train.energy().total();
  train.to(8.0);
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(train.car(k).vx, 20.0 - inputs::kStandardGravity * sine * 8.0, 1e-9);
    EXPECT_EQ(train.car(k).y, 0.0);
  }
  double weight = 0.0;
  for (const model::Car& c : train.model().cars()) weight += c.weight;
  EXPECT_NEAR(train.energy().work_grade / (weight * sine * (train.car(0).x + 400.0)), 1.0, 1e-3);
  EXPECT_NEAR(train.energy().total() / energy, 1.0, 1e-12);
}

TEST_P(Grade, ActsOnDerailedCarsToo) {
  const double grade = GetParam(), sine = grade / std::sqrt(1.0 + grade * grade);
  inputs::Scenario s = test::on_rails(1);
  s.track.grade = grade;
  Train train(s, {CarMotion{50.0, 0.0, 0.3, 20.0, 0.0, 0.0}});
  train.to(2.0);
  EXPECT_NEAR(train.car(0).vx, 20.0 - inputs::kStandardGravity * sine * 2.0, 1e-9);
}

INSTANTIATE_TEST_SUITE_P(UpAndDown, Grade, testing::Values(0.02, -0.02, 0.1));

TEST(Grade, HasATerminalSpeedUnderRegularisedResistance) {
  // r W v / sqrt(v^2 + v_eps^2) = W sin: v = v_eps q / sqrt(1 - q^2), q = sin / r.
  for (const double q : {0.3, 0.7, 0.85}) {
    inputs::Scenario s = test::on_rails(1, 5e-3);
    s.ground.regularization_speed = 2.0;
    s.brakes.rolling_resistance = 0.05;
    const double sine = 0.05 * q;
    s.track.grade = -sine / std::sqrt(1.0 - sine * sine);
    const double terminal = 2.0 * q / std::sqrt(1.0 - q * q);
    for (const double start : {0.0, 10.0}) {
      Train train(s, {CarMotion{-5000.0, 0.0, 0.0, start, 0.0, 0.0}});
      train.to(400.0);
      EXPECT_NEAR(train.car(0).vx / terminal, 1.0, 1e-4) << q << " from " << start;
    }
  }
}

TEST(FrictionWeight, GrowsWithAPowerOfTheWeight) {
  inputs::Ground g;
  EXPECT_EQ(model::friction_weight(g, 123456.789), 123456.789);
  g.load_exponent = 0.5;
  g.reference_weight = 1e6;
  EXPECT_DOUBLE_EQ(model::friction_weight(g, 1e6), 1e6);
  EXPECT_DOUBLE_EQ(model::friction_weight(g, 2.5e5), 5e5);
  g.load_exponent = 0.0;
  EXPECT_DOUBLE_EQ(model::friction_weight(g, 2.5e5), 1e6);
}

TEST(FrictionWeight, SlowsALightCarMore) {
  inputs::Scenario s = test::bare(1);
  test::set_friction(s, 0.0, 0.4);
  s.ground.regularization_speed = 1e-3;
  s.ground.load_exponent = 0.5;
  s.ground.reference_weight = 4.0 * s.consist[0].weight;
  s.initial.speed = 20.0;
  Train train(s, {CarMotion{50.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
  train.to(1.0);
  const double slowed = 0.4 * inputs::kStandardGravity * 2.0 * train.time();  // (W_ref / W)^(1/2) = 2
  EXPECT_NEAR(20.0 - train.car(0).vx, slowed, 1e-4 * slowed);
}

}  // namespace
}  // namespace train_derail
