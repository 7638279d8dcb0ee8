/// \file
/// How derailed cars lie: upright, leaning, on the side, inverted, on top of each other. Models of space only.
#pragma once

#include <vector>

#include "train_derail/model/attitude.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// One derailed car.
struct Standing {
  model::Footprint footprint;  ///< seen from above
  model::Attitude attitude;
};

/// Counts how the cars lie.
Posture posture(const std::vector<Standing>& cars);

}  // namespace train_derail::outcome
