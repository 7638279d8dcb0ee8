// The train in three dimensions against closed forms: free bodies, tipping, springs, couplers, contact, and whole runs.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "model/rotation.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/spatial_bed.hpp"
#include "train_derail/model/step_limit.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/model/track_profile.hpp"
#include "train_derail/simulation/checkpoint.hpp"

namespace train_derail {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using inputs::kFoot;
using inputs::kInfinity;
using inputs::kKip;
using model::BrokenCoupler;
using model::SpatialMotion;
using test::at;
using test::everything;
using test::height_of;
using test::spatial;
using test::turned;
using By = BrokenCoupler::By;
using Train = test::SpatialTrain;

constexpr double kGravity = inputs::kStandardGravity;

/// Far ahead of the point of derailment, where trucks are off the rails, and high above the ground: only weight acts.
const Vector3d kAloft(50.0, 3.0, 60.0);

// Free bodies

/// A body that tumbles about its middle axis.
struct Tumble {
  Vector3d inertia{1.0, 2.0, 4.0}, rates;
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();

  void step(double h) {
    using Three = model::Three<double>;
    const Three i{inertia.x(), inertia.y(), inertia.z()};
    const Three spin = i.times({rates.x(), rates.y(), rates.z()});
    const model::Turn<double> by = model::turn_by(model::mean_rates(i, spin, h) * h);
    const Three after = model::turned_back(spin, by).over(i);
    rates = {after.x, after.y, after.z};
    turn = (turn * Eigen::Quaterniond(by.w, by.v.x, by.v.y, by.v.z)).normalized();
  }
  Vector3d momentum() const { return turn * inertia.cwiseProduct(rates); }
  double energy() const { return 0.5 * rates.dot(inertia.cwiseProduct(rates)); }
};

TEST(Tumbling, KeepsMomentumAndEnergy) {
  double drift[2];
  for (const int i : {0, 1}) {
    Tumble body;
    body.rates = {0.01, 2.0, 0.02};
    const Vector3d momentum = body.momentum();
    const double energy = body.energy();
    drift[i] = 0.0;
    const double h = i == 0 ? 2e-3 : 1e-3;
    for (double t = 0.0; t < 60.0; t += h) {
      body.step(h);
      drift[i] = std::max(drift[i], std::abs(body.energy() / energy - 1.0));
    }
    EXPECT_LT((body.momentum() - momentum).norm() / momentum.norm(), 1e-11);
  }
  // It swings with every flip, by the square of the step, and does not grow.
  EXPECT_LT(drift[0], 1e-5);
  EXPECT_GT(drift[0] / drift[1], 3.5);
}

TEST(Tumbling, FlipsAtThePeriodOfTheEllipticIntegral) {
  Tumble body;
  body.rates = {0.02, 2.0, 0.0};
  const double i1 = body.inertia[0], i2 = body.inertia[1], i3 = body.inertia[2];
  const double l2 = body.momentum().squaredNorm(), e2 = 2.0 * body.energy();
  // Landau and Lifshitz, Mechanics, section 37; the axes such that L^2 > 2 E I2.
  const bool high = l2 > e2 * i2;
  const double a = high ? i1 : i3, c = high ? i3 : i1;
  const double modulus = std::sqrt((i2 - a) * (e2 * c - l2) / ((c - i2) * (l2 - e2 * a)));
  const double rate = std::sqrt((c - i2) * (l2 - e2 * a) / (a * i2 * c));
  const double period = 4.0 * std::comp_ellint_1(modulus) / std::abs(rate);
  std::vector<double> flips;
  const double h = 1e-4;
  double before = body.rates.y();
  for (double t = h; flips.size() < 5; t += h) {
    ASSERT_LT(t, 100.0);
    body.step(h);
    if (before * body.rates.y() < 0.0) flips.push_back(t);
    before = body.rates.y();
  }
  EXPECT_NEAR((flips[4] - flips[0]) / (2.0 * period), 1.0, 2e-3);
}

TEST(Tumbling, OfACarThatFalls) {
  inputs::Scenario s = spatial(1, 1e-3);
  const Vector3d rates(0.3, 0.2, 1.0);
  Train train(s, {at(kAloft + Vector3d(0.0, 0.0, 200.0), turned(0.4, {1.0, 2.0, 3.0}), {3.0, 0.0, 10.0}, rates)});
  const auto spin = [&] {
    const model::SpatialMomentum p = train.momentum();
    const SpatialMotion q = train.car(0);
    return Vector3d(p.angular - q.centre.cross(p.linear));
  };
  const Vector3d before = spin();
  const double energy = train.energy().kinetic_rotation;
  train.to(5.0);
  EXPECT_LT((spin() - before).norm() / before.norm(), 1e-10);
  EXPECT_NEAR(train.energy().kinetic_rotation / energy, 1.0, 1e-3);
  EXPECT_NEAR(train.car(0).velocity.z(), 10.0 - 5.0 * kGravity, 1e-9);
  // A symmetric top: pitch and yaw rates turn about the roll axis at (I / I_roll - 1) times the roll rate.
  const model::Car& car = train.model().cars()[0];
  const double angle = -(1.0 - car.roll_inertia / car.yaw_inertia) * rates.x() * 5.0;
  const Vector3d after = train.car(0).body_rates;
  EXPECT_NEAR(after.x(), rates.x(), 1e-8);
  EXPECT_NEAR(after.y(), rates.y() * std::cos(angle) - rates.z() * std::sin(angle), 2e-3);
  EXPECT_NEAR(after.z(), rates.y() * std::sin(angle) + rates.z() * std::cos(angle), 2e-3);
}

// On the rails

TEST(OnTheRails, AStraightTrainRollsAndNothingHappens) {
  inputs::Scenario s = test::accident(8);
  s.model = inputs::Model::spatial;
  s.brakes.force = s.brakes.rolling_resistance = 0.0;
  s.initial.perturbation = {};
  std::vector<SpatialMotion> cars;
  for (int k = 0; k < 8; ++k)
    cars.push_back(at({-300.0 - k * test::kPitch, 0.0, height_of(s)}, Matrix3d::Identity(), {15.0, 0.0, 0.0}));
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

TEST(OnTheRails, ACarTipsAtTheLateralAccelerationOfTheClosedForm) {
  const inputs::Scenario s = held(1, 5e-4);
  const double b = s.suspension.half_base, h = height_of(s), weight = s.consist[0].weight;
  const double lifts = kGravity * b / h * (1.0 - weight * h / (4.0 * s.suspension.stiffness * b * b));
  const double curvature = 1.0 / 250.0;
  const double lean = weight / (4.0 * s.suspension.stiffness * b);  // when the inner wheels lift
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
  EXPECT_NEAR(period * rate / (2.0 * test::kPi), 1.0, 0.01);
  EXPECT_NEAR(1.0 / period, 0.55, 0.15);  // Hz
}

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

/// Tanks whose axis goes through the centre of mass, so that they can roll about it.
void make_tanks(inputs::Scenario& s) {
  for (inputs::CarBlock& block : s.consist) {
    block.shape = inputs::BodyShape::cylinder;
    block.width = 3.0;
    block.floor_height = 1.0;
    block.roof_height = 4.0;
    block.centre_height = 2.5;
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

// Couplers

/// Two cars in the air, the trail car that much higher.
std::vector<SpatialMotion> in_steps(double rise) {
  return {at(kAloft), at(kAloft + Vector3d(-test::kPitch, 0.0, rise))};
}
/// Broken after a step.
std::vector<BrokenCoupler> broken(const inputs::Scenario& s, double rise) {
  Train train(s, in_steps(rise));
  train.step();
  return train.incidents().broken;
}

TEST(SpatialCoupler, AShelfHoldsItsForce) {
  inputs::Scenario s = spatial(2, 1e-5);
  s.coupler.pitch_stiffness = inputs::Coupler{}.pitch_stiffness;
  const double length = s.coupler.length, hold = inputs::coupler_hold(s.coupler, "", "").vertical_hold;
  EXPECT_NEAR(hold, 200e3 * inputs::kPoundForce, 1.0);
  // Both ends' moments over the length of the bar, upwards.
  const auto force = [&](double rise) {
    const double gap = std::hypot(length, rise), angle = std::asin(rise / gap);
    return 2.0 * s.coupler.pitch_stiffness * (angle - inputs::coupler_hold(s.coupler, "", "").pitch_limit) / gap *
           std::cos(angle);
  };
  double low = 0.0, high = 0.5;
  for (int i = 0; i < 60; ++i) (force(0.5 * (low + high)) < hold ? low : high) = 0.5 * (low + high);
  EXPECT_TRUE(broken(s, 0.99 * low).empty());
  const std::vector<BrokenCoupler> found = broken(s, 1.01 * low);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].by, By::vertical);
}

TEST(SpatialCoupler, TypeESlipsAtItsHeight) {
  inputs::Scenario s = spatial(2, 1e-5);
  s.coupler.slip_height = 0.25;
  s.coupler.vertical_hold = kInfinity;
  EXPECT_TRUE(broken(s, 0.249).empty());
  const std::vector<BrokenCoupler> found = broken(s, 0.251);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].by, By::slip);
}

