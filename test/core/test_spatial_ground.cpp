// Cars off the rails and the ground beside the track against closed forms: tipping, rolling, sliding, cross-sections,
// maps.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "model/ground_point.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/spatial_bed.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/track.hpp"

namespace train_derail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using model::SpatialMotion;
using test::at;
using test::height_of;
using test::spatial;
using test::turned;
using Train = test::SpatialTrain;
using test::kGravity;
using test::make_tanks;

// Off the rails

/// Ground and springs that hardly give, friction that holds.
inputs::Scenario rigid(int cars, double step = 2e-4) {
  inputs::Scenario s = spatial(cars, step);
  s.ground.off_track_friction = 10.0;
  s.suspension.stiffness = 1e9;
  s.suspension.damping_ratio = 2.0;
  s.terrain.body_stiffness = 1e9;
  s.terrain.body_damping_ratio = 2.0;
  return s;
}

TEST(OffTheRails, ACarTipsOnTheBankOfTheClosedForm) {
  for (const double share : {0.97, 1.03}) {
    inputs::Scenario s = rigid(1);
    const double h = height_of(s), slope = share * s.suspension.half_base / h, angle = std::atan(slope);
    s.terrain.bank_slope = slope;
    s.terrain.bank_left = 50.0;
    const Matrix3d axes = turned(-angle, Vector3d::UnitX());
    const double offset = s.terrain.crown + 20.0;
    const Vector3d foot(50.0, offset, -s.terrain.rail_height - 20.0 * slope);
    Train train(s, {at(foot + h * axes.col(2), axes)});
    train.to(4.0);
    const double lean = std::abs(train.roll(0)) - angle;
    if (share < 1.0) EXPECT_LT(std::abs(lean), 0.05);
    else EXPECT_GT(lean, 0.5);
  }
}

TEST(GroundPoint, PushesAlongTheNormalAndHoldsUpToItsFriction) {
  using V = model::Three<double>;
  const double stiffness = 2e6, step = 0.01, slope = 0.75, length = 1.25;  // of (0, -slope, 1)
  const auto vector = [](const V& v) { return Vector3d(v.x, v.y, v.z); };
  const Vector3d up(0.0, -slope, 1.0), along(0.0, 0.8, 0.6);
  model::GroundPoint<double> p{{up.x(), up.y(), up.z()}, 1.0 / length, {}, {}, 4e4, 500.0, 3e3};
  const auto push = [&](const Vector3d& v, const Vector3d& strain) {
    p.velocity = {v.x(), v.y(), v.z()};
    p.strain = {strain.x(), strain.y(), strain.z()};
    return model::push_of_ground(p, stiffness, step, [](const V&) { return 0.5; });
  };
  const auto still = push(Vector3d::Zero(), Vector3d::Zero());
  EXPECT_DOUBLE_EQ(still.push, 4e4);
  EXPECT_DOUBLE_EQ(still.carried, 4e4 * length);
  EXPECT_EQ(vector(still.rub).norm(), 0.0);
  // Sinks in: damped. Comes out fast: does not pull. Neither rubs.
  EXPECT_DOUBLE_EQ(push(-2.0 * up / length, Vector3d::Zero()).push, 4e4 + 500.0 * 2.0 * length);
  EXPECT_EQ(push(100.0 * up, Vector3d::Zero()).push, 0.0);
  EXPECT_LT(vector(push(-2.0 * up, Vector3d::Zero()).rub).norm(), 1e-9);
  // Uphill, slowly: a spring and a damper against it. A strain across the ground is none.
  const auto holds = push(0.1 * along, 1e-3 * along + 5e-3 * up);
  EXPECT_LT((vector(holds.rub) + (stiffness * 2e-3 + 300.0) * along).norm(), 1e-6);
  EXPECT_LT((vector(holds.strain) - 2e-3 * along).norm(), 1e-12);
  // It slides: friction, and no more strain than gives that.
  const auto slides = push(8.0 * along, Vector3d::Zero());
  EXPECT_LT((vector(slides.rub) + 0.5 * 4e4 * length * along).norm(), 1e-6);
  EXPECT_LT((stiffness * vector(slides.strain) + vector(slides.rub)).norm(), 1e-6);
}

