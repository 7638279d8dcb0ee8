/// \file
/// A line of surveyed points becomes a track of arcs and grades.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::tracks {

/// A point of a line in a plane, x east and y north [m].
struct PlanePoint {
  double x = 0.0, y = 0.0;
  std::optional<double> z;  ///< height above any level [m]
};

/// How a line is fitted.
struct FitOptions {
  /// Standard deviation of the points across the line [m]; none: estimated from the points.
  std::optional<double> noise;
  /// The same of the heights [m].
  std::optional<double> height_noise;
};

/// What a piece of the track is between two places along it.
struct Piece {
  double from = 0.0, to = 0.0;  ///< along the track from its beginning [m]
  double value = 0.0;           ///< curvature, to the left positive [1/m], or grade [-]
};

/// A track that was fitted to points. The pieces follow one another from the beginning to the end of the track.
struct TrackFit {
  double x = 0.0, y = 0.0, heading = 0.0;  ///< of the beginning [m], counter-clockwise from the x axis [rad]
  std::vector<Piece> curvature;
  std::vector<Piece> grade;     ///< empty if fewer than two points have heights
  double height = 0.0;          ///< at the beginning [m]
  std::vector<double> place;    ///< along the track, of each point [m]
  std::vector<double> offset;   ///< of each point from the track, to the left positive [m]
  double noise = 0.0;           ///< that was used: given or estimated [m]
  double height_noise = 0.0;    ///< the same of the heights [m]
  std::size_t outliers = 0;     ///< points farther than three times the noise from the track: they count less
  double height_largest = 0.0;  ///< largest distance in height of a point from the track [m]
  double height_rms = 0.0;      ///< the same, root of the mean square [m]

  double length() const { return curvature.back().to; }  ///< [m]
  double largest() const;                                ///< largest distance of a point from the track [m]
  double rms() const;                                    ///< the same, root of the mean square [m]
  /// Where the track is at a place along it, and its direction. Beyond its ends it goes on straight.
  struct Pose {
    double x, y, heading;
  };
  Pose at(double place) const;
  /// Height of the track there [m]; `height` if there are no grades.
  double height_at(double place) const;
};

/// Fits arcs to points along a line: piecewise constant curvature, of as few pieces as the noise allows. First a
/// smoothing spline orders the points along the line. Then neighbouring pieces are joined as long as that does not cost
/// more than Schwarz's criterion allows, and at last all places, curvatures, the beginning and its direction are
/// polished by least squares on the distances. Outliers count less (Huber). Grades: heights in the same way.
/// \param points  at least two, no two neighbours at the same place; at most kPointsMax.
/// Throws std::invalid_argument if the points turn back or the fit does not converge.
TrackFit fit_track(const std::vector<PlanePoint>& points, const FitOptions& options);
/// Most points of a line.
inline constexpr std::size_t kPointsMax = 20000;

/// The curves and grades of a scenario: the pieces of a fit that are not straight or level, from `origin` [m] on.
std::vector<inputs::Curve> curves(const TrackFit& fit, double origin);
std::vector<inputs::GradeSection> grades(const TrackFit& fit, double origin);

}  // namespace train_derail::tracks
