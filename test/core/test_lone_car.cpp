// One car, no couplers: everything about it has a closed form.
#include <gtest/gtest.h>

#include "fixtures.hpp"

namespace train_derail {
namespace {

using test::CarMotion;

inputs::Scenario lone_car() {
  inputs::Scenario s = test::baseline(1);
  s.initial.yaw_rate = 0.0;
  test::set_tolerance(s, 1e-10);
  return s;
}

class LoneCar : public testing::TestWithParam<inputs::Method> {};

TEST_P(LoneCar, SlidesVSquaredOverTwoMuG) {
  inputs::Scenario s = lone_car();
  s.solver.method = GetParam();
  // The regularisation lengthens the slide by about (v_eps / V)^2 ln(V / v_eps) = 5e-9, the part not run by 4e-8.
  s.ground.regularization_speed = 1e-3;
  s.stop.speed = 2e-3;
  simulation::Simulation sim(s);
  sim.run();
  const double v = s.initial.speed;
  const double expected = v * v / (2.0 * s.ground.off_track_friction * inputs::kStandardGravity);
  EXPECT_EQ(sim.outcome().ended, outcome::Ended::at_rest);
  EXPECT_NEAR(sim.snapshot().cars[0].x / expected, 1.0, 1e-6);
}

TEST_P(LoneCar, SlidesTheRegularisedDistanceAndTime) {
  inputs::Scenario s = lone_car();
  s.solver.method = GetParam();
  simulation::Simulation sim(s);
  sim.run();
  const double e = s.ground.regularization_speed, v = s.initial.speed;
  const double deceleration = s.ground.off_track_friction * inputs::kStandardGravity;
  const simulation::CarSnapshot car = sim.snapshot().cars[0];
  ASSERT_GT(car.vx, 0.0);
  ASSERT_LT(car.vx, s.stop.speed);
  const double distance = (test::slide_distance(v, e) - test::slide_distance(car.vx, e)) / deceleration;
  const double time = (test::slide_time(v, e) - test::slide_time(car.vx, e)) / deceleration;
  // The error of the integration: rtol 1e-10 a step over some hundreds of steps.
  EXPECT_NEAR(car.x / distance, 1.0, 1e-7);
  EXPECT_NEAR(sim.time() / time, 1.0, 1e-7);
  // Whole slide to v = 0, as the closed form is usually written; what is left at the end of the run is below v_s e / a.
  const double whole = (0.5 * v * std::sqrt(v * v + e * e) + 0.5 * e * e * std::asinh(v / e)) / deceleration;
  EXPECT_NEAR(car.x, whole, s.stop.speed * e / deceleration);
  EXPECT_EQ(car.y, 0.0);
  EXPECT_EQ(car.theta, 0.0);
}

TEST_P(LoneCar, SpinningInPlaceIsBrakedByBothTrucks) {
  inputs::Scenario s = lone_car();
  s.solver.method = GetParam();
  s.stop.speed = 0.5;
  const double omega = 1.5;
  simulation::Simulation sim(s, test::state_of({CarMotion{3.0, -2.0, 0.4, 0.0, 0.0, omega}}));
  sim.run();
  // Truck speed u = omega D / 2; torque mu W / 2 * D / 2 at each truck: du/dt = -a u / sqrt(u^2 + e^2), a as below.
  const model::Car& c = sim.cars()[0];
  const double arm = 0.5 * c.truck_spacing, e = s.ground.regularization_speed;
  const double a = s.ground.off_track_friction * c.weight * arm * arm / c.yaw_inertia;
  const simulation::CarSnapshot car = sim.snapshot().cars[0];
  ASSERT_GT(car.omega, 0.0);
  const double angle = (test::slide_distance(omega * arm, e) - test::slide_distance(car.omega * arm, e)) / (a * arm);
  const double time = (test::slide_time(omega * arm, e) - test::slide_time(car.omega * arm, e)) / a;
  EXPECT_NEAR((car.theta - 0.4) / angle, 1.0, 1e-7);
  EXPECT_NEAR(sim.time() / time, 1.0, 1e-7);
  // The two forces are a couple: the centre stays; 1e-9 m is atol times the number of steps with room to spare.
  EXPECT_NEAR(car.x, 3.0, 1e-9);
  EXPECT_NEAR(car.y, -2.0, 1e-9);
  const model::DerailmentModel m(s);
  EXPECT_NEAR(m.momentum(sim.state().data()).x / (c.mass * omega * arm), 0.0, 1e-9);
  EXPECT_NEAR(m.momentum(sim.state().data()).y / (c.mass * omega * arm), 0.0, 1e-9);
}

TEST_P(LoneCar, FrictionWorkIsTheLossOfKineticEnergy) {
  inputs::Scenario s = lone_car();
  s.solver.method = GetParam();
  const CarMotion start{0.0, 0.0, 0.7, 12.0, -5.0, 0.9};
  simulation::Simulation sim(s, test::state_of({start}));
  const model::Car& c = sim.cars()[0];
  const double before = 0.5 * c.mass * (12.0 * 12.0 + 5.0 * 5.0) + 0.5 * c.yaw_inertia * 0.9 * 0.9;
  sim.run();
  const outcome::Outcome o = sim.outcome();
  EXPECT_NEAR(o.energy_initial / before, 1.0, 1e-14);
  EXPECT_NEAR(o.energy.work_off_track / (before - o.energy.kinetic()), 1.0, 1e-8);
  EXPECT_EQ(o.energy.work_on_track, 0.0);
  EXPECT_LT(o.energy.kinetic() / before, 1e-4);
  EXPECT_LT(o.energy_residual, 1e-8);
}

TEST(LoneCarMass, DoesNotMatterToTheSlide) {
  // Friction grows with weight as inertia does: a car of three times the weight takes the same path.
  inputs::Scenario s = lone_car();
  const model::StateVector start = test::state_of({CarMotion{0.0, 0.0, 0.2, 15.0, 1.0, 0.5}});
  simulation::Simulation light(s, start);
  s.consist[0].weight *= 3.0;
  simulation::Simulation heavy(s, start);
  light.run();
  heavy.run();
  EXPECT_NEAR(light.snapshot().cars[0].x, heavy.snapshot().cars[0].x, 1e-7);
  EXPECT_NEAR(light.snapshot().cars[0].theta, heavy.snapshot().cars[0].theta, 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Methods, LoneCar,
                         testing::Values(inputs::Method::cash_karp, inputs::Method::dormand_prince,
                                         inputs::Method::bdf),
                         testing::PrintToStringParamName());

}  // namespace
}  // namespace train_derail
