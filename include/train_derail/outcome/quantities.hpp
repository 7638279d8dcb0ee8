// The numbers of an outcome by name: what tables, studies and comparisons are made of.
#pragma once

#include <array>
#include <string_view>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::outcome {

struct Quantity {
  std::string_view name;        // as in JSON
  std::string_view unit;        // SI
  std::string_view shown_unit;  // the one people read
  double per_shown;             // SI value of one shown unit
  std::string_view title;
  double (*value)(const Outcome&);
};

inline constexpr std::array<Quantity, 12> kQuantities{{
    {"cars_past_pod", "1", "cars", 1.0, "cars past the point of derailment", [](const Outcome& o) { return double(o.cars_past_pod); }},
    {"cars_off_track", "1", "cars", 1.0, "cars off the track", [](const Outcome& o) { return double(o.cars_off_track); }},
    {"closing_speed_max", "m/s", "mph", inputs::kMph, "largest closing speed at touch", [](const Outcome& o) { return o.closing_speed_max.speed; }},
    {"relative_speed_max", "m/s", "mph", inputs::kMph, "largest relative speed of car ends", [](const Outcome& o) { return o.relative_speed_max.speed; }},
    {"centre_speed_max", "m/s", "mph", inputs::kMph, "largest relative speed of car centres", [](const Outcome& o) { return o.centre_speed_max.speed; }},
    {"coupler_force_peak", "N", "kip", inputs::kKip, "peak coupler force", [](const Outcome& o) { return o.coupler_force_peak(); }},
    {"coupler_buff_peak", "N", "kip", inputs::kKip, "peak buff force", [](const Outcome& o) { return o.coupler_buff_peak.force; }},
    {"coupler_draft_peak", "N", "kip", inputs::kKip, "peak draft force", [](const Outcome& o) { return o.coupler_draft_peak.force; }},
    {"stop_time", "s", "s", 1.0, "time to rest", [](const Outcome& o) { return o.stop_time; }},
    {"pile_up_length", "m", "ft", inputs::kFoot, "pile-up length", [](const Outcome& o) { return o.pile_up.length; }},
    {"pile_up_width", "m", "ft", inputs::kFoot, "pile-up width", [](const Outcome& o) { return o.pile_up.width; }},
    {"energy_residual", "1", "", 1.0, "energy unaccounted for", [](const Outcome& o) { return o.energy_residual; }},
}};

}  // namespace train_derail::outcome
