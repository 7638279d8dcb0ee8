/// \file
/// The text of config/types/car_types.yaml, which the library carries in itself.
#pragma once

namespace train_derail::inputs {

extern const char* const kCarTypesText;

}  // namespace train_derail::inputs
