/// \file
/// A fitted line as the track of a scenario file.
#pragma once

#include <string>
#include <vector>

#include "train_derail/tracks/fit.hpp"

namespace train_derail::tracks {

/// A line and the track that was fitted to it, seen from the point of derailment.
struct FittedLine {
  std::string source;  ///< name of its file
  std::vector<PlanePoint> points;
  TrackFit fit;
  double origin = 0.0;  ///< place of the point of derailment along the fit [m]
  std::vector<std::string> assumptions;
};

/// Returns the place along the track that is nearest to a point [m].
double nearest_place(const TrackFit& fit, double x, double y);

/// Compass direction of the track at a place, clockwise from north, in [0, 2 pi) [rad]; y of the plane is north.
double compass(const TrackFit& fit, double place);

/// Returns YAML with the group `track`, and all that was assumed as comments.
/// \param base  scenario file for all else, as it is to be written; "": none.
std::string to_scenario(const FittedLine& line, const std::string& base);

/// Returns JSON for scripts/plot_track.py: points, track, curvature and grade over the place.
std::string to_json(const FittedLine& line);

}  // namespace train_derail::tracks
