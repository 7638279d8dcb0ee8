/// \file
/// Decides whether the numbers of a run can be believed.
#pragma once

#include <string>

#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Limits of Outcome::energy_residual, the energy of a run that is unaccounted for over the energy at its start. Runs
/// of the scenarios in config/ leave 1e-7 to 2e-5; runs that are unstable reach 1 and more within a few steps.
inline constexpr double kResidualUnusual = 1.0e-3;   ///< beyond it the outcome carries a warning
inline constexpr double kResidualTooLarge = 1.0e-2;  ///< beyond it the run has failed

/// Returns a sentence that says how much energy is unaccounted for and what helps.
std::string residual_text(double residual);

/// Returns what is wrong with the numbers so far and what helps, or "" if nothing is wrong. Wrong are numbers that are
/// not finite, and an energy residual above kResidualTooLarge.
std::string distrust(const Outcome& outcome);

/// Judges a run that has ended. If distrust() finds something, the run becomes Ended::integration_failed with that
/// message. Adds warnings to Outcome::warnings.
void judge(Outcome& outcome);

}  // namespace train_derail::outcome
