/// \file
/// The cars of a train.
#pragma once

#include <string>
#include <tuple>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::model {

/// One rigid car.
struct Car {
  std::string body;                ///< name of its block
  double mass;                     ///< M = W / g [kg]
  double weight;                   ///< W, on the rails [N]
  double yaw_inertia;              ///< I, about the vertical axis through the centre of mass [kg m^2]
  double length;                   ///< L, between the coupler pins [m]
  double truck_spacing;            ///< D, between the truck centres [m]
  double width;                    ///< of the footprint, whose length is L [m]
  double centre_height = 0.0;      ///< of the centre of mass above the rail [m]
  double floor_height = 0.0;       ///< of the underside of the body above the rail [m]
  double roof_height = 0.0;        ///< of its top [m]
  double underframe_height = 0.0;  ///< of what it lies on without trucks, along its length; at most floor_height [m]
  double underframe_width = 0.0;   ///< width of that [m]
  std::string coupler_type{};      ///< inputs::CarBlock::coupler_type
  bool cylinder = false;           ///< the body is a cylinder with domed heads, not a box
  double roll_inertia = 0.0;       ///< about the axis along the car through the centre of mass [kg m^2]
  double truck_mass = 0.0;         ///< of each of its two trucks, with wheels [kg]

  bool operator==(const Car& other) const {
    const auto all = [](const Car& c) {
      return std::tie(c.body, c.mass, c.weight, c.yaw_inertia, c.length, c.truck_spacing, c.width, c.centre_height,
                      c.floor_height, c.roof_height, c.underframe_height, c.underframe_width, c.roll_inertia,
                      c.cylinder, c.coupler_type, c.truck_mass);
    };
    return all(*this) == all(other);
  }
  bool operator!=(const Car& other) const { return !(*this == other); }
};

/// Height of the centre of mass of a truck above the rail: that of its axles, wheels of 36 in [m].
inline constexpr double kTruckHeight = 1.5 * inputs::kFoot;

/// What is left of a car that has lost both trucks: lighter by them, its centre of mass higher, its radii of gyration
/// those of the car.
Car without_trucks(const Car& car);

/// The consist's blocks, car by car from the first to derail back.
std::vector<Car> expand(const std::vector<inputs::CarBlock>& consist);

}  // namespace train_derail::model
