/// \file
/// Order of the state vector: structure of arrays, so that one coordinate of all cars lies side by side.
#pragma once

#include <cstddef>

namespace train_derail::model {

/// Column of a coordinate in the n x 6 array of motion. Car k of the paper is row k - 1.
enum Coordinate : std::ptrdiff_t { X, Y, THETA, VX, VY, OMEGA };  // m, m, rad, m/s, m/s, rad/s
inline constexpr std::ptrdiff_t kCoordinates = 6;

/// Work that leaves the cars' mechanical energy, integrated with the motion [J], positive when dissipated.
enum WorkTerm : std::ptrdiff_t { WORK_ON_TRACK, WORK_OFF_TRACK };
inline constexpr std::ptrdiff_t kWorkTerms = 2;

/// Length of the state vector of n cars: motion column by column, then the work terms.
constexpr std::ptrdiff_t state_size(std::ptrdiff_t cars) { return kCoordinates * cars + kWorkTerms; }

}  // namespace train_derail::model
