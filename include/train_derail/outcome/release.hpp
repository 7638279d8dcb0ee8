/// \file
/// Which tank cars release what they hold, from the impacts of a run. The law is docs/running_on_ties.md, section 7.
#pragma once

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/incidents.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Probability that an impact makes a tank release: 1 - exp(-max(v - v_0, 0) / v_s), where v_s is end_speed for a head
/// and side_speed for a shell, and v_0 threshold_speed, all three times `strength` (CarBlock::tank_strength; infinite:
/// nothing to release). `speed`: v, the closing speed normal [m/s]; `face`: the side of the tank that is hit.
double release_probability(const inputs::Release& law, double strength, double speed, model::Face face);

/// Tank cars that release by impacts, or by fittings if they have derailed, each independently of the others. One
/// random number a car, by the seed, decides: what is hit harder in the same scenario releases at least as often.
Released released(const inputs::Scenario& scenario, const model::Incidents& incidents);

}  // namespace train_derail::outcome
