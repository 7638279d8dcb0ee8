// How a derailment starts: which trucks leave the rails by each mechanism, and the forces of a train in buff.
#include <cmath>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "model/derailment_start.hpp"

namespace train_derail {
namespace {

using inputs::Mechanism;
using model::Cause;
using test::Train;

/// A train of 12 cars that rolls over the point of derailment, the third one first. Couplers and rails as in
/// accident().
inputs::Scenario rolling(Mechanism mechanism, inputs::TieLaw ties = inputs::TieLaw::guided) {
  inputs::Scenario s = test::accident(12, 20.0);
  s.initial.cars_ahead = 2;
  s.initial.mechanism = mechanism;
  s.ties.law = ties;
  s.brakes.emergency_time.reset();
  s.contact = {};
  return s;
}

int derailed(const Train& train) {
  int cars = 0;
  for (Eigen::Index k = 0; k < train.model().car_count(); ++k) cars += train.model().derailed(k) ? 1 : 0;
  return cars;
}

TEST(BadTrack, OfProbabilityOneTakesEveryTruckAndOfZeroNone) {
  inputs::Scenario s = rolling(Mechanism::bad_track);
  s.ties.drag = 0.01;
  s.initial.truck_probability = 1.0;
  Train all(s);
  all.to(40.0);
  EXPECT_EQ(all.incidents().derailments.size(), 20u);  // of ten cars
  for (const model::Derailment& d : all.incidents().derailments) {
    EXPECT_EQ(d.cause, Cause::bad_track);
    EXPECT_GE(d.x, -1e-3);
    EXPECT_LE(d.x, s.initial.bad_track_length + 0.1);
  }
  EXPECT_EQ(all.incidents().tie_runs.size(), 20u);
  s.initial.truck_probability = 0.0;
  Train none(s);
  none.to(40.0);
  EXPECT_EQ(derailed(none), 1);  // the one that the derailment starts with
  EXPECT_EQ(none.incidents().derailments.size(), 1u);
}

TEST(BadTrack, OfNoLengthAndProbabilityOneIsABrokenRail) {
  inputs::Scenario s = rolling(Mechanism::broken_rail, inputs::TieLaw::none);
  s.initial.perturbation.alignment = 0.0;  // the first truck stands at the point of derailment, not a hair before it
  Train broken(s);
  s.initial.bad_track_length = 0.0;
  s.initial.truck_probability = 1.0;
  for (const Mechanism same : {Mechanism::bad_track, Mechanism::turnout}) {
    s.initial.mechanism = same;
    Train bad(s);
    broken.to(20.0);
    bad.to(20.0);
    EXPECT_GT(derailed(bad), 5);
    EXPECT_EQ(broken.state(), bad.state());
  }
}

TEST(BadTrack, TakesTrucksWithItsProbabilityAnywhereOnIt) {
  inputs::Scenario s = rolling(Mechanism::bad_track);
  s.initial.truck_probability = 0.3;
  s.initial.bad_track_length = 50.0;
  int count = 0;
  double sum = 0.0;
  const int seeds = 200, trucks = 24;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    for (const double place : model::bad_places(s, 12)) {
      if (place == inputs::kInfinity) continue;
      ++count;
      sum += place;
      ASSERT_GE(place, 0.0);
      ASSERT_LE(place, 50.0);
    }
  }
  const double n = seeds * trucks;
  EXPECT_NEAR(count / n, 0.3, 4.3 * std::sqrt(0.21 / n));
  EXPECT_NEAR(sum / count, 25.0, 4.3 * 50.0 / std::sqrt(12.0 * count));
}

TEST(BadTrack, PersistsBehindATruckThatHasSpreadIt) {
  // A chain of Markov: the first run has 1 / (1 - q) trucks in the mean, of all trucks p / (1 + p - q) leave the rails,
  // and each run is at one place.
  inputs::Scenario s = test::accident(400);
  s.initial.mechanism = Mechanism::bad_track;
  const double p = s.initial.truck_probability = 0.1, q = 0.8;
  s.initial.persistence = q;
  const int seeds = 400, cars = 400;
  double first_runs = 0.0, all = 0.0;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    const std::vector<double> places = model::bad_places(s, cars);
    const auto place = [&](int i) { return places[static_cast<std::size_t>(i % 2 == 0 ? i / 2 : cars + i / 2)]; };
    int run = 1;
    for (; place(run) < inputs::kInfinity; ++run) ASSERT_EQ(place(run), 0.0) << "of the first run";
    first_runs += run;
    for (int i = 1; i < 2 * cars; ++i) all += place(i) < inputs::kInfinity ? 1.0 : 0.0;
  }
  EXPECT_NEAR(first_runs / seeds, 1.0 / (1.0 - q), 4.3 * std::sqrt(q) / (1.0 - q) / std::sqrt(seeds));
  EXPECT_NEAR(all / (seeds * 2.0 * cars), p / (1.0 + p - q), 0.01);
}

