#include "train_derail/model/footprint.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace train_derail::model {

namespace {

/// Point of `f` that lies farthest along `direction`: a corner, or the middle of an edge that lies square to it.
Vector2 farthest(const Footprint& f, const Vector2& direction) {
  constexpr double kSquare = 1e-9;
  const auto pick = [](double along, double half) {
    return std::abs(along) < kSquare ? 0.0 : std::copysign(half, along);
  };
  return f.centre + pick(f.axis.dot(direction), f.half_length) * f.axis +
         pick(f.side().dot(direction), f.half_width) * f.side();
}

}  // namespace

std::optional<Touch> touch(const Footprint& a, const Footprint& b) {
  const Vector2 between = a.centre - b.centre;
  Touch best{Vector2::Zero(), Vector2::Zero(), std::numeric_limits<double>::infinity()};
  bool face_of_a = true;
  const Vector2 candidates[4] = {a.axis, a.side(), b.axis, b.side()};
  for (int i = 0; i < 4; ++i) {
    const Vector2& n = candidates[i];
    const double distance = between.dot(n);
    const double depth = a.reach(n) + b.reach(n) - std::abs(distance);
    if (depth < 0.0) return std::nullopt;
    if (depth < best.depth) {
      best.depth = depth;
      best.normal = distance >= 0.0 ? n : Vector2(-n);
      face_of_a = i < 2;
    }
  }
  best.point = face_of_a ? farthest(b, best.normal) : farthest(a, Vector2(-best.normal));
  return best;
}

Manifold press(const Footprint& a, const Footprint& b) {
  Manifold m;
  const Vector2 between = a.centre - b.centre;
  // Relative orientation once; the reach of one box along the axes of the other follows from it.
  const double c = std::abs(a.axis.dot(b.axis)), s = std::abs(a.axis.dot(b.side()));
  const Vector2 axes[4] = {a.axis, a.side(), b.axis, b.side()};
  const double sum[4] = {
      a.half_length + b.half_length * c + b.half_width * s, a.half_width + b.half_length * s + b.half_width * c,
      b.half_length + a.half_length * c + a.half_width * s, b.half_width + a.half_length * s + a.half_width * c};
  int face = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 4; ++i) {
    const double distance = between.dot(axes[i]), depth = sum[i] - std::abs(distance);
    if (depth <= 0.0) return m;
    if (depth < least) {
      least = depth;
      face = i;
      m.normal = distance >= 0.0 ? axes[i] : Vector2(-axes[i]);
    }
  }
  m.face_of_a = face < 2;
  const Footprint& reference = m.face_of_a ? a : b;
  const Footprint& incident = m.face_of_a ? b : a;
  const Vector2 outward = m.face_of_a ? Vector2(-m.normal) : m.normal;  // from the reference's face
  const Vector2 along(-outward.y(), outward.x());
  const bool end_face = face % 2 == 0;
  const double face_distance = end_face ? reference.half_length : reference.half_width;
  const double face_half = end_face ? reference.half_width : reference.half_length;

  // The incident edge is the one that looks against `outward` most.
  const double by_axis = incident.axis.dot(outward), by_side = incident.side().dot(outward);
  const bool end_edge = std::abs(by_axis) > std::abs(by_side);
  const Vector2 edge_normal = end_edge ? Vector2(std::copysign(1.0, -by_axis) * incident.axis)
                                       : Vector2(std::copysign(1.0, -by_side) * incident.side());
  const Vector2 edge_along(-edge_normal.y(), edge_normal.x());
  const double edge_half = end_edge ? incident.half_width : incident.half_length;
  const Vector2 middle = incident.centre + (end_edge ? incident.half_length : incident.half_width) * edge_normal;

  // Clip the edge, middle + t edge_along with |t| <= edge_half, to |along| <= face_half.
  const double at = (middle - reference.centre).dot(along), slope = edge_along.dot(along);
  double from = -edge_half, to = edge_half;
  if (std::abs(slope) > 1e-12) {
    const double t1 = (-face_half - at) / slope, t2 = (face_half - at) / slope;
    from = std::max(from, std::min(t1, t2));
    to = std::min(to, std::max(t1, t2));
  }
  if (from > to) {
    // The edge passes the face by: what is deepest in the other is its corner.
    m.count = 1;
    m.point[0] = farthest(incident, Vector2(-outward));
    m.depth[0] = least;
    return m;
  }
  for (const double t : {from, to}) {
    const Vector2 p = middle + t * edge_along;
    const double depth = face_distance - (p - reference.centre).dot(outward);
    if (depth <= 0.0 || (m.count == 1 && to - from < 1e-9)) continue;
    m.point[m.count] = p;
    m.depth[m.count] = depth;
    ++m.count;
  }
  return m;
}

double gap(const Footprint& a, const Footprint& b) {
  const Vector2 between = a.centre - b.centre;
  const double c = std::abs(a.axis.dot(b.axis)), s = std::abs(a.axis.dot(b.side()));
  return std::max({std::abs(between.dot(a.axis)) - a.half_length - b.half_length * c - b.half_width * s,
                   std::abs(between.dot(a.side())) - a.half_width - b.half_length * s - b.half_width * c,
                   std::abs(between.dot(b.axis)) - b.half_length - a.half_length * c - a.half_width * s,
                   std::abs(between.dot(b.side())) - b.half_width - a.half_length * s - a.half_width * c, 0.0});
}

}  // namespace train_derail::model
