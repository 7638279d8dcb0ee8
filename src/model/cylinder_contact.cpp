#include "model/cylinder_contact.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include <Eigen/Geometry>

namespace train_derail::model {

namespace {

using Eigen::Vector3d;

constexpr double kParallel = 1e-12;  // square of the sine between axes
constexpr double kNowhere = 1e-9;    // a distance without a direction, m
constexpr double kOnePoint = 1e-6;   // ends of a stretch closer together are one point, m

/// How deep bodies overlap, and to what distance of their axes they do so by half of what is not crushed [m].
struct Depth {
  Depth(double reach, double distance, double crushed)
      : all(reach - distance), left(reach - crushed), half_way(0.5 * (left + distance)), yields(distance < left) {}

  double all, left, half_way;
  bool yields;  // there is more than what is crushed
};

/// One end of a stretch along which two bodies touch.
struct End {
  Vector3d place;
  double depth;  // beyond what is crushed, m
};

void touch_at(BodyManifold& m, const Vector3d& place, double depth, double share) {
  const auto i = static_cast<std::size_t>(m.count++);
  m.point[i] = place;
  m.depth[i] = depth;
  m.share[i] = share;
}

void share_out(BodyManifold& m, double depth, const End& first, const End& second) {
  const double sum = first.depth + second.depth;
  touch_at(m, first.place, depth, first.depth / sum);
  touch_at(m, second.place, depth, second.depth / sum);
}

/// The two roots of square x^2 + 2 slope x + excess, where excess <= 0: one not above 0, one not below. Infinite where
/// square and slope vanish.
struct Roots {
  Roots(double square, double slope, double excess) {
    const double size = std::sqrt(std::max(slope * slope - square * excess, 0.0));
    low = excess / (size - slope);
    high = -excess / (size + slope);
  }
  double low, high;
};

// Two cylinders

/// Where two axes are closest: so far along either, and from there of b to there of a.
struct Closest {
  double on_a, on_b;
  Vector3d between;
};

/// Ericson: Real-Time Collision Detection, 5.1.9.
Closest closest(const Cylinder& a, const Cylinder& b) {
  const Vector3d apart = a.centre - b.centre;
  const double cosine = a.along.dot(b.along), by_a = a.along.dot(apart), by_b = b.along.dot(apart);
  const double square = a.along.cross(b.along).squaredNorm();  // of the sine
  double s = square > kParallel ? std::clamp((cosine * by_b - by_a) / square, -a.half, a.half) : 0.0;
  const double t = std::clamp(cosine * s + by_b, -b.half, b.half);
  s = std::clamp(cosine * t - by_a, -a.half, a.half);
  return {s, t, apart + s * a.along - t * b.along};
}

// A cylinder and a box, seen from the box

/// The axis of a cylinder about the box [0, 0, 0].
struct Line {
  Vector3d middle, along, half;  // `half` of the box

  Vector3d at(double t) const { return middle + t * along; }
  Vector3d nearest(double t) const { return at(t).cwiseMax(-half).cwiseMin(half); }
  Vector3d outside(double t) const { return at(t) - nearest(t); }
  double slope(double t) const { return along.dot(outside(t)); }  // of half the square of the distance
};

/// Places along the axis, in order: its ends, and where it passes the plane of a face. In between, the square of the
/// distance from the box is one parabola.
struct Knots {
  Knots(const Line& line, double half) {
    add(-half);
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (const double side : {-1.0, 1.0}) {
        const double t = (side * line.half[i] - line.middle[i]) / line.along[i];
        if (std::abs(t) < half) add(t);
      }
    }
    add(half);
    std::sort(at.begin(), at.begin() + static_cast<std::ptrdiff_t>(count));
  }
  void add(double t) { at[count++] = t; }

