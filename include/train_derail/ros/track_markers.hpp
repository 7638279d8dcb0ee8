/// \file
/// Markers of what does not move in a run.
#pragma once

#include <string>
#include <vector>

#include <visualization_msgs/MarkerArray.h>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::ros_face {

/// Returns the markers of ~track_markers in the frame `world`: ground, ballast, rails and, where cars may pile up, ties
/// to scale; a ruler along the track, of 50 m on its left and of 100 ft on its right; the point of derailment. The
/// first one removes those of the run before. `cars` are those of `scenario`.
visualization_msgs::MarkerArray track_markers(const inputs::Scenario& scenario, const std::vector<model::Car>& cars,
                                              const std::string& world);

}  // namespace train_derail::ros_face
