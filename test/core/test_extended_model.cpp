// The extended model as a whole: momenta, curves, symmetry, and that it is the paper's model with its parts off.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/model/track.hpp"

namespace train_derail {
namespace {

using test::CarMotion;
using test::Train;

/// A crumpled free train whose couplers, gears, dampers, swing stops and bodies all act; no ground.
inputs::Scenario crumpling(double step) {
  inputs::Scenario s = test::accident(12);
  s.ground = {};
  test::set_friction(s, 0.0, 0.0);
  s.brakes = {};
  s.initial = {};
  s.solver.fixed_step = step;
  return s;
}

std::vector<CarMotion> crumpled(const inputs::Scenario& s, std::uint64_t seed) {
  test::Random random(seed);
  std::vector<CarMotion> cars = test::in_line(s.consist[0].count, -300.0, 0.0);
  for (CarMotion& c : cars) {
    c.y = random.uniform(-0.3, 0.3);
    c.theta = random.uniform(-0.1, 0.1);
    c.vx = -c.x * 0.05 - 10.0 + random.uniform(-1.0, 1.0);  // runs together from both ends
    c.vy = random.uniform(-2.0, 2.0);
    c.omega = random.uniform(-0.3, 0.3);
  }
  return cars;
}

TEST(Momentum, IsKeptByCouplersAndBodies) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    for (const double step : {4e-3, 1e-3}) {
      const inputs::Scenario s = crumpling(step);
      Train train(s, crumpled(s, seed));
      const model::Momentum before = train.momentum();
      double scale = 0.0;  // sum of magnitudes
      for (Eigen::Index k = 0; k < 12; ++k)
        scale += train.model().cars()[0].mass * std::hypot(train.car(k).vx, train.car(k).vy);
      for (int i = 1; i <= 5; ++i) {
        train.to(i);
        const model::Momentum after = train.momentum();
        EXPECT_NEAR((after.x - before.x) / scale, 0.0, 1e-12);
        EXPECT_NEAR((after.y - before.y) / scale, 0.0, 1e-12);
        // v += h a, q += h v keeps the angular momentum of forces with common points too, at any step.
        EXPECT_NEAR((after.angular - before.angular) / (300.0 * scale), 0.0, 1e-12);
      }
      EXPECT_GT(train.incidents().impacts.size(), 3u);
      EXPECT_GT(train.incidents().buff.force, 1e6);
      const model::EnergyLedger e = train.energy();
      EXPECT_GT(e.work_coupler_damping, 0.0);
      EXPECT_GT(e.work_impact_friction, 0.0);
      EXPECT_EQ(e.work_on_track + e.work_off_track + e.work_rails, 0.0);
    }
  }
}

// Only differences of places and velocities matter where there is no ground.
TEST(Galilei, SlidingAlongChangesNothing) {
  const inputs::Scenario s = crumpling(1e-3);
  std::vector<CarMotion> cars = crumpled(s, 4), moving = cars;
  for (CarMotion& c : moving) {
    c.vx += 8.0;
    c.vy -= 3.0;
    c.x += 16.0;
    c.y += 4.0;
  }
  Train a(s, cars), b(s, moving);
  a.to(1.0);
  b.to(1.0);
  for (Eigen::Index k = 0; k < 12; ++k) {
    EXPECT_NEAR(b.car(k).x - a.car(k).x, 24.0, 1e-7);
    EXPECT_NEAR(b.car(k).y - a.car(k).y, 1.0, 1e-7);
    EXPECT_NEAR(b.car(k).theta - a.car(k).theta, 0.0, 1e-8);
  }
}

/// An arc that ends 200 m before the point of derailment, 300 m long; before and after it the track is straight.
class OnACurve : public testing::TestWithParam<double> {
 protected:
  static inputs::Scenario scenario(int cars) {
    inputs::Scenario s = test::on_rails(cars);
    s.track.curves = {{-500.0, 300.0, GetParam()}};
    return s;
  }
  /// Cars in line on the straight before the arc, the first one's centre `ahead` before it. The arc turns by 300 m / R
  /// up to the heading 0 at (-200, 0).
  static std::vector<CarMotion> before_the_arc(int cars, double ahead, double speed) {
    const double heading = -300.0 * GetParam(), radius = 1.0 / GetParam();
    const Eigen::Vector2d start(-200.0 - radius * std::sin(-heading), radius * (1.0 - std::cos(heading)));
    const Eigen::Vector2d along(std::cos(heading), std::sin(heading));
    std::vector<CarMotion> train;
    for (int k = 0; k < cars; ++k) {
      const Eigen::Vector2d p = start - (ahead + k * test::kPitch) * along, v = speed * along;
      train.push_back({p.x(), p.y(), heading, v.x(), v.y(), 0.0});
    }
    return train;
  }
};

