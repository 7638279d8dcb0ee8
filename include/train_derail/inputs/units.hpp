#pragma once

#include <memory>
#include <string>

namespace train_derail::inputs {

/// Turns "37 mph" or "50e6 lbf/ft" into SI by UDUNITS-2. Not thread-safe; one object a thread.
class UnitSystem {
 public:
  UnitSystem();
  ~UnitSystem();
  UnitSystem(const UnitSystem&) = delete;
  UnitSystem& operator=(const UnitSystem&) = delete;

  /// Value of `text` in `si_unit`; a bare number counts as being in `si_unit`.
  /// Throws std::invalid_argument whose text says what is wrong (no number, unknown unit, wrong dimension).
  double to_si(const std::string& text, const std::string& si_unit);

  /// `value` in `si_unit` converted to `unit`.
  double from_si(double value, const std::string& si_unit, const std::string& unit);

 private:
  struct Impl;
  Impl& impl();  // reads the unit database at first use
  std::unique_ptr<Impl> impl_;
};

}  // namespace train_derail::inputs
