/// \file
/// Marks on cars and stars where cars touch: sizes that RViz and the page of a run share. All lengths are in m.
#pragma once

#include <algorithm>

#include "train_derail/scene/car_shape.hpp"
#include "train_derail/scene/palette.hpp"

namespace train_derail::scene {

/// Colours of what is dark on a car, and of a star.
inline constexpr Rgb kInk{18, 18, 20}, kStarRim{255, 235, 120};

/// Height of the number on a roof.
inline constexpr double kNumberHeight = 1.7;
/// Bars across a roof that say what the car is: width, distance from middle to middle.
inline constexpr double kBarWidth = 0.5, kBarSpacing = 1.0;
/// Arrow of a coupler's force on the roof: its length in class k is the first and k times the second.
inline constexpr double kArrowLengthMin = 1.8, kArrowLengthStep = 0.5;
/// Width and height of that arrow.
inline constexpr double kArrowWidth = 1.3, kArrowHeight = 0.4;
/// Half the width of a drawbar.
inline constexpr double kDrawbar = 0.35;
/// Height of a drawbar above the rail head.
inline constexpr double kDrawbarHeight = 0.9;
/// Bodies may lie across each other where nothing keeps them apart: small steps in height keep roofs from flickering.
inline constexpr int kLayers = 32;
/// Height of such a step.
inline constexpr double kLayerStep = 0.03;
/// Height at which marks lie above all roofs.
inline constexpr double kAboveRoofs = kRoofHeight + kLayerStep * kLayers;

/// How long a star is shown where two cars come to touch, simulated [s].
inline constexpr double kFlashTime = 1.0;
/// Returns the radius of a star where cars touch with this closing speed [m/s].
constexpr double star_radius(double speed) { return std::clamp(0.5 * speed, 1.5, 8.0); }

}  // namespace train_derail::scene
