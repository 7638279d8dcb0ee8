// Where a cylinder with domed heads presses on another one or on a box: closed forms, symmetry, continuity, brute
// force.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "model/cylinder_contact.hpp"
#include "random_bodies.hpp"

namespace train_derail {
namespace {

using model::BodyContact;
using model::BodyManifold;
using model::Box;
using model::Cylinder;
using model::press;
using test::random_axes;
using test::random_vector;
using Vec = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;

constexpr double kRadius = 1.5, kHalf = 7.0;
const Vec kBox(9.0, 1.4, 1.7);

Cylinder tank(const Vec& centre, const Vec& along = Vec::UnitX(), double half = kHalf, double radius = kRadius) {
  return {centre, along.normalized(), half, radius};
}
Box box(const Vec& centre = Vec::Zero(), const Matrix& axes = Matrix::Identity()) { return {centre, axes, kBox}; }
BodyContact press(const Cylinder& a, const Cylinder& b) { return model::press(a, b, 0.0); }
BodyContact press(const Cylinder& a, const Box& b) { return model::press(a, b, 0.0); }

/// Where the force acts.
Vec middle_of(const BodyManifold& m) {
  Vec sum = Vec::Zero();
  for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) sum += m.share[i] * m.point[i];
  return sum;
}

void expect_one(const BodyContact& c, const Vec& point, const Vec& normal, double depth, double within = 1e-9) {
  ASSERT_EQ(c.manifold.count, 1);
  EXPECT_EQ(c.gap, 0.0);
  EXPECT_NEAR(c.manifold.depth[0], depth, within);
  EXPECT_NEAR((c.manifold.normal - normal).norm(), 0.0, within);
  EXPECT_NEAR((c.manifold.point[0] - point).norm(), 0.0, within) << c.manifold.point[0].transpose();
  EXPECT_EQ(c.manifold.share[0], 1.0);
}

/// Two points with equal shares, in any order.
void expect_two(const BodyContact& c, const Vec& first, const Vec& second, const Vec& normal, double depth) {
  const BodyManifold& m = c.manifold;
  ASSERT_EQ(m.count, 2);
  EXPECT_NEAR((m.normal - normal).norm(), 0.0, 1e-9);
  const bool other_way = (m.point[0] - first).norm() > (m.point[0] - second).norm();
  EXPECT_NEAR((m.point[other_way ? 1 : 0] - first).norm(), 0.0, 1e-9);
  EXPECT_NEAR((m.point[other_way ? 0 : 1] - second).norm(), 0.0, 1e-9);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_NEAR(m.depth[i], depth, 1e-9);
    EXPECT_NEAR(m.share[i], 0.5, 1e-9);
  }
}

Cylinder random_tank(test::Random& random) {
  return tank(random_vector(random, 5.0), random_axes(random).col(0), random.uniform(2.0, 8.0),
              random.uniform(1.0, 1.8));
}
Box random_box(test::Random& random) {
  return {random_vector(random, 5.0),
          random_axes(random),
          {random.uniform(2.0, 9.0), random.uniform(1.0, 2.0), random.uniform(1.0, 2.0)}};
}

// Two cylinders

TEST(CylinderContact, HeadsMeetInAPoint) {
  const double reach = 2.0 * (kHalf + kRadius);
  expect_one(press(tank({reach - 0.2, 0.0, 0.0}), tank(Vec::Zero())), {0.5 * reach - 0.1, 0.0, 0.0}, Vec::UnitX(), 0.2);
  EXPECT_EQ(press(tank({reach + 0.2, 0.0, 0.0}), tank(Vec::Zero())).manifold.count, 0);
  EXPECT_NEAR(press(tank({reach + 0.2, 0.0, 0.0}), tank(Vec::Zero())).gap, 0.2, 1e-12);
  // Set aside by 1 m: spheres whose centres are 2 m apart along the track.
  const Vec apart(2.0, 1.0, 0.0);
  expect_one(press(tank({2.0 * kHalf + 2.0, 1.0, 0.0}), tank(Vec::Zero())), Vec(kHalf, 0.0, 0.0) + 0.5 * apart,
             apart.normalized(), 2.0 * kRadius - apart.norm());
}

