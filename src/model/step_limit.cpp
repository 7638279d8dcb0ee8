#include "train_derail/model/step_limit.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/rail_law.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

namespace {

using inputs::Scenario;

/// Largest values over the train of what a force at some place of a car does to the velocity there.
struct Responses {
  double pin = 0.0;    // axial force at a coupler pin, two neighbours together [1/kg]
  double swing = 0.0;  // moment at a coupler's ends, both ends together [1/(kg m^2)]
  double rails = 0.0;  // lateral force at a truck [1/kg], times two trucks
  double friction =
      0.0;  // of a car's weight on both trucks, against their velocity [N/kg]: g, or more where it turns the car
  double contact = 0.0;                              // force at a corner, of two cars [1/kg]
  double coupler_damping = 0.0, rail_damping = 0.0;  // 1/s
};

Responses responses(const Scenario& s) {
  Responses r;
  // A coupler turns no farther than it breaks, and shortens by no more than half.
  const double sine = s.coupler.break_swing < 0.5 * M_PI ? std::sin(s.coupler.break_swing) : 1.0;
  const double gap = 0.5 * s.coupler.length;
  const auto pin = [&](const Car& c) {
    const double arm = 0.5 * c.length * sine;
    return 1.0 / c.mass + arm * arm / c.yaw_inertia;
  };
  const auto swing = [&](const Car& c) {
    const double lever = 0.5 * c.length / gap;
    return 2.0 / (c.mass * gap * gap) + ((lever + 1.0) * (lever + 1.0) + lever * lever) / c.yaw_inertia;
  };
  const std::vector<Car> cars = expand(s.consist);
  double corner = 0.0, heaviest_corner = 0.0;
  for (std::size_t i = 0; i < cars.size(); ++i) {
    const Car& c = cars[i];
    const double spread = 0.25 * c.truck_spacing * c.truck_spacing / c.yaw_inertia;
    const double at_truck = std::max(1.0 / c.mass, spread);  // bounce, yaw
    r.rails = std::max(r.rails, 2.0 * at_truck);
    r.rail_damping = std::max(r.rail_damping, 2.0 * at_truck * rail_damping(s.rails, c.mass));
    r.friction = std::max(r.friction, c.weight * at_truck);
    const double diagonal = 0.25 * (c.length * c.length + c.width * c.width);
    const double here = 1.0 / c.mass + diagonal / c.yaw_inertia;
    if (here > corner) heaviest_corner = corner, corner = here;
    else heaviest_corner = std::max(heaviest_corner, here);
    if (i + 1 == cars.size()) continue;
    // Twice: a car has a coupler at either end.
    const double both = 2.0 * (pin(c) + pin(cars[i + 1]));
    r.pin = std::max(r.pin, both);
    r.swing = std::max(r.swing, 2.0 * std::max(swing(c), swing(cars[i + 1])));
    r.coupler_damping = std::max(r.coupler_damping, both * coupler_damping(s.coupler, c.mass, cars[i + 1].mass));
  }
  r.contact = cars.size() > 1 ? corner + heaviest_corner : 0.0;
  return r;
}

double largest_friction(const Scenario& s) {
  const inputs::Ground& g = s.ground;
  double off = g.off_track_law == inputs::OffTrackLaw::by_slip ? std::max(g.in_line_friction, g.broadside_friction)
                                                               : g.off_track_friction;
  for (const inputs::GroundPatch& p : g.patches) off *= std::max(p.factor, 1.0);
  if (s.brakes.law == inputs::BrakeLaw::friction) return std::max(off, g.on_track_friction);
  double share = 0.0;
  for (const inputs::CarBlock& b : s.consist) share = std::max(share, b.brake_share);
  return std::max(off, s.brakes.rolling_resistance + share * s.brakes.force);
}

double longest_step(const Scenario& s, double rate, double damping) {
  if (s.solver.method != inputs::Method::semi_implicit) return 1.0 / (rate + damping / 3.0);
  // Of h^2 rate^2 + 2 h damping = 4.
  return 4.0 / (damping + std::sqrt(damping * damping + 4.0 * rate * rate));
}

}  // namespace

std::vector<StepLimit> step_limits(const Scenario& s) {
  const Responses r = responses(s);
  std::vector<StepLimit> limits;
  const auto add = [&](const char* key, double stiffness, double response, double damping) {
    const double rate = std::sqrt(stiffness * response);
    limits.push_back({key, rate, damping, longest_step(s, rate, damping)});
  };
  const bool gear = s.coupler.draft_gear_travel > 0.0 && s.coupler.draft_gear_stiffness > s.coupler.stiffness;
  add(gear ? "coupler.draft_gear_stiffness" : "coupler.stiffness",
      gear ? s.coupler.draft_gear_stiffness : s.coupler.stiffness, r.pin, r.coupler_damping);
  add("coupler.swing_stiffness", s.coupler.swing_stiffness, r.swing, 0.0);
  if (s.ground.on_track_law == inputs::OnTrackLaw::rails)
    add("rails.stiffness", s.rails.stiffness, r.rails, r.rail_damping);
  // A car in a pile-up is pushed by two others at a time.
  if (s.contact.law != inputs::ContactLaw::none) add("contact.stiffness", s.contact.stiffness, 2.0 * r.contact, 0.0);
  add("ground.regularization_speed", 0.0, 0.0, largest_friction(s) * r.friction / s.ground.regularization_speed);
  std::stable_sort(limits.begin(), limits.end(),
                   [](const StepLimit& a, const StepLimit& b) { return a.step_max < b.step_max; });
  return limits;
}

void check_step(const Scenario& s) {
  if (!s.solver.fixed_step) return;
  const StepLimit strictest = step_limits(s).front();
  const double h = *s.solver.fixed_step;
  if (h <= strictest.step_max) return;
  throw inputs::InputError(
      "scenario", "solver.fixed_step", fmt::format("{}", h),
      fmt::format("too long for {} with these cars: the motion would be unstable", strictest.key),
      fmt::format("(0, {:.2g}] s, or {}", 0.99 * strictest.step_max,
                  strictest.key == "ground.regularization_speed" ? "a higher speed" : "less stiffness"));
}

}  // namespace train_derail::model
