#pragma once

#include <vector>

#include "train_derail/model/footprint.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

/// Where the counted cars lie; both arguments in the order of the train.
PileUp pile_up(const std::vector<model::Footprint>& cars, const std::vector<bool>& counted);

}  // namespace train_derail::outcome
