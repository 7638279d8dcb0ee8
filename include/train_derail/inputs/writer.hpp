#pragma once

#include <string>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// The whole scenario as YAML in SI units, every default filled in, each value annotated in the unit people read.
/// read_scenario() of it gives the same scenario back.
std::string to_yaml(const Scenario& scenario);

/// Table of every key: unit, allowed range, default, meaning.
std::string describe_keys();

}  // namespace train_derail::inputs
