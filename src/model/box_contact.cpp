#include "model/box_contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Geometry>

namespace train_derail::model {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kFaces = 6, kAxes = 15;
constexpr double kSlack = 0.02, kSlackLength = 0.01;  // how much worse a favoured axis may be; m
constexpr double kParallel = 1e-12;                   // square of the sine between edges
constexpr double kOnPlane = 1e-9;                     // m
constexpr double kSamePlace = 1e-6;                   // relative difference of depths there
constexpr double kNearly = 0.95;                      // cosine of the angle within which a face stands in for edges

using Overlaps = std::array<double, kAxes>;

double with_slack(double overlap) { return (1.0 + kSlack) * overlap + kSlackLength; }

/// How far the boxes overlap along each axis [m]; false if there is a gap along one. Infinite for edges that are
/// parallel, or along which boxes overlap more than along a face: nobody asks how much.
bool overlaps(const Box& a, const Box& b, Overlaps& overlap) {
  const Vector3d between = a.centre - b.centre;
  const Vector3d in_a = a.axes.transpose() * between, in_b = b.axes.transpose() * between;
  const Matrix3d turn = a.axes.transpose() * b.axes, reach = turn.cwiseAbs();
  const Vector3d of_a = a.half + reach * b.half - in_a.cwiseAbs();
  const Vector3d of_b = b.half + reach.transpose() * a.half - in_b.cwiseAbs();
  if (!(of_a.minCoeff() > 0.0 && of_b.minCoeff() > 0.0)) return false;
  for (int i = 0; i < 3; ++i) {
    overlap[i] = of_a[i];
    overlap[3 + i] = of_b[i];
  }
  const double least = (1.0 + kSamePlace) * std::min(of_a.minCoeff(), of_b.minCoeff());
  for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
    for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      double& here = overlap[kFaces + 3 * i + j];
      const double square = turn(i1, j) * turn(i1, j) + turn(i2, j) * turn(i2, j);  // of the sine between the edges
      if (square < kParallel) {
        here = std::numeric_limits<double>::infinity();
        continue;
      }
      const double sum = a.half[i1] * reach(i2, j) + a.half[i2] * reach(i1, j) + b.half[j1] * reach(i, j2) +
                         b.half[j2] * reach(i, j1) - std::abs(in_a[i2] * turn(i1, j) - in_a[i1] * turn(i2, j));
      if (!(sum > 0.0)) return false;
      here = sum * sum < least * least * square ? sum / std::sqrt(square) : std::numeric_limits<double>::infinity();
    }
  }
  return true;
}

/// The axis to press along.
int choose(const Overlaps& overlap, int best_face, int best_edge, int previous) {
  const double face = overlap[best_face], edge = overlap[best_edge];
  if (previous >= kFaces && overlap[previous] < face && overlap[previous] <= with_slack(edge)) return previous;
  if (previous >= 0 && previous < kFaces && overlap[previous] <= with_slack(std::min(face, edge))) return previous;
  return face <= with_slack(edge) ? best_face : best_edge;
}

/// Corners in a frame of the reference face: along its two edges, and how deep below it.
struct Polygon {
  int n = 0;
  std::array<Vector3d, 8> corner;

  void add(const Vector3d& c) {
    if (n < 8) corner[n++] = c;
  }
};

/// Leaves of the polygon what has sign * corner[along] <= limit. Corners on the limit stay and are not cut off a second
/// time: two faces of one width have four points, not more by rounding.
void clip(Polygon& polygon, int along, double sign, double limit) {
  std::array<double, 8> inside;
  bool whole = true;
  for (int i = 0; i < polygon.n; ++i) {
    inside[i] = limit - sign * polygon.corner[i][along];
    whole = whole && inside[i] >= -kOnPlane;
  }
  if (whole) return;
  Polygon left;
  for (int i = 0; i < polygon.n; ++i) {
    const int next = i + 1 < polygon.n ? i + 1 : 0;
    const double from = inside[i], to = inside[next];
    if (from >= -kOnPlane) left.add(polygon.corner[i]);
    if (std::min(from, to) < -kOnPlane && std::max(from, to) > kOnPlane) {
      left.add(polygon.corner[i] + from / (from - to) * (polygon.corner[next] - polygon.corner[i]));
    }
  }
  polygon = left;
}

