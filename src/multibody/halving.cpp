#include "multibody/halving.hpp"

#include <algorithm>

#include <Eigen/Geometry>

namespace train_derail::multibody {

void Apart::extend(const Apart& other) {
  position = std::max(position, other.position);
  angle = std::max(angle, other.angle);
}

Apart apart(const Frame& a, const Frame& b) {
  Apart most;
  for (std::size_t k = 0; k < a.cars.size(); ++k) {
    const BodyMotion &here = a.cars[k], &there = b.cars[k];
    most.extend({(here.centre - there.centre).norm(),
                 Eigen::AngleAxisd(Eigen::Matrix3d(here.axes.transpose() * there.axes)).angle()});
  }
  return most;
}

Apart farthest(const Film& a, const Film& b) {
  Apart most;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) most.extend(apart(a[i], b[i]));
  return most;
}

void HalvedComparison::extend(const Halves<Frame>& now) {
  whole.extend(apart(now.model_whole, now.engine_half));
  half.extend(apart(now.model_half, now.engine_half));
  model_.extend(apart(now.model_whole, now.model_half));
  engine_.extend(apart(now.engine_whole, now.engine_half));
  limit = {2.0 * (model_.position + engine_.position), 2.0 * (model_.angle + engine_.angle)};
}

HalvedComparison compare(const Halves<Film>& f) {
  HalvedComparison result;
  const std::size_t frames =
      std::min({f.model_whole.size(), f.model_half.size(), f.engine_whole.size(), f.engine_half.size()});
  for (std::size_t i = 0; i < frames; ++i)
    result.extend({f.model_whole[i], f.model_half[i], f.engine_whole[i], f.engine_half[i]});
  return result;
}

}  // namespace train_derail::multibody
