// Cars of the extended model that only roll along the track, beside the same cars with all of the plane computed.
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "same_ensembles.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail {
namespace {

using test::CarMotion;
using test::Train;

int rolling(const Train& train) {
  int count = 0;
  for (Eigen::Index k = 0; k < train.model().car_count(); ++k) count += train.model().rolls(k) ? 1 : 0;
  return count;
}

/// A train in emergency on rails that are out of line, far from the point of derailment.
inputs::Scenario in_emergency(int cars) {
  inputs::Scenario s = test::accident(cars);
  s.brakes.rolling_resistance = 0.0015;
  s.track.grade = 0.003;
  s.initial.perturbation.alignment = 0.01 * inputs::kFoot;
  return s;
}

/// All cars on the track of `s`, at mid-slack, the first one's centre at arc length `from`.
std::vector<CarMotion> on_track(const inputs::Scenario& s, double from, double speed) {
  const double d = 0.5 * s.consist.front().truck_spacing.value();
  const model::Track track(s, -4000.0, 100.0);
  std::vector<CarMotion> train;
  for (int k = 0; k < s.consist.front().count; ++k) {
    const double place = from - k * test::kPitch;
    const model::Track::Node ahead = track.at(place + d), behind = track.at(place - d);
    const Vector2 front = ahead.point, rear = behind.point, chord = front - rear;
    const Vector2 turn = ahead.tangent - behind.tangent;
    const Vector2 centre = 0.5 * (front + rear), velocity = speed * chord.normalized();
    train.push_back({centre.x(), centre.y(), std::atan2(chord.y(), chord.x()), velocity.x(), velocity.y(),
                     speed * (chord.x() * turn.y() - chord.y() * turn.x()) / chord.squaredNorm()});
  }
  return train;
}

/// Runs it with cars that may roll and with cars that may not, from 2 km before the point of derailment; calls
/// use(rolling train, full train) when both have run for `time`.
template <class Use>
void with_and_without(inputs::Scenario s, double speed, double time, const Use& use) {
  const std::vector<CarMotion> start = on_track(s, -2000.0, speed);
  Train rolls(s, start);
  s.rails.rolling_share = 0.0;
  Train full(s, start);
  rolls.to(time);
  full.to(time);
  EXPECT_EQ(rolling(full), 0);
  use(rolls, full);
}

TEST(PlanarRolling, MovesAlongTheTrackAsTheFullModelDoes) {
  with_and_without(in_emergency(30), 15.0, 12.0, [](const Train& rolls, const Train& full) {
    EXPECT_EQ(rolling(rolls), 30);
    EXPECT_LT(full.car(0).vx, 13.0);
    for (Eigen::Index k = 0; k < 30; ++k) {
      EXPECT_NEAR(rolls.car(k).x, full.car(k).x, 5e-3) << k;
      EXPECT_NEAR(rolls.car(k).vx, full.car(k).vx, 1e-3) << k;
      EXPECT_NEAR(rolls.car(k).y, full.car(k).y, 3e-3) << k;
    }
    EXPECT_NEAR(rolls.incidents().buff.force, full.incidents().buff.force, 1e-3 * full.incidents().buff.force);
  });
}

TEST(PlanarRolling, FollowsACurve) {
  inputs::Scenario s = in_emergency(30);
  s.track.curves = {{-4000.0, 6000.0, 1.0 / 800.0}};
  with_and_without(s, 12.0, 8.0, [](const Train& rolls, const Train& full) {
    EXPECT_EQ(rolling(rolls), 30);
    for (Eigen::Index k = 0; k < 30; ++k) {
      const CarMotion a = rolls.car(k), b = full.car(k);
      EXPECT_LT(std::hypot(a.x - b.x, a.y - b.y), 0.02) << k;
      EXPECT_NEAR(std::hypot(a.vx, a.vy), std::hypot(b.vx, b.vy), 2e-3) << k;
      EXPECT_NEAR(a.theta, b.theta, 2e-3) << k;
      EXPECT_NEAR(a.omega, b.omega, 0.3 * std::abs(b.omega)) << k;
    }
  });
}

TEST(PlanarRolling, LeavesTheRailsOfASharpCurveWhenAndWhereTheFullModelDoes) {
  inputs::Scenario s = in_emergency(30);
  s.brakes.emergency_time.reset();
  s.track.grade = 0.0;
  // Quasi-static L/V in the curve is a tenth below the limit: what enters it swings beyond.
  s.track.curves = {{-1880.0, 150.0, 0.9 * s.rails.derail_ratio * inputs::kStandardGravity / (25.0 * 25.0)}};
  with_and_without(s, 25.0, 8.0, [](const Train& rolls, const Train& full) {
    ASSERT_FALSE(full.incidents().derailments.empty());
    ASSERT_FALSE(rolls.incidents().derailments.empty());
    const model::Derailment &a = rolls.incidents().derailments.front(), &b = full.incidents().derailments.front();
    EXPECT_EQ(a.car, b.car);
    EXPECT_EQ(a.front, b.front);
    EXPECT_EQ(b.cause, model::Cause::lateral);
    EXPECT_GT(b.time, 4.0);
    EXPECT_NEAR(a.time, b.time, 5e-3);
    EXPECT_NEAR(a.x, b.x, 0.1);
  });
}

TEST(PlanarRolling, IsGivenUpWhileLateralForcesPassTheirShare) {
  inputs::Scenario s = in_emergency(16);
  s.brakes.emergency_time.reset();
  // v^2 / (g R) is 0.3 of the limit.
  s.track.curves = {{-1940.0, 800.0, 0.3 * s.rails.derail_ratio * inputs::kStandardGravity / (25.0 * 25.0)}};
  const std::vector<CarMotion> start = on_track(s, -2000.0, 25.0);
  for (const double share : {0.2, 0.6}) {
    s.rails.rolling_share = share;
    Train train(s, start);
    train.to(27.0);
    EXPECT_TRUE(train.incidents().derailments.empty());
    EXPECT_EQ(rolling(train), share < 0.3 ? 0 : 16) << share;
  }
}

TEST(PlanarRolling, ACutThatIsHitMovesOnAsTheFullModelSays) {
  inputs::Scenario s = test::on_rails(24, 2e-3);
  s.brakes.rolling_resistance = 0.0015;
  s.contact.law = inputs::ContactLaw::elastic;
  s.initial.perturbation.alignment = 0.01 * inputs::kFoot;
  // No couplers: eight cars run into the sixteen ahead of them.
  std::vector<CarMotion> start = test::in_line(24, -1500.0, 2.0);
  for (std::size_t k = 16; k < 24; ++k) {
    start[k].x -= 30.0;
    start[k].vx = 9.0;
  }
  std::array<std::vector<CarMotion>, 2> end;
  for (const std::size_t full : {0U, 1U}) {
    s.rails.rolling_share = full == 1U ? 0.0 : 0.2;
    Train train(s, start);
    train.to(3.0);
    EXPECT_EQ(rolling(train), full == 1U ? 0 : 24);
    while (train.incidents().impacts.empty()) train.step();
    train.step();
    EXPECT_FALSE(train.model().rolls(15) || train.model().rolls(16));
    train.to(20.0);
    for (Eigen::Index k = 0; k < 24; ++k) end[full].push_back(train.car(k));
  }
  for (std::size_t k = 0; k < 24; ++k) {
    EXPECT_NEAR(end[0][k].vx, end[1][k].vx, 0.05) << k;
    EXPECT_NEAR(end[0][k].x, end[1][k].x, 0.3) << k;
  }
}

TEST(PlanarRolling, TheLedgerClosesAndWhatIsAwayFromThePileRolls) {
  Train train(test::accident(60));
  const double at_start = train.energy().total();
  int most = 0;
  for (const double t : {2.0, 5.0, 8.0, 12.0}) {
    train.to(t);
    most = std::max(most, rolling(train));
  }
  EXPECT_GT(most, 30);
  EXPECT_GT(train.incidents().derailments.size(), 6U);
  EXPECT_NEAR(train.energy().total() / at_start, 1.0, 2e-5);
}

TEST(PlanarRolling, ARunThatIsSavedWhileCarsRollGoesOnBitForBit) {
  for (const bool curved : {false, true}) {
    inputs::Scenario s = test::accident(40);
    if (curved) s.track.curves = {{-900.0, 1500.0, 0.001}};
    simulation::Simulation whole(s), first(s);
    first.advance(2.5);
    simulation::Simulation second(s, first.checkpoint());
    for (simulation::Simulation* run : {&whole, &second}) run->run();
    EXPECT_EQ(whole.time(), second.time());
    EXPECT_TRUE(whole.state() == second.state());
  }
}

TEST(PlanarRolling, OtherInputsFromThereOnCanForbidIt) {
  inputs::Scenario s = test::accident(40);
  simulation::Simulation first(s);
  first.advance(2.0);
  const auto at_rest_in_yaw = [](const simulation::Simulation& run) {
    const auto cars = run.snapshot().cars;
    return std::count_if(cars.begin(), cars.end(), [](const auto& car) { return car.omega == 0.0; });
  };
  EXPECT_GT(at_rest_in_yaw(first), 8);
  s.rails.rolling_share = 0.0;
  simulation::Simulation second(s, first.checkpoint());
  second.advance(2.2);
  EXPECT_EQ(at_rest_in_yaw(second), 0);
}

TEST(PlanarRolling, ChangesNoOutcomeBeyondNoise) {
  const double p = test::least_p_without(
      40, [] { return test::accident(40); }, [](inputs::Scenario& s) { s.rails.rolling_share = 0.0; },
      [](const outcome::Outcome& o) {
        return std::array<double, 5>{static_cast<double>(o.cars_derailed), o.closing_speed_max.speed, o.pile_up.width,
                                     o.pile_up.length, o.coupler_buff_peak.force};
      });
  EXPECT_GT(p, 0.01);
}

}  // namespace
}  // namespace train_derail
