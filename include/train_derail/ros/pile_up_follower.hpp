/// \file
/// Where the cameras of RViz sit.
#pragma once

#include "train_derail/scene/heap.hpp"

namespace train_derail::ros_face {

/// Follows the middle of the heap smoothly, so that a camera can sit on it. No result depends on it. Each run needs an
/// object of its own.
class PileUpFollower {
 public:
  /// Takes the heap at the next point of the output grid; `time` is simulated [s].
  void update(const scene::Heap& heap, double time);
  /// Returns the x coordinate in the world frame [m].
  double x() const { return x_; }
  /// Returns the y coordinate in the world frame [m].
  double y() const { return y_; }

 private:
  bool begun_ = false;
  double time_ = 0.0, x_ = 0.0, y_ = 0.0;
};

}  // namespace train_derail::ros_face
