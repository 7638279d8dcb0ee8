// Whether the numbers of a run can be believed.
#pragma once

#include <string>

#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Energy of a run that is unaccounted for, over the energy at its start. Runs of the shipped scenarios leave 1e-7 to
/// 2e-5; runs that blow up leave 1 and more within a few steps.
inline constexpr double kResidualUnusual = 1.0e-3;   ///< beyond it the outcome carries a warning
inline constexpr double kResidualTooLarge = 1.0e-2;  ///< beyond it the run has failed

/// Says how much is missing and what helps.
std::string residual_text(double residual);

/// What is wrong with the numbers so far, and what helps; empty if nothing: a number that is not finite, a residual
/// that is too large.
std::string distrust(const Outcome& outcome);

/// Judges a run that has ended: it becomes Ended::integration_failed if distrust() says why; adds warnings.
void judge(Outcome& outcome);

}  // namespace train_derail::outcome
