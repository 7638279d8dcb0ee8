#pragma once

#include <string>

#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// JSON object in SI units; keys are listed in README.md.
std::string to_json(const Outcome& outcome);

/// Table for people: SI beside mph, kip, ft.
std::string to_table(const Outcome& outcome);

}  // namespace train_derail::outcome
