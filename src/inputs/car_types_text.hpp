/// \file
/// The texts of config/types/car_bodies.yaml and car_types.yaml, which the library carries in itself.
#pragma once

namespace train_derail::inputs {

extern const char *const kCarBodiesText, *const kCarTypesText;

}  // namespace train_derail::inputs
