// Where two boxes press on each other: closed forms, memory of the axis, symmetry, and brute force over random pairs.
#include <algorithm>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "model/box_contact.hpp"
#include "random_bodies.hpp"

namespace train_derail {
namespace {

using model::BodyManifold;
using model::Box;
using model::press;
using test::random_axes;
using test::random_vector;
using Vec = Eigen::Vector3d;
using Matrix = Eigen::Matrix3d;

const Vec kCar(9.0, 1.5, 1.7);  // half of a car

Matrix turned(double roll, double pitch, double yaw) {
  return (Eigen::AngleAxisd(yaw, Vec::UnitZ()) * Eigen::AngleAxisd(pitch, Vec::UnitY()) *
          Eigen::AngleAxisd(roll, Vec::UnitX()))
      .toRotationMatrix();
}

Box box(const Vec& centre, const Matrix& axes = Matrix::Identity(), const Vec& half = kCar) {
  return {centre, axes, half};
}

std::vector<Vec> corners(const Box& b) {
  std::vector<Vec> all;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) all.push_back(b.centre + b.axes * b.half.cwiseProduct(Vec(x, y, z)));
    }
  }
  return all;
}

/// The corner that lies farthest along `direction`.
Vec farthest(const Box& b, const Vec& direction) {
  const std::vector<Vec> all = corners(b);
  return *std::max_element(all.begin(), all.end(),
                           [&direction](const Vec& p, const Vec& q) { return p.dot(direction) < q.dot(direction); });
}

/// Middle of the edge along axis `i` that lies farthest along `direction`.
Vec farthest_edge(const Box& b, int i, const Vec& direction) {
  Vec p = farthest(b, direction);
  return p - (p - b.centre).dot(b.axes.col(i)) * b.axes.col(i);
}

/// How far a has to go along the unit vector `n` to come free; negative if there is a gap.
double overlap(const Box& a, const Box& b, const Vec& n) { return (farthest(b, n) - farthest(a, -n)).dot(n); }

/// Least overlap along the axis named as in BodyManifold::axis; infinite for parallel edges.
double overlap(const Box& a, const Box& b, int axis) {
  const Vec n = axis < 3   ? Vec(a.axes.col(axis))
                : axis < 6 ? Vec(b.axes.col(axis - 3))
                           : Vec(a.axes.col((axis - 6) / 3).cross(b.axes.col((axis - 6) % 3)));
  if (n.norm() < 1e-6) return std::numeric_limits<double>::infinity();
  return std::min(overlap(a, b, Vec(n.normalized())), overlap(a, b, Vec(-n.normalized())));
}

double least_overlap(const Box& a, const Box& b, int axes = 15) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < axes; ++i) least = std::min(least, overlap(a, b, i));
  return least;
}

/// How far `p` lies outside of the box along its axes; negative inside.
double outside(const Box& b, const Vec& p) {
  return ((b.axes.transpose() * (p - b.centre)).cwiseAbs() - b.half).maxCoeff();
}

double deepest(const BodyManifold& m) { return *std::max_element(m.depth.begin(), m.depth.begin() + m.count); }

/// Area within the points, which are in order.
double area(const BodyManifold& m) {
  Vec sum = Vec::Zero();
  for (int i = 1; i + 1 < m.count; ++i) sum += 0.5 * (m.point[i] - m.point[0]).cross(m.point[i + 1] - m.point[0]);
  return sum.norm();
}

/// Distance from `p` to the nearest point of the contact.
double nearest(const BodyManifold& m, const Vec& p) {
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < m.count; ++i) least = std::min(least, (m.point[i] - p).norm());
  return least;
}

void expect_points(const BodyManifold& m, const std::vector<Vec>& points, double depth) {
  ASSERT_EQ(m.count, static_cast<int>(points.size()));
  for (const Vec& p : points) EXPECT_LT(nearest(m, p), 1e-12) << p.transpose();
  for (int i = 0; i < m.count; ++i) EXPECT_NEAR(m.depth[i], depth, 1e-12);
}

