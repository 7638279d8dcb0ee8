/// \file
/// Where a ball, the end of a tank, presses on the ground beside the track: the slopes of its cross-section and the
/// edges between them.
#pragma once

#include <array>
#include <cstddef>

#include <Eigen/Core>

#include "train_derail/model/terrain.hpp"

namespace train_derail::model {

/// The cross-section of the ground as corners from right to left. Beyond the first and the last it is level.
class GroundOutline {
 public:
  struct Corner {
    double offset, z;  ///< m; to the left of the centre line, above the rails
  };

  explicit GroundOutline(const CrossSection& section);

  std::size_t corners() const { return count_; }
  const Corner& corner(std::size_t i) const { return corner_[i]; }
  /// Slopes are numbered from right to left, 0 to corners(): slope i ends at corner i.
  double slope(std::size_t i) const {
    if (i == 0 || i == count_) return 0.0;
    return (corner_[i].z - corner_[i - 1].z) / (corner_[i].offset - corner_[i - 1].offset);
  }

 private:
  std::size_t count_ = 0;
  std::array<Corner, 16> corner_;
};

/// A place where a ball is deeper than around it. Directions: to the left of the track, and up.
struct BallTouch {
  double aside, up;    ///< unit vector from there to the centre of the ball
  double depth;        ///< straight down [m]
  std::size_t number;  ///< of the slope twice, or of the corner at its left end twice and one more
};

struct BallTouches {
  std::size_t count = 0;
  std::array<BallTouch, 8> at;
};

/// A ball presses on every slope that it is deepest in straight below its centre as seen from that slope, and on every
/// edge that stands out and lies between the feet on both of its slopes. A slope goes on below the ground beyond a
/// hollow. So depth changes continuously as the ball moves, and the direction is its gradient: otherwise a tank that
/// rolls off the ballast would gain energy or lose it.
///
/// @param offset, height  of its centre: to the left of the centre line, above the rails [m]
/// @return those with a depth above 0
BallTouches ball_on_ground(const GroundOutline& ground, double offset, double height, double radius);

}  // namespace train_derail::model
