/// \file
/// What a car looks like, in RViz and in the page of a run: a few dozen triangles in the car's own axes. x points
/// forward, y to the left, z up from the rail head; the origin is midway between the truck centres. All lengths are in
/// m.
#pragma once

#include <string>

#include "train_derail/model/train.hpp"
#include "train_derail/scene/points.hpp"

namespace train_derail::scene {

/// Points of one car's picture.
struct CarShape {
  Points body;       ///< triangles in the colour of the car's state; corners counter-clockwise as seen from outside
  Points dark;       ///< triangles of trucks, underframe, doors, openings and outlines
  double top = 0.0;  ///< height at which marks lie on the body [m]
  double top_half_width = 0.0;  ///< how wide they may be, to either side [m]
  double top_end = 0.0;         ///< how far from the middle they may be [m]
};

/// Returns the shape that belongs to the name of the car's block: tank_car, hopper, boxcar or locomotive; a plain box
/// for any other name. It reaches from the car's own floor to its own roof.
CarShape car_shape(const model::Car& car);

}  // namespace train_derail::scene
