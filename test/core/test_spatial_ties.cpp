// Trucks on the ties and locomotives that pull on, in three dimensions: the closed forms of test_running_on_ties and
// test_traction, what carries such a truck, and how it leaves the track bed; what does not scale with the weight.
#include <cmath>

#include <gtest/gtest.h>

#include "spatial_fixtures.hpp"
#include "ties_fixtures.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/tie_law.hpp"
#include "train_derail/model/traction_law.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::test {
namespace {

using Eigen::Vector3d;
using inputs::FirstTruck;
using model::SpatialMotion;
using model::TieRun;

/// A train without couplers' forces, brakes or resistance, of which one truck runs on the ties.
inputs::Scenario dragging(int cars, double step = 2e-3) {
  inputs::Scenario s = spatial(cars, step);
  s.initial.mechanism = inputs::Mechanism::dragging_truck;
  s.initial.speed = 10.0;
  s.ties.law = inputs::TieLaw::guided;
  s.ties.drag = 0.2;
  s.ground.off_track_friction = 0.5;  // of the ground, which the ties keep it from
  return s;
}

class OneTruckInSpace : public testing::TestWithParam<FirstTruck> {};

TEST_P(OneTruckInSpace, StopsALoneCarUprightInTheLengthThatItsDragSays) {
  inputs::Scenario s = dragging(1);
  s.initial.truck = GetParam();
  SpatialTrain train(s);
  const double start = train.car(0).centre.x(), energy = train.energy().kinetic(), total = train.energy().total();
  train.to(30.0);
  // The drag at the height of the rails presses the truck that leads down and the other up.
  const model::Car car = train.model().cars()[0];
  const double lever = s.ties.drag * car.centre_height / car.truck_spacing;
  const double share = GetParam() == FirstTruck::front ? 0.5 / (1.0 - lever) : 0.5 / (1.0 + lever);
  const double length = 50.0 / (share * s.ties.drag * kGravity);
  EXPECT_NEAR(train.car(0).centre.x() - start, length, 5e-3 * length);
  EXPECT_LT(train.car(0).velocity.norm(), 1e-3);
  EXPECT_NEAR(train.car(0).centre.y(), 0.0, 1e-9);
  EXPECT_NEAR(train.roll(0), 0.0, 1e-9);
  EXPECT_NEAR(train.energy().work_ties, energy, 5e-3 * energy);
  EXPECT_EQ(train.energy().work_on_track, 0.0);
  EXPECT_NEAR(train.energy().total(), total, 1e-5 * energy);
  EXPECT_TRUE(train.model().derailed(0));
  EXPECT_NEAR(train.model().wheel_loads(0).sum(), s.consist[0].weight, 1e-3 * s.consist[0].weight);
  ASSERT_EQ(train.incidents().tie_runs.size(), 1u);
  const TieRun& run = train.incidents().tie_runs[0];
  EXPECT_EQ(run.front, GetParam() == FirstTruck::front);
  EXPECT_NEAR(run.distance, train.car(0).centre.x() - start, 0.05);
  EXPECT_EQ(run.end, TieRun::End::none);
  ASSERT_EQ(train.incidents().derailments.size(), 1u);
  EXPECT_EQ(train.incidents().derailments[0].cause, model::Cause::defect);
}

INSTANTIATE_TEST_SUITE_P(Trucks, OneTruckInSpace, testing::Values(FirstTruck::front, FirstTruck::rear));

TEST(SpatialTies, HoldACarAsRailsWouldUpToTheLimit) {
  inputs::Scenario rails = spatial(1, 1e-4), ties = dragging(1, 1e-4);
  rails.rails.damping_ratio = ties.rails.damping_ratio = ties.ties.damping_ratio = 0.1;
  ties.ties.stiffness = ties.rails.stiffness;
  ties.ties.lateral_ratio = inputs::kInfinity;
  ties.ties.drag = 0.0;
  const std::vector<SpatialMotion> aside{
      at({-500.0, 0.005, height_of(rails)}, turned(0.0005, Vector3d::UnitZ()), {10.0, 0.02, 0.0})};
  SpatialTrain on_rails(rails, aside), on_ties(ties, aside);
  for (int i = 1; i <= 20; ++i) {
    on_rails.to(0.05 * i);
    on_ties.to(0.05 * i);
    EXPECT_NEAR(on_ties.car(0).centre.y(), on_rails.car(0).centre.y(), 1e-12) << i;
    EXPECT_NEAR(on_ties.roll(0), on_rails.roll(0), 1e-12) << i;
  }
  EXPECT_EQ(on_ties.incidents().tie_runs.size(), 1u);
  EXPECT_TRUE(on_rails.incidents().tie_runs.empty());
}

/// Front truck on the ties, whose hold grows to `ratio` times the load within 1 cm; the other truck is free sideways.
inputs::Scenario pushed(double ratio) {
  inputs::Scenario s = dragging(1, 1e-4);
  s.initial.truck = FirstTruck::front;
  s.ties.drag = s.rails.damping_ratio = s.ties.damping_ratio = 0.0;
  s.rails.stiffness = 1.0;
  s.ties.drift_max = 0.05;
  s.ties.lateral_ratio = ratio;
  s.ties.stiffness = 100.0 * ratio * 0.5 * s.consist[0].weight;
  return s;
}
/// The car after a blow at its front truck, which the other truck does not feel. A force as large as the load would
/// stop the truck within 5 cm, a quarter of it within 20 cm; half of that where the car rolls freely under it.
SpatialMotion after_a_blow(const inputs::Scenario& s, double side) {
  const model::Car car = model::expand(s.consist)[0];
  const double load = 0.5 * car.weight, arm = 0.5 * car.truck_spacing;
  const double mobility = 1.0 / car.mass + arm * arm / car.yaw_inertia;
  const double impulse = side * std::sqrt(2.0 * load * 0.05 / mobility);
  return at({-arm, 0.0, height_of(s)}, Eigen::Matrix3d::Identity(), {0.0, impulse / car.mass, 0.0},
            {0.0, 0.0, impulse * arm / car.yaw_inertia});
}

TEST(SpatialTies, GiveWaySidewaysAtTheirLimit) {
  for (const double ratio : {0.25, 4.0}) {
    const inputs::Scenario s = pushed(ratio);
    for (const double side : {1.0, -1.0}) {
      SpatialTrain train(s, {after_a_blow(s, side)});
      const double energy = train.energy().total();
      train.to(0.5);
      ASSERT_EQ(train.incidents().tie_runs.size(), 1u);
      EXPECT_EQ(train.incidents().tie_runs[0].end, ratio < 1.0 ? TieRun::End::drift : TieRun::End::none) << ratio;
      EXPECT_EQ(train.energy().work_kicks, 0.0);
      EXPECT_NEAR(train.energy().total(), energy, 2e-3 * energy);
    }
  }
}

TEST(SpatialTies, HoldATruckWhereItHasDriftedTo) {
  inputs::Scenario s = pushed(0.25);
  s.ties.drift_max = inputs::kInfinity;
  s.ties.damping_ratio = 0.3;
  s.rails = {};
  for (const double side : {1.0, -1.0}) {
    SpatialTrain train(s, {after_a_blow(s, side)});
    const double arm = 0.5 * train.model().cars()[0].truck_spacing;
    double aside = 0.0, farthest = 0.0;
    train.to(5.0, [&] {
      aside = side * train.car(0).point({arm, 0.0, -height_of(s)}).y();
      farthest = std::max(farthest, aside);
    });
    // It has drifted to 1 cm before the farthest, and comes to rest within 1 cm of that.
    EXPECT_GT(farthest, 0.04);
    EXPECT_GT(aside, farthest - 0.02);
    EXPECT_EQ(train.incidents().tie_runs[0].end, TieRun::End::none);
  }
}

TEST(SpatialTies, AnObstacleThrowsATruckToTheSideAndTearsTheTrack) {
  inputs::Scenario s = dragging(2);
  put_obstacles(s);
  s.coupler.pitch_stiffness = s.coupler.roll_stiffness = 0.0;
  s.initial.truck = FirstTruck::front;
  SpatialTrain train(s);
  const auto aside = [](const SpatialTrain& t, double arm) {
    return t.car(0).velocity.y() + arm * t.car(0).rotation.z();
  };
  expect_a_throw_and_torn_track(train, aside, 1e-3);
}

TEST(SpatialTies, PartTheBrakePipe) {
  inputs::Scenario s = dragging(1, 0.01);
  s.ties.drag = 0.0;
  s.ties.parting_rate = 100.0;  // at once
  s.brakes.dead_time = s.brakes.build_up_time = 0.0;
  s.initial.truck = FirstTruck::rear;
  SpatialTrain train(s);
  train.to(2.0);
  // The front truck brakes, with its half of the weight; the other is on the ties.
  EXPECT_NEAR(train.car(0).velocity.x(), 10.0 - 2.0 * 0.5 * s.brakes.force * kGravity, 0.1 * s.brakes.force * kGravity);
}

TEST(SpatialTies, OnBadTrackTrucksLeaveByChanceAsInThePlane) {
  inputs::Scenario s = everything(20, 2e-3);
  s.initial.mechanism = inputs::Mechanism::bad_track;
  s.initial.bad_track_length = 30.0;
  s.initial.truck_probability = 0.6;
  s.ties.law = inputs::TieLaw::guided;
  s.brakes.emergency_time.reset();
  SpatialTrain space(s);
  inputs::Scenario flat = s;
  flat.model = inputs::Model::extended;
  flat.terrain = {};
  Train plane(flat);
  space.to(8.0);
  plane.to(8.0);
  const auto& in_space = space.incidents().derailments;
  const auto& in_plane = plane.incidents().derailments;
  ASSERT_GT(in_plane.size(), 4u);
  ASSERT_EQ(in_space.size(), in_plane.size());
  for (std::size_t i = 0; i < in_plane.size(); ++i) {
    EXPECT_EQ(in_space[i].car, in_plane[i].car) << i;
    EXPECT_EQ(in_space[i].front, in_plane[i].front) << i;
    EXPECT_EQ(in_space[i].cause, in_plane[i].cause) << i;
    EXPECT_NEAR(in_space[i].time, in_plane[i].time, 0.01) << i;
  }
  EXPECT_EQ(space.incidents().tie_runs.size(), in_space.size());
}

TEST(SpatialTies, ARunOfAllOfItClosesItsLedgerAndGoesOnBitForBit) {
  inputs::Scenario s = everything(20, 2e-3, true);
  s.initial.mechanism = inputs::Mechanism::bad_track;
  s.initial.truck_probability = 0.5;
  s.ties.law = inputs::TieLaw::guided;
  s.ties.lateral_ratio = 0.1;  // so that they drift
  s.ties.parting_rate = 0.002;
  s.obstacles.rate = 0.05;
  s.obstacles.throw_probability = 0.04;
  s.ground.load_exponent = 0.7;
  s.rails.load_exponent = 0.4;
  s.consist.front().name = "locomotive";
  s.traction.law = inputs::TractionLaw::steady;
  int thrown_off = 0;
  for (const int seed : {1, 2, 3}) {
    s.initial.perturbation.seed = seed;
    simulation::Simulation whole(s), first(s);
    first.advance(3.0);
    EXPECT_GT(first.outcome().on_ties.trucks, first.outcome().on_ties.thrown_off) << "some are on their way";
    simulation::Simulation second(s, first.checkpoint());
    whole.advance(200.0);
    second.advance(200.0);
    for (std::size_t k = 0; k < whole.snapshot().cars.size(); ++k) {
      EXPECT_EQ(second.snapshot().cars[k].x, whole.snapshot().cars[k].x) << k;
      EXPECT_EQ(second.snapshot().cars[k].qx, whole.snapshot().cars[k].qx) << k;
    }
    const outcome::Outcome o = whole.outcome();
    EXPECT_EQ(second.outcome().energy.work_ties, o.energy.work_ties);
    EXPECT_GT(o.on_ties.trucks, 0);
    EXPECT_NE(o.energy.work_ties, 0.0);
    EXPECT_LT(o.energy_residual, 1e-3);
    thrown_off += o.on_ties.thrown_off;
  }
  EXPECT_GT(thrown_off, 0);
}

inputs::Scenario held(double grade, double drag) {
  inputs::Scenario s = dragging(1, 5e-3);
  hold_by_a_locomotive(s, grade, drag);
  s.coupler.pitch_stiffness = s.coupler.roll_stiffness = 0.0;
  return s;
}

double speed_of(const SpatialTrain& train, const inputs::Scenario& s) {
  return train.momentum().linear.x() * kGravity / weight_of(s);
}

TEST(SpatialTraction, HoldsTheTrainAtItsSpeedOnAnyGradeUntilTheSignalComes) {
  for (const double grade : {0.0, 0.006, -0.006}) {
    inputs::Scenario s = held(grade, 0.002);
    s.brakes.emergency_time = 20.0;
    SpatialTrain train(s);
    const double energy = train.energy().total();
    train.to(20.0);
    EXPECT_NEAR(speed_of(train, s), 6.0, 5e-3) << grade;
    train.to(30.0);
    EXPECT_NEAR(speed_of(train, s), 6.0 - 10.0 * (grade + 0.002) * kGravity, 0.02) << grade;
    EXPECT_NEAR(train.energy().total(), energy, 1e-4 * energy) << grade;
    EXPECT_EQ(train.energy().work_off_track, 0.0) << grade;
  }
}

TEST(SpatialTraction, HoldsTheTrainOnGradesThatRiseAndFall) {
  for (const double grade : {0.006, -0.006}) {
    inputs::Scenario s = held(0.0, 0.002);
    s.track.grades = {{-2000.0, 4000.0, grade}};
    s.brakes.emergency_time = 100.0;
    SpatialTrain train(s);
    train.to(20.0);
    EXPECT_NEAR(speed_of(train, s), 6.0, 5e-3) << grade;
  }
}

TEST(SpatialTraction, ADerailedLocomotivePullsNoMore) {
  inputs::Scenario s = held(0.006, 0.002);
  s.initial.cars_ahead = 0;
  SpatialTrain train(s);
  train.to(20.0);
  EXPECT_NEAR(speed_of(train, s), 6.0 - 20.0 * (0.006 + 0.002) * kGravity, 0.02);
}

TEST(SpatialWeight, FrictionOnTheGroundGoesWithItsPower) {
  inputs::Scenario s = spatial(1, 1e-3);
  s.ground.load_exponent = 0.5;
  s.ground.off_track_friction = 0.3;
  s.consist[0].weight = 0.25 * s.ground.reference_weight;  // so it has twice the friction of Coulomb's law
  // On its wheels on the ground, far ahead of the point of derailment.
  SpatialTrain train(s, {at({60.0, 0.0, height_of(s)}, Eigen::Matrix3d::Identity(), {20.0, 0.0, 0.0})});
  train.to(1.0);
  const double before = train.car(0).velocity.x();
  train.to(2.5);
  EXPECT_NEAR((before - train.car(0).velocity.x()) / 1.5, 2.0 * 0.3 * kGravity, 0.01 * kGravity);
}

TEST(SpatialWeight, RailsHoldALightCarByItsPower) {
  // A car of a quarter of the weight beside the middle of the track: with power 1/2 the rails hold twice as much.
  for (const double power : {1.0, 0.5}) {
    inputs::Scenario s = spatial(1, 1e-4);
    s.consist[0].weight = 0.25 * s.rails.reference_weight;
    s.rails.load_exponent = power;
    const double aside = 0.01, ratio = s.rails.stiffness * aside / (0.5 * s.consist[0].weight);
    s.rails.derail_ratio = ratio / 1.4;
    s.rails.derail_time = 1e-3;
    SpatialTrain train(s, {at({-500.0, aside, height_of(s)}, Eigen::Matrix3d::Identity(), {10.0, 0.0, 0.0})});
    train.to(0.01);
    EXPECT_EQ(train.model().derailed(0), power == 1.0) << power;
  }
}

}  // namespace
}  // namespace train_derail::test