TEST(Terrain, BallastLiesOnTheRoadbed) {
  inputs::Terrain t;
  t.rail_height = 0.2;
  t.ballast_height = 0.6;
  t.ballast_half_width = 1.6;
  t.ballast_slope = 0.5;
  t.crown = 4.0;
  t.bank_left = 2.0;
  t.bank_right = -1.0;
  t.bank_slope = 0.5;
  const struct {
    double offset, z, slope;
  } places[] = {{1.0, -0.2, 0.0},  {2.0, -0.4, -0.5}, {3.0, -0.8, 0.0},   {5.0, -1.3, -0.5}, {9.0, -2.8, 0.0},
                {-2.0, -0.4, 0.5}, {-3.0, -0.8, 0.0}, {-5.0, -0.3, -0.5}, {-7.0, 0.2, 0.0}};
  for (const auto& p : places) {
    EXPECT_NEAR(model::ground_height(model::CrossSection(t), p.offset).z, p.z, 1e-12) << p.offset;
    EXPECT_NEAR(model::ground_height(model::CrossSection(t), p.offset).slope, p.slope, 1e-12) << p.offset;
    EXPECT_LE(p.z, model::highest_ground(t));
  }
  EXPECT_NEAR(model::highest_ground(t), 0.2, 1e-12);
  EXPECT_FALSE(model::level(t));
  // Without a jump, also where the ballast is wider than the crown.
  t.crown = 2.0;
  for (double o = -12.0; o < 12.0; o += 0.01)
    EXPECT_LT(std::abs(model::ground_height(model::CrossSection(t), o + 0.01).z -
                       model::ground_height(model::CrossSection(t), o).z),
              0.0051)
        << o;
}

TEST(OffTheRails, ACarWithOneSideDownTheBallastTipsAtTheClosedForm) {
  // Wheels of one side on the ballast, of the other at its foot: over if the line from the centre of mass falls
  // outside.
  for (const double share : {0.96, 1.04}) {
    inputs::Scenario s = rigid(1);
    const double h = height_of(s), b = s.suspension.half_base, angle = share * std::atan2(b, h);
    s.terrain.ballast_slope = 10.0;
    s.terrain.ballast_height = 2.0 * b * std::sin(angle);
    const Matrix3d axes = turned(-angle, Vector3d::UnitX());
    const Vector3d inner(50.0, s.terrain.ballast_half_width - 0.5, -s.terrain.rail_height);
    Train train(s, {at(inner + b * axes.col(1) + h * axes.col(2), axes)});
    train.to(4.0);
    const double lean = std::abs(train.roll(0)) - angle;
    if (share < 1.0) EXPECT_LT(std::abs(lean), 0.05);
    else EXPECT_GT(lean, 0.5);
  }
}

/// A car without trucks there: it has lost them in the air.
Train without_trucks(inputs::Scenario s, const SpatialMotion& car) {
  s.suspension.part_angle = 0.1;
  Train aloft(s, {at(test::kAloft, turned(0.2, Vector3d::UnitX()))});
  aloft.step();
  EXPECT_TRUE(aloft.model().truck_lost(0, true) && aloft.model().truck_lost(0, false));
  return {s, aloft, {car}};
}

/// Its underframe is 0.8 m below the floor and narrower.
inputs::Scenario on_a_narrow_underframe() {
  inputs::Scenario s = rigid(1);
  s.consist[0].floor_height = 1.1;
  s.consist[0].underframe_height = 0.3;
  s.consist[0].underframe_width = 1.2;
  return s;
}

/// So much higher is its centre of mass without trucks, which have theirs at the axles of 36 in wheels [m].
double rise_without_trucks(const inputs::Scenario& s) {
  const double trucks = 2.0 * *s.consist[0].truck_weight;
  return trucks / (s.consist[0].weight - trucks) * (height_of(s) - 0.4572);
}

