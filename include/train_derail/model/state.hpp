/// \file
/// The state vector of models of the plane as Eigen sees it.
#pragma once

#include "train_derail/eigen_types.hpp"
#include "train_derail/model/state_layout.hpp"

namespace train_derail::model {

/// Motion of all cars, one row a car, columns as in Coordinate; maps of it into a state.
using PlanarMotion = Eigen::Array<double, Eigen::Dynamic, kCoordinates, Eigen::ColMajor | Eigen::DontAlign>;
using MotionMap = Eigen::Map<PlanarMotion>;
using ConstMotionMap = Eigen::Map<const PlanarMotion>;
/// Work terms at the end of a state, as in WorkTerm; maps of them into a state.
using WorkTerms = Eigen::Array<double, kWorkTerms, 1, Eigen::ColMajor | Eigen::DontAlign>;
using WorkMap = Eigen::Map<WorkTerms>;
using ConstWorkMap = Eigen::Map<const WorkTerms>;

/// The motion in a state of so many cars.
inline MotionMap motion(double* state, Eigen::Index cars) { return {state, cars, kCoordinates}; }
inline ConstMotionMap motion(const double* state, Eigen::Index cars) { return {state, cars, kCoordinates}; }
/// The work terms in a state of so many cars.
inline WorkMap work(double* state, Eigen::Index cars) { return WorkMap(state + kCoordinates * cars); }
inline ConstWorkMap work(const double* state, Eigen::Index cars) { return ConstWorkMap(state + kCoordinates * cars); }

}  // namespace train_derail::model