TEST(SpatialCoupler, TypesByName) {
  inputs::Coupler c;
  const auto hold = [&](const char* lead, const char* trail) { return inputs::coupler_hold(c, lead, trail); };
  EXPECT_EQ(hold("", "").slip_height, kInfinity);
  EXPECT_NEAR(hold("", "").vertical_hold, 200.0 * kKip, 1.0);
  EXPECT_EQ(hold("E", "E").slip_height, 0.25);
  EXPECT_EQ(hold("E", "E").vertical_hold, kInfinity);
  EXPECT_EQ(hold("E", "double shelf").slip_height, kInfinity) << "a shelf at one end holds both";
  EXPECT_EQ(hold("rotary", "F").roll_limit, kInfinity) << "a rotary at one end turns";
  EXPECT_NEAR(hold("E", "F").pitch_limit, 4.0 * inputs::kDegree, 1e-12) << "the first stop that is met";
  c.type = "E";
  EXPECT_EQ(hold("", "").slip_height, 0.25);
  c.slip_height = 0.4;
  EXPECT_EQ(hold("E_shelf", "").slip_height, 0.4) << "a key of its own counts";
  // Of the three couplers of four cars, only that between two without shelves slips.
  inputs::Scenario s = spatial(4, 1e-5);
  s.consist[0].count = 1;
  s.consist.resize(4, s.consist[0]);
  for (std::size_t k : {0U, 1U}) s.consist[k].coupler_type = "E";
  const double length = model::expand(s.consist)[0].length + s.coupler.length;
  std::vector<SpatialMotion> cars;
  for (int k = 0; k < 4; ++k) cars.push_back(at(kAloft - Vector3d(length * k, 0.0, k % 2 == 0 ? 0.0 : 0.26)));
  Train train(s, cars);
  train.step();
  ASSERT_EQ(train.incidents().broken.size(), 1U);
  EXPECT_EQ(train.incidents().broken[0].coupler, 0);
  EXPECT_EQ(train.incidents().broken[0].by, By::slip);
  s.coupler.type = "H";
  EXPECT_THROW(inputs::validate(s), inputs::InputError);
}

