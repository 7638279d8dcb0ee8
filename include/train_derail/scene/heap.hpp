/// \file
/// Where the wreck is: what cameras look at, in RViz and in the page of a run.
#pragma once

#include <vector>

#include "train_derail/model/train.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::scene {

/// A rectangle on the ground around a group of cars.
struct Heap {
  double x = 0.0;       ///< of its middle, world frame [m]
  double y = 0.0;       ///< of its middle, world frame [m]
  double z = 0.0;       ///< mean height of its cars, as theirs [m]
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

}  // namespace train_derail::scene