TEST(OffTheRails, ABodyThatLosesItsTrucksIsLighterByThem) {
  inputs::Scenario s = rigid(1, 1e-4);
  s.consist[0].truck_weight = 15.0 * inputs::kKip;
  s.suspension.part_angle = 0.5;
  const inputs::CarBlock& block = s.consist[0];
  const double share = 1.0 - 2.0 * *block.truck_weight / block.weight, rise = rise_without_trucks(s);
  // Aloft it rolls on, until they part; then nothing else happens to it.
  const Vector3d velocity(3.0, -1.0, 2.0), rates(1.0, 0.3, -0.2);
  Train train(s, {at(test::kAloft, Matrix3d::Identity(), velocity, rates)});
  const double energy = train.energy().total(), mass = train.momentum().linear.x() / velocity.x();
  model::SpatialMomentum before;
  SpatialMotion car = train.car(0);
  for (before = train.momentum(); !train.model().truck_lost(0, true); train.step()) {
    ASSERT_LT(train.time(), 1.0);
    before = train.momentum();
    car = train.car(0);
  }
  EXPECT_NEAR(train.roll(0), 0.5, 0.05);
  const SpatialMotion after = train.car(0);
  // Nobody sees it jump.
  EXPECT_LT((after.centre - car.centre - 1e-4 * car.velocity).norm(), 1e-6);
  EXPECT_LT((after.velocity - car.velocity).norm(), 1e-2);
  EXPECT_LT((after.rotation - car.rotation).norm(), 1e-3);
  EXPECT_NEAR(train.model().observe(train.data()).cars[0].x, after.centre.x(), 1e-12);
  // It has the momentum of a lighter body whose centre is higher.
  const Vector3d centre = after.centre + rise * after.axes.col(2),
                 moves = after.velocity + after.rotation.cross(rise * after.axes.col(2));
  const model::SpatialMomentum left = train.momentum();
  EXPECT_LT((left.linear - share * mass * moves).norm() / left.linear.norm(), 1e-9);
  const model::Car whole = model::expand(s.consist)[0];
  const Vector3d inertia(whole.roll_inertia, whole.yaw_inertia, whole.yaw_inertia);
  const Vector3d spin = after.axes * share * inertia.cwiseProduct(after.body_rates);
  EXPECT_LT((left.angular - centre.cross(left.linear) - spin).norm() / spin.norm(), 1e-9);
  // What the trucks took along: the rest of its motion and weight.
  const auto motion = [&](double m, const Vector3d& v, const Vector3d& w) {
    return 0.5 * m * v.squaredNorm() + 0.5 * m / mass * w.dot(inertia.cwiseProduct(w));
  };
  const double height = (after.centre.z() - whole.centre_height) - share * (centre.z() - whole.centre_height - rise);
  EXPECT_NEAR(train.energy().work_trucks / (motion(mass, after.velocity, after.body_rates) -
                                            motion(share * mass, moves, after.body_rates) + height * whole.weight),
              1.0, 1e-6);
  // From here on its centre falls freely.
  const double from = train.time();
  train.to(from + 1.0);
  const SpatialMotion end = train.car(0);
  const double t = train.time() - from;
  const Vector3d fallen = centre + t * moves - Vector3d(0.0, 0.0, 0.5 * kGravity * t * t);
  EXPECT_LT((end.centre + rise * end.axes.col(2) - fallen).norm(), 2e-3);
  EXPECT_NEAR(train.energy().total() / energy, 1.0, 1e-4);
}

TEST(OffTheRails, ABodyWithoutTrucksLiesThereWithTheWeightOfTheRest) {
  inputs::Scenario s = rigid(1);
  s.consist[0].truck_weight = 20.0 * inputs::kKip;
  const inputs::CarBlock& block = s.consist[0];
  const model::Car car = model::expand(s.consist)[0];
  const double above = height_of(s) - car.underframe_height;
  Train train = without_trucks(s, at({200.0, 40.0, above - s.terrain.rail_height}));
  train.to(3.0);
  EXPECT_LT(std::abs(train.roll(0)), 1e-3);
  // Six points of the underframe carry it.
  const double rest = block.weight - 2.0 * *block.truck_weight;
  EXPECT_NEAR(train.energy().suspension / (0.5 * rest * rest / (6.0 * s.terrain.body_stiffness)), 1.0, 1e-3);
}

TEST(OffTheRails, ABodyWithoutTrucksTipsOverItsUnderframe) {
  for (const bool narrow : {true, false}) {
    for (const double share : {0.97, 1.03}) {
      inputs::Scenario s = on_a_narrow_underframe();
      s.terrain.body_friction = 10.0;
      inputs::CarBlock& block = s.consist[0];
      block.truck_weight = 10.0 * inputs::kKip;
      if (!narrow) block.underframe_height = block.floor_height;  // none
      const double above = height_of(s) - *block.underframe_height, h = above + rise_without_trucks(s),
                   slope = share * 0.5 * (narrow ? *block.underframe_width : block.width) / h, angle = std::atan(slope);
      s.terrain.bank_slope = slope;
      s.terrain.bank_left = 50.0;
      const Matrix3d axes = turned(-angle, Vector3d::UnitX());
      const Vector3d foot(50.0, s.terrain.crown + 0.5 * s.terrain.bank_left / slope,
                          -s.terrain.rail_height - 0.5 * s.terrain.bank_left);
      Train train = without_trucks(s, at(foot + above * axes.col(2), axes));
      train.to(4.0);
      const double lean = std::abs(train.roll(0)) - angle;
      if (share < 1.0) EXPECT_LT(std::abs(lean), 0.05) << narrow;
      else EXPECT_GT(lean, 0.5) << narrow;
    }
  }
}

