// What the 3D view is made of, without RViz, node or master: where the camera stands, what the overlay says.
#include <cmath>

#include <gtest/gtest.h>

#include "rviz/framing.hpp"

namespace train_derail::rviz_panel {
namespace {

/// What a box takes of the part of the picture that is free: from 0 to 1, as shares of its width and height.
struct Taken {
  Eigen::Array2d low = Eigen::Array2d::Constant(INFINITY), high = Eigen::Array2d::Constant(-INFINITY);

  Taken(const Box& box, const Camera& camera, const Picture& picture) {
    const Margins& m = picture.margins;
    const Eigen::Array2d before(m.left, m.bottom), free(1.0 - m.left - m.right, 1.0 - m.bottom - m.top);
    for (const auto& corner : corners(box).colwise()) {
      const Eigen::Array2d share = (0.5 + 0.5 * project(camera, picture, corner).array() - before) / free;
      low = low.min(share);
      high = high.max(share);
    }
  }
};

class Framing : public testing::Test {
 protected:
  template <class Use>
  void for_many(const Use& use) {
    for (const double aspect : {0.5, 1.0, 1.35, 1.78, 3.0}) {
      for (const double yaw : {-3.0, -1.75, -M_PI_2, 0.0, 0.3, 1.2}) {
        for (const double pitch : {0.05, 0.22, 0.6, 1.2, M_PI_2}) {
          for (const double length : {18.0, 60.0, 400.0}) {
            for (const double width : {3.0, 40.0, 150.0}) {
              const Box box = heap_box({-120.0, 30.0, 0.0}, 0.7, length, width);
              const Picture picture{0.61, aspect};
              use(box, Direction{yaw, pitch}, picture);
            }
          }
        }
      }
    }
  }
};

TEST_F(Framing, EveryCornerIsInsideTheMarginsAndTheBoxIsAsLargeAsThatAllows) {
  int wide = 0, high = 0;
  for_many([&](const Box& box, const Direction& direction, const Picture& picture) {
    const Camera camera = frame(box, direction, picture);
    ASSERT_GT(camera.distance, 0.0);
    for (const auto& corner : corners(box).colwise()) {
      ASSERT_GT(-(camera.axes.col(2).dot(corner - camera.position())), 0.0) << "behind the camera";
    }
    const Taken taken(box, camera, picture);
    const Eigen::Array2d size = taken.high - taken.low;
    constexpr double kRound = 1e-9;
    EXPECT_TRUE((taken.low > -kRound).all() && (taken.high < 1.0 + kRound).all());
    EXPECT_LT(size.x(), picture.width_share + kRound);
    EXPECT_LT(size.y(), picture.height_share + kRound);
    const bool fills_width = size.x() > picture.width_share - kRound;
    const bool fills_height = size.y() > picture.height_share - kRound;
    EXPECT_TRUE(fills_width || fills_height);
    if (fills_width) {
      EXPECT_NEAR(0.5 * (taken.low.x() + taken.high.x()), 0.5, kRound);
    } else {
      EXPECT_NEAR(0.5 * (taken.low.y() + taken.high.y()), 0.5, kRound);
    }
    wide += fills_width ? 1 : 0;
    high += fills_height ? 1 : 0;
  });
  EXPECT_GT(wide, 100);
  EXPECT_GT(high, 100);
}

TEST_F(Framing, AnOblongHeapSeenFromItsSideFillsTheWidth) {
  for_many([&](const Box& box, const Direction& direction, const Picture& picture) {
    const bool from_the_side = std::abs(std::sin(direction.yaw)) > 0.9 && direction.pitch < 0.7;
    if (!from_the_side || box.length < 3.0 * box.width || picture.aspect < 1.3 || picture.aspect > 2.0) return;
    const Taken taken(box, frame(box, direction, picture), picture);
    EXPECT_NEAR(taken.high.x() - taken.low.x(), picture.width_share, 1e-9);
  });
}

TEST_F(Framing, AShortHeapIsShownAsALongerOne) {
  const Box box = heap_box({0.0, 0.0, 0.0}, 0.0, 10.0, 3.0);
  EXPECT_EQ(box.length, kHeapLengthLeast);
  EXPECT_EQ(heap_box({0.0, 0.0, 0.0}, 0.0, 90.0, 3.0).length, 90.0);
  // A car of 18 m still takes a third of the picture.
  const Picture picture{0.61, 1.5};
  const Camera camera = frame(box, {-M_PI_2, 0.6}, picture);
  const double car = project(camera, picture, {9.0, 0.0, 0.0}).x() - project(camera, picture, {-9.0, 0.0, 0.0}).x();
  EXPECT_GT(0.5 * car, 0.25);
}

TEST_F(Framing, TheCameraIsWhereTheDirectionSays) {
  const Box box = heap_box({5.0, 6.0, 0.0}, M_PI_2, 60.0, 10.0);
  const Picture picture{0.61, 1.5};
  // The track heads along +y; -pi/2 is to its right, hence +x.
  const Camera side = frame(box, {-M_PI_2, 0.0}, picture);
  EXPECT_GT(side.position().x(), 5.0 + 30.0);
  EXPECT_NEAR(side.position().y(), 6.0, 1e-9);
  // Forward is to the right.
  EXPECT_GT(project(side, picture, {5.0, 20.0, 0.0}).x(), 0.0);
  EXPECT_GT(project(side, picture, {5.0, 6.0, 4.0}).y(), project(side, picture, {5.0, 6.0, 0.0}).y());
  const Camera above = frame(box, {-M_PI_2, M_PI_2}, picture);
  EXPECT_NEAR(above.axes(2, 2), 1.0, 1e-12);
  EXPECT_GT(project(above, picture, {5.0, 20.0, 0.0}).x(), 0.0);
  EXPECT_TRUE((side.axes.transpose() * side.axes).isIdentity(1e-12));
}

TEST_F(Framing, BetweenTwoBoxesTheHeadingGoesTheShortWay) {
  const Box a{{0.0, 0.0, 0.0}, 3.0, 10.0, 2.0, 4.0}, b{{10.0, 0.0, 0.0}, -3.0, 20.0, 4.0, 4.0};
  const Box half = between(a, b, 0.5);
  EXPECT_NEAR(std::cos(half.heading), -1.0, 1e-9);
  EXPECT_EQ(half.middle.x(), 5.0);
  EXPECT_EQ(half.length, 15.0);
  const Box all = between(a, b, 1.0);
  EXPECT_NEAR(std::remainder(all.heading - b.heading, 2.0 * M_PI), 0.0, 1e-9);
  EXPECT_EQ(all.width, 4.0);
}

}  // namespace
}  // namespace train_derail::rviz_panel
