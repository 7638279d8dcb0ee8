// Trucks that run on the ties: drag, lateral hold and drift against closed forms, obstacles and parted pipes against
// their probabilities.
#include <cmath>

#include <gtest/gtest.h>

#include "model/tie_runs.hpp"
#include "ties_fixtures.hpp"
#include "train_derail/model/tie_law.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail {
namespace {

using inputs::kStandardGravity;
using model::TieRun;
using test::CarMotion;
using test::Train;

TEST(TieLaw, HoldsLikeASpringUpToTheLimit) {
  inputs::Ties t;
  t.stiffness = 1e6;
  t.lateral_ratio = 0.5;
  EXPECT_DOUBLE_EQ(model::tie_force(t, 2e4, 0.1, 0.0, 4e5), -1e5);
  EXPECT_DOUBLE_EQ(model::tie_force(t, 2e4, -0.1, 1.0, 4e5), 1e5 - 2e4);
  EXPECT_DOUBLE_EQ(model::tie_force(t, 2e4, 0.3, 0.0, 4e5), -2e5);
  EXPECT_DOUBLE_EQ(model::tie_force(t, 2e4, -0.3, 0.0, 4e5), 2e5);
}

TEST(TieLaw, DriftsByWhatIsBeyondTheLimit) {
  inputs::Ties t;
  t.stiffness = 1e6;
  t.lateral_ratio = 0.5;  // 0.2 m under 4e5 N
  EXPECT_EQ(model::tie_drift(t, 0.19, 0.0, 4e5), 0.0);
  EXPECT_DOUBLE_EQ(model::tie_drift(t, 0.5, 0.0, 4e5), 0.3);
  EXPECT_DOUBLE_EQ(model::tie_drift(t, -0.5, 0.0, 4e5), -0.3);
  EXPECT_EQ(model::tie_drift(t, 0.15, 0.3, 4e5), 0.3);  // it does not come back by itself
  EXPECT_DOUBLE_EQ(model::tie_drift(t, 0.0, 0.3, 4e5), 0.2);
}

TEST(Obstacles, AreMoreOnSlowTrack) {
  inputs::Obstacles o;
  o.rate = 2e-3;
  o.reference_speed = 10.0;
  EXPECT_EQ(model::obstacle_rate(o, 5.0), 2e-3);
  o.speed_exponent = 1.5;
  EXPECT_DOUBLE_EQ(model::obstacle_rate(o, 10.0), 2e-3);
  EXPECT_DOUBLE_EQ(model::obstacle_rate(o, 2.5), 16e-3);
  o.rate = 0.0;
  EXPECT_EQ(model::obstacle_rate(o, 0.0), 0.0);
}

/// A train without couplers' forces, brakes or resistance, of which one truck runs on the ties.
inputs::Scenario dragging(int cars, double step = 2e-3) {
  inputs::Scenario s = test::on_rails(cars, step);
  s.initial.mechanism = inputs::Mechanism::dragging_truck;
  s.initial.speed = 10.0;
  s.ties.law = inputs::TieLaw::guided;
  s.ties.drag = 0.2;
  s.ground.off_track_friction = 0.5;  // of the ground, which the ties keep it from
  s.ground.regularization_speed = 0.01;
  s.stop.time_max = 60.0;
  return s;
}

class OneTruck : public testing::TestWithParam<inputs::FirstTruck> {};

TEST_P(OneTruck, StopsALoneCarInTheLengthThatItsDragSays) {
  inputs::Scenario s = dragging(1);
  s.initial.truck = GetParam();
  Train train(s);
  const double start = train.car(0).x, energy = train.energy().kinetic();
  train.to(30.0);
  // Half of the weight on the ties: v^2 = 2 (drag g / 2) L.
  const double length = 100.0 / (s.ties.drag * kStandardGravity);
  EXPECT_NEAR(train.car(0).x - start, length, 2e-3 * length);
  EXPECT_LT(std::abs(train.car(0).vx), 1e-3);
  EXPECT_NEAR(train.car(0).y, 0.0, 1e-9);
  EXPECT_NEAR(train.energy().work_ties, energy, 1e-4 * energy);
  EXPECT_NEAR(train.energy().total(), energy, 1e-9 * energy);
  ASSERT_EQ(train.incidents().tie_runs.size(), 1u);
  const TieRun& run = train.incidents().tie_runs[0];
  EXPECT_EQ(run.front, GetParam() == inputs::FirstTruck::front);
  EXPECT_NEAR(run.distance, train.car(0).x - start, 1e-9);
  EXPECT_EQ(run.end, TieRun::End::none);
  ASSERT_EQ(train.incidents().derailments.size(), 1u);
  EXPECT_EQ(train.incidents().derailments[0].cause, model::Cause::defect);
}

INSTANTIATE_TEST_SUITE_P(Trucks, OneTruck, testing::Values(inputs::FirstTruck::front, inputs::FirstTruck::rear));

TEST(OnTies, TakeTheMomentumThatTheirDragSays) {
  inputs::Scenario s = dragging(5);
  s.coupler = test::accident(1).coupler;  // slack, springs and dampers between the cars
  s.initial.cars_ahead = 2;
  Train train(s);
  const model::Momentum before = train.momentum();
  const double energy = train.energy().total();
  train.to(5.0);
  const double drag = s.ties.drag * 0.5 * s.consist[0].weight;
  EXPECT_NEAR(before.x - train.momentum().x, drag * train.time(), 1e-5 * drag * train.time());
  EXPECT_NEAR(train.momentum().y, 0.0, 1e-6 * before.x);
  EXPECT_NEAR(train.energy().total(), energy, 1e-5 * energy);
  EXPECT_GT(train.energy().work_ties, 0.0);
  // No other car has come to grief at the place where the first one is off.
  EXPECT_EQ(train.incidents().derailments.size(), 1u);
}

TEST(OnTies, HoldACarAsRailsWouldUpToTheLimit) {
  // The same spring and damper under a truck, whether it stands on the rails or on the ties.
  inputs::Scenario rails = test::on_rails(1, 1e-4), ties = dragging(1, 1e-4);
  rails.rails.damping_ratio = ties.rails.damping_ratio = ties.ties.damping_ratio = 0.1;
  ties.ties.stiffness = ties.rails.stiffness;
  ties.ties.lateral_ratio = inputs::kInfinity;
  ties.ties.drag = 0.0;
  const std::vector<CarMotion> aside{CarMotion{-500.0, 0.005, 0.0005, 10.0, 0.02, 0.0}};
  Train on_rails(rails, aside), on_ties(ties, aside);
  for (int i = 1; i <= 20; ++i) {
    on_rails.to(0.05 * i);
    on_ties.to(0.05 * i);
    EXPECT_NEAR(on_ties.car(0).y, on_rails.car(0).y, 1e-12) << i;
    EXPECT_NEAR(on_ties.car(0).theta, on_rails.car(0).theta, 1e-12) << i;
  }
  EXPECT_EQ(on_ties.incidents().tie_runs.size(), 1u);
  EXPECT_TRUE(on_rails.incidents().tie_runs.empty());
}

TEST(OnTies, DriftAsFarAsTheLimitTakesTheEnergy) {
  // A blow at the front truck, which the other truck does not feel: the front truck moves like a mass of its own.
  inputs::Scenario s = dragging(1, 1e-5);
  s.rails.stiffness = 1.0;
  s.rails.damping_ratio = s.ties.damping_ratio = s.ties.drag = 0.0;
  s.ties.stiffness = 2e7;
  s.ties.lateral_ratio = 0.4;
  s.ties.drift_max = inputs::kInfinity;
  const model::Car car = Train(s).model().cars()[0];
  const double arm = 0.5 * car.truck_spacing, mobility = 1.0 / car.mass + arm * arm / car.yaw_inertia;
  for (const double side : {1.0, -1.0}) {
    const double speed = 0.8, impulse = side * speed / mobility;
    Train train(s, {CarMotion{-arm, 0.0, 0.0, 0.0, impulse / car.mass, impulse * arm / car.yaw_inertia}});
    double farthest = 0.0;
    while (train.time() < 0.5) {
      train.step();
      farthest = std::max(farthest, side * (train.car(0).y + arm * std::sin(train.car(0).theta)));
    }
    const double limit = s.ties.lateral_ratio * 0.5 * car.weight, elastic = limit / s.ties.stiffness;
    const double sliding = 0.5 * speed * speed / mobility / limit - 0.5 * elastic;
    ASSERT_GT(sliding, 2.0 * elastic);
    EXPECT_NEAR(farthest, elastic + sliding, 2e-3 * farthest);
    EXPECT_EQ(train.incidents().tie_runs[0].end, TieRun::End::none);
    // What the spring has given back is motion again; sliding has taken the rest.
    const model::EnergyLedger spent = train.energy();
    EXPECT_NEAR(spent.total(), 0.5 * speed * speed / mobility, 1e-3 * spent.total());
    EXPECT_GT(spent.work_ties, 0.9 * limit * sliding);
  }
}

TEST(OnTies, LeaveTheTrackBedWhenTheyHaveDriftedTooFar) {
  inputs::Scenario s = dragging(1, 1e-4);
  s.ties.drift_max = 0.1;
  Train train(s, {CarMotion{-6.4, 0.0, 0.0, 10.0, 4.0, 0.0}});
  train.to(1.0);
  ASSERT_EQ(train.incidents().tie_runs.size(), 1u);
  const TieRun& run = train.incidents().tie_runs[0];
  EXPECT_EQ(run.end, TieRun::End::drift);
  EXPECT_GT(run.end_time, 0.0);
  EXPECT_NEAR(run.distance, 10.0 * run.end_time, 0.3);
  EXPECT_EQ(train.energy().work_kicks, 0.0);
}

TEST(Obstacles, ThrowATruckToTheSideAndTearTheTrack) {
  inputs::Scenario s = dragging(2);
  test::put_obstacles(s);
  Train train(s);
  const auto aside = [](const Train& t, double arm) { return t.car(0).vy + arm * t.car(0).omega; };
  test::expect_a_throw_and_torn_track(train, aside, 1e-6);
}

/// Half the width of an interval that a share of n seeds leaves once in 60,000 times.
double error_of_share(double share, int n) { return 4.3 * std::sqrt(share * (1.0 - share) / n); }

TEST(Obstacles, AreMissedWithTheProbabilityOfARate) {
  inputs::Scenario s = dragging(1, 0.01);
  s.obstacles.rate = 0.02;
  s.obstacles.throw_probability = 1.0;
  const double length = 100.0 / (s.ties.drag * kStandardGravity);
  const int seeds = 1000;
  int missed = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    Train train(s);
    train.to(11.0);
    missed += train.incidents().tie_runs.at(0).end == TieRun::End::none ? 1 : 0;
  }
  const double share = std::exp(-s.obstacles.rate * length);
  EXPECT_NEAR(static_cast<double>(missed) / seeds, share, error_of_share(share, seeds));
}

