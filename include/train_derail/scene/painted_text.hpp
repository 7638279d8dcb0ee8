/// \file
/// Numbers and units painted flat, as on a roof or on the ground: they keep their place and size, and turn with it.
#pragma once

#include <string_view>

#include "train_derail/scene/points.hpp"

namespace train_derail::scene {

/// Adds triangles in the plane `z` [m]: `text` with its middle at the origin, to be read with x to the right and y up,
/// `height` [m] tall. Knows digits, minus, space and the letters N, f, m and t.
void paint_text(Points& points, std::string_view text, double height, double z);

}  // namespace train_derail::scene
