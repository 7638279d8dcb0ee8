// Units by UDUNITS-2: "37 mph" or "50e6 lbf/ft" to SI and back. Any thread may ask.
#pragma once

#include <string>

namespace train_derail::inputs {

/// Value of `text` in `si_unit`; a bare number counts as being in `si_unit`.
/// Throws std::invalid_argument whose text says what is wrong (no number, unknown unit, wrong dimension).
double to_si(const std::string& text, const std::string& si_unit);

/// `value` in `si_unit` converted to `unit`.
double from_si(double value, const std::string& si_unit, const std::string& unit);

}  // namespace train_derail::inputs