TEST(Obstacles, ThrowOffWithTheirProbability) {
  inputs::Scenario s = dragging(1);
  s.obstacles.places = {{10.0, std::nullopt}, {20.0, 0.25}};
  s.obstacles.throw_probability = 0.6;
  const std::vector<model::Car> cars = model::expand(s.consist);
  const int seeds = 4000;
  int first = 0, second = 0, left = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    model::Record record;
    model::TieRuns ties(s, cars, record);
    ties.begin(0.0, 0, 0.0);
    if (ties.run(0, 0.0, 15.0).thrown) ++first;
    else if (ties.run(0, 15.0, 25.0).thrown) ++second;
    ties.end(1.0, 0, TieRun::End::obstacle);
    left += ties.throw_speed(0) > 0.0 ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(first) / seeds, 0.6, error_of_share(0.6, seeds));
  EXPECT_NEAR(static_cast<double>(second) / seeds, 0.1, error_of_share(0.1, seeds));
  EXPECT_NEAR(static_cast<double>(left) / seeds, 0.5, error_of_share(0.5, seeds));
}

TEST(Obstacles, TheFrogOfASwitchIsOne) {
  inputs::Scenario s = dragging(1);
  s.initial.mechanism = inputs::Mechanism::turnout;
  s.initial.frog_distance = 25.0;
  s.obstacles.places = {{40.0, std::nullopt}};
  model::Record record;
  EXPECT_EQ(model::TieRuns(s, model::expand(s.consist), record).obstacles(), (std::vector<double>{25.0, 40.0}));
}

