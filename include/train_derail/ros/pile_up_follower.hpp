/// \file
/// A point for the cameras of RViz.
#pragma once

#include <vector>

#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// A point of the ground plane that follows the middle of the derailed cars smoothly, so that a camera can sit on it.
/// No result depends on it. Each run needs an object of its own.
class PileUpFollower {
 public:
  /// Takes the next point of the output grid.
  void update(const simulation::Snapshot& now);
  /// Returns the x coordinate in the world frame [m].
  double x() const { return x_; }
  /// Returns the y coordinate in the world frame [m].
  double y() const { return y_; }

 private:
  bool begun_ = false;
  double time_ = 0.0, x_ = 0.0, y_ = 0.0;
};

}  // namespace train_derail::ros_face
