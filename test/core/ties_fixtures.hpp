// Trains with a truck on the ties, for both models that have one.
#pragma once

#include <cmath>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"

namespace train_derail::test {

/// Obstacles on the way of a truck on the ties at 10 m/s that nothing slows down; the third one throws it off.
inline void put_obstacles(inputs::Scenario& s) {
  s.ties.drag = s.ground.off_track_friction = 0.0;
  s.ties.lateral_ratio = 10.0;
  s.coupler = accident(1).coupler;
  s.obstacles.places = {{-5.0, 1.0}, {30.0, 0.0}, {40.0, 1.0}, {50.0, 1.0}};
  s.obstacles.throw_speed = 1.5;
}

/// `aside`: speed of the truck across the track [m/s], of the train and the truck's arm; `near`: error of a place [m].
template <class AnyTrain, class Aside>
void expect_a_throw_and_torn_track(AnyTrain& train, const Aside& aside, double near) {
  using model::TieRun;
  while (train.incidents().tie_runs.at(0).end == TieRun::End::none) {
    ASSERT_LT(train.time(), 10.0);
    train.step();
  }
  const TieRun& run = train.incidents().tie_runs[0];
  EXPECT_EQ(run.end, TieRun::End::obstacle);
  EXPECT_EQ(run.obstacles, 2);  // that behind the point of derailment it has never met
  EXPECT_NEAR(run.distance, 40.0, near);
  EXPECT_NEAR(run.end_time, 4.0, 1e-3);
  const model::Car& c = train.model().cars()[0];
  const double arm = 0.5 * c.truck_spacing;
  EXPECT_NEAR(std::abs(aside(train, arm)), 1.5, 1e-6);
  EXPECT_NEAR(train.energy().work_kicks, -0.5 * 1.5 * 1.5 / (1.0 / c.mass + arm * arm / c.yaw_inertia), 1.0);
  // What comes to that place next leaves the rails too.
  train.to(12.0);
  ASSERT_GT(train.incidents().derailments.size(), 1u);
  EXPECT_EQ(train.incidents().derailments[1].cause, model::Cause::torn_track);
  EXPECT_NEAR(train.incidents().derailments[1].x, 40.0, 2.0);
}

inline constexpr double kHeldResistance = 0.002;

/// A locomotive and nine cars like that of `s`, on a grade, held at their speed; the fourth car has a truck on the
/// ties. With a drag of kHeldResistance that changes nothing.
inline void hold_by_a_locomotive(inputs::Scenario& s, double grade, double drag) {
  s.coupler = accident(1).coupler;
  inputs::CarBlock locomotive = s.consist[0];
  locomotive.name = "locomotive";
  locomotive.weight = 420.0 * inputs::kKip;
  s.consist[0].count = 9;
  s.consist.insert(s.consist.begin(), locomotive);
  s.brakes.rolling_resistance = kHeldResistance;
  s.brakes.force = 0.0;
  s.track.grade = grade;
  s.traction.law = inputs::TractionLaw::steady;
  s.initial.mechanism = inputs::Mechanism::dragging_truck;
  s.initial.cars_ahead = 3;
  s.initial.speed = 6.0;
  s.ties.law = inputs::TieLaw::guided;
  s.ties.drag = drag;
}

inline double weight_of(const inputs::Scenario& s) {
  double sum = 0.0;
  for (const inputs::CarBlock& b : s.consist) sum += b.count * b.weight;
  return sum;
}

}  // namespace train_derail::test
