/// \file
/// What does not move in a run, as triangles: ground, track, ruler, point of derailment.
#pragma once

#include <optional>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"
#include "train_derail/scene/palette.hpp"
#include "train_derail/scene/points.hpp"

namespace train_derail::scene {

/// Colours of the parts of a TrackPicture.
inline constexpr Rgb kGround{124, 130, 108}, kBallast{150, 146, 138}, kTie{66, 50, 38}, kRail{196, 198, 204},
    kRuler{178, 184, 164}, kPod{255, 255, 255};
/// Height of the words at the point of derailment [m].
inline constexpr double kPodTextHeight = 3.0;

/// Triangles in the world frame, above `height`.
struct TrackPicture {
  Points ground;   ///< level, or along the track: hills, banks
  Points ballast;  ///< under the track, with its grades and superelevation
  Points ties;     ///< where cars may pile up, to scale
  Points rails;    ///< twice as wide as they are
  Points ruler;    ///< lines and numbers across the ground: every 50 m on the left, every 100 ft on the right;
                   ///< an arrow to the north beside the point of derailment, if the scenario says where north is
  Points pod;      ///< line across the point of derailment
  Point pod_name;  ///< where the words for it stand
  std::optional<Point> north;  ///< a unit vector on the ground, if the scenario says where north is
  double height = 0.0;         ///< of all this against the world frame, up [m]
};

/// Returns the picture of a scenario's track. `cars` are those of `scenario`.
TrackPicture track_picture(const inputs::Scenario& scenario, const std::vector<model::Car>& cars);

}  // namespace train_derail::scene