TEST(CylinderContact, SideBySideTheyTouchAlongWhatTheyShare) {
  // At the sum of the radii, at any height of one above the other.
  for (const double angle : {0.0, 0.6, 0.25 * test::kPi, 1.5}) {
    const Vec n(0.0, std::cos(angle), std::sin(angle));
    EXPECT_EQ(press(tank((2.0 * kRadius + 1e-6) * n), tank(Vec::Zero())).manifold.count, 0);
    const double depth = 0.1;
    const Vec away = (2.0 * kRadius - depth) * n;
    const Vec end(kHalf, 0.0, 0.0), ahead(5.0, 0.0, 0.0);
    expect_two(press(tank(away), tank(Vec::Zero())), 0.5 * away + end, 0.5 * away - end, n, depth);
    expect_two(press(tank(away + ahead), tank(Vec::Zero())), 0.5 * away + end, 0.5 * away + ahead - end, n, depth);
    expect_two(press(tank(away + ahead, -Vec::UnitX()), tank(Vec::Zero())), 0.5 * away + end, 0.5 * away + ahead - end,
               n, depth);
  }
}

TEST(CylinderContact, CrossedTheyTouchInAPoint) {
  expect_one(press(tank({2.0, 3.0, 2.9}, Vec::UnitY()), tank(Vec::Zero())), {2.0, 0.0, 1.45}, Vec::UnitZ(), 0.1);
  // A head in the side of the other.
  expect_one(press(tank({2.0, kHalf + 2.9, 0.0}, Vec::UnitY()), tank(Vec::Zero())), {2.0, 1.45, 0.0}, Vec::UnitY(),
             0.1);
}

TEST(CylinderContact, OneEndDownTakesMoreOfTheForce) {
  // The axis of a rises by `slope` from its rear to its front end; at the rear they overlap by `depth`.
  const double slope = 0.01, depth = 0.2;
  const Vec along = Vec(1.0, 0.0, slope).normalized();
  const Cylinder a = tank(Vec(-kHalf, 0.0, 2.0 * kRadius - depth) + kHalf * along, along);
  const BodyManifold m = press(a, tank(Vec::Zero())).manifold;
  ASSERT_EQ(m.count, 2);
  EXPECT_NEAR(m.depth[0], depth, 1e-4);
  const double length = std::abs(m.point[1].x() - m.point[0].x());
  // To where half of the depth is left.
  EXPECT_NEAR(length, 0.5 * depth / slope, 0.01);
  EXPECT_NEAR(middle_of(m).x(), -kHalf + length / 3.0, 0.01);
  // With 0.15 m crushed, half of what is left is left after 2.5 m.
  const BodyManifold crushed = model::press(a, tank(Vec::Zero()), 0.15).manifold;
  EXPECT_NEAR(std::abs(crushed.point[1].x() - crushed.point[0].x()), 2.5, 0.01);
  EXPECT_NEAR(crushed.depth[0], depth, 1e-4);
  // All is crushed: one point keeps the touch.
  EXPECT_EQ(model::press(a, tank(Vec::Zero()), 0.3).manifold.count, 1);
  EXPECT_NEAR(model::press(a, tank(Vec::Zero()), 0.3).manifold.depth[0], depth, 1e-4);
}

TEST(CylinderContact, NothingJumpsAsOneTurnsOverTheOther) {
  // From lying along each other to lying across, and on beyond; then tilted from one end to the other.
  const auto sweep = [](const auto& place, double most, double turns, const char* what) {
    Vec before = Vec::Zero(), normal = Vec::Zero();
    double depth = 0.0;
    for (int i = -35000; i <= 35000; ++i) {
      const BodyManifold m = press(place(5e-5 * i), tank({0.5, 0.1, -2.9})).manifold;
      ASSERT_GT(m.count, 0) << what << i;
      const Vec middle = middle_of(m);
      if (i > -35000) {
        ASSERT_LT((middle - before).norm(), most) << what << i;
        ASSERT_LT((m.normal - normal).norm(), turns) << what << i;
        ASSERT_NEAR(m.depth[0], depth, 5e-4) << what << i;
      }
      before = middle;
      normal = m.normal;
      depth = m.depth[0];
    }
  };
  sweep([](double a) { return tank(Vec::Zero(), {std::cos(a), std::sin(a), 0.0}); }, 0.005, 2e-4, "turned ");
  sweep([](double a) { return tank({0.0, 0.0, 0.05}, {std::cos(a), std::sin(a), 2e-3 * a}); }, 0.005, 2e-4, "askew ");
  sweep([](double a) { return tank(Vec::Zero(), {1.0, 0.003, 0.02 * a}); }, 0.02, 1e-3, "tilted ");
}

