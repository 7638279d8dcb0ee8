// What a scenario may hold but what should be looked at before its numbers are believed.
#pragma once

#include <string>
#include <vector>

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

/// Of a valid scenario; empty if nothing is odd.
std::vector<Warning> warnings(const Scenario& scenario);

}  // namespace train_derail::inputs