TEST_P(OnACurve, ATrainFollowsTheTrackAtItsSpeed) {
  inputs::Scenario s = scenario(8);
  s.coupler = test::accident(8).coupler;
  Train train(s, before_the_arc(8, 20.0, 15.0));
  const double energy = train.energy().kinetic(),
               deflection = train.model().cars()[0].mass * 225.0 * GetParam() / (2.0 * s.rails.stiffness);
  bool in_the_arc = false;
  for (int i = 1; i <= 33; ++i) {
    train.to(i);
    for (Eigen::Index k = 0; k < 8; ++k) {
      EXPECT_NEAR(std::hypot(train.car(k).vx, train.car(k).vy), 15.0, 0.05);
      for (const auto& truck :
           {train.model().front_truck(train.data(), k), train.model().rear_truck(train.data(), k)}) {
        EXPECT_LT(std::abs(train.model().track_place(k, truck.position).offset), 3.0 * std::abs(deflection) + 1e-3);
      }
    }
    in_the_arc = in_the_arc || std::abs(train.car(0).omega - 15.0 * GetParam()) < 0.1 * 15.0 * std::abs(GetParam());
  }
  EXPECT_TRUE(in_the_arc);
  EXPECT_TRUE(train.incidents().derailments.empty());
  // 495 m on the foremost car is 25 m before the origin, on the straight along +x.
  EXPECT_NEAR(train.car(0).x, -25.0, 0.5);
  EXPECT_NEAR(train.car(0).y, 0.0, 5e-3);
  EXPECT_NEAR(train.car(0).theta, 0.0, 1e-3);
  EXPECT_NEAR(train.car(0).vx, 15.0, 0.05);
  EXPECT_NEAR(train.energy().total() / energy, 1.0, 1e-3);
}

TEST_P(OnACurve, TheRailsPushWithTheCentripetalForce) {
  inputs::Scenario s = scenario(1);
  s.rails.damping_ratio = 1.0;
  Train train(s, before_the_arc(1, 20.0, 20.0));
  train.to(4.0);
  // The trucks hang outside by what the rails give way under half of M v^2 / R each.
  double offset = 0.0;
  const int samples = 1000;
  for (int i = 0; i < samples; ++i) {
    train.to(4.0 + 0.01 * i);
    offset += 0.5 *
              (train.model().track_place(0, train.model().front_truck(train.data(), 0).position).offset +
               train.model().track_place(0, train.model().rear_truck(train.data(), 0).position).offset) /
              samples;
  }
  const double expected = -train.model().cars()[0].mass * 400.0 * GetParam() / (2.0 * s.rails.stiffness);
  EXPECT_NEAR(offset / expected, 1.0, 0.05);
  EXPECT_NEAR(train.car(0).omega / (20.0 * GetParam()), 1.0, 0.1);
}

TEST_P(OnACurve, TheTrackIsTheClosedForm) {
  const double curvature = GetParam();
  const model::Track track(scenario(1), -1000.0, 100.0);
  for (double at = -499.0; at < -201.0; at += 0.7) {
    const double u = at + 200.0;  // heading curvature * u
    const model::Track::Node node = track.at(at);
    EXPECT_NEAR(node.point.x(), -200.0 + std::sin(curvature * u) / curvature, 1e-3) << at;
    EXPECT_NEAR(node.point.y(), (1.0 - std::cos(curvature * u)) / curvature, 1e-3) << at;
    EXPECT_NEAR(node.tangent.x(), std::cos(curvature * u), 2e-4) << at;  // half a node into the arc
    EXPECT_NEAR(node.tangent.y(), std::sin(curvature * u), 1e-3) << at;
    // From a metre to the left of it, the foot is the same place.
    const Eigen::Vector2d beside = node.point + Eigen::Vector2d(-node.tangent.y(), node.tangent.x());
    EXPECT_NEAR(track.foot(beside, at + 3.0), at, 2e-3) << at;
  }
  EXPECT_NEAR(track.at(0.0).point.norm(), 0.0, 1e-12);
  EXPECT_NEAR((track.at(50.0).point - Eigen::Vector2d(50.0, 0.0)).norm(), 0.0, 1e-12);
}

INSTANTIATE_TEST_SUITE_P(LeftAndRight, OnACurve, testing::Values(1.0 / 400.0, -1.0 / 400.0, 1.0 / 1000.0));

