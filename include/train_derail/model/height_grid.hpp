/// \file
/// Ground from a map of heights.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Core>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// The heights of a terrain's grid; empty if it has none.
class HeightGrid {
 public:
  /// Of a grid that inputs::validate() has found good.
  explicit HeightGrid(const inputs::TerrainGrid& grid);

  bool empty() const { return along_ == 0; }
  /// No height is greater [m].
  double highest() const { return highest_; }

  /// Height above the top of the rails at the point of derailment [m], and how it changes along x and y [-].
  struct Height {
    double z;
    Eigen::Vector2d slope;
  };
  /// At a place of the world frame; bilinear between knots, beyond the edge as at the edge. Must not be empty.
  Height at(double x, double y) const {
    const Knot i = knot((x - x_from_) / spacing_, along_), j = knot((y - y_from_) / spacing_, across_);
    const double* row = z_.data() + i.below * across_ + j.below;
    const double* next = row + across_;
    const double right = row[0] + i.share * (next[0] - row[0]), left = row[1] + i.share * (next[1] - row[1]);
    const double ahead = (1.0 - j.share) * (next[0] - row[0]) + j.share * (next[1] - row[1]);
    return {right + j.share * (left - right),
            {i.inside ? ahead / spacing_ : 0.0, j.inside ? (left - right) / spacing_ : 0.0}};
  }

 private:
  /// A place between two knots.
  struct Knot {
    std::size_t below;
    double share;
    bool inside;
  };
  static Knot knot(double place, std::size_t count) {
    const double last = static_cast<double>(count - 1), held = std::clamp(place, 0.0, last);
    const auto below = std::min(static_cast<std::size_t>(held), count - 2);
    return {below, held - static_cast<double>(below), held == place};
  }

  double spacing_, x_from_, y_from_, highest_;
  std::size_t along_, across_;  // knots
  std::vector<double> z_;       // row by row
};

}  // namespace train_derail::model