  std::size_t count = 0;
  std::array<double, 8> at;
};

/// Where the axis is nearest to the box: the first such place, if there are more.
double nearest(const Line& line, const Knots& knots) {
  double before = line.slope(knots.at[0]);
  if (before >= 0.0) return knots.at[0];
  for (std::size_t i = 1; i < knots.count; ++i) {
    const double here = line.slope(knots.at[i]);
    if (here >= 0.0) return knots.at[i - 1] + before / (before - here) * (knots.at[i] - knots.at[i - 1]);
    before = here;
  }
  return knots.at[knots.count - 1];
}

/// From there on in direction `way` (1 or -1) to the place whose distance from the box is `far`, or to the end.
double reach(const Line& line, const Knots& knots, double from, double way, double far) {
  for (std::size_t k = 0; k < knots.count; ++k) {
    const double to = knots.at[way > 0.0 ? k : knots.count - 1 - k];
    if (way * (to - from) <= 0.0) continue;
    if (line.outside(to).norm() > far) {
      const Vector3d start = line.outside(from), slope = (line.outside(to) - start) / std::abs(to - from);
      return from + way * Roots(slope.squaredNorm(), start.dot(slope), start.squaredNorm() - far * far).high;
    }
    from = to;
  }
  return from;
}

/// How much of a stretch is left as a cylinder that lies on a face gets up on its head: 1 to 0.
double lies(double rise) { return 1.0 - rise * rise; }

/// Of a cylinder whose axis is in the box; all in the box's frame.
void press_within(const Line& line, const Cylinder& a, double crushed, BodyManifold& m) {
  const Vector3d overlap = line.half + a.half * line.along.cwiseAbs() - line.middle.cwiseAbs();
  Eigen::Index i = 0;
  overlap.minCoeff(&i);
  const double side = line.middle[i] < 0.0 ? -1.0 : 1.0, rise = side * line.along[i];
  m.normal = side * Vector3d::Unit(i);
  const Depth depth(a.radius, -overlap[i], crushed);
  const auto end_at = [&](double t) {
    const double height = side * line.at(t)[i] - line.half[i];
    return End{line.at(t) - 0.5 * (a.radius + height) * m.normal, depth.left - height};
  };
  const double deepest = rise < 0.0 ? a.half : -a.half;
  const End first = end_at(deepest);
  if (!depth.yields) return touch_at(m, first.place, depth.all, 1.0);
  const double length = lies(rise) * std::min(2.0 * a.half, 0.5 * first.depth / std::abs(rise));
  if (!(length > kOnePoint)) return touch_at(m, first.place, depth.all, 1.0);
  share_out(m, depth.all, first, end_at(deepest + (rise < 0.0 ? -length : length)));
}

}  // namespace

BodyContact press(const Cylinder& a, const Cylinder& b, double crushed) {
  BodyContact contact;
  const Closest c = closest(a, b);
  const double distance = c.between.norm(), sum = a.radius + b.radius;
  if (!(distance < sum)) {
    contact.gap = distance - sum;
    return contact;
  }
  BodyManifold& m = contact.manifold;
  m.axis = 0;
  m.normal = distance > kNowhere ? Vector3d(c.between / distance) : (a.centre - b.centre).normalized();
  const Depth depth(sum, distance, crushed);
  const double cosine = a.along.dot(b.along), sense = cosine < 0.0 ? -1.0 : 1.0;
  const Vector3d parting = a.along - sense * b.along;
  const auto end_at = [&](double t) {
    const Vector3d on_a = a.centre + (c.on_a + t) * a.along - a.radius * m.normal;
    const Vector3d on_b = b.centre + (c.on_b + sense * t) * b.along + b.radius * m.normal;
    return End{0.5 * (on_a + on_b), depth.left - (c.between + t * parting).norm()};
  };
  double low = 0.0, high = 0.0;
  if (depth.yields) {
    const Roots roots(parting.squaredNorm(), c.between.dot(parting),
                      c.between.squaredNorm() - depth.half_way * depth.half_way);
    const double across = std::abs(cosine);
    low = across * std::max({roots.low, -a.half - c.on_a, -b.half - sense * c.on_b});
    high = across * std::min({roots.high, a.half - c.on_a, b.half - sense * c.on_b});
  }
  if (high - low > kOnePoint) share_out(m, depth.all, end_at(low), end_at(high));
  else touch_at(m, end_at(0.0).place, depth.all, 1.0);
  return contact;
}

BodyContact press(const Cylinder& a, const Box& b, double crushed) {
  BodyContact contact;
  const Line line{b.axes.transpose() * (a.centre - b.centre), b.axes.transpose() * a.along, b.half};
  const Knots knots(line, a.half);
  const double deepest = nearest(line, knots);
  const Vector3d outside = line.outside(deepest);
  const double distance = outside.norm();
  if (!(distance < a.radius)) {
    contact.gap = distance - a.radius;
    return contact;
  }
  BodyManifold& m = contact.manifold;
  m.axis = 0;
  const Depth depth(a.radius, distance, crushed);
  if (!(distance > kNowhere)) {
    press_within(line, a, crushed, m);
  } else {
    m.normal = outside / distance;
    const auto end_at = [&](double t) {
      return End{0.5 * (line.at(t) - a.radius * m.normal + line.nearest(t)), depth.left - line.outside(t).norm()};
    };
    double low = deepest, high = deepest;
    if (depth.yields) {
      const double lying = lies(m.normal.dot(line.along));
      low += lying * (reach(line, knots, deepest, -1.0, depth.half_way) - deepest);
      high += lying * (reach(line, knots, deepest, 1.0, depth.half_way) - deepest);
    }
    if (high - low > kOnePoint) share_out(m, depth.all, end_at(low), end_at(high));
    else touch_at(m, end_at(deepest).place, depth.all, 1.0);
  }
  m.normal = b.axes * m.normal;
  for (std::size_t i = 0; i < static_cast<std::size_t>(m.count); ++i) m.point[i] = b.centre + b.axes * m.point[i];
  return contact;
}

}  // namespace train_derail::model
