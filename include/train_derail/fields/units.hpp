/// \file
/// Units of the output fields: SI unit, unit that people read, and digits in tables (see Unit).
#pragma once

#include "train_derail/fields/field.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::fields {

/// Flags and texts.
inline constexpr Unit kNoUnit{"", ""};
/// Pure numbers and counts.
inline constexpr Unit kRatio{"1", ""};
inline constexpr Unit kCount{"1", ""};
inline constexpr Unit kCars{"1", "cars"};
inline constexpr Unit kTrucks{"1", "trucks"};
inline constexpr Unit kCouplers{"1", "couplers"};
inline constexpr Unit kImpacts{"1", "impacts"};
inline constexpr Unit kGroups{"1", "groups"};
/// Mean of a count.
inline constexpr Unit kMeanCars{"1", "cars", 1.0, 1, "", 1.0, 1};
/// Share that should be next to nothing.
inline constexpr Unit kResidual{"1", "", 1.0, 0, "", 1.0, 1, true};
/// Numbers with a unit.
inline constexpr Unit kTime{"s", "s", 1.0, 2, "s", 1.0, 2};
inline constexpr Unit kStep{"s", "s", 1.0, 5, "ms", 1e-3, 3};
inline constexpr Unit kComputingTime{"s", "s", 1.0, 3, "s", 1.0, 3};
inline constexpr Unit kLength{"m", "ft", inputs::kFoot, 0, "m", 1.0, 1};
inline constexpr Unit kHeight{"m", "ft", inputs::kFoot, 1, "m", 1.0, 2};
inline constexpr Unit kGap{"m", "in", inputs::kFoot / 12.0, 2, "mm", 1e-3, 0};
inline constexpr Unit kArea{"m2", "ft2", inputs::kFoot* inputs::kFoot, 0, "m2", 1.0, 0};
inline constexpr Unit kSpeed{"m/s", "mph", inputs::kMph, 1, "m/s", 1.0, 2};
inline constexpr Unit kAngle{"rad", "deg", inputs::kDegree, 1, "rad", 1.0, 3};
inline constexpr Unit kYawRate{"rad/s", "deg/s", inputs::kDegree, 1, "rad/s", 1.0, 3};
inline constexpr Unit kForce{"N", "kip", inputs::kKip, 0, "kN", 1e3, 0};
inline constexpr Unit kImpulse{"N s", "kip s", inputs::kKip, 0, "kN s", 1e3, 0};
inline constexpr Unit kMoment{"N m", "kip ft", inputs::kKip* inputs::kFoot, 0, "kN m", 1e3, 0};
inline constexpr Unit kEnergy{"J", "10^6 ft-lbf", 1e6 * inputs::kPoundForce* inputs::kFoot, 2, "MJ", 1e6, 2};

}  // namespace train_derail::fields