TEST(OffTheRails, ABodyWithoutTrucksLeansUntilItsFloorIsOnTheGround) {
  inputs::Scenario s = on_a_narrow_underframe();
  // Its centre is then between the two edges that it lies on, and its swing does not throw it over.
  s.consist[0].centre_height = 2.3;
  s.consist[0].underframe_height = 0.7;
  s.consist[0].underframe_width = 1.0;
  const inputs::CarBlock& block = s.consist[0];
  const double deep = *block.floor_height - *block.underframe_height,
               beside = 0.5 * (block.width - *block.underframe_width);
  const double lean = std::atan(deep / beside);
  for (const double way : {1.0, -1.0}) {
    for (const double share : {0.9, 1.0}) {
      const Matrix3d axes = turned(-way * share * lean, Vector3d::UnitX());
      const Vector3d edge(0.0, way * 0.5 * *block.underframe_width, *block.underframe_height - height_of(s));
      Train train = without_trucks(s, at(Vector3d(200.0, 40.0, -s.terrain.rail_height) - axes * edge, axes));
      train.to(4.0);
      EXPECT_NEAR(train.roll(0), -way * lean, 0.01) << share;
      EXPECT_LT(train.car(0).velocity.norm(), 1e-4);
    }
  }
}

TEST(OffTheRails, ALateralTripOverturnsAtTheSpeedOfTheFormula) {
  const inputs::Scenario s = rigid(1, 1e-4);
  const model::Car car = model::expand(s.consist)[0];
  const double h = car.centre_height, b = s.suspension.half_base, r = std::hypot(h, b);
  const double about_edge = car.roll_inertia + car.mass * r * r;
  const double trip = std::sqrt(2.0 * kGravity * (r - h) * about_edge / (car.mass * h * h));
  EXPECT_NEAR(trip, 1.9, 0.1);
  for (const double share : {0.93, 1.07}) {
    Train train(s, {at({50.0, 0.0, h - s.terrain.rail_height}, Matrix3d::Identity(), {0.0, share * trip, 0.0})});
    double most = 0.0;
    train.to(4.0, [&] { most = std::max(most, std::abs(train.roll(0))); });
    if (share < 1.0) EXPECT_LT(most, std::atan2(b, h) + 0.02) << share;
    else EXPECT_GT(most, 1.0) << share;
  }
}

/// Heights of f at the knots of a grid about the point of derailment.
template <class F>
inputs::TerrainGrid grid_of(F f, double spacing, int along, int across) {
  inputs::TerrainGrid grid;
  grid.spacing = spacing;
  grid.x_from = -along * spacing;
  grid.y_from = -across * spacing;
  for (int i = -along; i <= along; ++i) {
    std::string& row = grid.rows.emplace_back().heights;
    for (int j = -across; j <= across; ++j) row += std::to_string(f(i * spacing, j * spacing)) + " ";
  }
  return grid;
}

/// On a bank, or on a map that has the same slope.
class OnASlope : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(OffTheRails, OnASlope, testing::Bool(),
                         [](const auto& map) { return map.param ? "Map" : "Bank"; });

