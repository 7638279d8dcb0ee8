#include "train_derail/ros/pile_up_follower.hpp"

#include <cmath>

namespace train_derail::ros_face {

namespace {

constexpr double kTimeConstant = 0.5;  // simulated [s]

}  // namespace

void PileUpFollower::update(const simulation::Snapshot& now) {
  double x = 0.0, y = 0.0;
  int count = 0;
  for (const simulation::CarSnapshot& car : now.cars) {
    if (!car.derailed && !car.off_track) continue;
    x += car.x;
    y += car.y;
    ++count;
  }
  if (count > 0) {
    x /= count;
    y /= count;
  }
  const double share = begun_ ? 1.0 - std::exp(-(now.time - time_) / kTimeConstant) : 1.0;
  x_ += share * (x - x_);
  y_ += share * (y - y_);
  time_ = now.time;
  begun_ = true;
}

}  // namespace train_derail::ros_face
