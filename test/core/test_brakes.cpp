// Air brakes: build-up and signal, when each car of a train begins to brake, and how far a train runs until it stops.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/model/brake_law.hpp"

namespace train_derail {
namespace {

using inputs::kStandardGravity;
using test::CarMotion;
using test::Train;

TEST(BrakeLaw, BuildsUpLinearlyAfterTheDeadTime) {
  inputs::Brakes b;
  b.dead_time = 1.5;
  b.build_up_time = 8.0;
  EXPECT_EQ(model::brake_build_up(b, -1.0), 0.0);
  EXPECT_EQ(model::brake_build_up(b, 1.4999), 0.0);
  EXPECT_DOUBLE_EQ(model::brake_build_up(b, 3.5), 0.25);
  EXPECT_DOUBLE_EQ(model::brake_build_up(b, 7.5), 0.75);
  EXPECT_EQ(model::brake_build_up(b, 9.5), 1.0);
  EXPECT_EQ(model::brake_build_up(b, 1e9), 1.0);
  EXPECT_EQ(model::brake_build_up(b, -inputs::kInfinity), 0.0);  // the signal never comes
  b.build_up_time = 0.0;
  EXPECT_EQ(model::brake_build_up(b, 1.4999), 0.0);
  EXPECT_EQ(model::brake_build_up(b, 1.5001), 1.0);
}

TEST(BrakeLaw, SignalRunsAtItsSpeed) {
  inputs::Brakes b;
  b.propagation_speed = 250.0;
  EXPECT_DOUBLE_EQ(model::brake_signal_delay(b, 1000.0), 4.0);
  EXPECT_DOUBLE_EQ(model::brake_signal_delay(b, -1000.0), 4.0);
  b.signal = inputs::BrakeSignal::electronic;
  EXPECT_EQ(model::brake_signal_delay(b, 1000.0), 0.0);
}

/// A train far before the point of derailment whose couplers carry nothing: every car shows its own brakes.
inputs::Scenario braking(int cars) {
  inputs::Scenario s = test::on_rails(cars, 5e-3);
  s.brakes.emergency_time = 2.0;
  s.brakes.dead_time = 0.7;
  s.brakes.build_up_time = 0.0;  // a step in the deceleration
  s.brakes.propagation_speed = 200.0;
  s.ground.regularization_speed = 1e-3;
  return s;
}

/// Time at which each car begins to brake [s], until `end`; infinity for those that do not.
std::vector<double> onsets(Train& train, double end) {
  const auto n = static_cast<std::size_t>(train.model().car_count());
  std::vector<double> onset(n, inputs::kInfinity), speed(n);
  const auto v = [&](std::size_t k) { return train.car(static_cast<Eigen::Index>(k)).vx; };
  for (std::size_t k = 0; k < n; ++k) speed[k] = v(k);
  while (train.time() < end) {
    const double t = train.time();
    train.step();
    for (std::size_t k = 0; k < n; ++k) {
      if (onset[k] == inputs::kInfinity && v(k) < speed[k] * (1.0 - 1e-6)) onset[k] = t;
      speed[k] = v(k);
    }
  }
  return onset;
}

/// Place of a car along the pipe, from the front of the train to its middle [m].
double place(std::size_t k) { return 0.5 * 55.0 * inputs::kFoot + static_cast<double>(k) * test::kPitch; }

TEST(BrakeWave, RunsBackFromTheHead) {
  const inputs::Scenario s = braking(60);
  Train train(s, test::in_line(60, -900.0, 20.0));
  const std::vector<double> onset = onsets(train, 12.0);
  for (std::size_t k = 0; k < 60; ++k) EXPECT_NEAR(onset[k], 2.0 + 0.7 + place(k) / 200.0, 1e-2) << k;
}

TEST(BrakeWave, ElectronicBrakesTakeHoldAtOnce) {
  inputs::Scenario s = braking(60);
  s.brakes.signal = inputs::BrakeSignal::electronic;
  Train train(s, test::in_line(60, -900.0, 20.0));
  for (const double t : onsets(train, 4.0)) EXPECT_NEAR(t, 2.7, 1e-2);
}

TEST(BrakeWave, ComesFromARemoteSourceWhereThatIsNearerInTime) {
  inputs::Scenario s = braking(60);
  s.brakes.radio_delay = 1.5;
  inputs::CarBlock front = s.consist[0], remote = front, rear = front;
  front.count = 39;
  remote.count = 1;
  remote.brake_source = inputs::BrakeSource::remote;
  rear.count = 20;
  s.consist = {front, remote, rear};
  Train train(s, test::in_line(60, -900.0, 20.0));
  const std::vector<double> onset = onsets(train, 12.0);
  int from_radio = 0;
  for (std::size_t k = 0; k < 60; ++k) {
    const double pipe = place(k) / 200.0, radio = 1.5 + std::abs(place(k) - place(39)) / 200.0;
    EXPECT_NEAR(onset[k], 2.7 + std::min(pipe, radio), 1e-2) << k;
    if (radio < pipe) ++from_radio;
  }
  EXPECT_GT(from_radio, 20);
  EXPECT_LT(from_radio, 60);
}

TEST(BrakeWave, RunsFromTheFirstCouplerThatBreaksBothWays) {
  inputs::Scenario s = braking(40);
  s.brakes.emergency_time.reset();
  s.coupler.stiffness = 1e4;
  s.coupler.break_draft = 1e2;  // too little to be seen in the speeds
  auto cars = test::in_line(40, -900.0, 20.0);
  for (std::size_t k = 0; k < 25; ++k) cars[k].vx = 20.5;
  Train train(s, cars);
  const std::vector<double> onset = onsets(train, 6.0);
  ASSERT_GE(train.incidents().broken.size(), 1u);
  const model::BrokenCoupler first = train.incidents().broken[0];
  EXPECT_EQ(first.coupler, 24);
  EXPECT_EQ(first.by, model::BrokenCoupler::By::draft);
  // Half the slack and the stretch at 100 N, at half a metre a second.
  EXPECT_NEAR(first.time, (0.5 * s.coupler.slack + 1e-2) / 0.5, 1e-2);
  const double parting = 0.5 * (place(24) + place(25));
  for (std::size_t k = 0; k < 40; ++k) {
    EXPECT_NEAR(onset[k], first.time + 0.7 + std::abs(place(k) - parting) / 200.0, 1e-2) << k;
  }
}

TEST(BrakeWave, NeverStartsWithoutACause) {
  inputs::Scenario s = braking(5);
  s.brakes.emergency_time.reset();
  Train train(s, test::in_line(5, -900.0, 20.0));
  for (const double t : onsets(train, 10.0)) EXPECT_EQ(t, inputs::kInfinity);
  EXPECT_DOUBLE_EQ(train.car(2).vx, 20.0);
}

/// Speed and way of a car with rolling resistance r and brakes B (over weight): coasts for t_0, then builds up over
/// t_b.
struct Stop {
  double r, b, t_0, t_b, v_0;

