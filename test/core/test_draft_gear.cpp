// Couplers with draft gears, damping and a load at which they break, against closed forms.
#include <algorithm>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"
#include "train_derail/model/draft_gear_law.hpp"

namespace train_derail {
namespace {

using By = model::BrokenCoupler::By;
using test::CarMotion;
using test::Train;

inputs::Coupler gear() {
  inputs::Coupler c;
  c.stiffness = 4e8;
  c.draft_gear_stiffness = 2e7;
  c.draft_gear_travel = 0.15;
  return c;
}

/// Buff force `excess` beyond the slack; as large in draft.
double gear_force(const inputs::Coupler& c, double excess) {
  const double buff = model::coupler_spring_force<double>(c, c.length - 0.5 * c.slack - excess);
  EXPECT_NEAR(model::coupler_spring_force<double>(c, c.length + 0.5 * c.slack + excess), -buff,
              1e-7 * c.stiffness * 1e-3);
  return buff;
}

TEST(DraftGear, IsSoftOverItsTravelAndSolidBeyond) {
  const inputs::Coupler c = gear();
  for (const double within : {-0.49, 0.0, 0.3, 0.49}) {
    EXPECT_EQ(model::coupler_spring_force<double>(c, c.length + within * c.slack), 0.0);
  }
  EXPECT_NEAR(gear_force(c, 0.1), 2e6, 1e-6);
  EXPECT_NEAR(gear_force(c, 0.15), 3e6, 1e-6);
  EXPECT_NEAR(gear_force(c, 0.16), 3e6 + 4e6, 1e-6);
}

TEST(DraftGear, IsThePapersCouplerWithoutTravel) {
  inputs::Coupler c = gear();
  c.draft_gear_travel = 0.0;
  for (double gap = 0.5; gap < 2.0; gap += 0.013) {
    EXPECT_EQ(model::coupler_spring_force<double>(c, gap), model::axial_force<double>(c, gap)) << gap;
  }
}

TEST(DraftGear, ForceIsTheSlopeOfTheEnergy) {
  const inputs::Coupler c = gear();
  for (const double d : {0.01, 0.1, 0.149, 0.151, 0.2, 0.4}) {
    const double e = 1e-5;
    const double slope = (model::draft_gear_energy(c, d + e) - model::draft_gear_energy(c, d - e)) / (2.0 * e);
    EXPECT_NEAR(slope / gear_force(c, d), 1.0, 1e-8) << d;
  }
  EXPECT_EQ(model::draft_gear_energy(c, 0.0), 0.0);
  EXPECT_NEAR(model::draft_gear_energy(c, 0.15 + 1e-12), model::draft_gear_energy(c, 0.15), 1e-3);
}

TEST(CouplerDamper, OpposesTheRateAndNeverTurnsTheForceRound) {
  test::Random random(5);
  int limited = 0;
  for (int i = 0; i < 1000; ++i) {
    const double c = random.uniform(0.0, 1e7), spring = random.uniform(-1e6, 1e6), rate = random.uniform(-1.0, 1.0);
    const double damper = model::coupler_damper_force(c, spring, rate);
    EXPECT_LE(damper * rate, 0.0);  // takes energy: buff is positive where the gap closes
    EXPECT_GE((spring + damper) * spring, 0.0);
    if (std::abs(damper) < c * std::abs(rate) * (1.0 - 1e-12)) {
      ++limited;
      EXPECT_EQ(spring + damper, 0.0);
    } else {
      EXPECT_DOUBLE_EQ(damper, -c * rate);
    }
  }
  EXPECT_GT(limited, 100);
  EXPECT_EQ(model::coupler_damper_force(1e6, 0.0, 1.0), 0.0);  // none in the slack
}

TEST(CouplerDamper, HasTheDampingOfTwoCarsOnTheFirstSpring) {
  inputs::Coupler c = gear();
  c.damping_ratio = 0.3;
  EXPECT_DOUBLE_EQ(model::coupler_damping(c, 3e4, 6e4), 2.0 * 0.3 * std::sqrt(2e7 * 2e4));
  c.draft_gear_travel = 0.0;
  EXPECT_DOUBLE_EQ(model::coupler_damping(c, 6e4, 3e4), 2.0 * 0.3 * std::sqrt(4e8 * 2e4));
}

/// Two free cars at the end of the slack on the side that they are about to load; `closing` > 0: buff.
Train meet(const inputs::Scenario& s, double closing) {
  const double gap = s.coupler.length - std::copysign(0.5 * s.coupler.slack, closing);
  return Train(s, {CarMotion{-100.0, 0.0, 0.0, 10.0 - 0.5 * closing, 0.0, 0.0},
                   CarMotion{-100.0 - s.consist[0].length - gap, 0.0, 0.0, 10.0 + 0.5 * closing, 0.0, 0.0}});
}

inputs::Scenario two_cars(double step = 1e-4) {
  inputs::Scenario s = test::bare(2, step);
  const double swing = s.coupler.swing_stiffness;
  s.coupler = gear();
  s.coupler.swing_stiffness = swing;
  return s;
}

double reduced_mass(const inputs::Scenario& s) { return 0.5 * s.consist[0].weight / inputs::kStandardGravity; }

class Meeting : public testing::TestWithParam<double> {};

TEST_P(Meeting, LoadsTheGearToTheEnergyThatItBrings) {
  const double closing = GetParam();
  const inputs::Scenario s = two_cars();
  const double energy = 0.5 * reduced_mass(s) * closing * closing;
  Train train = meet(s, closing);
  double t = 0.0;
  do {  // until they have parted, not on to the other end of the slack
    train.to(t += 2e-3);
  } while (t < 2.0 && (train.incidents().buff.force + train.incidents().draft.force == 0.0 ||
                       train.model().coupler(train.data(), 0).axial != 0.0));
  const model::Peak& loaded = closing > 0.0 ? train.incidents().buff : train.incidents().draft;
  const model::Peak& idle = closing > 0.0 ? train.incidents().draft : train.incidents().buff;
  double low = 0.0, high = 2.0;  // depth at which the gear has taken the energy
  for (int i = 0; i < 100; ++i) {
    (model::draft_gear_energy(s.coupler, 0.5 * (low + high)) < energy ? low : high) = 0.5 * (low + high);
  }
  EXPECT_NEAR(loaded.force / gear_force(s.coupler, low), 1.0, 5e-3);
  EXPECT_EQ(loaded.coupler, 0);
  EXPECT_EQ(idle.force, 0.0);
  // They part as they met.
  EXPECT_NEAR(train.car(0).vx, 10.0 + 0.5 * closing, 5e-3 * std::abs(closing));
  EXPECT_NEAR(train.car(1).vx, 10.0 - 0.5 * closing, 5e-3 * std::abs(closing));
}

TEST_P(Meeting, OfDampedCarsFollowsTheOscillator) {
  // Within the soft travel: x(t) = v / w_d exp(-z w t) sin(w_d t) until the damper would turn the force round, where
  // 2 z w x' = -w^2 x: tan(w_d t) = w_d * 2 z / (w (2 z^2 - 1)), in the second quarter.
  const double closing = GetParam();
  inputs::Scenario s = two_cars(2e-5);
  s.coupler.draft_gear_travel = 10.0;
  s.coupler.damping_ratio = 0.2;
  const double z = 0.2, w = std::sqrt(s.coupler.draft_gear_stiffness / reduced_mass(s)),
               wd = w * std::sqrt(1.0 - z * z);
  const double free_at = (test::kPi + std::atan(wd * 2.0 * z / (w * (2.0 * z * z - 1.0)))) / wd;
  const auto x = [&](double t) { return std::exp(-z * w * t) * std::sin(wd * t) * std::abs(closing) / wd; };
  const auto rate = [&](double t) {
    return std::exp(-z * w * t) * (std::cos(wd * t) - z * w / wd * std::sin(wd * t)) * std::abs(closing);
  };
  Train train = meet(s, closing);
  const double gap = s.coupler.length - std::copysign(0.5 * s.coupler.slack, closing);
  double work = 0.0;
  for (int i = 1; i <= 20; ++i) {
    train.to(free_at * i / 20.0);
    const double t = std::min(train.time(), free_at);
    const double depth = std::copysign(1.0, closing) * (gap - train.model().coupler(train.data(), 0).gap);
    EXPECT_NEAR(depth, x(t), 1e-3 * std::abs(closing) / w);
    EXPECT_GE(train.energy().work_coupler_damping, work - 1e-9);
    work = train.energy().work_coupler_damping;
  }
  double t = free_at;
  while (t < 2.0 && std::abs(train.model().coupler(train.data(), 0).gap - s.coupler.length) > 0.5 * s.coupler.slack) {
    train.to(t += 1e-3);  // until they are free, not on to the other end of the slack
  }
  // From there on nothing acts.
  EXPECT_NEAR(train.car(0).vx - train.car(1).vx, -std::copysign(1.0, closing) * rate(free_at),
              2e-3 * std::abs(closing));
  const double left = 0.5 * reduced_mass(s) * (closing * closing - rate(free_at) * rate(free_at));
  EXPECT_NEAR(train.energy().work_coupler_damping / left, 1.0, 2e-3);
}

INSTANTIATE_TEST_SUITE_P(BuffAndDraft, Meeting, testing::Values(0.5, -0.5, 3.0, -3.0));

TEST(BreakingCoupler, HoldsUpToItsDraftLoadAndNoMore) {
  inputs::Scenario s = two_cars();
  s.coupler.draft_gear_travel = 0.0;
  s.coupler.stiffness = 2e7;
  s.coupler.break_draft = 1.5e6;
  const double w = std::sqrt(s.coupler.stiffness / reduced_mass(s));
  const double critical = s.coupler.break_draft * w / s.coupler.stiffness;  // top force = k v / w
  Train holds = meet(s, -0.99 * critical);
  holds.to(2.0);
  EXPECT_TRUE(holds.incidents().broken.empty());
  EXPECT_FALSE(holds.model().broken(0));

  const double parting = 1.25 * critical;
  Train train = meet(s, -parting);
  const double energy = train.energy().total();
  train.to(2.0);
  ASSERT_EQ(train.incidents().broken.size(), 1u);
  const model::BrokenCoupler& b = train.incidents().broken[0];
  EXPECT_EQ(b.by, By::draft);
  EXPECT_EQ(b.coupler, 0);
  EXPECT_NEAR(b.time, std::asin(0.8) / w, 4e-4);
  // No force beyond it, however long the step.
  EXPECT_EQ(train.incidents().draft.force, s.coupler.break_draft);
  EXPECT_EQ(b.axial_force, -s.coupler.break_draft);
  // The strain energy at that load is gone, what is left of the speed stays.
  const double lost = 0.5 * s.coupler.break_draft * s.coupler.break_draft / s.coupler.stiffness;
  EXPECT_NEAR(train.energy().work_coupler_break / lost, 1.0, 1e-2);
  EXPECT_NEAR(train.car(0).vx - train.car(1).vx, 0.6 * parting, 1e-2 * parting);
  EXPECT_NEAR(train.energy().total() / energy, 1.0, 1e-5);
  // It carries nothing from now on, though the gap is wide.
  EXPECT_TRUE(train.model().broken(0));
  EXPECT_EQ(train.model().coupler(train.data(), 0).axial, 0.0);
  const CarMotion before = train.car(0);
  train.to(2.5);
  EXPECT_EQ(train.car(0).vx, before.vx);
}

TEST(BreakingCoupler, BuffDoesNotBreakIt) {
  inputs::Scenario s = two_cars();
  s.coupler.break_draft = 1e5;
  Train train = meet(s, 3.0);
  train.to(0.1);
  EXPECT_GT(train.incidents().buff.force, 1e6);
  EXPECT_TRUE(train.incidents().broken.empty());
}

TEST(BreakingCoupler, BreaksByItsSwingAtEitherEnd) {
  for (const int turning : {0, 1}) {
    for (const double omega : {0.5, -0.5}) {
      inputs::Scenario s = two_cars(1e-3);
      s.coupler.swing_stiffness = 0.0;
      s.coupler.stiffness = s.coupler.draft_gear_stiffness = 1.0;  // nothing moves but what turns
      s.coupler.slack = 2.0 * s.coupler.length - 1e-3;
      s.coupler.break_swing = 40.0 * inputs::kDegree;
      std::vector<CarMotion> cars{{-100.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {-100.0 - test::kPitch, 0.0, 0.0, 0.0, 0.0, 0.0}};
      cars[static_cast<std::size_t>(turning)].omega = omega;
      Train train(s, cars);
      // The angle between the bar and either car, worked out from the pins.
      double swing = 0.0, before = 0.0;
      while (train.time() < 3.0) {
        before = swing;
        const Eigen::Vector2d d =
            train.model().rear_pin(train.data(), 0).position - train.model().front_pin(train.data(), 1).position;
        const double beta = std::atan2(d.y(), d.x());
        swing = std::max(std::abs(beta - train.car(0).theta), std::abs(beta - train.car(1).theta));
        if (!train.incidents().broken.empty()) break;
        train.step();
      }
      ASSERT_EQ(train.incidents().broken.size(), 1u);
      EXPECT_EQ(train.incidents().broken[0].by, By::swing);
      EXPECT_GE(swing, s.coupler.break_swing - 1e-12);
      EXPECT_LT(before, s.coupler.break_swing);
      // Within the step, where the angle was reached.
      const double share = (s.coupler.break_swing - before) / (swing - before);
      EXPECT_NEAR(train.incidents().broken[0].time, train.time() - (1.0 - share) * 1e-3, 1e-5);
    }
  }
}

TEST(BreakingCoupler, BreaksByItsMoments) {
  inputs::Scenario s = two_cars(1e-4);
  s.coupler.swing_limit = 0.1;
  s.coupler.swing_stiffness = 4e6;
  s.coupler.break_moment = 5e5;
  std::vector<CarMotion> cars{{-100.0, 0.0, 0.0, 10.0, 0.0, 1.0}, {-100.0 - test::kPitch, 0.0, 0.0, 10.0, 0.0, 0.0}};
  Train train(s, cars);
  double moment = 0.0;
  while (train.incidents().broken.empty() && train.time() < 3.0) {
    const auto b = train.model().coupler(train.data(), 0);
    moment = std::abs(b.moment_lead + b.moment_trail);
    train.step();
  }
  ASSERT_EQ(train.incidents().broken.size(), 1u);
  EXPECT_EQ(train.incidents().broken[0].by, By::moment);
  // The last that acted.
  EXPECT_LE(moment, s.coupler.break_moment);
  EXPECT_GT(moment, 0.95 * s.coupler.break_moment);
}

}  // namespace
}  // namespace train_derail