Box random_box(test::Random& random) {
  return box(random_vector(random, 5.0), random_axes(random),
             {random.uniform(2.0, 10.0), random.uniform(1.0, 2.0), random.uniform(1.0, 2.0)});
}

TEST(BoxContact, CarOnCarHasFourPoints) {
  const BodyManifold m = press(box({0.0, 0.0, 3.3}), box(Vec::Zero()));
  EXPECT_EQ(m.normal, Vec(0.0, 0.0, 1.0));
  expect_points(m, {{9.0, 1.5, 1.65}, {-9.0, 1.5, 1.65}, {-9.0, -1.5, 1.65}, {9.0, -1.5, 1.65}}, 0.1);
  EXPECT_NEAR(area(m), 18.0 * 3.0, 1e-12);
  // The same with all of it lying askew, where edges are parallel, and faces of one size, but for rounding.
  test::Random random(19);
  for (int i = 0; i < 200; ++i) {
    const Matrix turn = random_axes(random);
    const BodyManifold askew = press(box(turn * Vec(0.0, 0.0, 3.3), turn), box(Vec::Zero(), turn));
    ASSERT_EQ(askew.count, 4);
    ASSERT_NEAR(area(askew), 18.0 * 3.0, 1e-9);
  }
}

TEST(BoxContact, WhatLiesOnEachOtherIsCutOut) {
  // Set forward by 5 m and to the right by 1 m: they share x from -4 to 9 and y from -1.5 to 0.5.
  const BodyManifold m = press(box({5.0, -1.0, 3.3}), box(Vec::Zero()));
  EXPECT_EQ(m.normal, Vec(0.0, 0.0, 1.0));
  expect_points(m, {{-4.0, -1.5, 1.65}, {9.0, -1.5, 1.65}, {9.0, 0.5, 1.65}, {-4.0, 0.5, 1.65}}, 0.1);
  EXPECT_NEAR(area(m), 13.0 * 2.0, 1e-12);
  // A cube on a cube, turned by 45 degrees: an octagon.
  const Vec cube(1.0, 1.0, 1.0);
  const BodyManifold octagon =
      press(box({0.0, 0.0, 1.9}, turned(0.0, 0.0, 0.25 * test::kPi), cube), box(Vec::Zero(), Matrix::Identity(), cube));
  EXPECT_EQ(octagon.count, 8);
  EXPECT_NEAR(area(octagon), 8.0 * (std::sqrt(2.0) - 1.0), 1e-12);
  for (int i = 0; i < octagon.count; ++i) EXPECT_NEAR(octagon.depth[i], 0.1, 1e-12);
}

TEST(BoxContact, EdgeOnAFaceHasTwoPoints) {
  // Rolled by 0.6 and set forward by 4 m, its lowest edge 0.1 m below the top of b, 0.3 m to the left of the middle.
  Box a = box(Vec::Zero(), turned(0.6, 0.0, 0.0));
  const Vec low = farthest_edge(a, 0, -Vec::UnitZ());
  a.centre = Vec(4.0, 0.3, 1.6) - low;
  const BodyManifold m = press(a, box(Vec::Zero()));
  EXPECT_EQ(m.axis, 5);
  EXPECT_EQ(m.normal, Vec(0.0, 0.0, 1.0));
  expect_points(m, {{-5.0, 0.3, 1.65}, {9.0, 0.3, 1.65}}, 0.1);
}

TEST(BoxContact, CornerOnAFaceHasOnePoint) {
  Box a = box(Vec::Zero(), turned(0.5, 0.4, 0.7));
  a.centre = Vec(2.0, 0.3, 1.6) - farthest(a, -Vec::UnitZ());
  const BodyManifold m = press(a, box(Vec::Zero()));
  EXPECT_EQ(m.axis, 5);
  EXPECT_EQ(m.normal, Vec(0.0, 0.0, 1.0));
  expect_points(m, {{2.0, 0.3, 1.65}}, 0.1);
}