TEST(CylinderContact, NamesChangedOverGivesTheOpposite) {
  test::Random random(7);
  int touching = 0, lines = 0;
  for (int i = 0; i < 20000; ++i) {
    const Cylinder a = random_tank(random), b = random_tank(random);
    const double crushed = random.uniform(-0.2, 0.2);
    const BodyContact m = model::press(a, b, std::max(crushed, 0.0)), w = model::press(b, a, std::max(crushed, 0.0));
    ASSERT_EQ(m.manifold.count, w.manifold.count);
    ASSERT_NEAR(m.gap, w.gap, 1e-9);
    if (m.manifold.count == 0) continue;
    ++touching;
    lines += m.manifold.count == 2 ? 1 : 0;
    ASSERT_LT((m.manifold.normal + w.manifold.normal).norm(), 1e-9);
    ASSERT_LT((middle_of(m.manifold) - middle_of(w.manifold)).norm(), 1e-6) << i;
  }
  EXPECT_GT(touching, 5000);
  EXPECT_GT(lines, 4000);
}

TEST(CylinderContact, TheWholeSceneMovedTurnedAndMirroredGivesTheSame) {
  test::Random random(13);
  int touching = 0;
  for (int i = 0; i < 20000; ++i) {
    const Cylinder a = random_tank(random), b = random_tank(random);
    const Box c = random_box(random);
    Matrix turn = random_axes(random);
    if (i % 2 == 1) turn.col(1) *= -1.0;
    const Vec shift = random_vector(random, 1000.0);
    const auto moved = [&](const Cylinder& t) {
      return tank(turn * t.centre + shift, turn * t.along, t.half, t.radius);
    };
    Box box_moved{turn * c.centre + shift, turn * c.axes, c.half};
    // Which way an axis of a box looks does not matter, but axes stay right-handed.
    if (i % 2 == 1) box_moved.axes.col(2) *= -1.0;
    const BodyManifold pairs[2][2] = {{press(a, b).manifold, press(moved(a), moved(b)).manifold},
                                      {press(a, c).manifold, press(moved(a), box_moved).manifold}};
    for (const auto& pair : pairs) {
      ASSERT_EQ(pair[0].count > 0, pair[1].count > 0) << i;
      if (pair[0].count == 0) continue;
      ++touching;
      ASSERT_LT((turn * pair[0].normal - pair[1].normal).norm(), 1e-8) << i;
      ASSERT_NEAR(pair[0].depth[0], pair[1].depth[0], 1e-9) << i;
      ASSERT_LT((turn * middle_of(pair[0]) + shift - middle_of(pair[1])).norm(), 1e-5) << i;
    }
  }
  EXPECT_GT(touching, 10000);
}

// Cylinder and box

TEST(CylinderContact, LiesOnTheFaceOfABox) {
  const double up = kBox.z() + kRadius - 0.1, surface = kBox.z() - 0.05;
  expect_two(press(tank({1.0, 0.3, up}), box()), {1.0 + kHalf, 0.3, surface}, {1.0 - kHalf, 0.3, surface}, Vec::UnitZ(),
             0.1);
  // Across, it touches as far as the face goes and as far beyond as it overlaps by half: at 1.45 m from the edge.
  const double beyond = std::sqrt(1.45 * 1.45 - 1.4 * 1.4);
  const BodyContact across = press(tank({1.0, 0.3, up}, Vec::UnitY()), box());
  ASSERT_EQ(across.manifold.count, 2);
  EXPECT_NEAR(across.manifold.depth[0], 0.1, 1e-12);
  EXPECT_NEAR(middle_of(across.manifold).x(), 1.0, 1e-12);
  for (const Vec& p : {across.manifold.point[0], across.manifold.point[1]}) {
    EXPECT_LE(std::abs(p.y()), kBox.y() + beyond + 1e-9);
    EXPECT_GE(std::abs(p.y()), kBox.y());
  }
  EXPECT_NEAR(press(tank({1.0, 0.3, up + 0.4}), box()).gap, 0.3, 1e-12);
}

