/// \file
/// Cars of the extended model that nothing will ever happen to again: they roll away downhill for good.
#pragma once

#include "model/air_brakes.hpp"
#include "model/couplers.hpp"
#include "model/trucks.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/observation.hpp"
#include "train_derail/model/state_layout.hpp"

namespace train_derail::model {

/// What rolled_away() looks at.
struct Rolling {
  const std::vector<Car>& cars;
  const inputs::Track& track;
  const Couplers& couplers;
  const Trucks& trucks;
  const AirBrakes& brakes;
};

/// How many cars at the head of the train have rolled away for good. All of their trucks are on the rails, with lateral
/// forces and draft forces below half of what rails and couplers bear; they roll forward on a slope that pulls more
/// than their brakes will ever hold; the coupler behind them has broken; and no curve, no torn track and no other car
/// is ahead of the place two car lengths behind the last of them.
Eigen::Index rolled_away(const Rolling& train, const PlanColumns& q);

}  // namespace train_derail::model