TEST_P(OnASlope, ACylinderRollsDownAtTwoThirdsOfGSine) {
  inputs::Scenario s = spatial(1);
  s.terrain.bank_left = 60.0;
  s.terrain.crown = 1.0;
  s.terrain.bank_slope = 0.3;
  s.terrain.body_friction = 0.6;
  s.terrain.rolling_resistance = 0.0;
  inputs::CarBlock& tank = s.consist[0];
  const double mass = tank.weight / kGravity, radius = 1.5;
  tank.width = 2.0 * radius;
  tank.floor_height = 1.0;
  tank.roof_height = 1.0 + 2.0 * radius;
  tank.centre_height = 1.0 + radius;
  const double angle = std::atan(s.terrain.bank_slope);
  if (GetParam()) {
    s.terrain.bank_left = 0.0;
    s.terrain.grid =
        grid_of([&](double, double y) { return -s.terrain.rail_height - s.terrain.bank_slope * (y - s.terrain.crown); },
                5.0, 40, 20);
  }
  // It lies on its roof, so that its trucks hang and part from it.
  for (const double hollow : {0.5, 1.0}) {
    tank.shape = inputs::BodyShape::cylinder;
    tank.roll_inertia = hollow * mass * radius * radius;
    const double left = 20.0, under = -s.terrain.rail_height - s.terrain.bank_slope * (left - 1.0);
    const Vector3d centre(100.0, left, under + radius / std::cos(angle));
    Train train(s, {at(centre, turned(M_PI - angle, Vector3d::UnitX()))});
    train.to(1.0);
    EXPECT_TRUE(train.model().truck_lost(0, true) && train.model().truck_lost(0, false));
    const double before = train.car(0).velocity.norm();
    train.to(3.0);
    const double gained = 0.5 * (train.car(0).velocity.norm() - before);
    EXPECT_NEAR(gained / (kGravity * std::sin(angle)), 1.0 / (1.0 + hollow), 0.01);
    EXPECT_NEAR(std::abs(train.car(0).rotation.x()) * radius, train.car(0).velocity.norm(), 0.02);
    tank.shape = inputs::BodyShape::box;
    Train box(s, {at(centre, turned(M_PI - angle, Vector3d::UnitX()))});
    box.to(3.0);
    EXPECT_LT(box.car(0).velocity.norm(), 0.1) << "lies on its roof";
  }
}

TEST(OffTheRails, ARollingTankSlowsDownAndStops) {
  inputs::Scenario s = spatial(1);
  make_tanks(s);
  s.terrain.rolling_resistance = 0.1;
  const double mass = s.consist[0].weight / kGravity, radius = 1.5, hollow = 0.8, speed = 3.0;
  s.consist[0].roll_inertia = hollow * mass * radius * radius;
  // On its roof, so that its trucks hang and part from it.
  const double sink = s.consist[0].weight / (3.0 * s.terrain.body_stiffness);
  const Vector3d centre(100.0, 20.0, radius - sink - s.terrain.rail_height);
  for (const double way : {1.0, -1.0}) {
    Train train(
        s, {at(centre, turned(M_PI, Vector3d::UnitX()), {0.0, way * speed, 0.0}, {-way * speed / radius, 0.0, 0.0})});
    train.to(1.0);
    const double before = train.car(0).velocity.y();
    train.to(2.0);
    const double slowing = 0.1 * kGravity / (1.0 + hollow);
    EXPECT_NEAR((before - train.car(0).velocity.y()) * way / slowing, 1.0, 0.02);
    train.to(16.0);
    const Vector3d end = train.car(0).centre;
    EXPECT_NEAR((end.y() - 20.0) * way, 0.5 * speed * speed / slowing, 0.5);
    EXPECT_LT(train.car(0).velocity.norm(), 1e-3);
    train.to(18.0);
    EXPECT_LT((train.car(0).centre - end).norm(), 1e-3);
  }
}

TEST(OffTheRails, ATankBalancedOnTheBallastComesToRestByTheClosedForm) {
  inputs::Scenario s = spatial(1, 2e-3);
  make_tanks(s);
  s.terrain.rolling_resistance = 0.1;
  s.terrain.ballast_height = 0.6;
  s.terrain.ballast_half_width = 1.6;
  const double radius = 1.5, weight = s.consist[0].weight, mass = weight / kGravity;
  const double inertia = model::expand(s.consist)[0].yaw_inertia, arm = 0.1 * 0.1 * radius;
  // On its roof, across the track: only its middle touches the ground. It turns on the spot, or rolls on its middle.
  const Matrix3d axes = turned(0.5 * M_PI, Vector3d::UnitZ()) * turned(M_PI, Vector3d::UnitX());
  const Vector3d centre(100.0, 0.0, radius - weight / s.terrain.body_stiffness - s.terrain.rail_height);
  for (const bool turns : {true, false}) {
    const double rate = turns ? 0.05 : -0.015, moved = inertia + (turns ? 0.0 : mass * radius * radius);
    const double slows = weight * arm / moved, time = std::abs(rate) / slows, angle = 0.5 * std::abs(rate) * time;
    const Vector3d about = turns ? Vector3d::UnitZ() : Vector3d::UnitX(),
                   velocity(0.0, turns ? 0.0 : -rate * radius, 0.0);
    Train train(s, {at(centre, axes, velocity, axes.transpose() * (rate * about))});
    const auto rotation = [&] { return train.car(0).rotation.dot(about); };
    train.to(0.5 * time);
    EXPECT_NEAR(rotation() / rate, 0.5, 0.03) << turns;
    train.to(time + 12.0);
    EXPECT_TRUE(train.car(0).rotation.isZero(0.0) && train.car(0).velocity.isZero(0.0)) << "held";
    const Vector3d along = train.car(0).axes.col(0);
    // The strain that is left turns it back.
    EXPECT_NEAR(std::asin(turns ? -along.x() : -along.z()), angle - arm / radius, 0.003) << turns;
  }
}

