/// \file
/// Measures the pile-up of a train.
#pragma once

#include <functional>
#include <vector>

#include "train_derail/model/footprint.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Function that finds the place of a point by the track: arc length, offset, direction. `car` (from 0) is the car that
/// the point belongs to; `point` is in the world frame [m].
using PlaceByTrack = std::function<model::TrackPlace(std::size_t car, const Vector2& point)>;

/// Measures the pile-up.
/// \param cars     footprints of all cars in the order of the train.
/// \param counted  for each car, whether it belongs to the pile-up; of the same length.
/// \param place    finds the place of a point by the track.
PileUp pile_up(const std::vector<model::Footprint>& cars, const std::vector<bool>& counted, const PlaceByTrack& place);

}  // namespace train_derail::outcome
