/// \file
/// Warnings about a scenario: values that are allowed, but that should be checked before the results are believed.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// An input that is allowed, but is unusual or has no effect.
struct Warning {
  std::string key;    ///< "coupler.break_draft", "consist[0].weight"; empty if several keys are meant
  std::string value;  ///< value in the unit that people read; empty if there is none
  std::string text;   ///< what is unusual, and what would be usual
};

/// Returns a warning as one line: "coupler.slack = 5 ft: more than usual: 0 to 0.9843 ft".
std::string to_string(const Warning& warning);

/// Returns the warnings for a valid scenario; none if nothing is unusual. There is a warning for each number outside
/// its usual range, for each value that is not the default and that the chosen laws do not use, for trains of a
/// kind that has not been compared with real accidents, and for what was assumed of a train list.
std::vector<Warning> warnings(const Scenario& scenario);

/// The same for a scenario with the changed inputs `given`: a changed input without effect gives a warning even if its
/// value is the default.
std::vector<Warning> warnings(const Scenario& scenario, const std::vector<Override>& given);

}  // namespace train_derail::inputs
