// The train in three dimensions on its rails, against closed forms: wheel loads, superelevation, grades, rocking.
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "spatial_fixtures.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/model/track_profile.hpp"
#include "train_derail/outcome/monitor.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using model::SpatialMotion;
using Train = SpatialTrain;

TEST(OnTheRails, AStraightTrainRollsAndNothingHappens) {
  inputs::Scenario s = accident(8);
  s.model = inputs::Model::spatial;
  s.brakes.force = s.brakes.rolling_resistance = 0.0;
  s.initial.perturbation = {};
  std::vector<SpatialMotion> cars;
  for (int k = 0; k < 8; ++k)
    cars.push_back(at({-300.0 - k * kPitch, 0.0, height_of(s)}, Matrix3d::Identity(), {15.0, 0.0, 0.0}));
  Train train(s, cars);
  const double energy = train.energy().total();
  train.to(10.0);
  EXPECT_TRUE(train.incidents().derailments.empty());
  EXPECT_TRUE(train.incidents().broken.empty());
  EXPECT_TRUE(train.incidents().impacts.empty());
  for (int k = 0; k < 8; ++k) {
    const SpatialMotion q = train.car(k);
    EXPECT_NEAR(q.centre.x(), cars[static_cast<std::size_t>(k)].centre.x() + 150.0, 1e-9);
    EXPECT_NEAR(q.centre.y(), 0.0, 1e-9);
    EXPECT_NEAR(q.centre.z(), height_of(s), 1e-9);
    EXPECT_LT((q.axes - Matrix3d::Identity()).norm(), 1e-9);
    for (const double load : train.model().wheel_loads(k))
      EXPECT_NEAR(load, 0.25 * train.model().cars()[static_cast<std::size_t>(k)].weight, 1e-3);
  }
  EXPECT_NEAR(train.energy().total() / energy, 1.0, 1e-12);
}

/// One car on an arc of that curvature to the left, moving along it, leaning out of the rails' plane by `roll`.
Train in_curve(inputs::Scenario s, double curvature, double speed, double roll = 0.0, double superelevation = 0.0) {
  s.track.curves = {{-700.0, 700.0, curvature, superelevation}};
  const model::Track track(s, -800.0, 100.0);
  const model::Track::Node node = track.at(-650.0);
  const Matrix3d along = turned(std::atan2(node.tangent.y(), node.tangent.x()), Vector3d::UnitZ());
  const double bank = -std::copysign(std::atan(0.5 * superelevation / s.suspension.half_base), curvature);
  const Matrix3d axes = along * turned(bank + roll, Vector3d::UnitX());
  const Vector3d yaw_rate(0.0, 0.0, speed * curvature);
  // Both trucks on the arc.
  const double spacing = model::expand(s.consist)[0].truck_spacing, inwards = 0.125 * spacing * spacing * curvature;
  const Vector3d foot = Vector3d(node.point.x(), node.point.y(), 0.5 * superelevation) + inwards * along.col(1);
  return Train(s, {at(foot + height_of(s) * axes.col(2), axes, speed * along.col(0), axes.transpose() * yaw_rate)});
}

/// Rails that hold whatever comes, stiff enough that they do not give.
inputs::Scenario held(int cars, double step) {
  inputs::Scenario s = spatial(cars, step);
  s.rails.derail_ratio = 1e3;
  s.rails.derail_time = 1e3;
  s.rails.stiffness = 1e9;
  s.rails.damping_ratio = 1.0;
  s.suspension.damping_ratio = 1.5;
  return s;
}

TEST(OnTheRails, WheelLoadsInACurve) {
  const inputs::Scenario s = held(1, 5e-4);
  const double speed = 12.0, curvature = 1.0 / 250.0;
  Train train = in_curve(s, curvature, speed);
  train.to(6.0);
  const model::Car& car = train.model().cars()[0];
  const double b = s.suspension.half_base, h = car.centre_height, stiffness = 4.0 * s.suspension.stiffness * b * b;
  // The body leans out on its springs until they hold what it does at the centre of gravity.
  const double lean = car.mass * speed * speed * curvature * h / (stiffness - car.weight * h);
  const Eigen::Vector4d loads = train.model().wheel_loads(0);
  EXPECT_NEAR(loads.sum() / car.weight, 1.0, 2e-3);
  EXPECT_NEAR(((loads[0] + loads[2]) - (loads[1] + loads[3])) * b / (stiffness * lean), 1.0, 0.01);
  EXPECT_NEAR(train.roll(0) / lean, 1.0, 0.01);
}

