#include "train_derail/outcome/trust.hpp"

#include <cmath>

#include <fmt/format.h>

#include "train_derail/outcome/fields.hpp"

namespace train_derail::outcome {

std::string residual_text(double residual) {
  return fmt::format(
      "{:.2g} of the energy at the start is unaccounted for: try a shorter solver.fixed_step, a smaller solver.rtol, "
      "or less "
      "stiffness",
      residual);
}

std::string distrust(const Outcome& o) {
  for (const auto& field : outcome_fields()) {
    const fields::Value value = field.get(o);
    const auto* number = std::get_if<double>(&value);
    if (number != nullptr && !std::isfinite(*number)) {
      return fmt::format("{} is not a finite number: the computation has become unstable", field.name);
    }
  }
  if (o.energy_residual > kResidualTooLarge) return "the result cannot be trusted: " + residual_text(o.energy_residual);
  return "";
}

void judge(Outcome& o) {
  if (o.ended == Ended::running || o.ended == Ended::integration_failed) return;
  if (const std::string why = distrust(o); !why.empty()) {
    o.ended = Ended::integration_failed;
    o.message = why;
    return;
  }
  if (o.energy_residual > kResidualUnusual) o.warnings.push_back(residual_text(o.energy_residual));
  if (o.ended == Ended::time_max) {
    o.warnings.push_back(
        fmt::format("cut off at stop.time_max with {:.3g} MJ of motion left: what still moved would have gone on",
                    o.energy.kinetic() * 1e-6));
  }
  if (o.ended == Ended::at_rest && o.stop_time == 0.0) {
    o.warnings.emplace_back("nothing moved: every truck was slower than stop.speed from the start");
  }
}

}  // namespace train_derail::outcome