TEST(BoxContact, CrossedEdgesHaveOnePoint) {
  // b lies along x with an edge up, a across it at an angle of 1.1 with an edge down, 0.1 m into it over (3, 0.2).
  const Vec half(9.0, 1.0, 1.0);
  const Box b = box({0.0, 0.2, 0.0}, turned(0.25 * test::kPi, 0.0, 0.0), half);
  Box a = box(Vec::Zero(), turned(0.0, 0.0, 1.1) * turned(0.25 * test::kPi, 0.0, 0.0), half);
  a.centre = Vec(3.0, 0.2, 2.0 * std::sqrt(2.0) - 0.1) + 2.0 * a.axes.col(0);
  const BodyManifold m = press(a, b);
  EXPECT_EQ(m.axis, 6);
  EXPECT_NEAR((m.normal - Vec::UnitZ()).norm(), 0.0, 1e-12);
  expect_points(m, {{3.0, 0.2, std::sqrt(2.0) - 0.05}}, 0.1);
}

TEST(BoxContact, OneWithinTheOtherComesOutAtTheNearestFace) {
  const Box a = box({1.2, 0.0, 0.0}, Matrix::Identity(), {0.5, 0.5, 0.5});
  const Box b = box(Vec::Zero(), Matrix::Identity(), {2.0, 3.0, 4.0});
  const BodyManifold m = press(a, b);
  EXPECT_EQ(m.normal, Vec(1.0, 0.0, 0.0));
  expect_points(m, {{1.35, 0.5, 0.5}, {1.35, -0.5, 0.5}, {1.35, -0.5, -0.5}, {1.35, 0.5, -0.5}}, 1.3);
}

TEST(BoxContact, ParallelEdgesPressByTheirFaces) {
  // Both with an edge along x, the one up and the other down, 0.02 m beside each other: the face that looks that way is
  // the nearest. At first exactly parallel, then less and less so.
  const Vec half(9.0, 1.0, 1.0);
  const Matrix on_edge = turned(0.25 * test::kPi, 0.0, 0.0);
  const double up = 2.0 * std::sqrt(2.0) - 0.1, aside = 0.02;
  const double depth = 2.0 - (up + aside) / std::sqrt(2.0), width = 2.0 - (up - aside) / std::sqrt(2.0);
  for (const double yaw : {0.0, 1e-15, 1e-10, 1e-7, 1e-6, 1e-5, 1e-4}) {
    const Box a = box({0.0, aside, up}, turned(0.0, 0.0, yaw) * on_edge, half);
    const BodyManifold m = press(a, box(Vec::Zero(), on_edge, half));
    ASSERT_GE(m.count, 4) << yaw;
    EXPECT_LT(m.axis, 6) << yaw;
    EXPECT_NEAR(deepest(m), depth, 10.0 * yaw + 1e-12);
    EXPECT_NEAR((m.normal - Vec(0.0, 1.0, 1.0).normalized()).norm(), 0.0, 2.0 * yaw + 1e-12);
    EXPECT_NEAR(area(m), 18.0 * width, 200.0 * yaw + 1e-12);
  }
}

TEST(BoxContact, TouchesOrNotAlongEveryKindOfAxis) {
  test::Random random(3);
  std::array<int, 15> seen{};
  for (int i = 0; i < 600; ++i) {
    const int axis = i % 15;
    Box a = random_box(random), b = random_box(random);
    Vec n = axis < 3   ? Vec(a.axes.col(axis))
            : axis < 6 ? Vec(b.axes.col(axis - 3))
                       : Vec(a.axes.col((axis - 6) / 3).cross(b.axes.col((axis - 6) % 3)).normalized());
    n *= random.sign();
    // What lies farthest: a corner in the middle of a face, or the middles of two edges on each other.
    Vec on_a, on_b;
    if (axis < 3) {
      on_a = a.centre - a.half[axis] * n;
      on_b = farthest(b, n);
    } else if (axis < 6) {
      on_a = farthest(a, -n);
      on_b = b.centre + b.half[axis - 3] * n;
    } else {
      on_a = farthest_edge(a, (axis - 6) / 3, -n);
      on_b = farthest_edge(b, (axis - 6) % 3, n);
    }
    a.centre += on_b - on_a + 1e-6 * n;
    EXPECT_EQ(press(a, b).count, 0) << axis;
    EXPECT_EQ(press(a, b).axis, -1) << axis;
    a.centre -= 2e-6 * n;
    if (axis >= 6 && least_overlap(a, b, 6) < 0.011) continue;  // a face would do as well
    const BodyManifold m = press(a, b);
    ASSERT_EQ(m.count, 1) << axis;
    EXPECT_EQ(m.axis, axis);
    EXPECT_NEAR(m.depth[0], 1e-6, 1e-12);
    EXPECT_NEAR((m.normal - n).norm(), 0.0, 1e-9) << axis;
    EXPECT_NEAR((m.point[0] - (on_b - 0.5e-6 * n)).norm(), 0.0, axis < 6 ? 1e-12 : 1e-4) << axis;
    ++seen[static_cast<std::size_t>(axis)];
  }
  for (const int count : seen) EXPECT_GE(count, 30);
}

