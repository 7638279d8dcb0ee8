#include "multibody/body_patch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace train_derail::multibody {

using SimTK::Vec3;

namespace {

constexpr int kFaces = 6, kAll = 15;

/// How much more two blocks may overlap along an axis that is preferred.
double tolerated(double overlap) { return 1.02 * overlap + 0.01; }

Vec3 side(const Block& block, int axis) { return block.axes.col(axis).asVec3(); }

/// Axes along which two blocks may be apart, from the second to the first, and how far they overlap.
class Axes {
 public:
  Axes(const Block& a, const Block& b) : a_(a), b_(b), between_(a.centre - b.centre) {
    for (int i = 0; i < 3 && touch_; ++i) look(i, side(a, i));
    for (int i = 0; i < 3 && touch_; ++i) look(3 + i, side(b, i));
    if (!touch_) return;
    const double face = overlap(best(0, kFaces));
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3 && touch_; ++j) {
        const Vec3 across = SimTK::cross(side(a, i), side(b, j));
        const int number = kFaces + 3 * i + j;
        overlap_[number] = kNever;
        if (across.normSqr() < 1e-12) continue;
        look(number, across / across.norm());
        // Faces are the nearer way out.
        if (overlap_[number] >= (1.0 + 1e-6) * face) overlap_[number] = kNever;
      }
    }
  }
  bool touch() const { return touch_; }
  double overlap(int axis) const { return overlap_[axis]; }
  const Vec3& normal(int axis) const { return normal_[axis]; }
  int best(int from, int to) const {
    return static_cast<int>(std::min_element(overlap_.begin() + from, overlap_.begin() + to) - overlap_.begin());
  }
  /// The axis to press along.
  int chosen(int before) const {
    const int face = best(0, kFaces), edge = best(kFaces, kAll);
    const double least = std::min(overlap(face), overlap(edge));
    if (before >= 0 && before < kFaces && overlap(before) <= tolerated(least)) return before;
    if (before >= kFaces && overlap(before) < overlap(face) && overlap(before) <= tolerated(overlap(edge)))
      return before;
    return overlap(face) <= tolerated(overlap(edge)) ? face : edge;
  }

 private:
  static constexpr double kNever = std::numeric_limits<double>::infinity();
  void look(int number, const Vec3& axis) {
    const double apart = SimTK::dot(axis, between_);
    overlap_[number] = a_.reach(axis) + b_.reach(axis) - std::abs(apart);
    normal_[number] = apart >= 0.0 ? axis : Vec3(-axis);
    touch_ = overlap_[number] > 0.0;
  }
  const Block &a_, &b_;
  const Vec3 between_;
  bool touch_ = true;
  std::array<double, kAll> overlap_{};
  std::array<Vec3, kAll> normal_;
};

/// A polygon in space.
struct Outline {
  int count = 0;
  std::array<Vec3, 8> corner;
  void add(const Vec3& c) {
    if (count < 8) corner[count++] = c;
  }
};

/// What of it lies no farther along a unit vector than `limit`; what is on the limit stays as it is.
Outline cut(const Outline& whole, const Vec3& direction, double limit) {
  constexpr double kOn = 1e-9;  // m
  Outline rest;
  for (int i = 0; i < whole.count; ++i) {
    const Vec3 &here = whole.corner[i], &next = whole.corner[(i + 1) % whole.count];
    const double out = SimTK::dot(direction, here) - limit, out_next = SimTK::dot(direction, next) - limit;
    if (out <= kOn) rest.add(here);
    if (std::max(out, out_next) > kOn && std::min(out, out_next) < -kOn)
      rest.add(here + out / (out - out_next) * (next - here));
  }
  return rest;
}

/// The face of `lower` that looks along `up` bears the part of `upper` that is within its rims. Fills the points;
/// returns the deepest.
double bear(const Block& lower, int axis, const Vec3& up, const Block& upper, Patch& patch) {
  int facing = 0;
  for (int i = 1; i < 3; ++i)
    if (std::abs(SimTK::dot(side(upper, i), up)) > std::abs(SimTK::dot(side(upper, facing), up))) facing = i;
  const Vec3 down = SimTK::dot(side(upper, facing), up) > 0.0 ? Vec3(-side(upper, facing)) : side(upper, facing);
  const int p = (facing + 1) % 3, q = (facing + 2) % 3;
  const Vec3 middle = upper.centre + upper.half[facing] * down;
  const Vec3 to_p = upper.half[p] * side(upper, p), to_q = upper.half[q] * side(upper, q);
  Outline face;
  for (const Vec3& corner :
       {Vec3(middle + to_p + to_q), Vec3(middle - to_p + to_q), Vec3(middle - to_p - to_q), Vec3(middle + to_p - to_q)})
    face.add(corner);
  for (const int rim : {(axis + 1) % 3, (axis + 2) % 3}) {
    for (const double way : {1.0, -1.0}) {
      const Vec3 out = way * side(lower, rim);
      face = cut(face, out, SimTK::dot(out, lower.centre) + lower.half[rim]);
    }
  }
  const double level = SimTK::dot(up, lower.centre) + lower.half[axis];
  double deepest = 0.0;
  patch.count = 0;
  for (int i = 0; i < face.count; ++i) {
    const double depth = level - SimTK::dot(up, face.corner[i]);
    if (depth <= 0.0) continue;
    patch.depth[patch.count] = depth;
    patch.point[patch.count++] = face.corner[i] + 0.5 * depth * up;
    deepest = std::max(deepest, depth);
  }
  return deepest;
}