TEST(OnTheRails, WheelLoadsInACurveWithSuperelevation) {
  const inputs::Scenario s = held(1, 5e-4);
  const double b = s.suspension.half_base, h = height_of(s), stiffness = 4.0 * s.suspension.stiffness * b * b;
  const double superelevation = 0.1, bank = std::atan(0.5 * superelevation / b);
  for (const double curvature : {1.0 / 250.0, -1.0 / 250.0}) {
    const double balance = std::sqrt(kGravity * std::tan(bank) / std::abs(curvature));
    for (const double share : {0.0, 1.0, 1.4}) {
      const double speed = share * balance;
      Train train = in_curve(s, curvature, speed, 0.0, superelevation);
      train.to(6.0);
      const model::Car& car = train.model().cars()[0];
      // In the plane of the rails, outwards, and square to it.
      const double outwards = speed * speed * std::abs(curvature);
      const double across = car.mass * (outwards * std::cos(bank) - kGravity * std::sin(bank));
      const double onto = car.mass * (outwards * std::sin(bank) + kGravity * std::cos(bank));
      const double lean = across * h / (stiffness - onto * h);
      const Eigen::Vector4d loads = train.model().wheel_loads(0);
      const double right = loads[0] + loads[2], left = loads[1] + loads[3];
      EXPECT_NEAR((right + left) / onto, 1.0, 2e-3);
      const double outer = curvature > 0.0 ? right - left : left - right;
      EXPECT_NEAR(outer / car.weight, stiffness * lean / b / car.weight, 3e-3) << share;
      if (share == 1.0) EXPECT_NEAR(outer / car.weight, 0.0, 3e-3);
      else EXPECT_GT(std::abs(outer / car.weight), 0.1);
    }
  }
}

TEST(OnTheRails, SuperelevationRunsInAndRaisesTheOuterRail) {
  inputs::Scenario s = spatial(1);
  s.track.curves = {{-300.0, 100.0, 1.0 / 400.0, 0.12}, {-200.0, 100.0, 1.0 / 300.0, 0.12}, {50.0, 90.0, -0.002, 0.06}};
  const model::TrackProfile profile(s);
  const double half = 0.5 * model::TrackProfile::kRunIn, b = s.suspension.half_base;
  const auto rail = [&](double at, double side) { return profile.at(at).height + side * b * profile.at(at).tilt; };
  struct Case {
    double at, left, right;
  };
  const std::vector<Case> cases{{-1000.0, 0.0, 0.0},
                                {-300.0 - half - 2.0, 0.0, 0.0},
                                {-300.0, 0.0, 0.06},
                                {-300.0 + half + 2.0, 0.0, 0.12},
                                {-200.0, 0.0, 0.12},
                                {-100.0, 0.0, 0.06},
                                {-100.0 + 0.5 * half, 0.0, 0.03},
                                {0.0, 0.0, 0.0},
                                {95.0, 0.06, 0.0},
                                {1000.0, 0.0, 0.0}};
  for (const Case& c : cases) {
    EXPECT_NEAR(rail(c.at, 1.0), c.left, 1e-3) << c.at;
    EXPECT_NEAR(rail(c.at, -1.0), c.right, 1e-3) << c.at;
    EXPECT_EQ(profile.at(c.at).bed, 0.0);
  }
}

/// A monitor that has seen nothing but this.
outcome::Monitor monitor_of(const Train& train, const inputs::Scenario& s) {
  const model::StateVector now = Eigen::Map<const model::StateVector>(train.data(), train.model().size());
  outcome::Monitor monitor(train.model(), s.outcome, 0.0, now);
  monitor.sample(0.0, now.data());
  return monitor;
}