TEST(BoxContact, NothingFarAway) {
  EXPECT_EQ(press(box({30.0, 0.0, 0.0}), box(Vec::Zero())).count, 0);
  EXPECT_EQ(press(box({std::nan(""), 0.0, 0.0}), box(Vec::Zero())).count, 0);
  EXPECT_EQ(press(box({0.0, 3.1, 0.0}), box(Vec::Zero())).count, 0);  // their spheres overlap
}

TEST(BoxContact, EndsThatMeetTurnThroughZeroSmoothly) {
  // The middle of a's end stays 0.1 m in the end of b while a swings from one side to the other and nods.
  int axis = -1;
  Vec normal_before = Vec::Zero();
  double volume_before = 0.0;
  for (int i = -300; i <= 300; ++i) {
    const double yaw = 1e-4 * i;
    const Matrix axes = turned(0.0, 0.3 * yaw, yaw);
    const Box a = box(Vec(8.9, 0.4, 0.3) + 9.0 * axes.col(0), axes);
    const BodyManifold m = press(a, box(Vec::Zero()), axis);
    ASSERT_EQ(m.count, 4) << yaw;
    const double volume = area(m) * 0.25 * std::accumulate(m.depth.begin(), m.depth.begin() + 4, 0.0);
    if (i > -300) {
      ASSERT_EQ(m.axis, axis) << yaw;
      ASSERT_LT((m.normal - normal_before).norm(), 1.1e-4) << yaw;
      ASSERT_NEAR(volume, volume_before, 2e-4) << yaw;
    }
    if (i == 0) {
      EXPECT_NEAR(volume, 2.6 * 3.1 * 0.1, 1e-12);
    }
    axis = m.axis;
    normal_before = m.normal;
    volume_before = volume;
  }
}

TEST(BoxContact, EndsThatSwingFarHandOverOnceAndByFewDegrees) {
  int axis = -1, changes = 0;
  Vec before = Vec::UnitX();
  for (int i = -1000; i <= 1000; ++i) {
    const Matrix axes = turned(0.0, 0.0, 1e-4 * i);
    const BodyManifold m = press(box(Vec(8.9, 0.0, 0.0) + 9.0 * axes.col(0), axes), box(Vec::Zero()), axis);
    ASSERT_GE(m.count, 2) << i;
    ASSERT_EQ(m.axis % 3, 0) << i;
    if (m.axis != axis) ++changes;
    if (i > -1000) {
      ASSERT_LT((m.normal - before).norm(), 0.1) << i;
    }
    axis = m.axis;
    before = m.normal;
  }
  EXPECT_LE(changes, 2);  // the first included
}