TEST(OnTies, PartTheBrakePipeAtARate) {
  inputs::Scenario s = dragging(1, 0.01);
  s.ties.drag = 0.0;
  s.ties.parting_rate = 0.05;
  s.brakes.dead_time = s.brakes.build_up_time = 0.0;
  const int seeds = 1000;
  int whole = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    Train train(s);
    train.to(2.0);
    whole += train.car(0).vx > 10.0 - 1e-6 ? 1 : 0;
  }
  const double share = std::exp(-s.ties.parting_rate * 20.0);
  EXPECT_NEAR(static_cast<double>(whole) / seeds, share, error_of_share(share, seeds));
}

/// The outcome as one text.
std::vector<double> final_state(simulation::Simulation& run) {
  run.advance(200.0);
  const auto view = run.snapshot();
  std::vector<double> all;
  for (const auto& car : view.cars) all.insert(all.end(), {car.x, car.y, car.theta, car.vx});
  const outcome::Outcome o = run.outcome();
  all.insert(all.end(), {o.on_ties.distance_max, static_cast<double>(o.on_ties.obstacles),
                         static_cast<double>(o.on_ties.thrown_off), o.energy.work_ties});
  return all;
}

TEST(OnTies, ASavedRunGoesOnBitForBit) {
  inputs::Scenario s = test::accident(20, 30.0);
  s.initial.mechanism = inputs::Mechanism::bad_track;
  s.initial.truck_probability = 0.6;
  s.initial.cars_ahead = 3;
  s.ties.law = inputs::TieLaw::guided;
  s.ties.parting_rate = 0.002;
  s.obstacles.rate = 0.05;
  s.obstacles.throw_probability = 0.04;
  s.ties.lateral_ratio = 0.1;  // so that they drift
  s.ties.drift_max = 3.0;
  s.track.curves = {{0.0, 400.0, 0.001, 0.0}};
  int met = 0, thrown_off = 0;
  for (int seed = 0; seed < 6; ++seed) {
    s.initial.perturbation.seed = seed;
    simulation::Simulation whole(s), first(s);
    first.advance(9.0);
    met += first.outcome().on_ties.obstacles;
    simulation::Simulation second(s, first.checkpoint());
    const std::vector<double> state = final_state(whole);
    EXPECT_EQ(final_state(second), state) << seed;
    const outcome::Outcome o = whole.outcome();
    thrown_off += o.on_ties.thrown_off - first.outcome().on_ties.thrown_off;
    EXPECT_LT(o.energy_residual, 1e-4);
  }
  EXPECT_GT(met, 0);
  EXPECT_GT(thrown_off, 0);
}

}  // namespace
}  // namespace train_derail
