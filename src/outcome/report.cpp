#include "train_derail/outcome/report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace train_derail::outcome {

const char* to_string(Ended ended) {
  switch (ended) {
    case Ended::running: return "running";
    case Ended::at_rest: return "at_rest";
    case Ended::time_max: return "time_max";
    case Ended::integration_failed: return "integration_failed";
  }
  return "unknown";
}

std::string to_json(const Outcome& o) {
  nlohmann::ordered_json j;
  j["cars"] = o.cars;
  j["cars_past_pod"] = o.cars_past_pod;
  j["cars_off_track"] = o.cars_off_track;
  j["cars_derailed"] = o.cars_derailed;
  j["derailed_by"] = {
      {"pod", o.derailed_by.pod}, {"lateral", o.derailed_by.lateral}, {"torn_track", o.derailed_by.torn_track}};
  j["couplers_broken"] = o.couplers_broken;
  j["impacts"] = o.impacts.count;
  j["impact_speed_max"] = o.impacts.closing_normal_max;
  j["impact_force_peak"] = o.impacts.peak_force;
  j["impact_impulse_max"] = o.impacts.impulse_max;
  j["blockage_force"] = o.blockage_force;
  j["closing_speed_max"] = o.closing_speed_max.speed;
  j["closing_speed_normal"] = o.closing_speed_max.normal_speed;
  j["closing_cars"] = {o.closing_speed_max.car_a, o.closing_speed_max.car_b};
  j["closing_time"] = o.closing_speed_max.time;
  j["closing_place"] = {o.closing_speed_max.x, o.closing_speed_max.y};
  j["touches"] = o.touches;
  j["relative_speed_max"] = o.relative_speed_max.speed;
  j["relative_speed_coupler"] = o.relative_speed_max.coupler;
  j["relative_speed_time"] = o.relative_speed_max.time;
  j["centre_speed_max"] = o.centre_speed_max.speed;
  j["centre_speed_coupler"] = o.centre_speed_max.coupler;
  j["centre_speed_time"] = o.centre_speed_max.time;
  j["coupler_force_peak"] = o.coupler_force_peak();
  j["coupler_buff_peak"] = o.coupler_buff_peak.force;
  j["coupler_buff_peak_coupler"] = o.coupler_buff_peak.coupler;
  j["coupler_buff_peak_time"] = o.coupler_buff_peak.time;
  j["coupler_draft_peak"] = o.coupler_draft_peak.force;
  j["coupler_draft_peak_coupler"] = o.coupler_draft_peak.coupler;
  j["coupler_draft_peak_time"] = o.coupler_draft_peak.time;
  j["stop_time"] = o.stop_time;
  j["pile_up_length"] = o.pile_up.length;
  j["pile_up_width"] = o.pile_up.width;
  j["pile_up_area"] = o.pile_up.area;
  j["main_pile_cars"] = o.pile_up.main_cars;
  j["main_pile_length"] = o.pile_up.main_length;
  j["cars_across"] = o.pile_up.cars_across;
  j["groups"] = o.pile_up.groups;
  j["energy_initial"] = o.energy_initial;
  j["energy"] = {{"kinetic_translation", o.energy.kinetic_translation},
                 {"kinetic_rotation", o.energy.kinetic_rotation},
                 {"coupler_axial", o.energy.coupler_axial},
                 {"coupler_swing", o.energy.coupler_swing},
                 {"work_on_track", o.energy.work_on_track},
                 {"work_off_track", o.energy.work_off_track},
                 {"work_rails", o.energy.work_rails},
                 {"work_coupler_damping", o.energy.work_coupler_damping},
                 {"work_coupler_break", o.energy.work_coupler_break},
                 {"work_impact_normal", o.energy.work_impact_normal},
                 {"work_impact_friction", o.energy.work_impact_friction},
                 {"work_grade", o.energy.work_grade},
                 {"work_kicks", o.energy.work_kicks}};
  j["energy_residual"] = o.energy_residual;
  j["ended"] = to_string(o.ended);
  j["message"] = o.message;
  j["warnings"] = o.warnings;
  j["steps"] = o.solver.steps;
  j["rejected_steps"] = o.solver.rejected_steps;
  j["rhs_evaluations"] = o.solver.rhs_evaluations;
  j["jacobian_evaluations"] = o.solver.jacobian_evaluations;
  j["wall_time"] = o.wall_time;
  return j.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

namespace {

std::string speed(double v) { return fmt::format("{:10.2f} m/s   {:8.1f} mph", v, v / inputs::kMph); }
std::string force(double f) { return fmt::format("{:10.0f} kN    {:8.0f} kip", f / 1e3, f / inputs::kKip); }
std::string length(double l) { return fmt::format("{:10.1f} m     {:8.0f} ft", l, l / inputs::kFoot); }
std::string energy(double e) {
  return fmt::format("{:10.2f} MJ    {:8.2f} 10^6 ft-lbf", e / 1e6, e / (inputs::kPoundForce * inputs::kFoot) / 1e6);
}

}  // namespace

std::string to_table(const Outcome& o) {
  std::string t;
  const auto row = [&t](const char* name, const std::string& value, const std::string& note = "") {
    t += fmt::format("{:<34}{}{}{}\n", name, value, note.empty() ? "" : "   ", note);
  };
  const auto peak = [&](const char* name, const PeakForce& p) {
    row(name, force(p.force),
        p.coupler == 0 ? "" : fmt::format("coupler {}-{} at {:.2f} s", p.coupler, p.coupler + 1, p.time));
  };
  row("cars", fmt::format("{:10d}", o.cars));
  row("cars past the point of derailment", fmt::format("{:10d}", o.cars_past_pod));
  row("cars off the track", fmt::format("{:10d}", o.cars_off_track));
  if (o.derailed_by.pod + o.derailed_by.lateral + o.derailed_by.torn_track > 0) {
    row("cars derailed", fmt::format("{:10d}", o.cars_derailed),
        fmt::format("{} at the point of derailment, {} by lateral force, {} on torn track; {} groups",
                    o.derailed_by.pod, o.derailed_by.lateral, o.derailed_by.torn_track, o.pile_up.groups));
  }
  if (o.couplers_broken > 0) row("couplers broken", fmt::format("{:10d}", o.couplers_broken));
  const Closing& c = o.closing_speed_max;
  row("closing speed at touch, largest", speed(c.speed),
      c.car_a == 0 ? "no footprints touched"
                   : fmt::format("cars {} and {} at {:.2f} s, ({:.1f}, {:.1f}) m; normal {:.1f} mph", c.car_a, c.car_b,
                                 c.time, c.x, c.y, c.normal_speed / inputs::kMph));
  const auto relative = [&](const char* name, const RelativeSpeed& r) {
    row(name, speed(r.speed),
        r.coupler == 0 ? "" : fmt::format("coupler {}-{} at {:.2f} s", r.coupler, r.coupler + 1, r.time));
  };
  relative("relative speed of car ends, largest", o.relative_speed_max);
  relative("relative speed of centres, largest", o.centre_speed_max);
  peak("coupler buff force, peak", o.coupler_buff_peak);
  peak("coupler draft force, peak", o.coupler_draft_peak);
  if (o.impacts.count > 0) {
    row("impacts of car bodies", fmt::format("{:10d}", o.impacts.count));
    row("  fastest, normal", speed(o.impacts.closing_normal_max));
    row("  peak force", force(o.impacts.peak_force));
  }
  if (o.blockage_force > 0.0) row("blockage force, mean", force(o.blockage_force));
  row("pile-up length", length(o.pile_up.length));
  row("pile-up width", length(o.pile_up.width));
  row("  of it, the largest heap", length(o.pile_up.main_length), fmt::format("{} cars", o.pile_up.main_cars));
  row("site area",
      fmt::format("{:10.0f} m^2   {:8.0f} ft^2", o.pile_up.area, o.pile_up.area / (inputs::kFoot * inputs::kFoot)),
      fmt::format("{} cars at more than 60 degrees", o.pile_up.cars_across));
  row("energy at the start", energy(o.energy_initial));
  row("  spent by friction on the track", energy(o.energy.work_on_track));
  row("  spent by friction off the track", energy(o.energy.work_off_track));
  const auto spent = [&](const char* name, double work) {
    if (work != 0.0) row(name, energy(work));
  };
  spent("  spent sideways in the rails", o.energy.work_rails);
  spent("  spent by damping of couplers", o.energy.work_coupler_damping);
  spent("  let go by couplers that broke", o.energy.work_coupler_break);
  spent("  spent by crushing in impacts", o.energy.work_impact_normal);
  spent("  spent by friction in impacts", o.energy.work_impact_friction);
  spent("  spent uphill", o.energy.work_grade);
  spent("  given by kicks (negative)", o.energy.work_kicks);
  row("  left in motion", energy(o.energy.kinetic()));
  row("  left in couplers", energy(o.energy.coupler_axial + o.energy.coupler_swing));
  row("  unaccounted for, of the start", fmt::format("{:10.1e}", o.energy_residual));
  row("simulated time", fmt::format("{:10.2f} s", o.stop_time));
  row("ended", fmt::format("{:>10}", to_string(o.ended)), o.message);
  row("steps (rejected)", fmt::format("{:10d} ({})", o.solver.steps, o.solver.rejected_steps));
  row("right-hand sides", fmt::format("{:10d}", o.solver.rhs_evaluations));
  row("computing time", fmt::format("{:10.3f} s", o.wall_time));
  for (const std::string& warning : o.warnings) t += "warning: " + warning + "\n";
  return t;
}

}  // namespace train_derail::outcome