TEST(OffTheRails, ATankRestsOnWhatIsLessSteepThanItsRollingResistance) {
  for (const double share : {0.9, 1.1}) {
    inputs::Scenario s = spatial(1);
    make_tanks(s);
    s.terrain.rest_speed = 0.0;
    s.terrain.bank_left = 60.0;
    s.terrain.crown = 1.0;
    s.terrain.bank_slope = std::tan(std::asin(share * s.terrain.rolling_resistance));
    const double angle = std::atan(s.terrain.bank_slope), left = 20.0;
    const double under = -s.terrain.rail_height - s.terrain.bank_slope * (left - 1.0);
    Train train(s, {at({100.0, left, under + 1.5 / std::cos(angle)}, turned(M_PI - angle, Vector3d::UnitX()))});
    train.to(15.0);
    if (share < 1.0) EXPECT_LT(train.car(0).velocity.norm(), 1e-3);
    else EXPECT_GT(train.car(0).velocity.norm(), 0.3);
  }
}

TEST(OffTheRails, PatchesActUnderBodies) {
  inputs::Scenario s = spatial(1);
  s.ground.patches = {{0.0, 1000.0, 5.0, 1000.0, 0.4}};
  const double up = height_of(s) - model::expand(s.consist)[0].roof_height;
  const auto slides = [&](double y) {
    const Vector3d centre(200.0, y, -s.terrain.rail_height - up);
    Train train(s, {at(centre, turned(M_PI, Vector3d::UnitX()), {10.0, 0.0, 0.0})});
    train.to(0.5);
    return 10.0 - train.car(0).velocity.x();
  };
  EXPECT_NEAR(slides(10.0), 0.5 * 0.4 * s.terrain.body_friction * kGravity, 0.02);
  EXPECT_NEAR(slides(0.0), 0.5 * s.terrain.body_friction * kGravity, 0.05);
}

TEST(Terrain, SectionsChangeLinearlyIntoEachOther) {
  inputs::Terrain t;
  t.bank_left = 2.0;
  t.transition = 20.0;
  t.sections = {{100.0, 50.0, {}, {}, {}, {}, {}, 6.0, {}}, {150.0, 50.0, {}, {}, {}, 4.0, 1.0, -4.0, {}}};
  struct Place {
    double s, left, crown, slope;
  };
  for (const Place& p : {Place{0.0, 2.0, t.crown, 0.5},
                         {95.0, 3.0, t.crown, 0.5},
                         {100.0, 4.0, t.crown, 0.5},
                         {120.0, 6.0, t.crown, 0.5},
                         {150.0, 1.0, 0.5 * (t.crown + 4.0), 0.75},
                         {170.0, -4.0, 4.0, 1.0},
                         {200.0, -1.0, 0.5 * (t.crown + 4.0), 0.75},
                         {300.0, 2.0, t.crown, 0.5}}) {
    const model::CrossSection c = model::cross_section(t, p.s);
    EXPECT_NEAR(c.bank_left, p.left, 1e-9) << p.s;
    EXPECT_NEAR(c.crown, p.crown, 1e-9) << p.s;
    EXPECT_NEAR(c.bank_slope, p.slope, 1e-9) << p.s;
    EXPECT_EQ(c.bank_right, 0.0);
    for (const double offset : {-30.0, 0.0, 5.0, 30.0})
      EXPECT_LE(model::ground_height(c, offset).z, model::highest_ground(t) + 1e-12);
  }
  EXPECT_FALSE(model::level(t));
}

