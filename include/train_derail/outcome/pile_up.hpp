#pragma once

#include <functional>
#include <vector>

#include "train_derail/model/footprint.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Where a point of a car, counted from 0, lies by the track.
using PlaceByTrack = std::function<model::TrackPlace(std::size_t car, const Vector2& point)>;

/// Where the counted cars lie; cars in the order of the train.
PileUp pile_up(const std::vector<model::Footprint>& cars, const std::vector<bool>& counted, const PlaceByTrack& place);

}  // namespace train_derail::outcome
