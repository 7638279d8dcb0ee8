#include "train_derail/outcome/footprint.hpp"

#include <cmath>
#include <limits>

namespace train_derail::outcome {

namespace {

/// Point of `f` that lies farthest along `direction`: a corner, or the middle of an edge that lies square to it.
Eigen::Vector2d farthest(const Footprint& f, const Eigen::Vector2d& direction) {
  constexpr double kSquare = 1e-9;
  const auto pick = [](double along, double half) {
    return std::abs(along) < kSquare ? 0.0 : std::copysign(half, along);
  };
  return f.centre + pick(f.axis.dot(direction), f.half_length) * f.axis +
         pick(f.side().dot(direction), f.half_width) * f.side();
}

}  // namespace

std::optional<Touch> touch(const Footprint& a, const Footprint& b) {
  const Eigen::Vector2d between = a.centre - b.centre;
  Touch best{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero(), std::numeric_limits<double>::infinity()};
  bool face_of_a = true;
  const Eigen::Vector2d candidates[4] = {a.axis, a.side(), b.axis, b.side()};
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d& n = candidates[i];
    const double distance = between.dot(n);
    const double depth = a.reach(n) + b.reach(n) - std::abs(distance);
    if (depth < 0.0) return std::nullopt;
    if (depth < best.depth) {
      best.depth = depth;
      best.normal = distance >= 0.0 ? n : Eigen::Vector2d(-n);
      face_of_a = i < 2;
    }
  }
  best.point = face_of_a ? farthest(b, best.normal) : farthest(a, Eigen::Vector2d(-best.normal));
  return best;
}

}  // namespace train_derail::outcome
