// Where two footprints press on each other: known cases, symmetry, and brute force over random pairs.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/model/footprint.hpp"

namespace train_derail {
namespace {

using model::Footprint;
using model::Manifold;
using Vec = Vector2;

Footprint box(double x, double y, double angle, double length = 16.0, double width = 3.0) {
  return {{x, y}, {std::cos(angle), std::sin(angle)}, 0.5 * length, 0.5 * width};
}

/// Corners, counter-clockwise.
std::vector<Vec> corners(const Footprint& f) {
  const Vec l = f.half_length * f.axis, w = f.half_width * f.side();
  return {f.centre + l + w, f.centre - l + w, f.centre - l - w, f.centre + l - w};
}

/// Overlap of the two boxes' shadows on the line along `n`, negative if there is a gap: the way to part them along n.
double overlap(const Footprint& a, const Footprint& b, const Vec& n) {
  double from[2] = {1e300, 1e300}, to[2] = {-1e300, -1e300};
  for (int i = 0; i < 2; ++i) {
    for (const Vec& c : corners(i == 0 ? a : b)) {
      from[i] = std::min(from[i], c.dot(n));
      to[i] = std::max(to[i], c.dot(n));
    }
  }
  return std::min(to[0] - from[1], to[1] - from[0]);
}

double least_overlap(const Footprint& a, const Footprint& b) {
  return std::min(std::min(overlap(a, b, a.axis), overlap(a, b, a.side())),
                  std::min(overlap(a, b, b.axis), overlap(a, b, b.side())));
}

/// Polygon that both share (Sutherland and Hodgman).
std::vector<Vec> shared(const Footprint& a, const Footprint& b) {
  std::vector<Vec> polygon = corners(a);
  const std::vector<Vec> window = corners(b);
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec p = window[i], d = window[(i + 1) % 4] - p, inward(-d.y(), d.x());
    std::vector<Vec> clipped;
    for (std::size_t k = 0; k < polygon.size(); ++k) {
      const Vec &from = polygon[k], &to = polygon[(k + 1) % polygon.size()];
      const double f = (from - p).dot(inward), t = (to - p).dot(inward);
      if (f >= 0.0) clipped.push_back(from);
      if ((f < 0.0) != (t < 0.0)) clipped.push_back(from + f / (f - t) * (to - from));
    }
    polygon.swap(clipped);
  }
  return polygon;
}

/// How far `p` lies outside of the box; negative inside.
double outside(const Footprint& f, const Vec& p) {
  const Vec d = p - f.centre;
  return std::max(std::abs(d.dot(f.axis)) - f.half_length, std::abs(d.dot(f.side())) - f.half_width);
}

TEST(Press, CornerInASide) {
  // b lies along x; a stands over its side, turned, its lowest corner 0.1 m below b's upper edge at (2, 1.5).
  const double angle = 0.7;
  Footprint a = box(0.0, 0.0, angle);
  double lowest = 1e9;
  Vec corner = Vec::Zero();
  for (const Vec& c : corners(a)) {
    if (c.y() < lowest) {
      lowest = c.y();
      corner = c;
    }
  }
  a.centre = Vec(2.0, 1.4) - corner;
  const Footprint b = box(0.0, 0.0, 0.0);
  const Manifold m = model::press(a, b);
  ASSERT_EQ(m.count, 1);
  EXPECT_FALSE(m.face_of_a);
  EXPECT_NEAR((m.normal - Vec(0.0, 1.0)).norm(), 0.0, 1e-15);
  EXPECT_NEAR(m.depth[0], 0.1, 1e-12);
  EXPECT_NEAR((m.point[0] - Vec(2.0, 1.4)).norm(), 0.0, 1e-12);
}

TEST(Press, SideOnSideHasTwoPoints) {
  // a above b, set forward by 4 m: they share x from -4 to 8.
  const Manifold m = model::press(box(4.0, 2.9, 0.0), box(0.0, 0.0, 0.0));
  ASSERT_EQ(m.count, 2);
  EXPECT_EQ(m.normal, Vec(0.0, 1.0));
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(m.depth[i], 0.1, 1e-12);
  EXPECT_NEAR(std::min(m.point[0].x(), m.point[1].x()), -4.0, 1e-12);
  EXPECT_NEAR(std::max(m.point[0].x(), m.point[1].x()), 8.0, 1e-12);
}

TEST(Press, EndOnPressesOnTheEnds) {
  // Two cars in line, 0.2 m into each other and 0.5 m beside each other: along x, not out at the nearer side.
  const Manifold m = model::press(box(15.8, 0.5, 0.0), box(0.0, 0.0, 0.0));
  ASSERT_EQ(m.count, 2);
  EXPECT_EQ(m.normal, Vec(1.0, 0.0));
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(m.depth[i], 0.2, 1e-12);
  EXPECT_NEAR(std::min(m.point[0].y(), m.point[1].y()), -1.0, 1e-12);
  EXPECT_NEAR(std::max(m.point[0].y(), m.point[1].y()), 1.5, 1e-12);
  // A little askew: one corner goes in deeper, both count.
  const Manifold askew = model::press(box(15.8, 0.5, 0.02), box(0.0, 0.0, 0.0));
  EXPECT_EQ(askew.count, 2);
  EXPECT_GT(std::abs(askew.normal.x()), 0.99);
}

TEST(Press, NothingAcrossAGap) {
  EXPECT_EQ(model::press(box(16.001, 0.0, 0.0), box(0.0, 0.0, 0.0)).count, 0);
  EXPECT_EQ(model::press(box(0.0, 3.001, 0.0), box(0.0, 0.0, 0.0)).count, 0);
  EXPECT_EQ(model::press(box(9.5, 9.5, 2.3), box(0.0, 0.0, 0.0)).count, 0);
}

Footprint random_box(test::Random& random, double spread) {
  const double x = random.uniform(-spread, spread), y = random.uniform(-spread, spread);
  const double heading = random.uniform(-4.0, 4.0), length = random.uniform(4.0, 20.0);
  return box(x, y, heading, length, random.uniform(2.0, 3.9));
}

TEST(Press, AgreesWithBruteForce) {
  test::Random random(11);
  int touching = 0, one = 0, two = 0, shallow = 0;
  for (int i = 0; i < 60000; ++i) {
    const Footprint a = random_box(random, 9.0), b = random_box(random, 9.0);
    const Manifold m = model::press(a, b);
    const double least = least_overlap(a, b);
    ASSERT_EQ(m.count > 0, least > 0.0) << i;
    if (m.count == 0) continue;
    ++touching;
    ASSERT_NEAR(m.normal.norm(), 1.0, 1e-12);
    ASSERT_GT(m.normal.dot(a.centre - b.centre), -1e-12) << i;
    ASSERT_NEAR(overlap(a, b, m.normal), least, 1e-9) << i;  // the shortest way out
    const Footprint &reference = m.face_of_a ? a : b, &incident = m.face_of_a ? b : a;
    ASSERT_GT(std::max(std::abs(m.normal.dot(reference.axis)), std::abs(m.normal.dot(reference.side()))), 1.0 - 1e-12);
    for (int k = 0; k < m.count; ++k) {
      ASSERT_GT(m.depth[k], 0.0);
      ASSERT_LE(m.depth[k], least + 1e-9);
      if (least < 1.0) {  // in both, unless one runs through the other
        ASSERT_LE(outside(a, m.point[k]), 1e-9) << i;
        ASSERT_LE(outside(b, m.point[k]), 1e-9) << i;
      }
      ASSERT_NEAR(outside(incident, m.point[k]), 0.0, 1e-9) << i;
      // By its depth along the normal it comes to the face.
      const Vec to_face = (m.face_of_a ? -1.0 : 1.0) * m.depth[k] * m.normal;
      ASSERT_NEAR(outside(reference, m.point[k] + to_face), 0.0, 1e-9) << i;
    }
    (m.count == 1 ? one : two) += 1;
    if (least > 0.3) continue;  // deeper than two cars ever get
    ++shallow;
    // The deepest place of what they share is found.
    double deepest = 0.0;
    const Vec outward = m.face_of_a ? Vec(-m.normal) : m.normal;
    const double face = reference.centre.dot(outward) + reference.reach(outward);
    for (const Vec& p : shared(a, b)) deepest = std::max(deepest, face - p.dot(outward));
    ASSERT_NEAR(m.count == 2 ? std::max(m.depth[0], m.depth[1]) : m.depth[0], deepest, 1e-6) << i;
  }
  EXPECT_GT(touching, 15000);
  EXPECT_GT(one, 1000);
  EXPECT_GT(two, 1000);
  EXPECT_GT(shallow, 500);
}

/// The two points in an order that does not depend on who found them.
std::vector<std::pair<Vec, double>> sorted(const Manifold& m) {
  std::vector<std::pair<Vec, double>> points;
  for (int i = 0; i < m.count; ++i) points.emplace_back(m.point[i], m.depth[i]);
  std::sort(points.begin(), points.end(), [](const auto& p, const auto& q) { return p.first.x() < q.first.x(); });
  return points;
}

TEST(Press, SwappedArgumentsPushTheOtherWay) {
  test::Random random(12);
  int touching = 0;
  for (int i = 0; i < 20000; ++i) {
    const Footprint a = random_box(random, 9.0), b = random_box(random, 9.0);
    const Manifold m = model::press(a, b), n = model::press(b, a);
    ASSERT_EQ(m.count, n.count);
    if (m.count == 0) continue;
    ++touching;
    ASSERT_NE(m.face_of_a, n.face_of_a);
    ASSERT_NEAR((m.normal + n.normal).norm(), 0.0, 1e-12);
    const auto p = sorted(m), q = sorted(n);
    for (std::size_t k = 0; k < p.size(); ++k) {
      ASSERT_NEAR((p[k].first - q[k].first).norm(), 0.0, 1e-9);
      ASSERT_NEAR(p[k].second, q[k].second, 1e-9);
    }
  }
  EXPECT_GT(touching, 5000);
}

TEST(Press, MirroredFootprintsGiveTheMirroredAnswer) {
  test::Random random(13);
  const auto mirrored = [](Footprint f) {
    f.centre.y() = -f.centre.y();
    f.axis.y() = -f.axis.y();
    return f;
  };
  int touching = 0;
  for (int i = 0; i < 20000; ++i) {
    const Footprint a = random_box(random, 9.0), b = random_box(random, 9.0);
    const Manifold m = model::press(a, b), n = model::press(mirrored(a), mirrored(b));
    ASSERT_EQ(m.count, n.count);
    if (m.count == 0) continue;
    ++touching;
    ASSERT_EQ(m.face_of_a, n.face_of_a);
    ASSERT_EQ(m.normal, Vec(n.normal.x(), -n.normal.y()));
    const auto p = sorted(m), q = sorted(n);
    for (std::size_t k = 0; k < p.size(); ++k) {
      ASSERT_NEAR((p[k].first - Vec(q[k].first.x(), -q[k].first.y())).norm(), 0.0, 1e-12);
      ASSERT_NEAR(p[k].second, q[k].second, 1e-12);
    }
  }
  EXPECT_GT(touching, 5000);
}

}  // namespace
}  // namespace train_derail
