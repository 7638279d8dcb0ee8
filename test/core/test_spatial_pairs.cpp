// Two cars in space that act on each other: couplers, contact, tanks; stops, momentum, energy, who touched where.
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "random_bodies.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using inputs::kFoot;
using inputs::kInfinity;
using inputs::kKip;
using model::BrokenCoupler;
using model::SpatialMotion;
using test::at;
using test::spatial;
using test::turned;
using By = BrokenCoupler::By;
using Train = test::SpatialTrain;
using test::kAloft;
using test::make_tanks;

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

TEST(SpatialCoupler, AShelfGoesWithItsCars) {
  // The same two cars, rolled together: what the shelf bears, and that it bears nothing sideways, stays.
  inputs::Scenario s = spatial(2, 1e-5);
  s.coupler.pitch_stiffness = inputs::Coupler{}.pitch_stiffness;
  s.coupler.break_swing = s.coupler.break_moment = kInfinity;
  s.coupler.swing_limit = 0.1;
  const auto by = [&](double up, double aside, double rolled) {
    const Matrix3d roll = turned(rolled, Vector3d::UnitX());
    Train train(s, {at(kAloft, roll), at(kAloft + roll * Vector3d(-test::kPitch, aside, up), roll)});
    train.step();
    const auto& found = train.incidents().broken;
    return found.empty() ? By::draft : found[0].by;
  };
  for (const double rolled : {0.0, 0.6, 0.5 * test::kPi, 2.5}) {
    EXPECT_EQ(by(0.35, 0.0, rolled), By::vertical) << rolled;
    EXPECT_EQ(by(0.0, 0.5, rolled), By::draft) << rolled << ": it holds";
  }
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

/// Two cars aloft that press on each other, level, the trail car that much higher.
inputs::Scenario in_buff(double step) {
  inputs::Scenario s = all_stops(step);
  s.coupler.slack = 0.04;
  s.coupler.damping_ratio = 0.0;
  s.coupler.pitch_stiffness = s.coupler.roll_stiffness = s.coupler.swing_stiffness = 0.0;
  return s;
}
std::vector<SpatialMotion> pressed(const inputs::Scenario& s, double rise, double squeeze) {
  const double length = model::expand(s.consist)[0].length, bar = s.coupler.length - squeeze;
  return {at(kAloft), at(kAloft + Vector3d(-length - std::sqrt(bar * bar - rise * rise), 0.0, rise))};
}

TEST(SpatialCoupler, InBuffCarsStayLevelUpToTheHeightOfTheirButts) {
  const double h = 1e-6;
  const auto lifts = [&](double rise, double squeeze) {  // the lower of the two, against its weight
    const inputs::Scenario s = in_buff(h);
    Train train(s, pressed(s, rise, squeeze));
    const double force = train.model().observe(train.data()).couplers[0].vertical_force;
    train.step();
    const double up = train.car(0).velocity.z() / h + test::kGravity;
    const double along = train.car(0).velocity.x() / h;
    // What is told is what butts add across the bar; the rest is the bar's own direction.
    const double bar = std::sqrt(std::pow(s.coupler.length - squeeze, 2) - rise * rise);
    EXPECT_NEAR(up * train.model().cars()[0].mass / (force - rise / bar * along * train.model().cars()[0].mass), 1.0,
                0.03);
    return up;
  };
  EXPECT_GT(lifts(0.03, 0.08), 0.1);
  double low = 0.01, high = 0.3;
  for (int i = 0; i < 30; ++i) (lifts(0.5 * (low + high), 0.08) > 0.0 ? low : high) = 0.5 * (low + high);
  EXPECT_NEAR(low / inputs::Coupler{}.butt_height, 1.0, 0.02);
}

TEST(SpatialCoupler, KeepsTheEnergyOfItsButts) {
  double drift[2];
  for (const int i : {0, 1}) {
    const inputs::Scenario s = in_buff(i == 0 ? 2e-4 : 1e-4);
    std::vector<SpatialMotion> cars = pressed(s, 0.05, 0.08);
    cars[0].axes = turned(0.01, {0.3, 1.0, 0.2});
    Train train(s, cars);
    const model::EnergyLedger before = train.energy();
    EXPECT_GT(before.coupler_axial, 1e4);
    drift[i] = 0.0;
    double turning = 0.0;
    train.to(0.3, [&] {
      drift[i] = std::max(drift[i], std::abs(train.energy().total() - before.total()) / before.coupler_axial);
      turning = std::max(turning, train.car(0).body_rates.norm());
    });
    EXPECT_GT(turning, 0.01);
  }
  EXPECT_LT(drift[0], 2e-2);
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
  s.consist[0].truck_weight = 0.0;
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

TEST(SpatialImpact, ReturnsItsShareOfALowSpeedWhateverTheStep) {
  inputs::Scenario s = spatial(2);
  s.contact.law = inputs::ContactLaw::elastic;
  s.contact.restitution = 0.4;
  s.ground.regularization_speed = 1e-3;
  const double reach = model::expand(s.consist)[0].length + 1e-3, speed = 0.15;
  for (const double step : {2e-3, 2e-4}) {
    s.solver.fixed_step = step;
    Train train(s, {at(kAloft), at(kAloft + reach * Vector3d::UnitX(), Matrix3d::Identity(), {-speed, 0.0, 0.0})});
    train.to(0.6);
    ASSERT_EQ(train.incidents().impacts.size(), 1U);
    EXPECT_LT(train.incidents().impacts[0].end, 0.5);
    const double parting = train.car(1).velocity.x() - train.car(0).velocity.x();
    EXPECT_NEAR(parting / (s.contact.restitution * speed), 1.0, 0.02) << step;
  }
}

TEST(SpatialImpact, IsOneUntilTheBodiesAreClearOfEachOtherAsInThePlane) {
  // In line: the second car crushes the first and parts from it; later the third drives it into the first again.
  struct Case {
    double restitution, behind;  // of the third car [m]
    long impacts;                // of the first two
  };
  for (const Case& c : {Case{0.1, 7.0, 1}, Case{0.6, 20.0, 2}}) {
    inputs::Scenario s = spatial(3);
    s.contact.law = inputs::ContactLaw::elastic;
    s.contact.crush_force = 1.5e6;
    s.contact.restitution = c.restitution;
    const double length = model::expand(s.consist)[0].length;
    const std::vector<double> x{0.0, -length - 0.01, -2.0 * length - 0.01 - c.behind}, speed{0.0, 6.0, 8.0};
    std::vector<SpatialMotion> high;
    std::vector<test::CarMotion> flat;
    for (std::size_t k = 0; k < 3; ++k) {
      high.push_back(at({kAloft.x() + x[k], 0.0, 400.0}, Matrix3d::Identity(), {speed[k], 0.0, 0.0}));
      flat.push_back({kAloft.x() + x[k], 0.0, 0.0, speed[k], 0.0, 0.0});
    }
    Train space(s, high);
    s.model = inputs::Model::extended;
    test::Train plane(s, flat);
    double pause = 0.0;
    space.to(6.0, [&] {
      if (space.incidents().impacts.size() == 1) pause = space.time() - space.incidents().impacts[0].end;
    });
    plane.to(6.0);
    EXPECT_GT(pause, 0.5);
    const auto of_the_first_two = [](const model::Incidents& found) {
      return std::count_if(found.impacts.begin(), found.impacts.end(), [](const auto& i) { return i.car_a == 0; });
    };
    EXPECT_EQ(of_the_first_two(space.incidents()), c.impacts);
    EXPECT_EQ(of_the_first_two(plane.incidents()), c.impacts);
    EXPECT_GT(space.car(0).velocity.x(), 4.0);
    EXPECT_GT(plane.car(0).vx, 4.0);
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
    if (shape == inputs::BodyShape::cylinder) {
      EXPECT_NEAR(hit.z, kAloft.z(), 0.05);
    }
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
  const auto tumbling = [&](const Vector3d& centre, const Vector3d& velocity) {
    const double angle = random.uniform(-1.5, 1.5);
    const Vector3d about = test::random_vector(random, 1.0), rotation = test::random_vector(random, 0.3);
    return at(centre, turned(angle, about), velocity, rotation);
  };
  int hits = 0;
  for (int i = 0; i < 60; ++i) {
    s.consist[1].shape = i % 3 == 2 ? inputs::BodyShape::box : inputs::BodyShape::cylinder;
    s.contact.friction = i % 2 == 0 ? 0.35 : 0.0;
    const Vector3d towards = test::random_vector(random, 1.0).normalized();
    Train train(s, {tumbling(kAloft, Vector3d::Zero()), tumbling(kAloft + 10.0 * towards, -12.0 * towards)});
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
    EXPECT_GT((first - least) / kinetic, 1e-3) << i;
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

}  // namespace
}  // namespace train_derail
