/// \file
/// What the cameras of RViz look at.
#pragma once

#include <vector>

#include "train_derail/model/train.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// A rectangle on the ground around a group of cars.
struct Heap {
  double x = 0.0;       ///< of its middle, world frame [m]
  double y = 0.0;       ///< of its middle, world frame [m]
  double yaw = 0.0;     ///< of its long side, which is along the track there [rad]
  double length = 0.0;  ///< along the track [m]
  double width = 0.0;   ///< across it [m]
  int first_car = 1;    ///< foremost car of the group, from 1
  int last_car = 1;     ///< hindmost
};

/// Returns where the heap of cars lies: the largest group of cars that are turned by more than outcome::kMainPileCosine
/// says, with no more than outcome::kMainPileGap of track between them; before there are three of those, the largest
/// group of derailed cars; before there is one, the first cars of the train that are near the point of derailment.
Heap find_heap(const std::vector<model::Car>& cars, const std::vector<simulation::CarSnapshot>& now);

/// Follows the middle of the heap smoothly, so that a camera can sit on it. No result depends on it. Each run needs an
/// object of its own.
class PileUpFollower {
 public:
  /// Takes the heap at the next point of the output grid; `time` is simulated [s].
  void update(const Heap& heap, double time);
  /// Returns the x coordinate in the world frame [m].
  double x() const { return x_; }
  /// Returns the y coordinate in the world frame [m].
  double y() const { return y_; }

 private:
  bool begun_ = false;
  double time_ = 0.0, x_ = 0.0, y_ = 0.0;
};

}  // namespace train_derail::ros_face