TEST(SpatialCoupler, ACarThatGoesOverTakesItsNeighbourAlong) {
  for (const bool bound : {true, false}) {
    inputs::Scenario s = spatial(2, 5e-4);
    if (bound) s.coupler.roll_stiffness = inputs::Coupler{}.roll_stiffness;
    std::vector<SpatialMotion> cars = in_steps(0.0);
    cars[0] = at(cars[0].centre, Matrix3d::Identity(), Vector3d::Zero(), {0.5, 0.0, 0.0});
    Train train(s, cars);
    train.to(3.0);
    EXPECT_NEAR(train.roll(0) + train.roll(1), 1.5, 0.01);
    if (bound) {
      EXPECT_GT(train.roll(1), 0.5);
    } else {
      EXPECT_NEAR(train.roll(1), 0.0, 1e-9);
    }
  }
}

/// Two cars in the air with every stop of their coupler engaged.
inputs::Scenario all_stops(double step) {
  inputs::Scenario s = test::accident(2);
  s.model = inputs::Model::spatial;
  s.contact.law = inputs::ContactLaw::none;
  s.coupler.damping_ratio = 0.2;
  s.coupler.break_swing = s.coupler.break_draft = kInfinity;
  s.coupler.vertical_hold = s.coupler.break_twist = kInfinity;
  s.solver.fixed_step = step;
  return s;
}
std::vector<SpatialMotion> twisted() {
  const Matrix3d lead = turned(0.3, {0.2, 0.4, 1.0}), trail = turned(-0.6, {1.0, 0.3, 0.5});
  const double half = 0.5 * 55.0 * kFoot, below = 33.0 / 12.0 * kFoot - 2.22;
  const Vector3d pin = kAloft - lead * Vector3d(half, 0.0, -below);
  const Vector3d next = pin - Vector3d(1.28, 0.05, 0.02) - trail * Vector3d(half, 0.0, below);
  return {at(kAloft, lead, {1.0, 0.0, 0.5}, {0.3, 0.1, -0.2}), at(next, trail, {2.0, 0.3, 0.0}, {-0.2, 0.2, 0.1})};
}

TEST(SpatialCoupler, KeepsTheEnergyOfItsStops) {
  double drift[2];
  for (const int i : {0, 1}) {
    Train train(all_stops(i == 0 ? 2e-4 : 1e-4), twisted());
    const model::EnergyLedger before = train.energy();
    EXPECT_GT(before.coupler_swing, 1e4);
    const double all = before.total() - before.height;
    drift[i] = 0.0;
    train.to(0.5, [&] {
      const model::EnergyLedger e = train.energy();
      drift[i] = std::max(drift[i], std::abs(e.total() - before.total()) / all);
    });
  }
  EXPECT_LT(drift[0], 2e-3);
  EXPECT_NEAR(drift[0] / drift[1], 2.0, 0.7);
}

// Momentum: of two cars that act on each other, but for what weight gives.

void expect_momentum_kept(Train& train) {
  const double h = 1e-3;
  for (int i = 0; i < 20; ++i) {
    const model::SpatialMomentum before = train.momentum();
    Vector3d pull = Vector3d::Zero(), turn = Vector3d::Zero();
    double size = 0.0, turning = 0.0;
    for (Eigen::Index k = 0; k < 2; ++k) {
      const model::Car& car = train.model().cars()[static_cast<std::size_t>(k)];
      const Vector3d weight(0.0, 0.0, -car.weight * h);
      const SpatialMotion q = train.car(k);
      pull += weight;
      turn += q.centre.cross(weight);
      size += car.mass * q.velocity.norm();
      turning += q.centre.norm() * car.mass * q.velocity.norm();
    }
    train.step();
    const model::SpatialMomentum after = train.momentum();
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR((after.linear - before.linear - pull)[c] / size, 0.0, 1e-12);
      EXPECT_NEAR((after.angular - before.angular - turn)[c] / turning, 0.0, 1e-12);
    }
  }
}

TEST(SpatialMomentum, OfACoupler) {
  Train train(all_stops(1e-3), twisted());
  const Vector3d before = train.car(0).velocity;
  expect_momentum_kept(train);
  EXPECT_GT((train.car(0).velocity - before).norm(), 0.1);
}

/// Two cars that only contact acts on, and weight.
inputs::Scenario loose_cars(double step) {
  inputs::Scenario s = test::accident(2);
  s.model = inputs::Model::spatial;
  s.solver.fixed_step = step;
  s.coupler = spatial(2).coupler;
  return s;
}
/// Two cars in the air whose bodies go into each other.
std::vector<SpatialMotion> colliding() {
  const Matrix3d lead = turned(0.3, {0.2, 0.4, 1.0}), trail = turned(-0.9, {1.0, 0.3, 0.5});
  return {at(kAloft, lead, {0.0, 0.0, 2.0}, {0.3, 0.1, -0.2}),
          at(kAloft + Vector3d(2.0, 0.5, 2.4), trail, {1.0, 2.0, -3.0}, {-0.2, 0.2, 0.1})};
}

TEST(SpatialMomentum, OfAContact) {
  Train train(loose_cars(1e-3), colliding());
  const Vector3d before = train.car(0).velocity;
  expect_momentum_kept(train);
  EXPECT_EQ(train.incidents().impacts.size(), 1U);
  EXPECT_GT((train.car(0).velocity - before).norm(), 0.2);
  EXPECT_GT(train.energy().work_impact_friction, 1e3);
  EXPECT_GT(train.car(1).body_rates.norm(), 0.3);
}

TEST(SpatialMomentum, OfTanks) {
  for (const bool both : {true, false}) {
    for (const bool swapped : {false, true}) {
      inputs::Scenario s = loose_cars(1e-3);
      s.consist[0].count = 1;
      s.consist.resize(2, s.consist[0]);
      s.consist[swapped ? 1 : 0].shape = inputs::BodyShape::cylinder;
      if (both) s.consist[swapped ? 0 : 1].shape = inputs::BodyShape::cylinder;
      Train train(s, colliding());
      const Vector3d before = train.car(0).velocity;
      expect_momentum_kept(train);
      EXPECT_EQ(train.incidents().impacts.size(), 1U);
      EXPECT_GT((train.car(0).velocity - before).norm(), 0.2);
      EXPECT_GT(train.energy().work_impact_friction, 1e3);
    }
  }
}

