#include "train_derail/ros/pile_up_follower.hpp"

#include <cmath>

namespace train_derail::ros_face {

namespace {

constexpr double kTimeConstant = 0.5;  // simulated [s]

}  // namespace

void PileUpFollower::update(const scene::Heap& heap, double time) {
  const double share = begun_ ? 1.0 - std::exp(-(time - time_) / kTimeConstant) : 1.0;
  x_ += share * (heap.x - x_);
  y_ += share * (heap.y - y_);
  time_ = time;
  begun_ = true;
}

}  // namespace train_derail::ros_face