TEST(CylinderContact, AHeadOnTheFacesOfABox) {
  expect_one(press(tank({kBox.x() + kHalf + 1.4, 0.3, 0.2}), box()), {kBox.x() - 0.05, 0.3, 0.2}, Vec::UnitX(), 0.1);
  expect_one(press(tank({2.0, kBox.y() + kHalf + 1.4, 0.2}, Vec::UnitY()), box()), {2.0, kBox.y() - 0.05, 0.2},
             Vec::UnitY(), 0.1);
  // Aslant: the centre of the head lies 1.4 m above the roof, at its middle.
  const Vec along = Vec(0.3, 0.2, 1.0).normalized();
  const BodyManifold m = press(tank(Vec(0.0, 0.0, kBox.z() + 1.4) + kHalf * along, along), box()).manifold;
  EXPECT_NEAR((m.normal - Vec::UnitZ()).norm(), 0.0, 1e-12);
  EXPECT_NEAR(m.depth[0], 0.1, 1e-12);
  EXPECT_LT(middle_of(m).head<2>().norm(), 0.05);
}

TEST(CylinderContact, OnTheEdgesOfABox) {
  // Across an upper edge, askew to both faces; its axis passes the edge at 1.4 m.
  const Vec out = Vec(0.0, 1.0, 1.0).normalized(), edge(2.0, kBox.y(), kBox.z());
  const Vec along = Vec(0.4, 1.0, -1.0).normalized();
  const BodyManifold m = press(tank(edge + 1.4 * out + 0.5 * along, along), box()).manifold;
  EXPECT_NEAR((m.normal - out).norm(), 0.0, 1e-9);
  EXPECT_NEAR(m.depth[0], 0.1, 1e-9);
  EXPECT_NEAR((middle_of(m) - (edge - 0.05 * out)).norm(), 0.0, 2e-3);
  // Along it.
  const Vec beside = Vec(0.0, kBox.y(), kBox.z()), end(kHalf, 0.0, 0.0);
  expect_two(press(tank(beside + 1.4 * out), box()), beside + end - 0.05 * out, beside - end - 0.05 * out, out, 0.1);
}

TEST(CylinderContact, OnTheCornerOfABox) {
  // A head in any direction from the corner, and the side of a tank that passes it.
  const Vec out = Vec(1.0, 2.0, 3.0).normalized();
  expect_one(press(tank(kBox + (1.4 + kHalf) * out, out), box()), kBox - 0.05 * out, out, 0.1);
  const Vec along = out.cross(Vec(1.0, -1.0, 0.2)).normalized();
  const BodyManifold m = press(tank(kBox + 1.4 * out + along, along), box()).manifold;
  EXPECT_NEAR(m.depth[0], 0.1, 1e-9);
  EXPECT_NEAR((m.normal - out).norm(), 0.0, 1e-9);
  EXPECT_LT((middle_of(m) - (kBox - 0.05 * out)).norm(), 0.03);
}

TEST(CylinderContact, AnAxisWithinTheBoxComesOutWhereItIsNearest) {
  // 0.2 m below the roof, level and then with an end up.
  const BodyContact level = press(tank({1.0, 0.2, kBox.z() - 0.2}), box());
  const double middle = 0.5 * (kBox.z() + kBox.z() - 0.2 - kRadius);
  expect_two(level, {1.0 + kHalf, 0.2, middle}, {1.0 - kHalf, 0.2, middle}, Vec::UnitZ(), kRadius + 0.2);
  const Vec along = Vec(1.0, 0.0, 0.02).normalized();
  const BodyManifold m = press(tank({1.0, 0.2, kBox.z() - 0.2}, along), box()).manifold;
  EXPECT_NEAR((m.normal - Vec::UnitZ()).norm(), 0.0, 1e-12);
  EXPECT_NEAR(m.depth[0], kRadius + 0.2 + kHalf * along.z(), 1e-9);
  EXPECT_LT(middle_of(m).x(), 1.0);
  // Depth and normal go on where the axis goes in.
  const auto at_height = [](double up) { return press(tank({1.0, 0.2, kBox.z() + up}), box()).manifold; };
  EXPECT_NEAR(at_height(1e-6).depth[0] - at_height(-1e-6).depth[0], -2e-6, 1e-12);
  EXPECT_NEAR((middle_of(at_height(1e-6)) - middle_of(at_height(-1e-6))).norm(), 0.0, 1e-5);
}