TEST(Terrain, ABodySlidesOverATransitionWithoutALossInTheLedger) {
  // Down from a section with a low bank into the deep ground beyond it, without friction: height becomes speed.
  inputs::Scenario s = spatial(1, 5e-4);
  s.terrain.body_friction = s.terrain.body_damping_ratio = 0.0;
  s.terrain.crown = 0.5;
  s.terrain.bank_slope = 5.0;
  s.terrain.bank_left = 6.0;
  s.terrain.transition = 100.0;
  s.terrain.sections = {{-100.0, 300.0, {}, {}, {}, {}, {}, 3.0, {}}};
  const double up = height_of(s) - model::expand(s.consist)[0].roof_height;
  Train train(
      s, {at({130.0, 20.0, -s.terrain.rail_height - 3.0 - up}, turned(M_PI, Vector3d::UnitX()), {10.0, 0.0, 0.0})});
  train.to(8.0);
  const SpatialMotion& end = train.car(0);
  const double dropped = -s.terrain.rail_height - 3.0 - up - end.centre.z();
  EXPECT_GT(dropped, 1.5);
  EXPECT_NEAR(end.velocity.squaredNorm(), 100.0 + 2.0 * kGravity * dropped, 3.0);
}

TEST(Terrain, AGridIsBilinearAndAsItsEdgeBeyondIt) {
  const auto f = [](double x, double y) { return 1.0 + 0.25 * x - 0.5 * y + 0.125 * x * y; };
  const model::HeightGrid grid(grid_of(f, 4.0, 3, 2));
  for (const auto& [x, y] : {std::pair(1.0, -3.0), {-11.5, 7.5}, {0.0, 0.0}, {12.0, 8.0}}) {
    EXPECT_NEAR(grid.at(x, y).z, f(x, y), 1e-6) << x << ' ' << y;
    EXPECT_NEAR(grid.at(x, y).slope.x(), 0.25 + 0.125 * y, 1e-6) << x << ' ' << y;
    EXPECT_NEAR(grid.at(x, y).slope.y(), -0.5 + 0.125 * x, 1e-6) << x << ' ' << y;
  }
  EXPECT_NEAR(grid.at(50.0, 2.0).z, f(12.0, 2.0), 1e-6);
  EXPECT_EQ(grid.at(50.0, 2.0).slope.x(), 0.0);
  EXPECT_NEAR(grid.at(50.0, 2.0).slope.y(), -0.5 + 0.125 * 12.0, 1e-6);
  EXPECT_NEAR(grid.highest(), f(-12.0, -8.0), 1e-6);
}

TEST(Terrain, OnAGridTheRoadbedGoesOverIntoTheMapAndPushesAlongTheNormal) {
  inputs::Scenario s = spatial(1);
  s.ground.on_track_law = inputs::OnTrackLaw::rails;
  s.terrain.ballast_height = 0.4;
  s.track.curves = {{-200.0, 300.0, 1.0 / 400.0}};
  s.track.grades = {{-200.0, 400.0, 0.015}};
  const auto hill = [](double x, double y) {
    return -2.0 + 0.02 * x - 0.03 * y + 0.8 * std::sin(0.1 * x) * std::cos(0.07 * y);
  };
  s.terrain.grid = grid_of(hill, 5.0, 60, 30);
  inputs::validate(s);
  const model::SpatialBed bed(s);
  const model::HeightGrid map(s.terrain.grid);
  EXPECT_FALSE(bed.level());
  for (const double at_s : {-120.0, -3.0, 61.0}) {
    const model::Track::Node node = bed.track.at(at_s);
    double before = bed.beside(at_s, -40.0).z;
    for (double left = -40.0; left <= 40.0; left += 0.05) {
      const Vector3d p(node.point.x() - left * node.tangent.y(), node.point.y() + left * node.tangent.x(), 0.0);
      const model::Under g = bed.ground(p, at_s);
      EXPECT_NEAR(g.z, bed.beside(at_s, left).z, 1e-6);
      EXPECT_LT(std::abs(g.z - before), 0.25) << "no step in the ground: " << at_s << ' ' << left;
      before = g.z;
      EXPECT_LE(g.z, bed.highest_ground(at_s, 50.0));
      const double beyond = std::abs(left) - s.terrain.crown;
      if (beyond >= s.terrain.grid.seam) {
        // The ballast's side may reach beyond the crown.
        const double ballast = bed.profile.at(at_s).bed - s.terrain.rail_height -
                               s.terrain.ballast_slope * (std::abs(left) - s.terrain.ballast_half_width);
        EXPECT_NEAR(g.z, std::max(ballast, map.at(p.x(), p.y()).z), 1e-9);
      } else if (beyond <= 0.0) {
        const double down = s.terrain.ballast_slope * (std::abs(left) - s.terrain.ballast_half_width);
        EXPECT_NEAR(g.z,
                    bed.profile.at(at_s).bed - s.terrain.rail_height - std::clamp(down, 0.0, s.terrain.ballast_height),
                    1e-9);
      }
      // The normal is that of the surface, by differences; not where it has an edge.
      constexpr double kStep = 1e-5;
      const auto height = [&](double dx, double dy) { return bed.ground(p + Vector3d(dx, dy, 0.0), at_s).z; };
      const double x_up = (height(kStep, 0) - height(0, 0)) / kStep,
                   x_down = (height(0, 0) - height(-kStep, 0)) / kStep;
      const double y_up = (height(0, kStep) - height(0, 0)) / kStep,
                   y_down = (height(0, 0) - height(0, -kStep)) / kStep;
      if (std::abs(x_up - x_down) > 1e-4 || std::abs(y_up - y_down) > 1e-4) continue;
      EXPECT_NEAR(g.up.x(), -x_up, 2e-3) << at_s << ' ' << left;
      EXPECT_NEAR(g.up.y(), -y_up, 2e-3) << at_s << ' ' << left;
    }
  }
}