TEST(OnTheRails, ACarIsOffTheTrackByItsTrucksHoweverItLeans) {
  const inputs::Scenario s = spatial(1);
  const Train raised = in_curve(s, 1.0 / 400.0, 15.0, 0.0, 0.15);
  ASSERT_GT(height_of(s) * raised.car(0).axes.col(2).head<2>().norm(), s.outcome.off_track_threshold);
  EXPECT_FALSE(monitor_of(raised, s).off_track(0));
  // On straight track a car leans by 0.1 rad, its trucks in their place; then they are beside it, under its middle.
  const Matrix3d leaning = turned(0.1, Vector3d::UnitX());
  const Vector3d up = leaning * Vector3d(0.0, 0.0, height_of(s)), foot(-300.0, 0.0, 0.0);
  EXPECT_FALSE(monitor_of(Train(s, {at(foot + up, leaning)}), s).off_track(0));
  EXPECT_TRUE(monitor_of(Train(s, {at(foot + up - Vector3d(0.0, up.y(), 0.0), leaning)}), s).off_track(0));
  // One truck alone.
  const double angle = 1.1 * s.outcome.off_track_threshold / (0.5 * raised.model().cars()[0].truck_spacing);
  const Matrix3d skewed = turned(angle, Vector3d::UnitZ()) * leaning;
  EXPECT_TRUE(monitor_of(Train(s, {at(foot + skewed * Vector3d(0.0, 0.0, height_of(s)), skewed)}), s).off_track(0));
}

TEST(OnTheRails, SpeedsAreThoseOfPinsAndTrucksWhateverTheHeight) {
  // Two cars in line that fall, and roll against each other about the middle of the train.
  const inputs::Scenario s = spatial(2);
  const double height = height_of(s), fall = 5.0, roll = 1.0;
  const auto falling = [&](double x, double rate) {
    return at({x, 0.0, height + 3.0}, Matrix3d::Identity(), {0.0, 0.0, -fall}, {rate, 0.0, 0.0});
  };
  const Train train(s, {falling(-300.0, roll), falling(-300.0 - kPitch, -roll)});
  const outcome::Monitor monitor = monitor_of(train, s);
  EXPECT_NEAR(monitor.truck_speed_max(), std::hypot(fall, roll * height), 1e-9);
  EXPECT_NEAR(monitor.truck_speed_max_behind(1, train.data()), std::hypot(fall, roll * height), 1e-9);
  outcome::Outcome o;
  monitor.report(0.0, train.data(), o);
  EXPECT_NEAR(o.relative_speed_max.speed, 2.0 * roll * (height - s.coupler.height), 1e-9);
  EXPECT_NEAR(o.centre_speed_max.speed, 0.0, 1e-9);
}

TEST(OnTheRails, ATrainThatStopsUphillClosesItsLedger) {
  // What stands below the point of derailment has no less energy for it.
  for (const double grade : {0.02, -0.02}) {
    inputs::Scenario s = accident(12);
    s.model = inputs::Model::spatial;
    s.initial.cars_ahead = 2;
    s.initial.speed = 6.0;
    s.initial.perturbation = {};
    s.track.grades = {{-2000.0, 4000.0, grade}};
    simulation::Simulation run(s);
    run.advance(s.stop.time_max);
    const outcome::Outcome o = run.outcome();
    EXPECT_EQ(o.ended, outcome::Ended::at_rest) << grade << ": " << o.message;
    double mass = 0.0;
    for (const model::Car& car : run.cars()) mass += car.mass;
    EXPECT_NEAR(o.energy_initial / (0.5 * mass * 36.0), 1.0, 0.05) << grade;
    EXPECT_LT(o.energy_residual, 1e-3) << grade;
    EXPECT_GT(o.energy.height * grade, 0.0);
    EXPECT_LT(std::abs(o.energy.height), mass * kGravity * std::abs(grade) * 200.0);
  }
}

TEST(OnTheRails, ShortArcsHaveAllOfTheirSuperelevationInTheMiddle) {
  inputs::Scenario s = spatial(1);
  s.track.curves = {{-100.0, 30.0, 1.0 / 400.0, 0.12}, {100.0, 80.0, 0.002, 0.1}, {180.0, 20.0, 0.003, 0.1}};
  const model::TrackProfile profile(s);
  EXPECT_NEAR(profile.at(-85.0).height, 0.06, 1e-9);
  EXPECT_NEAR(profile.at(-100.0).height, 0.03, 1e-3);
  EXPECT_EQ(profile.at(-100.0 - 0.5 * 0.75 * 30.0 - 2.0).height, 0.0);
  // Where two arcs meet it stays what both have.
  for (double at = 140.0; at < 190.0; at += 1.0) EXPECT_NEAR(profile.at(at).height, 0.05, 1e-9) << at;
}

