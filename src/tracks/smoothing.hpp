/// \file
/// A smoothing spline through points in a plane.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "train_derail/tracks/fit.hpp"

namespace train_derail::tracks {

/// A smooth curve near the points, sampled at each of them.
struct SmoothLine {
  Eigen::VectorXd x, y;   ///< m
  Eigen::VectorXd place;  ///< along it from the first point [m]
};

/// Standard deviation of values about a smooth curve over `at`, from their third differences: half of the points may be
/// outliers.
double noise_of(const Eigen::VectorXd& at, const Eigen::VectorXd& value);

/// Smooths the points such that they are off the curve by `noise` [m] on average.
SmoothLine smoothed(const std::vector<PlanePoint>& points, double noise);

}  // namespace train_derail::tracks