TEST(SpatialImpact, NamesTheFacesAndTheHeight) {
  using model::Face;
  inputs::Scenario s = spatial(2);
  s.contact.law = inputs::ContactLaw::elastic;
  const model::Car car = model::expand(s.consist)[0];
  const Vector3d size(car.length, car.width, car.roof_height - car.floor_height);
  const double floor = kAloft.z() + car.floor_height - car.centre_height;
  struct Case {
    Vector3d towards;  // the second car, seen from the first
    Face a, b;
    double low, high;  // of the touch above the floor
  };
  const std::vector<Case> cases{{{0.0, 0.0, 1.0}, Face::top, Face::bottom, size.z(), size.z()},
                                {{0.0, 0.0, -1.0}, Face::bottom, Face::top, 0.0, 0.0},
                                {{0.0, 1.0, 0.0}, Face::left, Face::right, 0.0, size.z()},
                                {{0.0, -1.0, 0.0}, Face::right, Face::left, 0.0, size.z()},
                                {{1.0, 0.0, 0.0}, Face::front, Face::rear, 0.0, size.z()},
                                {{-1.0, 0.0, 0.0}, Face::rear, Face::front, 0.0, size.z()}};
  for (const Case& c : cases) {
    const Vector3d away = (size.dot(c.towards.cwiseAbs()) + 0.01) * c.towards;
    Train train(s, {at(kAloft), at(kAloft + away, Matrix3d::Identity(), -c.towards)});
    train.to(0.05);
    ASSERT_EQ(train.incidents().impacts.size(), 1U);
    const model::Impact& hit = train.incidents().impacts[0];
    EXPECT_EQ(hit.face_a, c.a);
    EXPECT_EQ(hit.face_b, c.b);
    EXPECT_GT(hit.z, floor + c.low - 0.02) << model::to_string(c.a);
    EXPECT_LT(hit.z, floor + c.high + 0.02) << model::to_string(c.a);
  }
}

TEST(SpatialImpact, SidesAreCrushedBelowTheForceOfEnds) {
  inputs::Scenario s = spatial(2, 2e-4);
  s.contact.law = inputs::ContactLaw::elastic;
  s.contact.crush_force = 4e6;
  s.contact.side_crush_force = 1.5e6;
  const model::Car car = model::expand(s.consist)[0];
  struct Case {
    Vector3d towards;  // the second car, seen from the first
    Matrix3d axes;     // of the second car
    double reach, force;
  };
  const Matrix3d across = turned(0.5 * test::kPi, Vector3d::UnitZ());
  const std::vector<Case> cases{
      {Vector3d::UnitX(), Matrix3d::Identity(), car.length, 4e6},
      {Vector3d::UnitY(), Matrix3d::Identity(), car.width, 1.5e6},
      {Vector3d::UnitX(), across, 0.5 * (car.length + car.width), 1.5e6},  // an end against a side
      {Vector3d::UnitZ(), Matrix3d::Identity(), car.roof_height - car.floor_height, 1.5e6}};
  for (const Case& c : cases) {
    Train train(s, {at(kAloft), at(kAloft + (c.reach + 0.01) * c.towards, c.axes, -6.0 * c.towards)});
    train.to(0.3);
    ASSERT_EQ(train.incidents().impacts.size(), 1U);
    // Up to the speed below which loading goes over into unloading.
    EXPECT_NEAR(train.incidents().impacts[0].peak_force / c.force, 1.0, 2e-3);
  }
}

/// Two tanks, or a tank and a box, in the air, that meet.
inputs::Scenario tanks(double step = 1e-3) {
  inputs::Scenario s = loose_cars(step);
  make_tanks(s);
  return s;
}
double impact_time(const inputs::Scenario& s, const std::vector<SpatialMotion>& cars) {
  Train train(s, cars);
  while (train.incidents().impacts.empty() && train.time() < 2.0) train.step();
  return train.incidents().impacts.empty() ? kInfinity : train.incidents().impacts[0].time;
}

TEST(SpatialTanks, MeetHeadOnAtTheForceOfBoxes) {
  for (const auto shape : {inputs::BodyShape::box, inputs::BodyShape::cylinder}) {
    inputs::Scenario s = tanks(2e-4);
    s.consist[0].shape = shape;
    s.contact.crush_force = 4e6;
    s.contact.side_crush_force = 1.5e6;
    const double reach = model::expand(s.consist)[0].length + 0.01;
    Train train(s, {at(kAloft), at(kAloft + Vector3d(reach, 0.0, 0.0), Matrix3d::Identity(), {-6.0, 0.0, 0.0})});
    train.to(0.3);
    ASSERT_EQ(train.incidents().impacts.size(), 1U);
    const model::Impact& hit = train.incidents().impacts[0];
    EXPECT_NEAR(hit.peak_force / 4e6, 1.0, 2e-3);
    EXPECT_EQ(hit.face_a, model::Face::front);
    EXPECT_EQ(hit.face_b, model::Face::rear);
    EXPECT_NEAR(hit.closing_speed_normal, 6.0, 0.01);
    if (shape == inputs::BodyShape::cylinder) EXPECT_NEAR(hit.z, kAloft.z(), 0.05);
    EXPECT_LT(train.car(1).body_rates.norm(), 1e-9);
  }
}