TEST(BoxContact, AFaceIsKeptUntilAnotherIsBetterByMoreThanTheSlack) {
  // End on, 0.3 m beside each other at the sides and `end` into each other at the ends.
  const auto offset = [](double end) { return box({18.0 - end, 2.7, 0.2}); };
  const Box b = box(Vec::Zero());
  EXPECT_EQ(press(offset(0.29), b).normal, Vec::UnitX());
  EXPECT_EQ(press(offset(0.31), b).normal, Vec::UnitY());
  EXPECT_EQ(press(offset(0.315), b, 0).axis, 0);
  EXPECT_EQ(press(offset(0.315), b, 3).axis, 3);
  EXPECT_EQ(press(offset(0.317), b, 3).normal, Vec::UnitY());  // beyond 0.3 x 1.02 + 0.01
  EXPECT_EQ(press(offset(0.29), b, 1).axis, 1);
  EXPECT_EQ(press(offset(0.28), b, 1).normal, Vec::UnitX());
  // Shaken about the place where both are equal, the axis stays what it was.
  test::Random random(5);
  for (const int kept : {0, 1, 3, 4}) {
    int axis = kept;
    for (int i = 0; i < 1000; ++i) {
      Box a = offset(0.3 + random.uniform(-0.003, 0.003));
      const Vec turn = test::random_vector(random, 1e-4);
      a.axes = turned(turn.x(), turn.y(), turn.z());
      axis = press(a, b, axis).axis;
      ASSERT_EQ(axis, kept);
    }
  }
}

/// Where the points pull on average, by their depths.
Vec centre_of(const BodyManifold& m) {
  Vec moment = Vec::Zero();
  double sum = 0.0;
  for (std::size_t k = 0; k < static_cast<std::size_t>(m.count); ++k) {
    moment += m.depth[k] * m.point[k];
    sum += m.depth[k];
  }
  return moment / sum;
}

TEST(BoxContact, EndsSetOffSidewaysTouchOnAllTheyShare) {
  // Yaw and pitch such that the ends overlap least along edges that cross at their rims, then wobbling.
  const Box b = box(Vec::Zero());
  for (const double depth : {0.05, 0.2, 0.5}) {
    for (const double sideways : {-0.5, 0.5}) {
      int axis = -1, by_edges = 0, remembered = 0;
      Vec before = Vec::Zero();
      for (int i = 0; i < 5000; ++i) {
        const double t = 0.002 * i;
        const Matrix axes = turned(0.1 * std::sin(2.3 * t), 0.07 * std::sin(1.7 * t), 0.1 * std::sin(2.0 * t));
        const Box a = box(Vec(9.0 - depth, sideways, 0.4) + 9.0 * axes.col(0), axes);
        const BodyManifold m = press(a, b, axis);
        ASSERT_GE(m.count, 2) << t;
        ASSERT_EQ(m.axis % 3, 0) << t;
        if (least_overlap(a, b) < least_overlap(a, b, 6) - 0.025) {
          ++by_edges;
          if (press(a, b, 0).axis == 0 && press(a, b, 3).axis == 3) ++remembered;
        }
        const Vec centre = centre_of(m);
        if (i > 0) {
          ASSERT_LT((centre - before).norm(), 0.03) << t;
        }
        before = centre;
        axis = m.axis;
      }
      EXPECT_GT(by_edges, 200);
      EXPECT_EQ(remembered, by_edges);
    }
  }
}

TEST(BoxContact, ACrossingAtARimTurnsIntoALineAndACorner) {
  // a lies across b's side, the last metre of it over b: its lower edge crosses the upper edge of b. Its outer end
  // hangs down at first and then rises until the inner end goes into the top of b.
  const Box b = box(Vec::Zero());
  const auto across = [](double tilt) {
    Box a = box(Vec::Zero(), turned(0.0, 0.0, 0.5 * test::kPi) * turned(0.0, tilt, 0.0) * turned(0.4, 0.0, 0.0));
    a.centre = Vec(0.0, 1.5, 1.6) - farthest_edge(a, 0, -Vec::UnitZ()) + 8.0 * a.axes.col(0);
    return a;
  };
  EXPECT_GE(press(across(0.4), b).axis, 6);
  EXPECT_EQ(press(across(0.08), b).count, 2);
  EXPECT_EQ(press(across(0.08), b).axis, 5);
  int axis = -1, changes = 0;
  Vec before = centre_of(press(across(0.4), b));
  for (int i = 4000; i >= -3000; --i) {
    const BodyManifold m = press(across(1e-4 * i), b, axis);
    if (axis >= 0 && m.axis != axis) ++changes;
    if (m.axis >= 6) {
      ASSERT_GT(i, 980);  // the inner end is above b
    }
    const Vec centre = centre_of(m);
    ASSERT_LT((centre - before).norm(), 0.01) << i;
    before = centre;
    axis = m.axis;
  }
  EXPECT_EQ(axis, 5);
  EXPECT_EQ(changes, 1);
}

