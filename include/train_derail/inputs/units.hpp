/// \file
/// Conversion of units by UDUNITS-2: "37 mph" or "50e6 lbf/ft" to SI units and back. Safe to call from any thread.
#pragma once

#include <string>

namespace train_derail::inputs {

/// Returns the value of `text`, a number with or without a unit, in `si_unit`. A number without a unit is taken to be
/// in `si_unit`. Throws std::invalid_argument, whose text says what is wrong: no number, unknown unit, wrong dimension.
double to_si(const std::string& text, const std::string& si_unit);

/// Converts `value` from `si_unit` to `unit`.
double from_si(double value, const std::string& si_unit, const std::string& unit);

}  // namespace train_derail::inputs