TEST(SpatialTanks, TouchSideBySideAtTheSumOfTheirRadii) {
  // 3.5 m beside each other, closing by 2 m/s: after 0.25 s, however far they have rolled; boxes on edge do so sooner.
  inputs::Scenario s = tanks();
  for (const double roll : {0.0, 0.25 * test::kPi, 1.0}) {
    const Matrix3d axes = turned(roll, Vector3d::UnitX());
    const std::vector<SpatialMotion> cars{at(kAloft, axes),
                                          at(kAloft + Vector3d(1.0, 3.5, 0.0), Matrix3d::Identity(), {0.0, -2.0, 0.0})};
    EXPECT_NEAR(impact_time(s, cars), 0.25, 2e-3) << roll;
  }
  s.consist[0].shape = inputs::BodyShape::box;
  EXPECT_LT(impact_time(s, {at(kAloft, turned(0.25 * test::kPi, Vector3d::UnitX())),
                            at(kAloft + Vector3d(1.0, 3.5, 0.0), Matrix3d::Identity(), {0.0, -2.0, 0.0})}),
            0.02);
}

TEST(SpatialTanks, RolledOverTheyMoveAsNotRolled) {
  for (const bool with_box : {false, true}) {
    inputs::Scenario s = tanks();
    s.consist[0].count = 1;
    s.consist.resize(2, s.consist[0]);
    if (with_box) s.consist[1].shape = inputs::BodyShape::box;
    const auto run = [&](double roll) {
      std::vector<SpatialMotion> cars = colliding();
      const Vector3d rotation = cars[0].rotation;
      cars[0].axes = cars[0].axes * turned(roll, Vector3d::UnitX());
      cars[0].body_rates = cars[0].axes.transpose() * rotation;
      Train train(s, cars);
      train.to(0.5);
      EXPECT_EQ(train.incidents().impacts.size(), 1U);
      return std::pair(train.car(0), train.car(1));
    };
    const auto straight = run(0.0), rolled = run(0.25 * test::kPi);
    EXPECT_GT((straight.first.velocity - colliding()[0].velocity).head<2>().norm(), 0.2);
    EXPECT_LT((straight.first.centre - rolled.first.centre).norm(), 1e-8);
    EXPECT_LT((straight.first.rotation - rolled.first.rotation).norm(), 1e-8);
    EXPECT_LT((straight.second.centre - rolled.second.centre).norm(), 1e-8);
    EXPECT_LT((straight.second.axes - rolled.second.axes).norm(), 1e-8);
  }
}

TEST(SpatialTanks, GainNoEnergyInATouch) {
  // They keep nothing for the way back, but where they part more slowly than by what one of them would fall in ten
  // steps: the force goes over from loading to unloading there.
  test::Random random(3);
  inputs::Scenario s = tanks();
  s.contact.restitution = 0.0;
  s.contact.crush_force = 4e6;
  s.consist[0].count = 1;
  s.consist.resize(2, s.consist[0]);
  const auto three = [&](double size) {
    return Vector3d(random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size));
  };
  int hits = 0;
  for (int i = 0; i < 60; ++i) {
    s.consist[1].shape = i % 3 == 2 ? inputs::BodyShape::box : inputs::BodyShape::cylinder;
    s.contact.friction = i % 2 == 0 ? 0.35 : 0.0;
    const Vector3d towards = three(1.0).normalized();
    Train train(
        s, {at(kAloft, turned(random.uniform(-1.5, 1.5), three(1.0)), Vector3d::Zero(), three(0.3)),
            at(kAloft + 10.0 * towards, turned(random.uniform(-1.5, 1.5), three(1.0)), -12.0 * towards, three(0.3))});
    const auto energy = [&] { return train.energy().kinetic() + train.energy().height; };
    const double first = energy(), kinetic = train.energy().kinetic();
    double least = first, gained = 0.0;
    train.to(0.6, [&] {
      gained = std::max(gained, (energy() - least) / kinetic);
      least = std::min(least, energy());
    });
    EXPECT_LT(gained, 1e-3) << i;
    if (train.incidents().impacts.empty()) continue;
    ++hits;
    EXPECT_GT((first - least) / kinetic, 0.01) << i;
  }
  EXPECT_GT(hits, 30);
}

TEST(SpatialTanks, NameTheFacesAndTheHeight) {
  using model::Face;
  const inputs::Scenario s = tanks();
  struct Case {
    Vector3d towards;  // the second tank, seen from the first
    Face a, b;
  };
  for (const Case& c : std::vector<Case>{{{0.0, 0.0, 1.0}, Face::top, Face::bottom},
                                         {{0.0, 0.6, 0.8}, Face::top, Face::bottom},
                                         {{0.0, 0.8, 0.6}, Face::left, Face::right},
                                         {{0.0, -1.0, 0.0}, Face::right, Face::left}}) {
    Train train(s, {at(kAloft), at(kAloft + 3.01 * c.towards, Matrix3d::Identity(), -c.towards)});
    train.to(0.05);
    ASSERT_EQ(train.incidents().impacts.size(), 1U);
    const model::Impact& hit = train.incidents().impacts[0];
    EXPECT_EQ(hit.face_a, c.a) << c.towards.transpose();
    EXPECT_EQ(hit.face_b, c.b);
    EXPECT_NEAR(hit.z, kAloft.z() + 1.5 * c.towards.z(), 0.03);
  }
  // Heads set aside by 1.8 and by 2.4 m: they look by 37 and by 53 degrees aside where they touch.
  const double heads = model::expand(s.consist)[0].length - 3.0;
  for (const double aside : {1.8, 2.4}) {
    const Vector3d apart(heads + std::sqrt(9.02 - aside * aside), aside, 0.0);
    Train train(s, {at(kAloft), at(kAloft + apart, Matrix3d::Identity(), {-1.0, 0.0, 0.0})});
    train.to(0.05);
    ASSERT_EQ(train.incidents().impacts.size(), 1U);
    EXPECT_EQ(train.incidents().impacts[0].face_a, aside < 2.0 ? Face::front : Face::left);
    EXPECT_EQ(train.incidents().impacts[0].face_b, aside < 2.0 ? Face::rear : Face::right);
  }
}

