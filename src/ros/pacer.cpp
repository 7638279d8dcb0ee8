#include "train_derail/ros/pacer.hpp"

#include <algorithm>

namespace train_derail::ros_face {

namespace {

/// Less than what an ordinary kernel's scheduling costs is not worth a new anchor, however fine the grid [s].
constexpr double kToleranceMin = 0.01;

}  // namespace

void Pacer::anchor(WallTime now, double t) {
  anchor_wall_ = window_wall_ = now;
  anchor_time_ = window_time_ = t;
  lost_ = 0.0;
}

WallTime Pacer::due(double t) const {
  return paced() ? anchor_wall_ + wall_seconds((t - anchor_time_) / rate_) : anchor_wall_;
}

double Pacer::done(WallTime now, double t) {
  if (!paced()) return 0.0;
  const double late = to_seconds(now - due(t));
  if (late > std::max(interval_ / rate_, kToleranceMin)) {
    anchor_wall_ = now;
    anchor_time_ = t;
    lost_ += late;
  }
  return std::max(late, 0.0);
}

double Pacer::take_achieved_rate(WallTime now, double t) {
  const double wall = window(now);
  const double achieved = wall > 0.0 ? (t - window_time_) / wall : 0.0;
  window_wall_ = now;
  window_time_ = t;
  return achieved;
}

}  // namespace train_derail::ros_face
