/// \file
/// How far a train can get along the track in one run.
#pragma once

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// Part of the track that tables of the track must cover: the train at its start, the distance that it can run (at most
/// 6 km, the track is straight beyond), and all curves.
struct TrackExtent {
  double from,  ///< arc length where it begins, from the point of derailment, forward [m]
      to;       ///< arc length where it ends [m]
};
/// Returns the extent for a scenario.
TrackExtent track_extent(const Scenario& scenario);

}  // namespace train_derail::inputs
