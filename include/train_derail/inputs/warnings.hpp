// What a scenario may hold but what should be looked at before its numbers are believed.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// An input that is allowed but unusual, or without effect.
struct Warning {
  std::string key;    ///< "coupler.break_draft", "consist[0].weight"; empty if it is about several
  std::string value;  ///< as people read it; empty if there is none
  std::string text;   ///< what is odd about it, and what would be usual
};

/// "coupler.slack = 5 ft: longer than usual: 0 to 1 ft", one line.
std::string to_string(const Warning& warning);

/// Of a valid scenario; empty if nothing is odd. Odd are numbers out of their usual range, values other than the
/// default that the chosen laws do not use, and trains of which nothing was compared with reality.
std::vector<Warning> warnings(const Scenario& scenario);

/// The same for a scenario with changed inputs: each of `given` that has no effect, even if it is the default.
std::vector<Warning> warnings(const Scenario& scenario, const std::vector<Override>& given);

}  // namespace train_derail::inputs