TEST(OnTheRails, ACarThatRollsDownGainsTheSpeedOfTheHeight) {
  inputs::Scenario s = spatial(1);
  s.track.grades = {{-400.0, 200.0, -0.02}};
  const double drop = 4.0;
  EXPECT_NEAR(model::TrackProfile(s).at(-500.0).height, drop, 1e-9);
  EXPECT_EQ(model::TrackProfile(s).at(-100.0).height, 0.0);
  for (const double offset : {0.0, 0.12}) {
    if (offset > 0.0) s.track.curves = {{-450.0, 400.0, 1.0 / 500.0, offset}};  // and up onto superelevation and off it
    const model::Track track(s, -600.0, 0.0);
    const model::Track::Node node = track.at(-520.0);
    const Matrix3d axes = turned(std::atan2(node.tangent.y(), node.tangent.x()), Vector3d::UnitZ());
    const Vector3d foot(node.point.x(), node.point.y(), drop + height_of(s));
    Train train(s, {at(foot, axes, 8.0 * axes.col(0))});
    const model::EnergyLedger before = train.energy();
    double middle = 0.0;
    while (train.car(0).centre.x() < -8.0) {
      ASSERT_LT(train.time(), 100.0);
      train.step();
      if (train.car(0).centre.x() < -250.0) middle = train.car(0).centre.z() - height_of(s);
    }
    EXPECT_TRUE(train.incidents().derailments.empty());
    const model::EnergyLedger after = train.energy();
    const double fallen = kGravity * drop * train.model().cars()[0].mass;
    EXPECT_NEAR(before.height / fallen, 1.0, 1e-6);
    EXPECT_NEAR(after.height / fallen, 0.0, 1e-4);
    EXPECT_NEAR((after.kinetic() - before.kinetic() + after.work_rails + after.work_truck_damping) / fallen, 1.0, 3e-4);
    EXPECT_NEAR((after.total() - before.total()) / fallen, 0.0, offset > 0.0 ? 2e-5 : 1e-8);
    if (offset == 0.0) {
      EXPECT_NEAR(train.car(0).velocity.x(), std::sqrt(64.0 + 2.0 * kGravity * drop), 1e-3);
      EXPECT_NEAR(middle, 0.02 * (250.0 - 200.0), 0.02);
    }
  }
}

TEST(OnTheRails, ACarStartsAtRestInThePlaneOfTheRails) {
  inputs::Scenario s = spatial(3);
  s.initial.speed = 0.0;
  s.initial.cars_ahead = 2;
  s.track.grades = {{-500.0, 1000.0, 0.02}};
  s.track.curves = {{-500.0, 1000.0, -1.0 / 400.0, 0.1}};
  s.brakes.force = 0.2;
  s.brakes.build_up_time = 0.0;
  s.brakes.emergency_time = -100.0;
  Train train(s);
  const SpatialMotion before = train.car(0);
  EXPECT_NEAR(before.axes(2, 0), 0.02, 1e-5);
  EXPECT_NEAR(before.axes(2, 1), 0.05 / s.suspension.half_base, 3e-4);
  train.to(20.0);
  // Brakes hold it. It leans inwards on its springs, no more.
  const SpatialMotion after = train.car(0);
  EXPECT_LT(after.velocity.norm(), 1e-2);
  EXPECT_NEAR((after.centre - before.centre).dot(before.axes.col(0)), 0.0, 5e-3);
  EXPECT_LT((after.axes.col(0) - before.axes.col(0)).norm(), 1e-3);
  EXPECT_NEAR(after.axes(2, 1) - before.axes(2, 1), 0.027, 0.005);
}

/// A car on its right wheels: those on the left are that high above the rail.
Train on_one_side(const inputs::Scenario& s, double lift) {
  const double b = s.suspension.half_base, weight = s.consist[0].weight;
  const double rest = 0.25 * weight / s.suspension.stiffness, right = 2.0 * rest;
  const double roll = std::asin((right + lift) / (2.0 * b));
  const Matrix3d axes = turned(roll, Vector3d::UnitX());
  const Vector3d wheel(-300.0, -b, rest - right);
  return Train(s, {at(wheel + axes * Vector3d(0.0, b, height_of(s)), axes)});
}

TEST(OnTheRails, ATruckWhoseWheelsHangAboveTheFlangeLeavesTheRails) {
  inputs::Scenario s = held(1, 1e-4);
  s.rails.derail_time = 0.0;
  for (const double share : {0.95, 1.05}) {
    Train train = on_one_side(s, share * s.rails.flange_height);
    train.step();
    ASSERT_EQ(train.incidents().derailments.size(), share < 1.0 ? 0U : 2U);
    for (const model::Derailment& d : train.incidents().derailments) EXPECT_EQ(d.cause, model::Cause::lateral);
  }
  // It has to hang there for a while, and rails that hold all hold that.
  s.rails.derail_time = 0.5;
  Train falls_back = on_one_side(s, 1.2 * s.rails.flange_height);
  falls_back.to(2.0);
  EXPECT_TRUE(falls_back.incidents().derailments.empty());
  EXPECT_LT(std::abs(falls_back.roll(0)), 0.05);
  s.rails.derail_time = 0.0;
  s.rails.flange_height = inputs::kInfinity;
  Train guided = on_one_side(s, 0.1);
  guided.step();
  EXPECT_TRUE(guided.incidents().derailments.empty());
}

