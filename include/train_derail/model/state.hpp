// Layout of the state vector: structure of arrays, so that one coordinate of all cars lies side by side.
#pragma once

#include <Eigen/Core>

namespace train_derail::model {

/// Column of a coordinate in the n x 6 array of motion. Car k of the paper is row k - 1.
enum Coordinate : Eigen::Index { X, Y, THETA, VX, VY, OMEGA };  // m, m, rad, m/s, m/s, rad/s
inline constexpr Eigen::Index kCoordinates = 6;

/// Work that leaves the cars' mechanical energy, integrated with the motion [J], positive when dissipated.
enum WorkTerm : Eigen::Index { WORK_ON_TRACK, WORK_OFF_TRACK };
inline constexpr Eigen::Index kWorkTerms = 2;

using Motion = Eigen::Array<double, Eigen::Dynamic, kCoordinates>;
using MotionMap = Eigen::Map<Motion>;
using ConstMotionMap = Eigen::Map<const Motion>;
using Work = Eigen::Array<double, kWorkTerms, 1>;
using WorkMap = Eigen::Map<Work>;
using ConstWorkMap = Eigen::Map<const Work>;
using StateVector = Eigen::VectorXd;

/// Length of the state vector of n cars: motion column by column, then the work terms.
constexpr Eigen::Index state_size(Eigen::Index cars) { return kCoordinates * cars + kWorkTerms; }

inline MotionMap motion(double* state, Eigen::Index cars) { return {state, cars, kCoordinates}; }
inline ConstMotionMap motion(const double* state, Eigen::Index cars) { return {state, cars, kCoordinates}; }
inline WorkMap work(double* state, Eigen::Index cars) { return WorkMap(state + kCoordinates * cars); }
inline ConstWorkMap work(const double* state, Eigen::Index cars) { return ConstWorkMap(state + kCoordinates * cars); }

}  // namespace train_derail::model
