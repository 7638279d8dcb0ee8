/// \file
/// An outcome as JSON and as a table.
#pragma once

#include <string>

#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Returns an outcome as a JSON object in SI units; docs/outcomes.md lists its keys.
std::string to_json(const Outcome& outcome);

/// Returns an outcome as a table for people: SI units beside mph, kip and ft.
std::string to_table(const Outcome& outcome);

}  // namespace train_derail::outcome
