/// \file
/// Colours of the scene and what they mean, for markers, overlay, panel and pages. Okabe and Ito's palette for what a
/// car is, ColorBrewer's diverging RdBu for forces; both can be told apart by the colour-blind (a test simulates the
/// three kinds). What a car is also stands on its roof as bars.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/incidents.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::scene {

/// Red, green and blue, each 0 to 255, sRGB.
struct Rgb {
  std::uint8_t r, g, b;
};

/// What a car is.
enum class Look : std::uint8_t {
  on_track,       ///< on the rails
  past_point,     ///< where rails never yield: past the point of derailment
  off_track,      ///< where rails never yield: off the track before the point
  at_point,       ///< where rails yield: derailed at the point of derailment
  by_lateral,     ///< where rails yield: derailed by lateral force
  by_torn_track,  ///< where rails yield: derailed on track that others had torn up
};
inline constexpr std::size_t kLooks = 6;

/// How a car that is something looks.
struct LookFacts {
  std::string_view words;  ///< for a legend
  Rgb colour;              ///< of its body
  int bars;                ///< across its roof
};

/// In the order of Look.
inline constexpr std::array<LookFacts, kLooks> kLookFacts{{{"on the track", {0, 114, 178}, 0},
                                                           {"past the point of derailment", {213, 94, 0}, 1},
                                                           {"off the track", {240, 228, 66}, 2},
                                                           {"derailed at the point", {213, 94, 0}, 1},
                                                           {"derailed by lateral force", {240, 228, 66}, 2},
                                                           {"derailed on torn track", {204, 121, 167}, 3}}};

/// Returns the facts of a look.
constexpr const LookFacts& facts_of(Look look) { return kLookFacts[static_cast<std::size_t>(look)]; }

/// Returns what a car is. `rails_yield`: the scenario's ground.on_track_law is `rails`.
constexpr Look look_of(bool rails_yield, bool past_pod, bool off_track, model::Cause cause) {
  if (!rails_yield) return past_pod ? Look::past_point : off_track ? Look::off_track : Look::on_track;
  switch (cause) {
    case model::Cause::none: return Look::on_track;
    case model::Cause::pod: return Look::at_point;
    case model::Cause::lateral: return Look::by_lateral;
    case model::Cause::torn_track: return Look::by_torn_track;
    case model::Cause::bad_track: return Look::at_point;
    case model::Cause::defect: return Look::at_point;
  }
  return Look::on_track;
}

/// How a car lies, by its tilt against the vertical.
enum class Lie : std::uint8_t { upright, leaning, on_side, inverted };
inline constexpr std::size_t kLies = 4;

/// In the order of Lie; the bounds are those of outcome::Posture.
inline constexpr std::array<LookFacts, kLies> kLieFacts{{{"upright", {0, 114, 178}, 0},
                                                         {"leaning", {86, 180, 233}, 1},
                                                         {"on the side", {240, 228, 66}, 2},
                                                         {"inverted", {213, 94, 0}, 3}}};

/// Returns the facts of a lie.
constexpr const LookFacts& facts_of(Lie lie) { return kLieFacts[static_cast<std::size_t>(lie)]; }

/// Returns how a car lies whose vertical axis is `tilt` off the vertical [rad].
constexpr Lie lie_of(double tilt) {
  if (tilt < outcome::kLeaning) return Lie::upright;
  if (tilt < outcome::kOver) return Lie::leaning;
  return tilt <= outcome::kInverted ? Lie::on_side : Lie::inverted;
}

/// What the colours of cars say.
enum class Colours : std::uint8_t {
  cause,    ///< a Look: why a car left the track
  posture,  ///< a Lie
};
/// In the order of Colours: what they are called outside.
inline constexpr std::array<std::string_view, 2> kColoursNames{"cause", "posture"};

/// Returns the name of what the colours say.
constexpr std::string_view to_string(Colours colours) { return kColoursNames[static_cast<std::size_t>(colours)]; }
/// Throws inputs::InputError, with this file (or node) and key, unless `name` is one of kColoursNames.
Colours colours_of(const std::string& where, const std::string& key, const std::string& name);

/// Colour of a broken coupler.
inline constexpr Rgb kBrokenColour{0, 0, 0};

/// Coupler forces are shown in classes: class k begins at kForceSteps[k - 1], class 0 at no force [N].
inline constexpr std::array<double, 5> kForceSteps{50.0 * inputs::kKip, 200.0 * inputs::kKip, 500.0 * inputs::kKip,
                                                   1000.0 * inputs::kKip, 2000.0 * inputs::kKip};
inline constexpr int kForceClasses = 5;

/// Returns the class of a coupler's axial force [N]: 1 to 5 in buff (force positive), -1 to -5 in draft, 0 below the
/// first step.
inline int force_class(double force) {
  int k = 0;
  for (const double step : kForceSteps) k += std::abs(force) >= step ? 1 : 0;
  return force < 0.0 ? -k : k;
}

/// Returns the colour of a class: blue in draft, light grey, red in buff; the stronger, the darker.
constexpr Rgb force_colour(int force_class) {
  constexpr std::array<Rgb, 11> kColours{{{5, 48, 97},
                                          {33, 102, 172},
                                          {67, 147, 195},
                                          {146, 197, 222},
                                          {209, 229, 240},
                                          {247, 247, 247},
                                          {253, 219, 199},
                                          {244, 165, 130},
                                          {214, 96, 77},
                                          {178, 24, 43},
                                          {103, 0, 31}}};
  return kColours[static_cast<std::size_t>(force_class + kForceClasses)];
}

}  // namespace train_derail::scene