TEST(Terrain, RefusesAGridThatIsNotWhole) {
  inputs::Scenario s = spatial(3);
  s.terrain.grid = grid_of([](double, double) { return -1.0; }, 5.0, 2, 2);
  inputs::validate(s);
  const auto refused = [&s](const char* key, auto change) {
    inputs::Scenario bad = s;
    change(bad);
    try {
      inputs::validate(bad);
      ADD_FAILURE() << key;
    } catch (const inputs::InputError& e) {
      EXPECT_EQ(e.key(), key) << e.what();
    }
  };
  refused("terrain.grid.rows[1].heights", [](inputs::Scenario& b) { b.terrain.grid.rows[1].heights = "1 2 3 4"; });
  refused("terrain.grid.rows[2].heights", [](inputs::Scenario& b) { b.terrain.grid.rows[2].heights = "1 2 3 4 nan"; });
  refused("terrain.grid.rows[0].heights", [](inputs::Scenario& b) { b.terrain.grid.rows[0].heights = ""; });
  refused("terrain.grid.rows", [](inputs::Scenario& b) { b.terrain.grid.rows.resize(1); });
  refused("terrain.bank_left", [](inputs::Scenario& b) { b.terrain.bank_left = 2.0; });
  refused("terrain.sections", [](inputs::Scenario& b) {
    b.terrain.sections.resize(1);
    b.terrain.sections[0].length = 5.0;
  });
  refused("terrain.grid.spacing", [](inputs::Scenario& b) { b.terrain.grid.spacing = 0.0; });
}

TEST(OffTheRails, ABodySlidesDownABankOrHoldsOnIt) {
  // On its side, without trucks under it: friction 0.3 and 0.7 on a slope of one half.
  for (const double mu : {0.3, 0.7}) {
    inputs::Scenario s = spatial(1, 1e-3);
    s.terrain.bank_left = 80.0;
    s.terrain.body_friction = mu;
    s.terrain.body_damping_ratio = 1.0;
    const double slope = s.terrain.bank_slope, angle = std::atan(slope);
    const model::Car car = model::expand(s.consist)[0];
    // The left side lies on the bank.
    const Matrix3d axes = turned(-angle - 0.5 * test::kPi, Vector3d::UnitX());
    const Vector3d up(0.0, std::sin(angle), std::cos(angle));
    const Vector3d foot(50.0, s.terrain.crown + 30.0, -s.terrain.rail_height - 30.0 * slope);
    const double sink = 0.25 * car.weight / s.terrain.body_stiffness / 1.6;
    Train train(s, {at(foot + (0.5 * s.consist[0].width - sink) * up, axes)});
    train.to(2.0);
    const Vector3d a = train.car(0).velocity;
    train.to(4.0);
    const Vector3d moved = train.car(0).velocity - a, down(0.0, std::cos(angle), -std::sin(angle));
    const double expected = kGravity * (std::sin(angle) - mu * std::cos(angle));
    if (mu < slope) EXPECT_NEAR(moved.dot(down) / 2.0 / expected, 1.0, 0.02);
    else EXPECT_LT(train.car(0).velocity.norm(), 1e-5);
  }
}

}  // namespace
}  // namespace train_derail
