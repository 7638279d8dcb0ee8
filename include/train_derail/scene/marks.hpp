/// \file
/// Marks on cars and stars where cars touch: sizes that RViz and the page of a run share. All lengths are in m.
#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "train_derail/model/train.hpp"
#include "train_derail/scene/palette.hpp"

namespace train_derail::scene {

/// Colours of what is dark on a car, and of a star.
inline constexpr Rgb kInk{18, 18, 20}, kStarRim{255, 235, 120};

/// Height of the number on a roof.
inline constexpr double kNumberHeight = 1.7;
/// Plate that it stands on: length, width.
inline constexpr double kPlateLength = 3.0 * kNumberHeight, kPlateWidth = 1.4 * kNumberHeight;
/// Where a coupler is broken the roof's end is black: this part of the half of it.
inline constexpr double kBrokenEnd = 0.12;
/// Bars across a roof that say what the car is: width, distance from middle to middle.
inline constexpr double kBarWidth = 0.5, kBarSpacing = 1.0;
/// Arrow of a coupler's force on the roof: its length in class k is the first and k times the second.
inline constexpr double kArrowLengthMin = 1.8, kArrowLengthStep = 0.5;
/// Width and height of that arrow.
inline constexpr double kArrowWidth = 1.3, kArrowHeight = 0.4;
/// Its outline on the page: along, across, in lengths and widths. RViz has arrows of its own.
inline constexpr std::array<std::pair<double, double>, 7> kArrowOutline{
    {{0.5, 0.0}, {-0.05, 0.5}, {-0.05, 0.2}, {-0.5, 0.2}, {-0.5, -0.2}, {-0.05, -0.2}, {-0.05, -0.5}}};
/// Half the width of a drawbar; its thickness.
inline constexpr double kDrawbar = 0.35, kDrawbarThickness = 0.4;
/// Height of a drawbar above the rail head.
inline constexpr double kDrawbarHeight = 0.9;
/// In the plane bodies may lie across each other where nothing keeps them apart: small steps in height, by the number
/// of the car, keep roofs from flickering.
inline constexpr int kLayers = 16;
/// Returns the height of such a step. In three dimensions there is none: cars are drawn where they are.
inline double layer_step(inputs::Model model) { return model == inputs::Model::spatial ? 0.0 : 0.003; }
/// Height of arrows and stars above roofs.
inline constexpr double kAboveRoof = 0.96;
/// Returns the height at which arrows lie above the roof of a car.
inline double above_roof(const model::Car& car) { return car.roof_height + kAboveRoof; }
/// Returns the height at which stars lie above the cars of a train.
inline double above_roofs(const std::vector<model::Car>& cars) {
  double height = 0.0;
  for (const model::Car& car : cars) height = std::max(height, above_roof(car));
  return height + 0.6;
}

/// How long a star is shown where two cars come to touch, simulated [s].
inline constexpr double kFlashTime = 1.0;
/// A star: its rays, the radius between two of them in radii, and what it has lost of its radius when it goes.
inline constexpr int kStarRays = 8;
inline constexpr double kStarInner = 0.4, kStarFade = 0.7;
/// Returns the radius of a star where cars touch with this closing speed [m/s].
constexpr double star_radius(double speed) { return std::clamp(0.5 * speed, 1.5, 8.0); }

/// How a line of a chart is drawn: its colour, and its dashes and gaps in pixels (none: solid).
struct Line {
  Rgb colour;
  int dash = 0, gap = 0;
};
/// Largest forces in buff and in draft; a first and a second coupler.
inline constexpr Line kBuffLine{force_colour(4)}, kDraftLine{force_colour(-4), 5, 2}, kFirstLine{{0, 114, 178}},
    kSecondLine{{213, 94, 0}, 5, 2};
/// The moment that is shown, on charts and on the time line; and the frame round the car that is chosen.
inline constexpr Rgb kNow{230, 159, 0}, kChosen{255, 255, 255};
/// Behind everything.
inline constexpr Rgb kSky{174, 189, 202};

}  // namespace train_derail::scene