/// Points on the face of `reference` that is square to its axis `k` and looks along `outward`; returns the deepest.
double press_on_face(const Box& reference, int k, const Vector3d& outward, const Box& incident, BodyManifold& m) {
  const int u = (k + 1) % 3, v = (k + 2) % 3;
  Matrix3d frame;
  frame.row(0) = reference.axes.col(u).transpose();
  frame.row(1) = reference.axes.col(v).transpose();
  frame.row(2) = -outward.transpose();

  // The incident face is the one that looks against `outward` most.
  const Vector3d facing = incident.axes.transpose() * outward;
  int f = 0;
  for (int i = 1; i < 3; ++i) {
    if (std::abs(facing[i]) > std::abs(facing[f])) f = i;
  }
  const int p = (f + 1) % 3, q = (f + 2) % 3;
  Vector3d middle =
      frame * (incident.centre - std::copysign(incident.half[f], facing[f]) * incident.axes.col(f) - reference.centre);
  middle[2] += reference.half[k];
  const Vector3d to_p = frame * (incident.half[p] * incident.axes.col(p));
  const Vector3d to_q = frame * (incident.half[q] * incident.axes.col(q));

  Polygon polygon;
  polygon.add(middle + to_p + to_q);
  polygon.add(middle - to_p + to_q);
  polygon.add(middle - to_p - to_q);
  polygon.add(middle + to_p - to_q);
  for (const double sign : {1.0, -1.0}) {
    clip(polygon, 0, sign, reference.half[u]);
    clip(polygon, 1, sign, reference.half[v]);
  }

  double deepest = 0.0;
  m.count = 0;
  for (int i = 0; i < polygon.n; ++i) {
    const Vector3d& c = polygon.corner[i];
    if (!(c[2] > 0.0)) continue;
    m.point[m.count] = reference.centre + c[0] * reference.axes.col(u) + c[1] * reference.axes.col(v) +
                       (reference.half[k] - 0.5 * c[2]) * outward;
    m.depth[m.count] = c[2];
    ++m.count;
    deepest = std::max(deepest, c[2]);
  }
  return deepest;
}

/// The middle of the edge of `box` along its axis `i` that lies farthest along `direction`.
Vector3d farthest_edge(const Box& box, int i, const Vector3d& direction) {
  Vector3d middle = box.centre;
  for (const int k : {(i + 1) % 3, (i + 2) % 3}) {
    middle += std::copysign(box.half[k], box.axes.col(k).dot(direction)) * box.axes.col(k);
  }
  return middle;
}

/// The point where two edges cross, m.normal square to both; returns its depth, 0 if they pass each other by.
double press_on_edge(const Box& a, int i, const Box& b, int j, double overlap, BodyManifold& m) {
  const Vector3d along_a = a.axes.col(i), along_b = b.axes.col(j);
  const Vector3d on_a = farthest_edge(a, i, -m.normal), on_b = farthest_edge(b, j, m.normal);
  const Vector3d across = on_b - on_a;
  const double cosine = along_a.dot(along_b), by_a = along_a.dot(across), by_b = along_b.dot(across);
  const double square = along_a.cross(along_b).squaredNorm();
  const double s = (by_a - cosine * by_b) / square, t = (cosine * by_a - by_b) / square;
  m.count = 1;
  m.point[0] = 0.5 * (on_a + s * along_a + on_b + t * along_b);
  m.depth[0] = overlap;
  return std::abs(s) <= a.half[i] && std::abs(t) <= b.half[j] ? overlap : 0.0;
}

/// Unit vector from b into a.
Vector3d normal_of(const Box& a, const Box& b, int axis) {
  const int edges = axis - kFaces;
  const Vector3d n = axis < 3        ? Vector3d(a.axes.col(axis))
                     : axis < kFaces ? Vector3d(b.axes.col(axis - 3))
                                     : Vector3d(a.axes.col(edges / 3).cross(b.axes.col(edges % 3)).normalized());
  return n.dot(a.centre - b.centre) >= 0.0 ? n : Vector3d(-n);
}