TEST(BadTrack, WithThePersistenceOfOneTakesAllThatCome) {
  inputs::Scenario s = rolling(Mechanism::bad_track);
  s.ties.drag = 0.01;
  s.initial.truck_probability = 0.0;
  s.initial.persistence = 1.0;
  Train all(s);
  all.to(40.0);
  EXPECT_EQ(all.incidents().derailments.size(), 20u);  // of ten cars
  s.initial.persistence = 0.0;
  Train none(s);
  none.to(40.0);
  EXPECT_EQ(none.incidents().derailments.size(), 1u);
}

TEST(DraggingTruck, IsTheOnlyOneThatLeavesTheRails) {
  for (const auto& [truck, front] :
       {std::pair{inputs::FirstTruck::front, true}, std::pair{inputs::FirstTruck::rear, false}}) {
    inputs::Scenario s = rolling(Mechanism::dragging_truck);
    s.initial.truck = truck;
    Train train(s);
    train.to(30.0);
    ASSERT_EQ(train.incidents().derailments.size(), 1u);
    const model::Derailment& d = train.incidents().derailments[0];
    EXPECT_EQ(d.car, 2);
    EXPECT_EQ(d.front, front);
    EXPECT_EQ(d.cause, Cause::defect);
    EXPECT_EQ(train.model().cause(2), Cause::defect);
    EXPECT_EQ(train.model().cause(3), Cause::none);
    EXPECT_GT(train.incidents().tie_runs.at(0).distance, 100.0);
  }
}

TEST(DraggingTruck, IsEitherByTheSeed) {
  inputs::Scenario s = rolling(Mechanism::dragging_truck);
  s.initial.truck = inputs::FirstTruck::either;
  int front = 0;
  for (int seed = 0; seed < 1000; ++seed) {
    s.initial.perturbation.seed = seed;
    front += model::starts_with_front(s) ? 1 : 0;
  }
  EXPECT_NEAR(front, 500, 4.3 * std::sqrt(250.0));
}

class TrainForces : public testing::TestWithParam<double> {};

TEST_P(TrainForces, AreLargestAtTheFirstCarAndFallToBothEnds) {
  inputs::Scenario s = rolling(Mechanism::train_forces);
  s.initial.perturbation = {};
  s.initial.buff_force = GetParam() * inputs::kKip;
  Train train(s);
  // Cars 1 and 2 are ahead: couplers 1 and 2 lead up to car 3, the others away from it.
  const std::vector<double> shares{0.5,     1.0,     1.0,     8.0 / 9, 7.0 / 9, 6.0 / 9,
                                   5.0 / 9, 4.0 / 9, 3.0 / 9, 2.0 / 9, 1.0 / 9};
  const ArrayX& axial = *train.model().axial_forces();
  ASSERT_EQ(axial.size(), 11);
  for (Eigen::Index i = 0; i < axial.size(); ++i)
    EXPECT_NEAR(axial[i], shares[static_cast<std::size_t>(i)] * s.initial.buff_force, 20.0) << i;
  ASSERT_EQ(train.incidents().derailments.size(), 1u);
  EXPECT_EQ(train.incidents().derailments[0].cause, Cause::lateral);
  EXPECT_EQ(train.incidents().derailments[0].car, 2);
  // Its front truck stands at the point of derailment and swings out as it is told.
  const auto car = train.car(2);
  const double half = 0.5 * train.model().cars()[2].truck_spacing;
  EXPECT_NEAR(car.x, -half, 1e-9);
  EXPECT_NEAR(car.vy + half * car.omega, 2.0 * half * s.initial.yaw_rate, 1e-9);
}

// The draft gear is solid at 750 kip: both branches.
INSTANTIATE_TEST_SUITE_P(Forces, TrainForces, testing::Values(300.0, 900.0, -200.0));

TEST(Mechanisms, StandStillOnTheTiesAtTheStart) {
  for (const Mechanism m : {Mechanism::bad_track, Mechanism::turnout, Mechanism::dragging_truck}) {
    const inputs::Scenario s = rolling(m);
    EXPECT_TRUE(model::starts_on_ties(s));
    EXPECT_LT(std::abs(Train(s).car(2).omega), 0.01);  // but for the alignment of the rails
    EXPECT_FALSE(model::starts_on_ties(rolling(m, inputs::TieLaw::none)));
    EXPECT_NEAR(Train(rolling(m, inputs::TieLaw::none)).car(2).omega, s.initial.yaw_rate, 0.01);
  }
}

}  // namespace
}  // namespace train_derail
