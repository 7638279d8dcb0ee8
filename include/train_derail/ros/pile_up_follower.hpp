#pragma once

#include <vector>

#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// Point of the ground plane that follows the middle of the cars that have derailed, smoothly, so that a camera can sit
/// on it. A picture's helper: no result depends on it. One object a run.
class PileUpFollower {
 public:
  void update(const simulation::Snapshot& now);
  double x() const { return x_; }
  double y() const { return y_; }

 private:
  bool begun_ = false;
  double time_ = 0.0, x_ = 0.0, y_ = 0.0;
};

}  // namespace train_derail::ros_face