/// A car that leans to the right by `roll` and whose trucks are `aside` of the track's centre line.
Train leaning(const inputs::Scenario& s, double roll, double aside) {
  const Matrix3d axes = turned(roll, Vector3d::UnitX());
  return Train(s, {at(Vector3d(-300.0, aside, 0.0) + height_of(s) * axes.col(2), axes)});
}

/// What the springs carry as the car stands there: of the lighter side and of both.
TEST(OnTheRails, TheLoadOfTheSideWhoseFlangeIsPressedHoldsATruck) {
  inputs::Scenario s = held(1, 1e-5);
  s.rails.derail_ratio = 0.8;
  s.rails.derail_time = 0.0;
  const double spring = s.suspension.stiffness, rest = 0.25 * s.consist[0].weight / spring, roll = 0.02;
  const double lighter = spring * (rest - s.suspension.half_base * roll);
  ASSERT_GT(lighter, 0.0);
  const auto derails = [&](double way, double lateral, double share) {
    Train train = leaning(s, way * roll, -share * lateral / s.rails.stiffness);
    train.step();
    return !train.incidents().derailments.empty();
  };
  // Rails push to the left, by the flange of the right wheels; leaning to the left these carry less.
  for (const double way : {1.0, -1.0}) {
    const double light_side = way * s.rails.derail_ratio * 2.0 * lighter;
    EXPECT_FALSE(derails(-way, light_side, 0.98));
    EXPECT_TRUE(derails(-way, light_side, 1.02));
    // On the heavier side no more than the load of both holds it.
    const double both = way * s.rails.derail_ratio * 2.0 * spring * rest;
    EXPECT_FALSE(derails(way, both, 0.98));
    EXPECT_TRUE(derails(way, both, 1.02));
  }
}

TEST(OnTheRails, ACarTipsAtTheLateralAccelerationOfTheClosedForm) {
  const inputs::Scenario s = held(1, 5e-4);
  const double b = s.suspension.half_base, h = height_of(s), weight = s.consist[0].weight;
  const double lean = weight / (4.0 * s.suspension.stiffness * b);  // when the inner wheels lift
  const double lifts = kGravity * (b / h - lean);
  const double curvature = 1.0 / 250.0;
  for (const double share : {0.97, 1.03}) {
    Train train = in_curve(s, curvature, std::sqrt(share * lifts / curvature), std::min(share, 1.0) * lean);
    double most = 0.0;
    train.to(12.0, [&] { most = std::max(most, std::abs(train.roll(0))); });
    if (share < 1.0) EXPECT_LT(most, 1.1 * lean);
    else EXPECT_GT(most, 0.7);
  }
}

TEST(OnTheRails, RockingOfALoadedCar) {
  inputs::Scenario s = held(1, 2.5e-4);
  s.suspension.damping_ratio = 0.0;
  Train train(s, {at({-300.0, 0.0, height_of(s)}, Matrix3d::Identity(), Vector3d::Zero(), {0.02, 0.0, 0.0})});
  const model::Car& car = train.model().cars()[0];
  const double b = s.suspension.half_base, h = car.centre_height;
  // About the point at the top of the rails that these hold.
  const double rate =
      std::sqrt((4.0 * s.suspension.stiffness * b * b - car.weight * h) / (car.roll_inertia + car.mass * h * h));
  std::vector<double> zeros;
  double before = 0.0;
  train.to(8.0, [&] {
    const double now = train.roll(0);
    if (before < 0.0 && now >= 0.0) zeros.push_back(train.time());
    before = now;
  });
  ASSERT_GE(zeros.size(), 3U);
  const double period = (zeros.back() - zeros.front()) / static_cast<double>(zeros.size() - 1);
  EXPECT_NEAR(period * rate / (2.0 * kPi), 1.0, 0.01);
  EXPECT_NEAR(1.0 / period, 0.55, 0.15);  // Hz
}

}  // namespace
}  // namespace train_derail::test
