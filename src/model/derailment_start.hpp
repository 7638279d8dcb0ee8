/// \file
/// How a derailment starts: which truck is off the rails first, and where others leave them (inputs::Mechanism).
#pragma once

#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/incidents.hpp"

namespace train_derail::model {

/// The front truck of the first car is off first; false: the rear one. By the seed where the scenario leaves it open.
bool starts_with_front(const inputs::Scenario& scenario);

/// The first truck runs on the ties and has no lateral motion at the start.
bool starts_on_ties(const inputs::Scenario& scenario);

/// Why trucks leave the rails by the mechanism.
Cause cause_of(inputs::Mechanism mechanism);

/// Arc length at which each truck leaves the rails by the mechanism, if it gets there on them; infinite: nowhere [m].
/// The front trucks of all cars, then the rear ones. By the seed where it is by chance.
std::vector<double> bad_places(const inputs::Scenario& scenario, std::size_t cars);

}  // namespace train_derail::model