TEST(SpatialTanks, AHeapOfTanksComesToRest) {
  // Two lie beside each other, a third in the hollow between them.
  inputs::Scenario s = spatial(3, 2e-3);
  s.contact.law = inputs::ContactLaw::elastic;
  s.coupler.break_draft = 1e-4;
  make_tanks(s);
  const double up = 1.5 - s.terrain.rail_height;
  const Matrix3d over = turned(M_PI, Vector3d::UnitX());
  Train train(s, {at({200.0, 20.0, up}, over), at({200.0, 23.2, up}, over), at({198.0, 21.5, up + 2.8}, over)});
  train.to(20.0);
  EXPECT_LT(train.energy().kinetic(), 1e-6);
  EXPECT_GT(train.car(2).centre.z(), up + 1.0) << "it lies on them";
  const Vector3d axis = train.car(0).axes.col(0);
  const auto apart = [&](Eigen::Index k) {
    const Vector3d d = train.car(2).centre - train.car(k).centre;
    return (d - d.dot(axis) * axis).norm();
  };
  EXPECT_NEAR(apart(0), 3.0, 0.15);
  EXPECT_NEAR(apart(1), 3.0, 0.15);
}

// Whole runs

TEST(SpatialRun, EnergyIsAccountedFor) {
  struct Case {
    double step;
    bool hilly, round;
  };
  for (const auto& [step, hilly, round] :
       {Case{2e-3, false, false}, {5e-4, false, false}, {2e-3, true, false}, {2e-3, false, true}}) {
    inputs::Scenario s = everything(30, step, hilly);
    if (round) s.consist.back().shape = inputs::BodyShape::cylinder;
    simulation::Simulation sim(s);
    sim.run();
    const outcome::Outcome o = sim.outcome();
    EXPECT_EQ(o.ended, outcome::Ended::at_rest) << step << ' ' << o.energy.kinetic();
    EXPECT_LT(o.energy_residual, step == 2e-3 ? 1e-4 : 3e-5);
    const model::EnergyLedger& e = o.energy;
    for (const double taken : {e.work_on_track, e.work_off_track, e.work_rails, e.work_coupler_damping,
                               e.work_truck_damping, e.work_body_ground, e.work_impact_normal, e.work_impact_friction})
      EXPECT_GT(taken / o.energy_initial, 1e-5);
    EXPECT_LT(e.work_grade, 0.0);
    // All cars fall from the rails; on hills the train also stands at another height than before.
    if (hilly) EXPECT_GT(std::abs(e.height), 1e6);
    else EXPECT_LT(e.height, 0.0);
  }
}

TEST(SpatialRun, APileComesToRest) {
  inputs::Scenario s = test::accident(60);
  s.model = inputs::Model::spatial;
  s.terrain.bank_left = 2.0;
  s.terrain.rest_speed = 0.0;  // by its forces alone
  Train train(s);
  train.to(90.0);
  int over = 0;
  std::vector<Vector3d> places;
  for (Eigen::Index k = 0; k < 60; ++k) {
    places.push_back(train.car(k).centre);
    if (train.model().derailed(k) && train.car(k).axes(2, 2) < 0.5) ++over;
  }
  EXPECT_GT(over, 3);
  EXPECT_LT(train.energy().kinetic(), 1e-3);
  train.to(110.0);
  for (Eigen::Index k = 0; k < 60; ++k)
    EXPECT_LT((train.car(k).centre - places[static_cast<std::size_t>(k)]).norm(), 1e-4) << k;
  EXPECT_LT(train.energy().kinetic(), 1e-6);
}

TEST(SpatialRest, APileIsHeldWithoutALossInTheLedger) {
  inputs::Scenario s = everything(30, 2e-3);
  Train train(s);
  train.to(60.0);
  std::vector<Vector3d> places;
  const model::EnergyLedger before = train.energy();
  int held = 0;
  for (Eigen::Index k = 0; k < 30; ++k) {
    places.push_back(train.car(k).centre);
    if (!train.model().derailed(k)) continue;
    held += train.car(k).velocity.isZero(0.0) && train.car(k).rotation.isZero(0.0) ? 1 : 0;
  }
  EXPECT_GT(held, 5);
  train.to(70.0);
  for (Eigen::Index k = 0; k < 30; ++k) {
    if (!train.model().derailed(k)) continue;
    EXPECT_EQ(train.car(k).centre, places[static_cast<std::size_t>(k)]) << k;
  }
  EXPECT_NEAR(train.energy().suspension / before.suspension, 1.0, 1e-5);
  s.terrain.rest_speed = 0.0;
  Train free(s);
  free.to(60.0);
  EXPECT_NEAR(train.energy().total() / free.energy().total(), 1.0, 1e-4);
}

TEST(SpatialRest, AHitWakesACarAndWhatLeansOnIt) {
  // Two cars stand off the rails, end to end; a third one runs into them.
  inputs::Scenario s = spatial(3);
  s.contact.law = inputs::ContactLaw::elastic;
  s.ground.off_track_friction = 0.5;
  const auto run = [&s](double rest_speed) {
    s.terrain.rest_speed = rest_speed;
    const double length = model::expand(s.consist)[0].length, up = height_of(s) - s.terrain.rail_height;
    std::vector<SpatialMotion> cars(3);
    cars[0] = at({200.0, 0.0, up});
    cars[1] = at({200.0 - length, 0.0, up});
    cars[2] = at({200.0 - 2.0 * length - 9.0, 0.3, up}, Matrix3d::Identity(), {14.0, 0.0, 0.0});
    Train train(s, cars);
    train.to(0.6);
    const bool held = train.car(0).velocity.isZero(0.0) && train.car(1).velocity.isZero(0.0);
    EXPECT_TRUE(held || rest_speed == 0.0);
    train.to(20.0);
    return std::array<Vector3d, 3>{train.car(0).centre, train.car(1).centre, train.car(2).centre};
  };
  const auto woken = run(0.01), free = run(0.0);
  EXPECT_GT(woken[0].x(), 200.05);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT((woken[k] - free[k]).norm(), 0.05) << k;
}

