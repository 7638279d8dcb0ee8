// Releases of tank cars from impacts: the law against its closed form, independent impacts, random numbers.
#include <cmath>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/outcome/release.hpp"

namespace train_derail {
namespace {

using model::Face;

inputs::Release law() {
  inputs::Release r;
  r.fittings = 0.0;
  r.threshold_speed = 3.0;
  r.end_speed = 20.0;
  r.side_speed = 10.0;
  return r;
}

TEST(Release, ProbabilityOfAnImpact) {
  const auto p = [](double strength, double speed, Face face) {
    return outcome::release_probability(law(), strength, speed, face);
  };
  EXPECT_EQ(p(1.0, 3.0, Face::left), 0.0);
  EXPECT_DOUBLE_EQ(p(1.0, 13.0, Face::left), 1.0 - std::exp(-1.0));
  EXPECT_DOUBLE_EQ(p(1.0, 13.0, Face::top), 1.0 - std::exp(-1.0));
  EXPECT_DOUBLE_EQ(p(1.0, 13.0, Face::front), 1.0 - std::exp(-0.5));
  EXPECT_DOUBLE_EQ(p(1.0, 13.0, Face::rear), 1.0 - std::exp(-0.5));
  EXPECT_DOUBLE_EQ(p(2.0, 26.0, Face::right), 1.0 - std::exp(-1.0));  // twice as strong: at twice the speed
  EXPECT_EQ(p(inputs::kInfinity, 100.0, Face::right), 0.0);
}

model::Impact impact(Eigen::Index a, Eigen::Index b, Face face_a, Face face_b, double speed) {
  model::Impact i{};
  i.car_a = a;
  i.car_b = b;
  i.face_a = face_a;
  i.face_b = face_b;
  i.closing_speed_normal = speed;
  return i;
}

TEST(Release, ImpactsOfACarAreIndependentAndSeedsKeepTheMean) {
  inputs::Scenario s = test::accident(3);
  s.release = law();
  s.consist.push_back(s.consist[0]);
  s.consist[1].name = "hopper";
  s.consist[1].count = 1;
  model::Incidents happened;
  happened.derailments.push_back({0.0, 2, true, model::Cause::pod, 0.0, 0.0});
  happened.impacts = {impact(0, 1, Face::rear, Face::left, 13.0), impact(1, 3, Face::right, Face::front, 8.0)};
  const double head = 1.0 - std::exp(-0.5), shell = 1.0 - std::exp(-1.0 - 0.5), expected = head + shell;
  EXPECT_NEAR(outcome::released(s, happened).expected, expected, 1e-12);  // the hopper holds nothing
  const int seeds = 4000;
  int cars = 0;
  for (int seed = 0; seed < seeds; ++seed) {
    s.initial.perturbation.seed = seed;
    cars += outcome::released(s, happened).cars;
  }
  const double variance = head * (1.0 - head) + shell * (1.0 - shell);
  EXPECT_NEAR(static_cast<double>(cars) / seeds, expected, 4.3 * std::sqrt(variance / seeds));
  s.consist[1].tank_strength = 1.0;
  EXPECT_NEAR(outcome::released(s, happened).expected, expected + 1.0 - std::exp(-0.25), 1e-12);
  s.consist[0].tank_strength = inputs::kInfinity;
  EXPECT_NEAR(outcome::released(s, happened).expected, 1.0 - std::exp(-0.25), 1e-12);
  EXPECT_EQ(outcome::released(s, {}).expected, 0.0);
}

TEST(Release, FittingsOfADerailedTankCarAddToImpacts) {
  inputs::Scenario s = test::accident(3);
  s.release = law();
  s.release.fittings = 0.1;
  model::Incidents happened;
  for (const bool front : {true, false}) happened.derailments.push_back({0.0, 0, front, model::Cause::pod, 0.0, 0.0});
  EXPECT_NEAR(outcome::released(s, happened).expected, 0.1, 1e-12);  // once a car, not once a truck
  happened.impacts = {impact(0, 1, Face::left, Face::left, 13.0)};
  const double shell = 1.0 - std::exp(-1.0);
  EXPECT_NEAR(outcome::released(s, happened).expected, shell + 1.0 - 0.9 * (1.0 - shell), 1e-12);
  s.consist[0].name = "hopper";
  EXPECT_EQ(outcome::released(s, happened).expected, 0.0);
  s.consist[0].name = "tank_car";
  s.contact.law = inputs::ContactLaw::none;
  EXPECT_EQ(outcome::released(s, happened).expected, 0.0);
}

}  // namespace
}  // namespace train_derail
