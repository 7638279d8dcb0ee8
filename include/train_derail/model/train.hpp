#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// One rigid car; SI.
struct Car {
  std::string body;      // name of its block
  double mass;           // M = W / g [kg]
  double weight;         // W [N]
  double yaw_inertia;    // I about the centre of mass [kg m^2]
  double length;         // L between coupler pins [m]
  double truck_spacing;  // D [m]
  double width;          // of the footprint; its length is L [m]
};

/// The consist's blocks, car by car from the first to derail back.
std::vector<Car> expand(const std::vector<inputs::CarBlock>& consist);

}  // namespace train_derail::model