TEST(BoxContact, FacesComeBeforeEdgesAndEdgesAreKeptUntilAFaceIsAsGood) {
  // Where the best edges and the best face are within the slack, or the face is better.
  test::Random random(17);
  int favoured = 0, kept = 0, left = 0;
  for (int i = 0; i < 15000; ++i) {
    const Box a = random_box(random), b = random_box(random);
    const double face = least_overlap(a, b, 6);
    if (face <= 0.0) continue;
    int best = 6;
    for (int k = 7; k < 15; ++k) {
      if (overlap(a, b, k) < overlap(a, b, best)) best = k;
    }
    const double edge = overlap(a, b, best);
    if (edge <= 0.0 || edge < face / 1.02 - 0.009) continue;
    if (face < edge) {
      EXPECT_LT(press(a, b, best).axis, 6) << i;
      ++left;
    } else {
      // Faces that pass by what is deepest leave it to the edges.
      const Vec n = a.axes.col((best - 6) / 3).cross(b.axes.col((best - 6) % 3)).normalized();
      const bool aslant = std::max((a.axes.transpose() * n).cwiseAbs().maxCoeff(),
                                   (b.axes.transpose() * n).cwiseAbs().maxCoeff()) < 0.95;
      if (aslant && press(a, b).axis < 6) ++favoured;
      if (press(a, b, best).axis == best) ++kept;
    }
  }
  EXPECT_GT(left, 1000);
  EXPECT_GT(favoured, 5);
  EXPECT_GT(kept, 20);
}

TEST(BoxContact, NamesChangedOverGivesTheOppositeBitByBit) {
  test::Random random(7);
  int touching = 0;
  for (int i = 0; i < 20000; ++i) {
    const Box a = random_box(random), b = random_box(random);
    const int previous = random.index(16) - 1;
    const int other = previous < 0   ? -1
                      : previous < 6 ? (previous + 3) % 6
                                     : 6 + 3 * (previous % 3) + (previous - 6) / 3;
    const BodyManifold m = press(a, b, previous), w = press(b, a, other);
    ASSERT_EQ(m.count, w.count);
    if (m.count == 0) continue;
    ++touching;
    ASSERT_EQ(m.normal, Vec(-w.normal));
    ASSERT_EQ(w.axis, m.axis < 6 ? (m.axis + 3) % 6 : 6 + 3 * (m.axis % 3) + (m.axis - 6) / 3);
    for (std::size_t k = 0; k < static_cast<std::size_t>(m.count); ++k) {
      ASSERT_EQ(m.point[k], w.point[k]);
      ASSERT_EQ(m.depth[k], w.depth[k]);
    }
  }
  EXPECT_GT(touching, 5000);
  // Mirror images, where the end of either would do.
  const Box a = box({8.9, 0.5, 0.0}, turned(0.0, 0.0, 0.1)), b = box({-8.9, 0.5, 0.0}, turned(0.0, 0.0, -0.1));
  ASSERT_GT(press(a, b).count, 0);
  EXPECT_EQ(press(a, b).normal, Vec(-press(b, a).normal));
}

