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

inline constexpr std::array<Quantity, 23> kQuantities{{
    {"cars_past_pod", "1", "cars", 1.0, "cars past the point of derailment",
     [](const Outcome& o) { return double(o.cars_past_pod); }},
    {"cars_off_track", "1", "cars", 1.0, "cars off the track",
     [](const Outcome& o) { return double(o.cars_off_track); }},
    {"closing_speed_max", "m/s", "mph", inputs::kMph, "largest closing speed at touch",
     [](const Outcome& o) { return o.closing_speed_max.speed; }},
    {"relative_speed_max", "m/s", "mph", inputs::kMph, "largest relative speed of car ends",
     [](const Outcome& o) { return o.relative_speed_max.speed; }},
    {"centre_speed_max", "m/s", "mph", inputs::kMph, "largest relative speed of car centres",
     [](const Outcome& o) { return o.centre_speed_max.speed; }},
    {"coupler_force_peak", "N", "kip", inputs::kKip, "peak coupler force",
     [](const Outcome& o) { return o.coupler_force_peak(); }},
    {"coupler_buff_peak", "N", "kip", inputs::kKip, "peak buff force",
     [](const Outcome& o) { return o.coupler_buff_peak.force; }},
    {"coupler_draft_peak", "N", "kip", inputs::kKip, "peak draft force",
     [](const Outcome& o) { return o.coupler_draft_peak.force; }},
    {"stop_time", "s", "s", 1.0, "time to rest", [](const Outcome& o) { return o.stop_time; }},
    {"pile_up_length", "m", "ft", inputs::kFoot, "pile-up length", [](const Outcome& o) { return o.pile_up.length; }},
    {"pile_up_width", "m", "ft", inputs::kFoot, "pile-up width", [](const Outcome& o) { return o.pile_up.width; }},
    {"cars_derailed", "1", "cars", 1.0, "cars derailed", [](const Outcome& o) { return double(o.cars_derailed); }},
    {"couplers_broken", "1", "couplers", 1.0, "couplers broken",
     [](const Outcome& o) { return double(o.couplers_broken); }},
    {"impacts", "1", "impacts", 1.0, "impacts of car bodies", [](const Outcome& o) { return double(o.impacts.count); }},
    {"impact_speed_max", "m/s", "mph", inputs::kMph, "largest normal closing speed of an impact",
     [](const Outcome& o) { return o.impacts.closing_normal_max; }},
    {"impact_force_peak", "N", "kip", inputs::kKip, "peak force of an impact",
     [](const Outcome& o) { return o.impacts.peak_force; }},
    {"pile_up_area", "m2", "ft2", inputs::kFoot* inputs::kFoot, "area of the site",
     [](const Outcome& o) { return o.pile_up.area; }},
    {"main_pile_cars", "1", "cars", 1.0, "cars in the largest heap",
     [](const Outcome& o) { return double(o.pile_up.main_cars); }},
    {"main_pile_length", "m", "ft", inputs::kFoot, "length of the largest heap",
     [](const Outcome& o) { return o.pile_up.main_length; }},
    {"cars_across", "1", "cars", 1.0, "cars at more than 60 degrees",
     [](const Outcome& o) { return double(o.pile_up.cars_across); }},
    {"groups", "1", "groups", 1.0, "separate groups of derailed cars",
     [](const Outcome& o) { return double(o.pile_up.groups); }},
    {"blockage_force", "N", "kip", inputs::kKip, "mean blockage force",
     [](const Outcome& o) { return o.blockage_force; }},
    {"energy_residual", "1", "", 1.0, "energy unaccounted for", [](const Outcome& o) { return o.energy_residual; }},
}};

}  // namespace train_derail::outcome