  double speed(double t) const {
    const double g = kStandardGravity, u = std::max(t - t_0, 0.0);
    const double built = u < t_b ? 0.5 * u * u / t_b : u - 0.5 * t_b;
    return v_0 - g * (r * t + b * built);
  }
  double way(double t) const {
    const double g = kStandardGravity, u = std::max(t - t_0, 0.0);
    const double twice = u < t_b ? u * u * u / (6.0 * t_b) : 0.5 * u * u - 0.5 * t_b * u + t_b * t_b / 6.0;
    return v_0 * t - g * (0.5 * r * t * t + b * twice);
  }
  double time_at(double v) const {
    double low = 0.0, high = 1e4;
    for (int i = 0; i < 200; ++i) (speed(0.5 * (low + high)) > v ? low : high) = 0.5 * (low + high);
    return low;
  }
};

TEST(BrakeForce, StopsACarWithinTheClosedForm) {
  for (const double share : {0.0, 0.5, 1.0, 1.7}) {
    inputs::Scenario s = test::on_rails(1, 2e-3);
    s.consist[0].brake_share = share;
    s.brakes.rolling_resistance = 0.01;
    s.brakes.force = 0.05;
    s.brakes.emergency_time = 1.0;
    s.brakes.dead_time = 0.5;
    s.brakes.build_up_time = 9.0;
    s.ground.regularization_speed = 1e-3;
    const Stop stop{0.01, 0.05 * share, 1.5 + place(0) / s.brakes.propagation_speed, 9.0, 20.0};
    Train train(s, {CarMotion{-2500.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
    for (const double v : {15.0, 8.0, 0.1}) {
      const double t = stop.time_at(v);
      while (train.car(0).vx > v) train.step();
      EXPECT_NEAR(train.time(), t, 0.01) << share << " to " << v;
      EXPECT_NEAR(train.car(0).x + 2500.0, stop.way(t), 0.05) << share << " to " << v;
    }
    // What the brakes have taken is all that it had.
    const double mass = train.model().cars()[0].mass;
    EXPECT_NEAR(train.energy().work_on_track / (0.5 * mass * (400.0 - std::pow(train.car(0).vx, 2))), 1.0, 1e-9);
  }
}

TEST(BrakeForce, ARunawayHasNone) {
  inputs::Scenario s = test::on_rails(1);
  s.brakes.force = 0.0;
  s.brakes.emergency_time = 0.0;
  Train train(s, {CarMotion{-500.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
  train.to(15.0);
  EXPECT_DOUBLE_EQ(train.car(0).vx, 20.0);
}

TEST(BrakeForce, IsThePapersFrictionIfThereIsNoAir) {
  inputs::Scenario s = test::on_rails(1);
  s.brakes.law = inputs::BrakeLaw::friction;
  s.ground.on_track_friction = 0.15;
  s.ground.regularization_speed = 1e-6;
  Train train(s, {CarMotion{-500.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
  train.to(5.0);
  EXPECT_NEAR(train.car(0).vx, 20.0 - 0.15 * kStandardGravity * 5.0, 1e-9);
}

/// Deceleration of a lone car in full emergency from the start [m/s^2].
double deceleration(const inputs::CarBlock& block) {
  inputs::Scenario s = braking(1);
  s.consist = {block};
  s.brakes.emergency_time = 0.0;
  s.brakes.dead_time = 0.0;
  s.brakes.propagation_speed = inputs::kInfinity;
  s.initial.speed = 20.0;
  Train train(s, {CarMotion{-1000.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
  train.to(2.0);
  return (20.0 - train.car(0).vx) / train.time();
}

TEST(Brakes, OfACarHaveOneForceWhateverItIsLoadedWith) {
  inputs::CarBlock loaded = braking(1).consist[0], empty = loaded;
  loaded.weight = 286.0 * inputs::kKip;
  empty.weight = 65.0 * inputs::kKip;
  empty.loaded_weight = loaded.weight;
  const auto force = [](const inputs::CarBlock& b) { return b.weight / kStandardGravity * deceleration(b); };
  const double full = braking(1).brakes.force * loaded.weight;
  EXPECT_NEAR(force(loaded), full, 1e-4 * full);
  EXPECT_NEAR(force(empty), full, 1e-4 * full);
  // A load sensor takes a part of it away.
  empty.brake_share = 0.5;
  EXPECT_NEAR(force(empty), 0.5 * full, 1e-4 * full);
  // Without a loaded weight it is a share of the weight.
  empty.loaded_weight.reset();
  EXPECT_NEAR(deceleration(empty), 0.5 * deceleration(loaded), 1e-4);
}

TEST(Brakes, TheEmergencyComesSoonerToAFasterTrain) {
  inputs::Scenario s = braking(1);
  s.brakes.emergency_time = 2.0;
  s.brakes.dead_time = 0.0;
  s.brakes.reference_speed = 10.0;
  s.initial.speed = 20.0;
  for (const double k : {0.0, 1.0, 2.0}) {
    s.brakes.emergency_speed_exponent = k;
    EXPECT_DOUBLE_EQ(model::emergency_moment(s.brakes, 10.0), 2.0);
    EXPECT_DOUBLE_EQ(model::emergency_moment(s.brakes, 5.0), 2.0 * std::pow(2.0, k));
    Train train(s, {CarMotion{-1000.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
    EXPECT_NEAR(onsets(train, 20.0).at(0) - place(0) / 200.0, 2.0 * std::pow(0.5, k), 0.03) << k;
  }
  EXPECT_DOUBLE_EQ(model::emergency_moment(s.brakes, 0.0), 86400.0);
}

TEST(Brakes, CrewsDifferByTheSeed) {
  inputs::Scenario s = braking(1);
  s.initial.perturbation.emergency_time = 0.5;
  s.brakes.dead_time = 0.0;
  double sum = 0.0, squares = 0.0;
  const int seeds = 400;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    Train train(s, {CarMotion{-1000.0, 0.0, 0.0, 20.0, 0.0, 0.0}});
    const double onset = onsets(train, 20.0).at(0), size = std::log((onset - place(0) / 200.0) / 2.0);
    ASSERT_LT(onset, 20.0);
    sum += size;
    squares += size * size;
  }
  EXPECT_NEAR(sum / seeds, 0.0, 4.3 * 0.5 / std::sqrt(seeds));
  EXPECT_NEAR(std::sqrt(squares / seeds), 0.5, 4.3 * 0.5 / std::sqrt(2.0 * seeds));
}

}  // namespace
}  // namespace train_derail