/// A car that stands off the rails, and one that comes from behind without a coupler.
inputs::Scenario standing_and_coming() {
  inputs::Scenario s = spatial(2, 2e-3);
  s.contact.law = inputs::ContactLaw::elastic;
  s.contact.friction = 0.0;
  s.coupler.break_draft = 1e-4;
  s.ground.off_track_law = inputs::OffTrackLaw::by_slip;
  s.track.curves = {{10.0, 1000.0, 1.0 / 600.0}};
  s.track.grade = -0.01;
  s.ground.patches = {{-1e3, 1e3, -1.0, 1.0, 0.0}};  // nothing would hold the car in the middle of the track
  return s;
}
std::vector<SpatialMotion> standing_and_coming(const inputs::Scenario& s, double gap, double speed) {
  const double length = model::expand(s.consist)[0].length, up = height_of(s) - s.terrain.rail_height;
  const Matrix3d along = turned(std::atan(190.0 / 600.0), Vector3d::UnitZ());
  const Vector3d first(200.0, 34.0, up);
  return {at(first, along),
          at(first - along * Vector3d(length + gap, 0.3, 0.0), along, along * Vector3d(speed, 0.0, 0.0))};
}

TEST(SpatialRest, TheFirstBlowWakesACar) {
  inputs::Scenario s = standing_and_coming();
  // All of the force at once: it does not change from the first step of the blow to the next.
  s.contact.crush_force = 1e5;
  // It comes long after the car has come to rest, or in the very next steps.
  int held = 0;
  for (double gap = 8.0; gap < 11.0; gap += 0.013) {
    Train train(s, standing_and_coming(s, gap, 20.0));
    bool still = false;
    while (train.incidents().impacts.empty() && train.time() < 3.0) {
      still = train.car(0).velocity.isZero(0.0);
      train.step();
    }
    train.step();  // the blow may have begun with less than what wakes
    if (!still || train.time() > 2.9) continue;
    ++held;
    ASSERT_GT(train.car(0).velocity.x(), 0.0) << gap;
  }
  EXPECT_GT(held, 50);
}

TEST(SpatialRest, AHeldCarThatIsRestoredWakesAsItWouldHave) {
  inputs::Scenario s = standing_and_coming();
  Train whole(s, standing_and_coming(s, 20.0, 20.0));
  whole.to(0.8);
  ASSERT_TRUE(whole.car(0).velocity.isZero(0.0));
  Train resumed(s, whole);
  s.terrain.rest_speed = 0.0;
  Train free(s, whole);
  free.step();
  EXPECT_FALSE(free.car(0).velocity.isZero(0.0)) << "no car is held any more";
  for (Train* train : {&whole, &resumed}) train->to(4.0);
  EXPECT_GT(whole.car(0).centre.x(), 200.5);
  for (Eigen::Index k = 0; k < 2; ++k) EXPECT_EQ(whole.car(k).centre, resumed.car(k).centre) << k;
}

void expect_mirror_image(inputs::BodyShape shape, double time) {
  inputs::Scenario s = test::accident(12);
  s.consist.back().shape = shape;
  s.model = inputs::Model::spatial;
  s.initial.perturbation.kick = s.initial.perturbation.alignment = 0.0;
  s.terrain.bank_left = 2.0;
  s.terrain.ballast_height = 0.5;
  s.track.curves = {{-300.0, 500.0, 1.0 / 500.0, 0.08}};
  inputs::Scenario m = s;
  m.initial.yaw_rate *= -1.0;
  std::swap(m.terrain.bank_left, m.terrain.bank_right);
  m.track.curves[0].curvature *= -1.0;
  Train train(s), mirrored(m);
  train.to(time);
  mirrored.to(time);
  double turned_most = 0.0;
  for (Eigen::Index k = 0; k < 12; ++k) {
    const SpatialMotion a = train.car(k), b = mirrored.car(k);
    EXPECT_LT((a.centre - b.centre.cwiseProduct(Vector3d(1.0, -1.0, 1.0))).norm(), 1e-6) << k;
    EXPECT_NEAR(a.axes(2, 1), -b.axes(2, 1), 1e-6);
    EXPECT_NEAR(a.axes(1, 0), -b.axes(1, 0), 1e-6);
    turned_most = std::max(turned_most, std::abs(a.axes(2, 1)));
  }
  EXPECT_GT(train.incidents().impacts.size(), 0U);
  EXPECT_GT(turned_most, 0.02);
}

TEST(SpatialRun, MirroredIsTheMirrorImage) { expect_mirror_image(inputs::BodyShape::box, 5.0); }
TEST(SpatialRun, MirroredIsTheMirrorImageWithTanks) { expect_mirror_image(inputs::BodyShape::cylinder, 6.5); }

