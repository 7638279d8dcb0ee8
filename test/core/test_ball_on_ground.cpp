// Where a ball presses on the ground beside the track: against the ground's height, place by place, and as it moves.
#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/model/ball_on_ground.hpp"

namespace train_derail {
namespace {

using model::ball_on_ground;
using model::BallTouch;
using model::BallTouches;
using model::CrossSection;
using model::ground_height;
using model::GroundOutline;

CrossSection section(double ballast, double left, double right) {
  CrossSection t{inputs::Terrain{}};
  t.ballast_height = ballast;
  t.bank_left = left;
  t.bank_right = right;
  return t;
}
CrossSection random_section(test::Random& random) {
  CrossSection t{inputs::Terrain{}};
  t.ballast_height = random.index(3) == 0 ? 0.0 : random.uniform(0.1, 1.5);
  t.bank_left = random.index(3) == 0 ? 0.0 : random.uniform(-4.0, 4.0);
  t.bank_right = random.index(3) == 0 ? 0.0 : random.uniform(-4.0, 4.0);
  t.bank_slope = random.uniform(0.2, 1.0);
  t.ballast_slope = random.uniform(0.2, 1.0);
  t.ballast_half_width = random.uniform(1.0, 3.0);
  t.crown = random.uniform(1.0, 4.0);
  return t;
}

/// How deep the part of a ball `aside` from its middle is in the ground, straight down.
double depth_at(const CrossSection& t, double offset, double height, double radius, double aside) {
  return ground_height(t, offset + aside).z - height + std::sqrt(radius * radius - aside * aside);
}

TEST(GroundOutline, IsTheGround) {
  test::Random random(1);
  for (int i = 0; i < 500; ++i) {
    const CrossSection t = random_section(random);
    const GroundOutline outline(t);
    for (std::size_t k = 0; k < outline.corners(); ++k)
      EXPECT_EQ(outline.corner(k).z, ground_height(t, outline.corner(k).offset).z);
    for (std::size_t k = 1; k < outline.corners(); ++k) {
      const auto &a = outline.corner(k - 1), &b = outline.corner(k);
      ASSERT_LT(a.offset, b.offset);
      for (const double share : {0.01, 0.3, 0.5, 0.99})
        ASSERT_NEAR(ground_height(t, a.offset + share * (b.offset - a.offset)).z, a.z + share * (b.z - a.z), 1e-9) << i;
    }
    ASSERT_GT(outline.corners(), 0U);
    for (const double beyond : {0.1, 20.0}) {
      EXPECT_NEAR(ground_height(t, outline.corner(0).offset - beyond).z, outline.corner(0).z, 1e-9);
      const auto& last = outline.corner(outline.corners() - 1);
      EXPECT_NEAR(ground_height(t, last.offset + beyond).z, last.z, 1e-9);
    }
  }
}

TEST(BallOnGround, TouchesWhereItIsDeeperThanAround) {
  test::Random random(2);
  int none = 0, one = 0, more = 0, edges = 0, below = 0;
  for (int i = 0; i < 5000; ++i) {
    const CrossSection t = random_section(random);
    const GroundOutline outline(t);
    const double radius = random.uniform(0.5, 2.0), offset = random.uniform(-9.0, 9.0);
    // So that it is at most a little deep.
    double most = -1e9;
    for (int k = -1000; k <= 1000; ++k) most = std::max(most, depth_at(t, offset, 0.0, radius, 0.000999 * k * radius));
    const double wanted = random.uniform(-0.05, 0.15), height = most - wanted;
    const BallTouches found = ball_on_ground(outline, offset, height, radius);
    (found.count == 0 ? none : found.count == 1 ? one : more) += 1;
    double deepest = 0.0;
    for (std::size_t k = 0; k < found.count; ++k) {
      const BallTouch& touch = found.at[k];
      ASSERT_NEAR(std::hypot(touch.aside, touch.up), 1.0, 1e-12);
      ASSERT_GT(touch.up, 0.0);
      const double here = -radius * touch.aside;
      const double in_ground = depth_at(t, offset, height, radius, here);
      if (touch.number % 2 == 0 && touch.depth < in_ground - 1e-9) {
        ++below;  // a slope that goes on beyond a hollow
        continue;
      }
      ASSERT_NEAR(touch.depth, in_ground, 1e-9) << i;
      for (const double by : {-1e-5, 1e-5}) {
        if (std::abs(here + by) >= radius) continue;
        ASSERT_LT(depth_at(t, offset, height, radius, here + by), touch.depth + 1e-9) << i;
      }
      deepest = std::max(deepest, touch.depth);
      edges += touch.number % 2 == 1 ? 1 : 0;
    }
    ASSERT_NEAR(deepest, std::max(wanted, 0.0), 2e-3) << i;
  }
  EXPECT_GT(none, 500);
  EXPECT_GT(one, 2000);
  EXPECT_GT(more, 50);
  EXPECT_GT(edges, 200);
  EXPECT_LT(below, 50);
}

TEST(BallOnGround, PressesAlongTheGradientOfItsEnergy) {
  // Of the sum of the squares of all depths, which is what the ground's springs store.
  test::Random random(3);
  int touching = 0, jumps = 0;
  for (int i = 0; i < 6000; ++i) {
    const CrossSection t = random_section(random);
    const GroundOutline outline(t);
    const double offset = random.uniform(-9.0, 9.0), radius = 1.5, step = 1e-6;
    double most = -1e9;
    for (int k = -100; k <= 100; ++k) most = std::max(most, depth_at(t, offset, 0.0, radius, 0.00999 * k * radius));
    const double height = most - (i % 2 == 0 ? 0.03 : random.uniform(0.03, 0.4));
    const auto energy = [&](double y, double z) {
      const BallTouches found = ball_on_ground(outline, y, z, radius);
      double sum = 0.0;
      for (std::size_t k = 0; k < found.count; ++k) sum += 0.5 * found.at[k].depth * found.at[k].depth;
      return sum;
    };
    const BallTouches found = ball_on_ground(outline, offset, height, radius);
    double push_aside = 0.0, push_up = 0.0;
    for (std::size_t k = 0; k < found.count; ++k) {
      push_up += found.at[k].depth;
      push_aside += found.at[k].depth * found.at[k].aside / found.at[k].up;
    }
    if (found.count == 0) continue;
    ++touching;
    const double up = (energy(offset, height + step) - energy(offset, height - step)) / (2.0 * step);
    const double aside = (energy(offset + step, height) - energy(offset - step, height)) / (2.0 * step);
    EXPECT_NEAR(-up, push_up, 1e-3);
    if (std::abs(-aside - push_aside) > 1e-3) ++jumps;
  }
  EXPECT_GT(touching, 5000);
  EXPECT_LT(jumps, 10);
}

TEST(BallOnGround, DoesNotJumpAtAHollowHoweverDeepItIs) {
  // Over the foot of 0.5 m of ballast, from the roadbed up, at a load of a car and of ten.
  CrossSection t = section(0.5, 0.0, 0.0);
  const GroundOutline outline(t);
  const double foot = t.ballast_half_width + t.ballast_height / t.ballast_slope, radius = 1.5;
  const double bed = -t.rail_height - t.ballast_height;
  for (const double depth : {0.03, 0.1, 0.3, 0.45}) {
    double before = -1.0;
    for (double at = foot + 2.0; at > foot - 0.3; at -= 1e-4) {
      const BallTouches found = ball_on_ground(outline, at, bed + radius - depth, radius);
      double energy = 0.0;
      for (std::size_t k = 0; k < found.count; ++k) energy += 0.5 * found.at[k].depth * found.at[k].depth;
      if (before >= 0.0) {
        ASSERT_NEAR(energy, before, 1e-4) << depth << " m deep at " << at - foot;
      }
      before = energy;
    }
  }
}

TEST(BallOnGround, MirroredIsTheMirrorImage) {
  test::Random random(4);
  for (int i = 0; i < 2000; ++i) {
    const CrossSection t = random_section(random);
    CrossSection m = t;
    std::swap(m.bank_left, m.bank_right);
    const GroundOutline outline(t), mirrored(m);
    ASSERT_EQ(outline.corners(), mirrored.corners());
    const double offset = random.uniform(-9.0, 9.0), height = ground_height(t, offset).z + 1.48;
    const BallTouches a = ball_on_ground(outline, offset, height, 1.5),
                      b = ball_on_ground(mirrored, -offset, height, 1.5);
    ASSERT_EQ(a.count, b.count) << i;
    for (std::size_t k = 0; k < a.count; ++k) {
      const BallTouch &x = a.at[k], &y = b.at[b.count - 1 - k];
      EXPECT_NEAR(x.aside, -y.aside, 1e-12);
      EXPECT_NEAR(x.depth, y.depth, 1e-12);
      EXPECT_EQ(x.number + y.number, 2 * outline.corners());
    }
  }
}

TEST(BallOnGround, LiesInAHollowOnBothSlopes) {
  // A cut of slope 1:2 on the left of a level crown: as deep in either, the ball's centre is above the line between.
  const CrossSection t = section(0.0, -5.0, 0.0);
  const double angle = std::atan(t.bank_slope), radius = 1.5, depth = 0.1;
  const double height = -t.rail_height + radius - depth;
  // The distance from the slope is such that it is 0.1 m deep there, too, straight down.
  const double distance = radius - depth * std::cos(angle);
  const double offset = t.crown + (radius - depth) / std::tan(angle) - distance / std::sin(angle);
  const BallTouches found = ball_on_ground(GroundOutline(t), offset, height, radius);
  ASSERT_EQ(found.count, 2U);
  EXPECT_NEAR(found.at[0].depth, depth, 1e-12);
  EXPECT_NEAR(found.at[1].depth, depth, 1e-12);
  EXPECT_NEAR(found.at[0].up, 1.0, 1e-12);
  EXPECT_NEAR(found.at[1].aside, -std::sin(angle), 1e-12);
}

}  // namespace
}  // namespace train_derail
