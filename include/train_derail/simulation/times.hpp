/// \file
/// Times that may be asked for.
#pragma once

#include <cmath>
#include <string>

namespace train_derail::simulation {

/// Returns why a run cannot be asked to go on to simulated time `t` [s], or "" if it can. Infinite: to its end.
inline std::string flaw_of_time(double t) {
  return std::isnan(t) ? "not a number" : t < 0.0 ? "before the run begins" : "";
}

}  // namespace train_derail::simulation