void expect_the_same_elsewhere(inputs::BodyShape shape) {
  // Off the rails on level ground, where no place differs from another.
  inputs::Scenario s = test::accident(3);
  s.consist.back().shape = shape;
  s.model = inputs::Model::spatial;
  s.ground.off_track_law = inputs::OffTrackLaw::coulomb;
  s.initial.perturbation = {};
  const double ground = height_of(s) - s.terrain.rail_height;
  std::vector<SpatialMotion> cars;
  for (int k = 0; k < 3; ++k)
    cars.push_back(at({100.0 - 15.0 * k, 6.0 * k, ground}, turned(0.3 + 0.4 * k, Vector3d::UnitZ()),
                      {8.0 + 4.0 * k, 2.0 - 3.0 * k, 0.0}, {1.5, 0.0, 0.4}));
  s.coupler.swing_stiffness = s.coupler.roll_stiffness = s.coupler.pitch_stiffness = 0.0;
  s.coupler.break_swing = kInfinity;
  s.coupler.break_draft = 0.0001;
  const Matrix3d turn = turned(2.0, Vector3d::UnitZ());
  const Vector3d shift(300.0, -700.0, 0.0);
  std::vector<SpatialMotion> moved = cars;
  for (SpatialMotion& q : moved) q = at(shift + turn * q.centre, turn * q.axes, turn * q.velocity, q.body_rates);
  Train here(s, cars), there(s, moved);
  here.to(2.0);
  there.to(2.0);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const SpatialMotion a = here.car(k), b = there.car(k);
    EXPECT_LT((shift + turn * a.centre - b.centre).norm(), 1e-6) << k;
    EXPECT_LT((turn * a.axes - b.axes).norm(), 1e-6);
  }
  EXPECT_GT(here.incidents().impacts.size(), 0U);
}

TEST(SpatialRun, MovedAndTurnedIsTheSame) { expect_the_same_elsewhere(inputs::BodyShape::box); }
TEST(SpatialRun, MovedAndTurnedIsTheSameWithTanks) { expect_the_same_elsewhere(inputs::BodyShape::cylinder); }

TEST(SpatialRun, FlatAndStiffMovesAsInThePlane) {
  inputs::Scenario plane = test::accident(15);
  plane.model = inputs::Model::extended;
  plane.initial.perturbation.kick = 0.0;
  inputs::Scenario space = plane;
  space.model = inputs::Model::spatial;
  space.terrain.rail_height = 0.0;
  space.suspension.half_base = 1.5;
  space.suspension.damping_ratio = 0.5;
  for (inputs::CarBlock& b : space.consist) b.centre_height = 0.2;
  space.coupler.height = 0.2;
  test::Train flat(plane);
  Train train(space);
  for (const double t : {0.5, 1.0, 2.0}) {
    flat.to(t);
    train.to(t);
    for (Eigen::Index k = 0; k < 15; ++k) {
      const SpatialMotion q = train.car(k);
      const test::CarMotion p = flat.car(k);
      EXPECT_NEAR(q.centre.x(), p.x, 0.03 * t * t) << k << " at " << t;
      EXPECT_NEAR(q.centre.y(), p.y, 0.03 * t * t) << k << " at " << t;
      EXPECT_NEAR(std::atan2(q.axes(1, 0), q.axes(0, 0)), p.theta, 0.01 * t * t) << k << " at " << t;
    }
    EXPECT_EQ(train.incidents().derailments.size(), flat.incidents().derailments.size());
  }
  EXPECT_GT(train.incidents().derailments.size(), 2U);
}

TEST(SpatialRun, IsTheSameForEveryInstructionSet) {
  for (const bool hilly : {false, true}) {
    // As many cars as leave a part of the widest block.
    const inputs::Scenario s = everything(18, 2e-3, hilly);
    Train plain(s, {}, "plain");
    plain.to(3.0);
    EXPECT_GT(plain.incidents().derailments.size(), 2U);
    for (const std::string& set : model::SpatialModel::instruction_sets(18)) {
      Train train(s, {}, set);
      train.to(3.0);
      for (Eigen::Index k = 0; k < 18; ++k) {
        EXPECT_LT((train.car(k).centre - plain.car(k).centre).norm(), 1e-6) << set << " car " << k;
        EXPECT_LT((train.car(k).axes - plain.car(k).axes).norm(), 1e-6) << set << " car " << k;
      }
      EXPECT_NEAR(train.energy().total(), plain.energy().total(), 1e-6 * plain.energy().total()) << set;
      EXPECT_NEAR(train.energy().work_coupler_damping, plain.energy().work_coupler_damping,
                  1e-4 * plain.energy().work_coupler_damping)
          << set;
    }
  }
}

TEST(SpatialRun, GoesOnFromACheckpointBitForBit) {
  inputs::Scenario s = everything(20, 2e-3);
  s.consist.back().count -= 8;
  s.consist.push_back(s.consist.back());
  s.consist.back().count = 8;
  s.consist[s.consist.size() - 2].shape = inputs::BodyShape::cylinder;
  simulation::Simulation whole(s);
  // While cars derail, and when brakes and ground hold them.
  for (const double t : {7.0, 22.0}) {
    whole.advance(t);
    const simulation::Checkpoint saved = whole.checkpoint();
    whole.advance(t + 8.0);
    simulation::Simulation resumed(s, saved);
    resumed.advance(t + 8.0);
    EXPECT_GT(whole.outcome().cars_derailed, 3);
    EXPECT_EQ((whole.state() - resumed.state()).cwiseAbs().maxCoeff(), 0.0) << t;
  }
}

TEST(SpatialRun, ATooLongStepIsRefused) {
  inputs::Scenario s = test::accident(5);
  s.model = inputs::Model::spatial;
  const double longest = model::step_limits(s).front().step_max;
  EXPECT_GT(longest, 2e-3);
  s.solver.fixed_step = 1.01 * longest;
  EXPECT_THROW(simulation::Simulation{s}, inputs::InputError);
  s.solver.fixed_step = 0.99 * longest;
  EXPECT_NO_THROW(simulation::Simulation{s});
  // Each new mechanism may be what limits the step.
  for (const auto& stiffen : std::vector<std::function<void()>>{
           [&] { s.suspension.stiffness = 1e12; }, [&] { s.terrain.body_stiffness = 1e12; },
           [&] { s.coupler.pitch_stiffness = 1e12; }, [&] { s.coupler.roll_stiffness = 1e12; }}) {
    const inputs::Scenario kept = s;
    stiffen();
    EXPECT_THROW(simulation::Simulation{s}, inputs::InputError);
    s = kept;
  }
}

}  // namespace
}  // namespace train_derail