/// Middle of the edge along axis `i` that is farthest along a direction.
Vec3 edge(const Block& block, int i, const Vec3& direction) {
  Vec3 place = block.centre;
  for (const int k : {(i + 1) % 3, (i + 2) % 3})
    place += (SimTK::dot(side(block, k), direction) < 0.0 ? -block.half[k] : block.half[k]) * side(block, k);
  return place;
}

/// Two edges cross. Returns the depth; 0 if they pass each other beyond their ends.
double cross_edges(const Block& a, int i, const Block& b, int j, double overlap, Patch& patch) {
  const Vec3 p = edge(a, i, -patch.normal), q = edge(b, j, patch.normal), u = side(a, i), v = side(b, j);
  // p + s u and q + t v are nearest where their difference is square to both.
  const SimTK::Mat22 square(1.0, -SimTK::dot(u, v), -SimTK::dot(u, v), 1.0);
  const SimTK::Vec2 nearest = square.invert() * SimTK::Vec2(SimTK::dot(q - p, u), -SimTK::dot(q - p, v));
  patch.count = 1;
  patch.depth[0] = overlap;
  patch.point[0] = 0.5 * (p + nearest[0] * u + q + nearest[1] * v);
  return std::abs(nearest[0]) <= a.half[i] && std::abs(nearest[1]) <= b.half[j] ? overlap : 0.0;
}

double press_along(const Block& a, const Block& b, const Axes& axes, int axis, Patch& patch) {
  patch.axis = axis;
  patch.normal = axes.normal(axis);
  if (axis < 3) return bear(a, axis, -patch.normal, b, patch);
  if (axis < kFaces) return bear(b, axis - 3, patch.normal, a, patch);
  return cross_edges(a, (axis - kFaces) / 3, b, (axis - kFaces) % 3, axes.overlap(axis), patch);
}

/// Edges that cross at the rims of two faces that lie nearly flat on each other, and are as deep: the faces bear all
/// that they share.
void widen(const Block& a, const Block& b, const Axes& axes, int before, Patch& patch) {
  const auto cosine = [&](int face) {
    return std::abs(SimTK::dot(patch.normal, face < 3 ? side(a, face) : side(b, face - 3)));
  };
  int nearest = 0;
  for (int face = 1; face < kFaces; ++face)
    if (cosine(face) > cosine(nearest)) nearest = face;
  const double depth = patch.depth[0];
  for (const int face : {before >= 0 && before < kFaces ? before : nearest, nearest}) {
    Patch wide;
    if (cosine(face) < 0.95) continue;
    const double deepest = press_along(a, b, axes, face, wide) * cosine(face);
    if (wide.count < 2 || std::abs(deepest - depth) > 1e-6 * depth) continue;
    patch = wide;
    return;
  }
}

/// The name of an axis after the blocks have changed places.
int changed_over(int axis) {
  if (axis < 0) return axis;
  return axis < kFaces ? (axis + 3) % kFaces : kFaces + (axis - kFaces) % 3 * 3 + (axis - kFaces) / 3;
}

}  // namespace

double Block::reach(const Vec3& direction) const {
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) sum += half[i] * std::abs(SimTK::dot(side(*this, i), direction));
  return sum;
}

Patch patch_of(const Block& a, const Block& b, int before) {
  // Of two axes that are as good the first one is taken, and that is to be the same one for (b, a).
  for (int i = 0; i < 3; ++i) {
    if (a.centre[i] == b.centre[i]) continue;
    if (a.centre[i] < b.centre[i]) break;
    Patch patch = patch_of(b, a, changed_over(before));
    patch.normal = -patch.normal;
    patch.axis = changed_over(patch.axis);
    return patch;
  }
  Patch patch;
  const Axes axes(a, b);
  if (!axes.touch()) return patch;
  const int chosen = axes.chosen(before), best = axes.best(0, kAll);
  const double deepest = press_along(a, b, axes, chosen, patch);
  // What is preferred may pass by the place where they touch.
  if (chosen != best && deepest < 0.5 * axes.overlap(best)) press_along(a, b, axes, best, patch);
  if (patch.axis >= kFaces) widen(a, b, axes, before, patch);
  if (patch.count == 0) patch.axis = -1;
  return patch;
}

}  // namespace train_derail::multibody