// Brute force

double distance(const Cylinder& a, const Cylinder& b, double s) {
  const Vec p = a.centre + s * a.along;
  const double t = std::clamp(b.along.dot(p - b.centre), -b.half, b.half);
  return (p - b.centre - t * b.along).norm();
}
double distance(const Cylinder& a, const Box& b, double s) {
  const Vec p = b.axes.transpose() * (a.centre + s * a.along - b.centre);
  return (p - p.cwiseMax(-b.half).cwiseMin(b.half)).norm();
}
double reach(const Cylinder& a, const Cylinder& b) { return a.radius + b.radius; }
double reach(const Cylinder& a, const Box&) { return a.radius; }

/// Distance from the axis of a, which is convex, by thirds.
template <class Other>
double least_distance(const Cylinder& a, const Other& b) {
  double low = -a.half, high = a.half;
  for (int i = 0; i < 120; ++i) {
    const double third = (high - low) / 3.0;
    if (distance(a, b, low + third) > distance(a, b, high - third)) low += third;
    else high -= third;
  }
  return distance(a, b, 0.5 * (low + high));
}

template <class Other>
void compare_with_brute_force(test::Random& random, Other make(test::Random&)) {
  int touching = 0, apart = 0, inside = 0, shortened = 0;
  for (int i = 0; i < 6000; ++i) {
    const Cylinder a = random_tank(random);
    const Other b = make(random);
    const double least = least_distance(a, b), overlap = reach(a, b) - least;
    const BodyContact c = press(a, b);
    const BodyManifold& m = c.manifold;
    ASSERT_EQ(m.count > 0, overlap > 0.0) << i;
    if (m.count == 0) {
      ASSERT_NEAR(c.gap, -overlap, 1e-7) << i;
      ++apart;
      continue;
    }
    ++touching;
    const auto points = static_cast<std::size_t>(m.count);
    ASSERT_NEAR(std::accumulate(m.share.begin(), m.share.begin() + m.count, 0.0), 1.0, 1e-12);
    ASSERT_NEAR(m.normal.norm(), 1.0, 1e-12);
    // It parts them.
    Cylinder moved = a;
    moved.centre += m.depth[0] * m.normal;
    ASSERT_LE(reach(a, b) - least_distance(moved, b), 1e-6) << i;
    if (least < 1e-7) {
      ++inside;
      continue;
    }
    ASSERT_NEAR(m.depth[0], overlap, 1e-7) << i;
    // On the axis, points belong to places that are at least half as deep.
    for (std::size_t k = 0; k < points; ++k) {
      ASSERT_EQ(m.depth[k], m.depth[0]);
      ASSERT_GT(m.share[k], 1.0 / 3.0 - 1e-6) << i;
      const double s = std::clamp(a.along.dot(m.point[k] - a.centre), -a.half, a.half);
      if (std::abs(s) < a.half - 0.5) ++shortened;
    }
  }
  EXPECT_GT(touching, 1000);
  EXPECT_GT(apart, 500);
  EXPECT_GT(shortened, 500);
  EXPECT_TRUE(inside > 100 || (std::is_same_v<Other, Cylinder>));
}

TEST(CylinderContact, OfTwoAgreesWithBruteForce) {
  test::Random random(11);
  compare_with_brute_force(random, random_tank);
}

TEST(CylinderContact, WithABoxAgreesWithBruteForce) {
  test::Random random(12);
  compare_with_brute_force(random, random_box);
}

TEST(CylinderContact, OfABallAndOfANoNumber) {
  // As long as it is wide: no axis is left.
  const Cylinder ball = tank({0.0, 0.0, 3.1}, Vec::UnitX(), 0.0, 1.6);
  expect_one(press(ball, box()), {0.0, 0.0, 0.5 * (kBox.z() + 1.5)}, Vec::UnitZ(), 0.2);
  expect_one(press(ball, tank(Vec::Zero(), Vec::UnitX(), 0.0, 1.6)), {0.0, 0.0, 1.55}, Vec::UnitZ(), 0.1);
  EXPECT_EQ(press(tank({std::nan(""), 0.0, 0.0}), tank(Vec::Zero())).manifold.count, 0);
  EXPECT_EQ(press(tank({std::nan(""), 0.0, 0.0}), box()).manifold.count, 0);
}

}  // namespace
}  // namespace train_derail