TEST(BoxContact, TheWholeSceneMovedAndTurnedGivesTheSame) {
  test::Random random(13);
  int touching = 0;
  for (int i = 0; i < 20000; ++i) {
    const Box a = random_box(random), b = random_box(random);
    const BodyManifold m = press(a, b);
    const Matrix turn = random_axes(random);
    const Vec shift = random_vector(random, 1000.0);
    const BodyManifold w =
        press({turn * a.centre + shift, turn * a.axes, a.half}, {turn * b.centre + shift, turn * b.axes, b.half});
    ASSERT_EQ(m.count, w.count) << i;
    ASSERT_EQ(m.axis, w.axis) << i;
    if (m.count == 0) continue;
    ++touching;
    ASSERT_LT((turn * m.normal - w.normal).norm(), 1e-10) << i;
    std::vector<double> depths[2];
    for (std::size_t k = 0; k < static_cast<std::size_t>(m.count); ++k) {
      ASSERT_LT(nearest(w, turn * m.point[k] + shift), 1e-8) << i;
      depths[0].push_back(m.depth[k]);
      depths[1].push_back(w.depth[k]);
    }
    for (auto& d : depths) std::sort(d.begin(), d.end());
    for (std::size_t k = 0; k < depths[0].size(); ++k) ASSERT_NEAR(depths[0][k], depths[1][k], 1e-9) << i;
  }
  EXPECT_GT(touching, 5000);
}

TEST(BoxContact, AgreesWithBruteForce) {
  test::Random random(11);
  int touching = 0, faces = 0, edges = 0, remembered = 0;
  for (int i = 0; i < 10000; ++i) {
    const Box a = random_box(random), b = random_box(random);
    const double least = least_overlap(a, b), slack = 1.02 * least + 0.01;
    ASSERT_EQ(press(a, b).count > 0, least > 0.0) << i;
    if (least <= 0.0) continue;
    ++touching;
    // No direction among many parts them sooner.
    for (int k = 0; k < 20; ++k) ASSERT_GE(overlap(a, b, Vec(random_axes(random).col(0))), least - 1e-9) << i;
    // Without a memory, and with each that makes a difference.
    for (int previous = -1; previous < 15; ++previous) {
      if (previous >= 0 && overlap(a, b, previous) > slack) continue;
      const BodyManifold m = press(a, b, previous);
      ASSERT_GT(m.count, 0) << i;
      if (previous < 0) (m.axis < 6 ? faces : edges) += 1;
      if (previous >= 0 && m.axis == previous && overlap(a, b, previous) > least + 1e-9) ++remembered;
      ASSERT_NEAR(m.normal.norm(), 1.0, 1e-12);
      ASSERT_GE(m.normal.dot(a.centre - b.centre), 0.0) << i;
      ASSERT_LE(deepest(m), slack / 0.95 + 1e-9) << i;
      for (std::size_t k = 0; k < static_cast<std::size_t>(m.count); ++k) {
        ASSERT_GT(m.depth[k], 0.0) << i;
        ASSERT_LE(outside(a, m.point[k]), 0.5 * m.depth[k] + 1e-8) << i << " " << previous;
        ASSERT_LE(outside(b, m.point[k]), 0.5 * m.depth[k] + 1e-8) << i << " " << previous;
      }
      // It parts them.
      Box moved = a;
      moved.centre += deepest(m) * m.normal;
      ASSERT_LE(least_overlap(moved, b), 1e-9) << i << " " << previous;
    }
  }
  EXPECT_GT(touching, 3000);
  EXPECT_GT(faces, 1000);
  EXPECT_GT(edges, 500);
  EXPECT_GT(remembered, 200);
}

TEST(BoxGap, IsNoMoreThanTheBoxesAreApart) {
  test::Random random(7);
  int apart = 0;
  for (int i = 0; i < 2000; ++i) {
    const Box a = box({0.0, 0.0, 0.0}, random_axes(random));
    const Box b = box(random_vector(random, 12.0), random_axes(random));
    const double gap = model::gap(a, b), least = least_overlap(a, b, 6);
    ASSERT_NEAR(gap, std::max(-least, 0.0), 1e-9);
    if (gap == 0.0) continue;
    ++apart;
    // Wherever the other one goes by that much.
    Box moved = b;
    moved.centre += 0.999 * gap * random_axes(random).col(0);
    ASSERT_EQ(press(a, moved).count, 0) << i;
  }
  EXPECT_GT(apart, 500);
  // Face to face it is the distance.
  EXPECT_NEAR(model::gap(box({0.0, 0.0, 0.0}), box({18.4, 0.2, 0.0})), 0.4, 1e-12);
}

}  // namespace
}  // namespace train_derail
