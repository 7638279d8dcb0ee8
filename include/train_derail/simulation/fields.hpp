/// \file
/// What a snapshot holds, described once.
#pragma once

#include "train_derail/fields/field.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::simulation {

const fields::Fields<CarSnapshot>& car_fields();
const fields::Fields<CouplerSnapshot>& coupler_fields();

}  // namespace train_derail::simulation