// Beside a track that comes back to itself: none of all its places is nearer.
TEST(TrackPlace, IsTheNearestOfTheWholeTrack) {
  inputs::Scenario s = test::on_rails(1);
  s.track.curves = {{-900.0, 500.0, 1.0 / 120.0}, {-300.0, 200.0, -1.0 / 150.0}};
  const model::Track track(s, -1500.0, 300.0);
  test::Random random(3);
  for (int i = 0; i < 300; ++i) {
    const model::Track::Node node = track.at(random.uniform(-1500.0, 300.0));
    const Eigen::Vector2d across(-node.tangent.y(), node.tangent.x()),
        at = node.point + random.uniform(-50.0, 50.0) * across;
    double least = inputs::kInfinity;
    for (double arc = -1500.0; arc < 300.0; arc += 0.5) least = std::min(least, (track.at(arc).point - at).norm());
    EXPECT_LT((track.at(track.nearest(at)).point - at).norm(), least + 0.01) << at.transpose();
  }
}

TEST(HorseshoeCurve, HoldsATrainThatIsLongerThanItsDiameter) {
  // As above Altoona: 220 degrees at a radius of 186 m. 50 cars stand in it.
  inputs::Scenario s = test::on_rails(50);
  s.initial.speed = 5.0;
  s.track.curves = {{-800.0, 720.0, 1.0 / 186.0}};
  Train train(s);
  for (Eigen::Index k = 0; k < 50; ++k) {
    EXPECT_LT(std::abs(train.model().track_place(k, train.model().rear_truck(train.data(), k).position).offset), 2e-3)
        << k;
  }
  train.to(2.0);
  for (const model::Derailment& d : train.incidents().derailments) EXPECT_EQ(d.car, 0);
  for (Eigen::Index k = 1; k < 50; ++k) EXPECT_NEAR(std::hypot(train.car(k).vx, train.car(k).vy), 5.0, 0.1) << k;
}

inputs::Scenario symmetric(int cars) {
  inputs::Scenario s = test::accident(cars);
  s.initial.perturbation = {};
  return s;
}

TEST(Mirror, AMirroredAccidentIsTheMirroredAccident) {
  inputs::Scenario left = symmetric(40), right = left;
  left.initial.yaw_rate = 0.1;
  right.initial.yaw_rate = -0.1;
  left.ground.patches = {{20.0, 60.0, -30.0, -1.0, 1.5}};
  right.ground.patches = {{20.0, 60.0, 1.0, 30.0, 1.5}};
  Train a(left), b(right);
  double worst = 0.0;
  for (int i = 1; i <= 20; ++i) {
    a.to(i);
    b.to(i);
    for (Eigen::Index k = 0; k < 40; ++k) {
      const CarMotion p = a.car(k), q = b.car(k);
      worst = std::max({worst, std::abs(p.x - q.x), std::abs(p.y + q.y), std::abs(p.theta + q.theta)});
    }
  }
  EXPECT_LT(worst, 1e-8);  // two points of contact are summed in the other order in the mirror
  EXPECT_GT(a.incidents().impacts.size(), 10u);
  EXPECT_EQ(a.incidents().impacts.size(), b.incidents().impacts.size());
  EXPECT_EQ(a.incidents().broken.size(), b.incidents().broken.size());
}

TEST(Mirror, AStraightTrainStaysStraight) {
  inputs::Scenario s = symmetric(30);
  s.initial.yaw_rate = 0.0;
  Train train(s);
  train.to(15.0);
  for (Eigen::Index k = 0; k < 30; ++k) {
    EXPECT_EQ(train.car(k).y, 0.0);
    EXPECT_EQ(train.car(k).theta, 0.0);
  }
  EXPECT_FALSE(train.incidents().derailments.empty());
}

// The train before the point of derailment pulls away from what derails behind it, and runs on.
TEST(CarsAhead, PartByThemselvesAndRunOnOnSoundTrack) {
  inputs::Scenario s = test::accident(30, 45.0);
  s.initial.cars_ahead = 10;
  s.ground.in_line_friction = 0.5;  // derailed cars stop harder than the head brakes
  Train train(s);
  train.to(40.0);
  int parted = 0;
  for (const model::BrokenCoupler& b : train.incidents().broken) parted += b.coupler >= 8 && b.coupler <= 11 ? 1 : 0;
  EXPECT_GE(parted, 1);
  for (const model::Derailment& d : train.incidents().derailments) {
    if (d.car < 10) {
      EXPECT_NE(d.cause, model::Cause::pod);
    }
  }
  EXPECT_FALSE(train.model().derailed(0));
  EXPECT_FALSE(train.model().past_pod(0));
  EXPECT_NEAR(train.car(0).y, 0.0, 0.05);
  EXPECT_GT(train.car(0).x - train.car(10).x, 10.0 * test::kPitch + 5.0);
  EXPECT_TRUE(train.model().derailed(12));
}

}  // namespace
}  // namespace train_derail
