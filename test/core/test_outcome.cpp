// What a run yields, in cases whose answer is known.
#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/outcome/pile_up.hpp"

namespace train_derail {
namespace {

using test::CarMotion;

/// Free cars without any friction: they keep their velocities.
inputs::Scenario free_cars(int cars, double until) {
  inputs::Scenario s = test::baseline(cars);
  test::set_friction(s, 0.0, 0.0);
  test::uncouple(s);
  test::set_tolerance(s, 1e-10);
  s.initial.yaw_rate = 0.0;
  s.stop.time_max = until;
  return s;
}

TEST(Ended, AtRestAtTheTimeKnown) {
  inputs::Scenario s = test::baseline(1);
  s.initial.yaw_rate = 0.0;
  test::set_tolerance(s, 1e-9);
  simulation::Simulation sim(s);
  sim.run();
  const double e = s.ground.regularization_speed, a = s.ground.off_track_friction * inputs::kStandardGravity;
  const double slow = (test::slide_time(s.initial.speed, e) - test::slide_time(s.stop.speed, e)) / a;
  const outcome::Outcome o = sim.outcome();
  EXPECT_EQ(o.ended, outcome::Ended::at_rest);
  EXPECT_EQ(outcome::to_string(o.ended), "at_rest");
  EXPECT_GE(o.stop_time, slow - 1e-6);  // the rule is looked at in samples
  EXPECT_LE(o.stop_time, slow + s.outcome.sample_interval + 1e-6);
  EXPECT_EQ(o.stop_time, sim.time());
}

TEST(Ended, AtTimeMax) {
  inputs::Scenario s = test::baseline(6);
  s.stop.time_max = 0.7531;  // on no sample
  simulation::Simulation sim(s);
  EXPECT_EQ(sim.outcome().ended, outcome::Ended::running);
  sim.run();
  EXPECT_EQ(sim.outcome().ended, outcome::Ended::time_max);
  EXPECT_EQ(sim.time(), 0.7531);
  EXPECT_EQ(sim.outcome().stop_time, 0.7531);
}

TEST(Ended, NotWhileATruckStillMoves) {
  // The centre rests, the trucks do not.
  inputs::Scenario s = free_cars(1, 1.0);
  simulation::Simulation sim(s, test::state_of({CarMotion{0, 0, 0, 0, 0, 0.3}}));
  sim.run();
  EXPECT_EQ(sim.outcome().ended, outcome::Ended::time_max);
}

TEST(CarsPastPod, AreThoseThatARollingTrainHasCarriedOver) {
  inputs::Scenario s = test::baseline(20);
  test::set_friction(s, 0.0, 0.0);
  s.initial.yaw_rate = 0.0;
  const double pitch = s.consist[0].length + s.coupler.length;
  s.stop.time_max = 7.5 * pitch / s.initial.speed;
  simulation::Simulation sim(s);
  EXPECT_EQ(sim.outcome().cars_past_pod, 1);
  sim.run();
  EXPECT_EQ(sim.outcome().cars_past_pod, 8);
  EXPECT_EQ(sim.outcome().cars_off_track, 0);
  EXPECT_EQ(sim.outcome().coupler_force_peak(), 0.0);
  EXPECT_NEAR(sim.outcome().relative_speed_max.speed, 0.0, 1e-9);
  EXPECT_EQ(sim.outcome().touches, 0);
  EXPECT_LT(sim.outcome().energy_residual, 1e-12);
}

TEST(CarsPastPod, IsLatched) {
  // The second car is thrown over the point and back again; both drift sideways, so that they never rest.
  inputs::Scenario s = free_cars(2, 1.0);
  s.coupler = inputs::Coupler{};
  s.coupler.stiffness = 2e6;  // gives way by 0.78 m, of which each car takes half
  s.coupler.swing_stiffness = 0.0;
  const double pitch = s.consist[0].length + s.coupler.length;
  simulation::Simulation sim(
      s, test::state_of({CarMotion{pitch - 0.2, 0, 0, -3, 0.2, 0}, CarMotion{-0.2, 0, 0, 3, 0.2, 0}}));
  double highest = -1.0;
  for (int i = 1; i <= 60; ++i) {
    sim.advance(0.01 * i);
    highest = std::max(highest, sim.snapshot().cars[1].x);
  }
  EXPECT_GT(highest, 0.1);
  EXPECT_LT(sim.snapshot().cars[1].x, -0.1);
  EXPECT_TRUE(sim.snapshot().cars[1].past_pod);
  EXPECT_EQ(sim.outcome().cars_past_pod, 2);
}

TEST(CarsPastPod, CountsACarThatStartsPastIt) {
  inputs::Scenario s = free_cars(2, 0.5);
  s.ground.off_track_friction = 0.4;
  simulation::Simulation sim(s, test::state_of({CarMotion{60, 0, 0, 5, 0, 0}, CarMotion{0.5, 0, 0, 5, 0, 0}}));
  EXPECT_TRUE(sim.snapshot().cars[1].past_pod);
  sim.run();
  EXPECT_EQ(sim.outcome().cars_past_pod, 2);
  EXPECT_LT(sim.snapshot().cars[1].vx, 3.5);  // it feels the off-track friction
}

TEST(CarsOffTrack, AreThoseWithATruckSideways) {
  // Half a foot at the front truck, D / 2 = 6.406 m ahead, is an angle of 0.0238 rad; the second car has half of it.
  inputs::Scenario s = free_cars(3, 1.0);
  const double angle = 0.024;
  ASSERT_GT(0.5 * 0.71 * s.consist[0].length * std::sin(angle), s.outcome.off_track_threshold);
  simulation::Simulation sim(s, test::state_of({CarMotion{0, 0, 0, 1, 0, 0}, CarMotion{-40, 0, 0.5 * angle, 1, 0, 0},
                                                CarMotion{-80, 0, 0, 1, 0.2, 0}}));
  EXPECT_EQ(sim.outcome().cars_off_track, 0);
  sim.advance(0.7);
  EXPECT_EQ(sim.outcome().cars_off_track, 0);
  sim.advance(0.8);  // the third car has drifted 0.16 m
  EXPECT_EQ(sim.outcome().cars_off_track, 1);
  EXPECT_TRUE(sim.snapshot().cars[2].off_track);
  EXPECT_FALSE(sim.snapshot().cars[2].past_pod);
  simulation::Simulation turned(s, test::state_of({CarMotion{0, 0, 0, 1, 0, 0}, CarMotion{-40, 0, -angle, 1, 0, 0},
                                                   CarMotion{-80, 0, 0, 1, 0, 0}}));
  turned.advance(0.1);
  EXPECT_EQ(turned.outcome().cars_off_track, 1);
}

TEST(PileUp, IsTheExtentOfTheFootprintsOffTheTrack) {
  inputs::Scenario s = free_cars(3, 0.1);
  const double length = s.consist[0].length, width = s.consist[0].width;
  // First car past the point, second off the track, third neither.
  simulation::Simulation sim(s, test::state_of({CarMotion{10, 0, 0.3, 0, 0, 0}, CarMotion{-15, 4, -1.2, 0, 0, 0},
                                                CarMotion{-60, 0, 0, 1, 0, 0}}));
  sim.run();
  const auto reach_x = [&](double a) { return 0.5 * (length * std::abs(std::cos(a)) + width * std::abs(std::sin(a))); };
  const auto reach_y = [&](double a) { return 0.5 * (length * std::abs(std::sin(a)) + width * std::abs(std::cos(a))); };
  const outcome::PileUp p = sim.outcome().pile_up;
  EXPECT_NEAR(p.length, 10.0 + reach_x(0.3) - (-15.0 - reach_x(1.2)), 1e-9);
  const double top = std::max(reach_y(0.3), 4.0 + reach_y(1.2)), bottom = std::min(-reach_y(0.3), 4.0 - reach_y(1.2));
  EXPECT_NEAR(p.width, top - bottom, 1e-9);
}

TEST(PileUp, GoesAlongACurvedTrack) {
  // Six cars on an arc to the right: two of them across it, the last one does not count.
  constexpr double kRadius = 200.0, kHalfLength = 8.0, kHalfWidth = 1.5;
  inputs::Scenario s = test::on_rails(6);
  s.track.curves = {{-400.0, 500.0, -1.0 / kRadius}};
  const model::ExtendedModel model(s);
  const Eigen::Vector2d middle(0.0, -kRadius);
  std::vector<model::Footprint> cars;
  for (const double arc : {-40.0, -60.0, -80.0, -110.0, -130.0, -300.0}) {
    const double angle = -arc / kRadius;  // to +x, the direction at the point of derailment
    const Eigen::Vector2d out(-std::sin(angle), std::cos(angle)), along(std::cos(angle), std::sin(angle));
    const bool across = arc == -110.0 || arc == -130.0;
    cars.push_back({middle + kRadius * out, across ? out : along, kHalfLength, kHalfWidth});
  }
  std::vector<bool> counted(6, true);
  counted.back() = false;
  const outcome::PileUp p = outcome::pile_up(cars, counted, [&](std::size_t car, const Eigen::Vector2d& point) {
    return model.track_place(static_cast<Eigen::Index>(car), point);
  });
  const double ahead = -40.0 + kRadius * std::atan(kHalfLength / (kRadius - kHalfWidth));
  const double behind = -130.0 - kRadius * std::atan(kHalfWidth / (kRadius - kHalfLength));
  EXPECT_NEAR(p.length, ahead - behind, 1e-3);
  EXPECT_NEAR(p.width, std::hypot(kRadius + kHalfLength, kHalfWidth) - std::hypot(kRadius - kHalfLength, kHalfWidth),
              1e-3);
  EXPECT_EQ(p.cars_across, 2);
  EXPECT_EQ(p.main_cars, 1);  // 17 m between the two
  EXPECT_NEAR(p.main_length, 2.0 * kHalfWidth, 1e-3);
}

TEST(RelativeSpeed, IsThatOfTheFacingPins) {
  // Centres at rest, both cars turn to the left: the facing pins move apart sideways, fastest at the start.
  inputs::Scenario s = free_cars(2, 0.5);
  const double length = s.consist[0].length;
  simulation::Simulation sim(
      s, test::state_of({CarMotion{0, 0, 0, 0, 0, 0.2}, CarMotion{-length - 1.5, 0, 0, 0, 0, 0.3}}));
  sim.run();
  EXPECT_NEAR(sim.outcome().relative_speed_max.speed, 0.5 * length * (0.2 + 0.3), 1e-9);
  EXPECT_EQ(sim.outcome().relative_speed_max.coupler, 1);
  EXPECT_EQ(sim.outcome().relative_speed_max.time, 0.0);
}

TEST(CentreSpeed, IsThatOfNeighbouringCentresHoweverTheyTurn) {
  inputs::Scenario s = free_cars(3, 0.5);
  const double length = s.consist[0].length;
  simulation::Simulation sim(s,
                             test::state_of({CarMotion{0, 0, 0, 9, 0, 0.2}, CarMotion{-length - 1.5, 0, 0, 6, 0, 0.3},
                                             CarMotion{-2 * length - 3, 0, 0, 3, 4, 0}}));
  sim.run();
  EXPECT_NEAR(sim.outcome().centre_speed_max.speed, 5.0, 1e-9) << "cars 1 and 3 are further apart, but no neighbours";
  EXPECT_EQ(sim.outcome().centre_speed_max.coupler, 2);
  EXPECT_EQ(sim.outcome().centre_speed_max.time, 0.0);
}

/// The second car stands across the track; the first, ahead of it and straight, runs back into its side.
TEST(ClosingSpeed, OfASideImpactIsKnown) {
  inputs::Scenario s = free_cars(2, 1.0);
  const double length = s.consist[0].length, width = s.consist[0].width;
  const double way = 2.0;  // from the first car's rear face to the second one's side
  const double x = 50.0 + 0.5 * width + way + 0.5 * length;
  simulation::Simulation sim(
      s, test::state_of({CarMotion{x, 0, 0, -3.0, 1.0, 0}, CarMotion{50, 0, 0.5 * test::kPi, 1.0, -1.0, 0}}));
  sim.run();
  const outcome::Outcome o = sim.outcome();
  const double closing = 4.0, sliding = 2.0, touch = way / closing;
  EXPECT_EQ(o.touches, 1);
  EXPECT_EQ(o.closing_speed_max.car_a, 1);
  EXPECT_EQ(o.closing_speed_max.car_b, 2);
  EXPECT_NEAR(o.closing_speed_max.speed_normal, closing, 1e-9);
  EXPECT_NEAR(o.closing_speed_max.speed, std::hypot(closing, sliding), 1e-9);
  EXPECT_GE(o.closing_speed_max.time, touch - 1e-9);
  EXPECT_LE(o.closing_speed_max.time, touch + s.outcome.sample_interval + 1e-9);
  const double side = 50.0 + 0.5 * width + 1.0 * touch;  // x of the side at the touch; both move on within the sample
  EXPECT_NEAR(o.closing_speed_max.x, side, 2.0 * closing * s.outcome.sample_interval);
  EXPECT_LT(std::abs(o.closing_speed_max.y), 0.5 * width + 1.0);
  EXPECT_EQ(o.coupler_force_peak(), 0.0);
}

/// A spinning car's corners knock at a standing car's side, once with each end a turn.
TEST(ClosingSpeed, OfACornerIncludesTheSpin) {
  inputs::Scenario s = free_cars(2, 0.0);
  s.outcome.sample_interval = 1e-3;
  const double length = s.consist[0].length, width = s.consist[0].width, spin = 2.0 * test::kPi;
  s.stop.time_max = 1.0;                                                             // one turn
  const double radius = 0.5 * std::hypot(length, width), wall = 0.5 * length - 0.5;  // the end sweeps half a metre deep
  // First car spins about (100, 0); the second one's side faces it from x = 100 - wall.
  simulation::Simulation sim(s, test::state_of({CarMotion{100, 0, 0.5 * test::kPi, 0, 0, spin},
                                                CarMotion{100 - wall - 0.5 * width, 0, 0.5 * test::kPi, 0, 0, 0}}));
  sim.run();
  const outcome::Outcome o = sim.outcome();
  EXPECT_EQ(o.touches, 2);
  ASSERT_EQ(sim.touches().size(), 2u);
  EXPECT_NEAR(sim.touches()[1].time - sim.touches()[0].time, 0.5, 2e-3) << "half a turn apart";
  EXPECT_EQ(std::max(sim.touches()[0].speed, sim.touches()[1].speed), o.closing_speed_max.speed);
  const double lever = std::sqrt(radius * radius - wall * wall);  // the corner's height above the spin's centre
  // A sample late the corner has turned by spin * 1e-3 = 0.006: the normal speed changes by that times spin * wall.
  EXPECT_NEAR(o.closing_speed_max.speed, spin * radius, 0.01 * spin * radius);
  EXPECT_NEAR(o.closing_speed_max.speed_normal, spin * lever, 0.01 * spin * radius);
  EXPECT_NEAR(std::abs(o.closing_speed_max.y), lever, 0.1);
  EXPECT_NEAR(o.closing_speed_max.x, 100.0 - wall, 0.1);
}

TEST(ClosingSpeed, CarsThatMissDoNotTouch) {
  inputs::Scenario s = free_cars(2, 3.0);
  const double width = s.consist[0].width;
  // They pass side by side, a tenth of a metre apart.
  simulation::Simulation sim(
      s, test::state_of({CarMotion{60, width + 0.1, 0, -10.0, 0, 0}, CarMotion{20, 0, 0, 10.0, 0, 0}}));
  sim.run();
  EXPECT_EQ(sim.outcome().touches, 0);
  EXPECT_EQ(sim.outcome().closing_speed_max.speed, 0.0);
  EXPECT_NEAR(sim.outcome().relative_speed_max.speed, 20.0, 1e-9);
  EXPECT_EQ(sim.outcome().relative_speed_max.coupler, 1);
  // A tenth of a metre closer they graze.
  simulation::Simulation graze(
      s, test::state_of({CarMotion{60, width - 0.1, 0, -10.0, 0, 0}, CarMotion{20, 0, 0, 10.0, 0, 0}}));
  graze.run();
  EXPECT_EQ(graze.outcome().touches, 1);
  EXPECT_NEAR(graze.outcome().closing_speed_max.speed, 20.0, 1e-9);
}

TEST(ClosingSpeed, IsTakenOverAllPairsNotNeighboursAlone) {
  inputs::Scenario s = free_cars(3, 1.0);
  const double length = s.consist[0].length;
  // Cars 1 and 3 meet end to end; car 2 stands aside.
  simulation::Simulation sim(s, test::state_of({CarMotion{50, 0, 0, -2, 0, 0}, CarMotion{30, 40, 0, 0, 0, 0},
                                                CarMotion{50 - length - 1.0, 0, 0, 3, 0, 0}}));
  sim.run();
  const outcome::FirstTouch c = sim.outcome().closing_speed_max;
  EXPECT_EQ(sim.outcome().touches, 1);
  EXPECT_EQ(c.car_a, 1);
  EXPECT_EQ(c.car_b, 3);
  EXPECT_NEAR(c.speed, 5.0, 1e-9);
  EXPECT_NEAR(c.speed_normal, 5.0, 1e-9);
}

}  // namespace
}  // namespace train_derail
