// How far a run can reach along the track.
#pragma once

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// Part of the track that tables of it have to cover, from the point of derailment, forward [m]: the train, the way
/// that it can run (6 km at most, beyond it the track goes on straight), all curves.
struct TrackExtent {
  double from, to;
};
TrackExtent track_extent(const Scenario& scenario);

}  // namespace train_derail::inputs
