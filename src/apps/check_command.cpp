#include "check_command.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/model/step_limit.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::apps {

namespace {

/// How long the step may be, and by what, as a comment of YAML; "" where error control chooses it.
std::string step_text(const inputs::Scenario& s) {
  if (!s.solver.fixed_step) return "";
  const model::StepLimit strictest = model::step_limits(s).front();
  return fmt::format("# Step {:.4g} s; at most {:.4g} s, beyond which {} would make the motion unstable\n",
                     *s.solver.fixed_step, strictest.step_max, strictest.key);
}

void put(inputs::Coupler& coupler, const inputs::CouplerHold& hold) {
  coupler.pitch_limit = hold.pitch_limit;
  coupler.slip_height = hold.slip_height;
  coupler.vertical_hold = hold.vertical_hold;
  coupler.roll_limit = hold.roll_limit;
}

/// The scenario with the values that act in space and follow from others: from the name and weight of a block, from the
/// type of the couplers.
inputs::Scenario acting(inputs::Scenario s) {
  for (inputs::CarBlock& block : s.consist) {
    inputs::CarBlock one = block;
    one.count = 1;
    const model::Car car = model::expand({one}).front();
    block.centre_height = car.centre_height;
    block.floor_height = car.floor_height;
    block.roof_height = car.roof_height;
    block.underframe_height = car.underframe_height;
    block.underframe_width = car.underframe_width;
    block.truck_weight = car.truck_mass * inputs::kStandardGravity;
    block.roll_inertia = car.roll_inertia;
  }
  put(s.coupler, inputs::coupler_hold(s.coupler, "", ""));
  return s;
}

/// What holds the couplers next to blocks that have a type of their own, as comments of YAML, one for each pair of
/// types.
std::string holds_text(const inputs::Scenario& s) {
  std::set<std::pair<std::string, std::string>> pairs;
  const auto type = [&s](const inputs::CarBlock& block) {
    return block.coupler_type.empty() ? s.coupler.type : block.coupler_type;
  };
  const auto add = [&](const inputs::CarBlock& lead, const inputs::CarBlock& trail) {
    if (!lead.coupler_type.empty() || !trail.coupler_type.empty()) pairs.insert(std::minmax({type(lead), type(trail)}));
  };
  for (std::size_t i = 0; i < s.consist.size(); ++i) {
    if (s.consist[i].count > 1) add(s.consist[i], s.consist[i]);
    if (i > 0) add(s.consist[i - 1], s.consist[i]);
  }
  std::string text;
  for (const auto& [lead, trail] : pairs) {
    inputs::Scenario between = s;
    put(between.coupler, inputs::coupler_hold(s.coupler, lead, trail));
    std::string values;
    for (const char* name : {"pitch_limit", "slip_height", "vertical_hold", "roll_limit"}) {
      const inputs::KeyValue v = inputs::key_value(between, std::string("coupler.") + name);
      values += fmt::format(
          "{} {} {}", values.empty() ? "" : ",", name,
          v.value == ".inf"
              ? v.value
              : fmt::format("{:.6g} {}", inputs::from_si(inputs::to_si(v.value, v.unit), v.unit, v.shown_unit),
                            v.shown_unit));
    }
    text += fmt::format("# Coupler {} to {}:{}\n", lead, trail, values);
  }
  return text;
}

}  // namespace

std::string explained(const inputs::Scenario& scenario) {
  if (inputs::model_of(scenario) != inputs::Model::spatial) return inputs::to_yaml(scenario) + step_text(scenario);
  return "# A key behind a # is left out: its value, which follows from other keys, is the one that acts.\n" +
         inputs::to_yaml(scenario, acting(scenario)) + holds_text(scenario) + step_text(scenario);
}

}  // namespace train_derail::apps
