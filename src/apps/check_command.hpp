/// \file
/// What `derail check` prints of a scenario.
#pragma once

#include <string>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::apps {

/// Returns the scenario as YAML with all defaults filled in. What follows from other keys stands there as comments:
/// heights and roll inertia of cars, what holds couplers, how long the step may be.
std::string explained(const inputs::Scenario& scenario);

}  // namespace train_derail::apps