/// Returns how deep the deepest point is, 0 if there is none.
double press_along(const Box& a, const Box& b, int axis, double overlap, BodyManifold& m) {
  m.axis = axis;
  m.normal = normal_of(a, b, axis);
  if (axis < 3) return press_on_face(a, axis, -m.normal, b, m);
  if (axis < kFaces) return press_on_face(b, axis - 3, m.normal, a, m);
  return press_on_edge(a, (axis - kFaces) / 3, b, (axis - kFaces) % 3, overlap, m);
}

/// Two faces that lie nearly flat on each other, set off sideways, overlap least along edges that cross at their rims,
/// and there they are deepest; but they touch on the whole of what they share. Puts all of that into m, unless it is
/// not so. Otherwise the contact of two ends would jump from their middle to their rims and back.
void spread_over_face(const Box& a, const Box& b, int previous, BodyManifold& m) {
  const Vector3d cosine_a = a.axes.transpose() * m.normal, cosine_b = b.axes.transpose() * m.normal;
  int nearest = 0;
  const auto cosine = [&](int face) { return std::abs(face < 3 ? cosine_a[face] : cosine_b[face - 3]); };
  for (int i = 1; i < kFaces; ++i) {
    if (cosine(i) > cosine(nearest)) nearest = i;
  }
  const int remembered = previous >= 0 && previous < kFaces ? previous : nearest;
  const double depth = m.depth[0];
  for (const int face : {remembered, nearest}) {
    if (cosine(face) < kNearly) continue;
    BodyManifold wide;
    const double deepest = cosine(face) * press_along(a, b, face, depth, wide);
    if (wide.count < 2 || std::abs(deepest - depth) > kSamePlace * depth) continue;
    m = wide;
    return;
  }
}

/// The same axis with the boxes' names changed over.
int other_way(int axis) {
  if (axis < 0) return axis;
  if (axis < kFaces) return axis < 3 ? axis + 3 : axis - 3;
  return kFaces + 3 * ((axis - kFaces) % 3) + (axis - kFaces) / 3;
}

/// `a` is the box whose centre comes first.
BodyManifold press_in_order(const Box& a, const Box& b, int previous) {
  BodyManifold m;
  Overlaps overlap;
  if (!overlaps(a, b, overlap)) return m;
  const auto least = [&overlap](int from, int to) {
    return static_cast<int>(std::min_element(overlap.begin() + from, overlap.begin() + to) - overlap.begin());
  };
  const int face = least(0, kFaces), edge = least(kFaces, kAxes);
  const int chosen = choose(overlap, face, edge, previous);
  const int best = overlap[edge] < overlap[face] ? edge : face;
  const double deepest = press_along(a, b, chosen, overlap[chosen], m);
  // A favoured face or edge may pass by what the boxes overlap on; the best one never does.
  if (chosen != best && deepest < 0.5 * overlap[best]) press_along(a, b, best, overlap[best], m);
  if (m.axis >= kFaces) spread_over_face(a, b, previous, m);
  if (m.count == 0) m.axis = -1;
  else std::fill_n(m.share.begin(), m.count, 1.0 / m.count);
  return m;
}

}  // namespace

BodyManifold press(const Box& a, const Box& b, int previous_axis) {
  const double ra = a.half.squaredNorm(), rb = b.half.squaredNorm();
  if (!((a.centre - b.centre).squaredNorm() < ra + rb + 2.0 * std::sqrt(ra * rb))) return {};
  // Equal overlaps go to whoever comes first: that is to be the same box for press(b, a).
  if (!std::lexicographical_compare(b.centre.begin(), b.centre.end(), a.centre.begin(), a.centre.end())) {
    return press_in_order(a, b, previous_axis);
  }
  BodyManifold m = press_in_order(b, a, other_way(previous_axis));
  m.normal = -m.normal;
  m.axis = other_way(m.axis);
  return m;
}

double gap(const Box& a, const Box& b) {
  const Vector3d between = a.centre - b.centre;
  const Matrix3d reach = (a.axes.transpose() * b.axes).cwiseAbs();
  const Vector3d of_a = (a.axes.transpose() * between).cwiseAbs() - a.half - reach * b.half;
  const Vector3d of_b = (b.axes.transpose() * between).cwiseAbs() - b.half - reach.transpose() * a.half;
  return std::max({of_a.maxCoeff(), of_b.maxCoeff(), 0.0});
}

}  // namespace train_derail::model
