// Rails that yield: force and damping against an oscillator's closed form, the limit and its time, and why trucks
// leave.
#include <algorithm>
#include <functional>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/model/rail_law.hpp"
#include "train_derail/model/track.hpp"

namespace train_derail {
namespace {

using model::Cause;
using test::CarMotion;
using test::Train;

TEST(RailLaw, ForceOpposesOffsetAndRate) {
  inputs::Rails r;
  r.stiffness = 2e7;
  EXPECT_DOUBLE_EQ(model::rail_force(r, 3e5, 0.01, 0.0), -2e5);
  EXPECT_DOUBLE_EQ(model::rail_force(r, 3e5, -0.01, 0.0), 2e5);
  EXPECT_DOUBLE_EQ(model::rail_force(r, 3e5, 0.0, 0.2), -6e4);
  EXPECT_DOUBLE_EQ(model::rail_force(r, 3e5, 0.01, 0.2), -2.6e5);
}

/// Lateral force of a truck over time, in steps of length h: when it leaves the rails, or infinity.
double leaves_at(const inputs::Rails& r, double load, double h, int steps, const std::function<double(double)>& force) {
  double overloaded = 0.0;
  for (int i = 0; i < steps; ++i) {
    const double from = force(i * h), to = force((i + 1) * h);
    overloaded = model::overloaded_time<double>(r, from, to, load, h, overloaded);
    if (overloaded > r.derail_time) return model::derail_moment(r, from, to, load, (i + 1) * h, h, overloaded);
  }
  return inputs::kInfinity;
}

TEST(RailLaw, YieldsWhenTheLimitHasBeenExceededForThatLongWithoutABreak) {
  inputs::Rails r;
  r.derail_ratio = 0.8;
  r.derail_time = 0.0205;
  const double load = 1000.0;
  // However long the step is: also if the time ends within one.
  for (const double h : {0.001, 0.004, 0.013}) {
    for (const double sign : {1.0, -1.0}) {
      EXPECT_NEAR(leaves_at(r, load, h, 100, [&](double) { return sign * 801.0; }), 0.0205, 1e-12) << h;
      // A ramp reaches 800 N at 0.08 s.
      EXPECT_NEAR(leaves_at(r, load, h, 200, [&](double t) { return sign * 1e4 * t; }), 0.08 + 0.0205, 1e-12) << h;
    }
    EXPECT_EQ(leaves_at(r, load, h, 1000, [](double) { return 799.9; }), inputs::kInfinity);
  }
  // Above the limit from 0.01 to 0.03 s, again from 0.05 s on: each time counts anew.
  const auto twice = [](double t) { return t > 0.0095 && t < 0.0295 ? 2000.0 : t > 0.0495 ? 2000.0 : 0.0; };
  EXPECT_NEAR(leaves_at(r, load, 0.001, 100, twice), 0.05 + 0.0205, 1e-3);
  // It falls below the limit within the very step in which the time is over.
  EXPECT_NEAR(leaves_at(r, load, 0.03, 1, [](double t) { return 900.0 - 120.0 / 0.03 * t; }), 0.0205, 1e-12);
  r.derail_time = 0.0;
  EXPECT_NEAR(leaves_at(r, load, 0.01, 100, [](double t) { return 1e4 * t; }), 0.08, 1e-12);
}

/// y(t) of y'' + 2 z w y' + w^2 y = 0 from y0 at rest.
double ring_down(double y0, double w, double z, double t) {
  const double damped = w * std::sqrt(1.0 - z * z);
  return y0 * std::exp(-z * w * t) * (std::cos(damped * t) + z * w / damped * std::sin(damped * t));
}

class OffsetCar : public testing::TestWithParam<double> {};

TEST_P(OffsetCar, RingsDownAsADampedOscillator) {
  // Two springs k_r under a mass M: w^2 = 2 k_r / M, and the damping ratio is the one of the input.
  inputs::Scenario s = test::on_rails(1);
  s.rails.damping_ratio = GetParam();
  const double mass = s.consist[0].weight / inputs::kStandardGravity, w = std::sqrt(2.0 * s.rails.stiffness / mass);
  for (const bool yaw : {false, true}) {
    double error[2];
    for (int fine = 0; fine < 2; ++fine) {
      const double h = 2e-4 / (fine + 1);
      s.solver.fixed_step = h;
      const double y0 = yaw ? 0.0 : 0.01, theta0 = yaw ? 0.001 : 0.0;
      Train train(s, {CarMotion{-500.0, y0, theta0, 0.0, 0.0, 0.0}});
      const model::Car& car = train.model().cars()[0];
      const double rate = yaw ? w * 0.5 * car.truck_spacing * std::sqrt(mass / car.yaw_inertia) : w;
      const double ratio = GetParam() * rate / w, start = yaw ? theta0 : y0;
      error[fine] = 0.0;
      for (int i = 1; i <= 50; ++i) {
        train.to(0.01 * i);
        const double value = yaw ? train.car(0).theta : train.car(0).y;
        error[fine] = std::max(error[fine], std::abs(value - ring_down(start, rate, ratio, train.time())) / start);
      }
      EXPECT_TRUE(train.incidents().derailments.empty());
    }
    EXPECT_LT(error[0], 1e-2) << "yaw " << yaw;
    EXPECT_NEAR(error[1] / error[0], 0.5, 0.05) << "yaw " << yaw;  // first order
  }
}

INSTANTIATE_TEST_SUITE_P(Damping, OffsetCar, testing::Values(0.0, 0.15, 0.5));

TEST(Rails, HoldTowardsTheSideThatTheyComeFrom) {
  inputs::Scenario s = test::on_rails(1);
  Train train(s, {CarMotion{-500.0, 0.01, 0.0, 10.0, 0.0, 0.0}});
  EXPECT_LT(train.rates_over_a_step(0).vy, 0.0);
  EXPECT_EQ(train.car(0).omega, 0.0);
}

// A load that grows from nothing: the car is thrown sideways with v, k y = k v / w sin(w t) on either truck.
TEST(Rails, LetGoWhenTheLateralForceHasBeenTooLargeForLongEnough) {
  inputs::Scenario s = test::on_rails(1, 1e-4);
  s.rails.damping_ratio = 0.0;
  s.rails.derail_time = 0.02;
  const double mass = s.consist[0].weight / inputs::kStandardGravity, w = std::sqrt(2.0 * s.rails.stiffness / mass);
  const double limit = s.rails.derail_ratio * 0.5 * s.consist[0].weight;
  for (const double side : {1.0, -1.0}) {
    // Above the limit between asin(limit / top) and pi minus that: over a span T if top = limit / cos(w T / 2).
    const double rate = limit / s.rails.stiffness * w;
    Train short_push(s, {CarMotion{-500.0, 0.0, 0.0, 10.0, side * rate / std::cos(0.5 * w * 0.0195), 0.0}});
    short_push.to(0.5 * test::kPi / w + 0.1);
    EXPECT_TRUE(short_push.incidents().derailments.empty());

    const double top = 1.0 / std::cos(0.5 * w * 0.0205);
    Train push(s, {CarMotion{-500.0, 0.0, 0.0, 10.0, side * rate * top, 0.0}});
    push.to(0.5 * test::kPi / w + 0.1);
    ASSERT_EQ(push.incidents().derailments.size(), 2u);  // both trucks bear the same
    for (const model::Derailment& d : push.incidents().derailments) {
      EXPECT_EQ(d.cause, Cause::lateral);
      EXPECT_EQ(d.car, 0);
      EXPECT_NEAR(d.time, std::asin(1.0 / top) / w + s.rails.derail_time, 3e-4);
      EXPECT_NEAR(d.x, -500.0 + 10.0 * d.time + (d.front ? 0.5 : -0.5) * *s.consist[0].truck_spacing, 1e-2);
      EXPECT_GT(side * d.y, 0.9 * limit / s.rails.stiffness);
    }
    EXPECT_NE(push.incidents().derailments[0].front, push.incidents().derailments[1].front);
    EXPECT_TRUE(push.model().derailed(0));
    EXPECT_FALSE(push.model().past_pod(0));
  }
}

TEST(Rails, HoldLightCarsByTheirOwnStrength) {
  inputs::Rails r;
  EXPECT_EQ(model::holding_load(r, 2e5, 1e5), 2e5);
  r.load_exponent = 0.0;
  r.reference_weight = 1.2e6;
  for (const double weight : {3e5, 1.2e6, 2.4e6}) EXPECT_DOUBLE_EQ(model::holding_load(r, 0.5 * weight, weight), 6e5);
  // A car of a quarter of the weight at the power one half: as if L/V had twice the limit.
  inputs::Scenario s = test::on_rails(1, 1e-4);
  s.rails.derail_ratio = 0.4;
  s.rails.load_exponent = 0.5;
  s.rails.reference_weight = 4.0 * s.consist[0].weight;
  const double mass = s.consist[0].weight / inputs::kStandardGravity, w = std::sqrt(2.0 * s.rails.stiffness / mass);
  const auto left = [&](double share) {  // of the limit of 0.8
    const double rate = 0.8 * 0.5 * s.consist[0].weight / s.rails.stiffness * w;
    s.rails.damping_ratio = s.rails.derail_time = 0.0;
    Train push(s, {CarMotion{-500.0, 0.0, 0.0, 10.0, share * rate, 0.0}});
    push.to(test::kPi / w);
    return push.incidents().derailments.size();
  };
  EXPECT_EQ(left(0.98), 0u);
  EXPECT_EQ(left(1.02), 2u);
  s.rails.load_exponent = 1.0;
  EXPECT_EQ(left(0.6), 2u);
}

TEST(Rails, ThatNeverYieldHoldAnything) {
  inputs::Scenario s = test::on_rails(1, 1e-4);
  s.rails.derail_ratio = inputs::kInfinity;
  Train train(s, {CarMotion{-500.0, 0.0, 0.0, 10.0, 5.0, 0.0}});
  train.to(0.5);
  EXPECT_TRUE(train.incidents().derailments.empty());
  EXPECT_FALSE(train.model().derailed(0));
}

// Over a curve the rails push with M v^2 / R, half of it on either truck: L/V = v^2 / (g R).
TEST(Rails, LetGoInACurveAtTheSpeedOfTheirLimit) {
  for (const double turn : {1.0, -1.0}) {
    inputs::Scenario s = test::on_rails(1);
    s.rails.damping_ratio = 1.0;
    s.rails.derail_ratio = 0.3;
    const double radius = 600.0, critical = std::sqrt(s.rails.derail_ratio * inputs::kStandardGravity * radius);
    s.track.curves = {{-400.0, 300.0, turn / radius}};
    for (const double share : {0.93, 1.07}) {
      s.initial.speed = share * critical;
      // On the tangent before the curve's middle, then into it: start far enough behind it.
      const model::Track track(s, -1000.0, 100.0);
      const model::Track::Node node = track.at(-450.0);
      const double heading = std::atan2(node.tangent.y(), node.tangent.x());
      const Eigen::Vector2d v = s.initial.speed * node.tangent;
      Train train(s, {CarMotion{node.point.x(), node.point.y(), heading, v.x(), v.y(), 0.0}});
      train.to(300.0 / s.initial.speed);
      const auto& left = train.incidents().derailments;
      if (share < 1.0) {
        EXPECT_TRUE(left.empty()) << turn;
        continue;
      }
      ASSERT_FALSE(left.empty()) << turn;
      EXPECT_EQ(left[0].cause, Cause::lateral);
      // It runs off to the outside.
      EXPECT_LT(turn * train.model().track_place(left[0].car, {left[0].x, left[0].y}).offset, 0.0);
    }
  }
}

std::map<Cause, int> causes(const model::Incidents& incidents) {
  std::map<Cause, int> count;
  for (const model::Derailment& d : incidents.derailments) ++count[d.cause];
  return count;
}

TEST(Derailments, EveryTruckLeavesAtThePointOfDerailment) {
  inputs::Scenario s = test::on_rails(4);
  for (const double torn : {0.0, 5.0 * inputs::kFoot, 7.3}) {
    s.rails.torn_length = torn;
    Train train(s, test::in_line(4, -30.0, 20.0));
    train.to(7.0);  // all have come past it
    const auto& left = train.incidents().derailments;
    ASSERT_EQ(left.size(), 8u) << torn;
    const double half = 0.5 * *s.consist[0].truck_spacing;
    for (std::size_t i = 0; i < 8; ++i) {
      const model::Derailment& d = left[i];
      EXPECT_EQ(d.cause, Cause::pod) << torn << " " << i;
      EXPECT_EQ(d.car, static_cast<Eigen::Index>(i / 2));
      EXPECT_EQ(d.front, i % 2 == 0);
      EXPECT_NEAR(d.x, 0.0, 0.021) << torn << " " << i;  // one step
      EXPECT_EQ(d.y, 0.0);
      EXPECT_NEAR(d.time, (30.0 + static_cast<double>(d.car) * test::kPitch - (d.front ? half : -half)) / 20.0, 2e-3);
    }
    for (Eigen::Index k = 0; k < 4; ++k) EXPECT_TRUE(train.model().past_pod(k));
  }
}

TEST(Derailments, ATruckThatLeavesTearsUpTheTrackForTheNext) {
  for (const double torn : {1.5, 0.0}) {
    inputs::Scenario s = test::on_rails(2);
    s.rails.torn_length = torn;
    s.rails.derail_time = 0.0;
    // The leader is thrown off 60 m before the point of derailment, the follower comes straight behind it; none gets to
    // the point.
    auto cars = test::in_line(2, -60.0, 20.0);
    cars[0].vy = 3.0;
    Train train(s, cars);
    train.to(2.5);
    const auto count = causes(train.incidents());
    EXPECT_EQ(count.count(Cause::pod), 0u);
    ASSERT_EQ(count.at(Cause::lateral), 2);
    if (torn == 0.0) {
      EXPECT_EQ(count.count(Cause::torn_track), 0u);
      EXPECT_FALSE(train.model().derailed(1));
      continue;
    }
    ASSERT_EQ(count.at(Cause::torn_track), 2);
    const auto& left = train.incidents().derailments;
    double rearmost = 1e9;
    for (const auto& d : left) {
      if (d.cause != Cause::lateral) continue;
      rearmost = std::min(rearmost, d.x);
    }
    for (const auto& d : left) {
      if (d.cause != Cause::torn_track) continue;
      EXPECT_EQ(d.car, 1);
      EXPECT_GE(d.x, rearmost - torn - 0.02);  // the first torn piece that it comes to
      EXPECT_LE(d.x, rearmost + 0.02);
    }
  }
}

TEST(Derailments, ATrainThatStartsOverThePointHasLostTheTrucksThatAreBeyondIt) {
  const inputs::Scenario s = test::on_rails(2);
  Train train(s);
  ASSERT_EQ(train.incidents().derailments.size(), 1u);
  EXPECT_TRUE(train.incidents().derailments[0].front);
  EXPECT_EQ(train.incidents().derailments[0].cause, Cause::pod);
  EXPECT_TRUE(train.model().derailed(0));
  EXPECT_FALSE(train.model().derailed(1));
}

// Cars ahead of the point of derailment stay on sound track, and are not counted as past it.
TEST(Derailments, CarsAheadOfThePointRunOn) {
  inputs::Scenario s = test::on_rails(6);
  s.initial.cars_ahead = 3;
  s.initial.speed = 20.0;
  Train train(s);
  const double foremost = train.car(0).x;
  EXPECT_NEAR(train.model().front_truck(train.data(), 3).position.x(), 0.0, 1e-12);  // it has come to the point
  EXPECT_NEAR(foremost - train.car(3).x, 3.0 * test::kPitch, 1e-9);
  train.to(6.0);
  for (Eigen::Index k = 0; k < 3; ++k) {
    EXPECT_FALSE(train.model().derailed(k)) << k;
    EXPECT_FALSE(train.model().past_pod(k)) << k;
    EXPECT_NEAR(train.car(k).x, foremost - static_cast<double>(k) * test::kPitch + 120.0, 1e-6);
  }
  for (Eigen::Index k = 3; k < 6; ++k) EXPECT_TRUE(train.model().derailed(k)) << k;
  for (const model::Derailment& d : train.incidents().derailments) EXPECT_GE(d.car, 3);
}

// A kick is an impulse at the truck, across the car: there the velocity changes by exactly that.
TEST(Kicks, ChangeTheVelocityOfTheTruckByTheKick) {
  inputs::Scenario s = test::on_rails(1);
  s.rails.torn_length = 0.0;
  double sum = 0.0, squares = 0.0;
  const int seeds = 200;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    s.initial.perturbation.kick = 0.5;
    Train train(s, {CarMotion{-9.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
    const model::Car& car = train.model().cars()[0];
    const double arm = 0.5 * car.truck_spacing;
    double energy = 0.5 * car.mass * 400.0;
    CarMotion before = train.car(0);
    while (train.incidents().derailments.empty()) {
      before = train.car(0);
      train.step();
    }
    ASSERT_TRUE(train.incidents().derailments[0].front);
    const CarMotion after = train.car(0);
    const double kick = after.vy + arm * after.omega;
    ASSERT_NE(kick, 0.0);
    // The centre of percussion of the impulse has not moved: no rate there, at -I / (M arm).
    EXPECT_NEAR(after.vy - car.yaw_inertia / (car.mass * arm) * after.omega, 0.0, 1e-14 + 1e-12 * std::abs(kick));
    EXPECT_EQ(before.vy, 0.0);
    EXPECT_DOUBLE_EQ(after.vx, 20.0);
    EXPECT_NEAR(train.energy().work_kicks, -0.5 * kick * kick / (1.0 / car.mass + arm * arm / car.yaw_inertia),
                1e-9 * energy);
    EXPECT_NEAR(train.energy().total() / energy, 1.0, 1e-13);
    sum += kick;
    squares += kick * kick;
    s.initial.perturbation.kick = 1.0;  // twice the kick from the same seed
    Train twice(s, {CarMotion{-9.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
    twice.to(train.time());
    EXPECT_NEAR((twice.car(0).vy + arm * twice.car(0).omega) / kick, 2.0, 1e-12);
  }
  // Normal with the standard deviation of the input: mean within 3.5 sigma / sqrt(n), variance within 3.5 sqrt(2 / n).
  EXPECT_LT(std::abs(sum / seeds), 3.5 * 0.5 / std::sqrt(seeds));
  EXPECT_NEAR(squares / seeds / 0.25, 1.0, 3.5 * std::sqrt(2.0 / seeds));
}

TEST(Alignment, HasItsStandardDeviationAndPushesTheCars) {
  inputs::Scenario s = test::on_rails(1);
  s.initial.perturbation.alignment = 0.01;
  double squares = 0.0, knots = 0.0;
  for (int seed = 0; seed < 20; ++seed) {
    s.initial.perturbation.seed = seed;
    const model::Track track(s, -1000.0, 100.0);
    double before = track.alignment(-1000.0);
    for (double at = -1000.0; at < 90.0; at += 0.25) {
      // No steps: half a cosine over 20 ft between knots of 10 mm does not rise faster than that.
      EXPECT_LT(std::abs(track.alignment(at) - before), 0.25 * 0.5 * test::kPi * 6.0 * 0.01 / (20.0 * inputs::kFoot));
      before = track.alignment(at);
    }
    for (double at = -1000.0; at < 90.0; at += 20.0 * inputs::kFoot) {
      squares += std::pow(track.alignment(at), 2);
      ++knots;
    }
  }
  EXPECT_NEAR(squares / knots / 1e-4, 1.0, 3.5 * std::sqrt(2.0 / knots));
  // A car at a walk follows the rails: its trucks stand on them. The model's table begins 100 m behind the train.
  s.initial.perturbation.seed = 3;
  Train train(s, {CarMotion{-100.0, 0.0, 0.0, 0.5, 0.0, 0.0}});
  const model::Track track(s, -(test::kPitch + 100.0), 100.0);
  double largest = 0.0;
  for (int i = 0; i < 40; ++i) {
    train.to(10.0 + 0.5 * i);
    for (const auto& truck : {train.model().front_truck(train.data(), 0), train.model().rear_truck(train.data(), 0)}) {
      EXPECT_NEAR(truck.position.y(), track.alignment(truck.position.x()), 2e-4);
      largest = std::max(largest, std::abs(truck.position.y()));
    }
  }
  EXPECT_GT(largest, 0.005);
  EXPECT_TRUE(train.incidents().derailments.empty());
}

}  // namespace
}  // namespace train_derail
