#include "train_derail/model/step_limit.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "model/coupler_butts.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/model/brake_law.hpp"
#include "train_derail/model/contact_law.hpp"
#include "train_derail/model/draft_gear_law.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/rail_law.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/tie_law.hpp"
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
  double contact = 0.0;                                                 // force at a corner, of two cars [1/kg]
  double coupler_damping = 0.0, rail_damping = 0.0, tie_damping = 0.0;  // 1/s
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
    r.tie_damping = std::max(r.tie_damping, 2.0 * at_truck * tie_damping(s.ties, c.mass));
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
  double lightest = inputs::kInfinity, heaviest = 0.0;
  for (const inputs::CarBlock& b : s.consist) {
    lightest = std::min(lightest, b.weight);
    heaviest = std::max(heaviest, b.weight);
  }
  // Over the weight it is most for the lightest car, or for the heaviest.
  off *= std::max(friction_weight(g, lightest) / lightest, friction_weight(g, heaviest) / heaviest);
  if (s.ties.law == inputs::TieLaw::guided) off = std::max(off, s.ties.drag);
  if (s.brakes.law == inputs::BrakeLaw::friction) return std::max(off, g.on_track_friction);
  double share = 0.0;
  for (const inputs::CarBlock& b : s.consist) share = std::max(share, brake_ratio(s.brakes, b));
  return std::max(off, s.brakes.rolling_resistance + share);
}

double longest_step(const Scenario& s, double rate, double damping) {
  if (s.solver.method != inputs::Method::semi_implicit) return 1.0 / (rate + damping / 3.0);
  // Of h^2 rate^2 + 2 h damping = 4.
  return 4.0 / (damping + std::sqrt(damping * damping + 4.0 * rate * rate));
}

/// The same of a car in space, beside what it has in the plane. Forces act above or below the centre of mass, so that
/// the car rolls and pitches.
struct SpatialResponses {
  double pin = 0.0, swing = 0.0, pitch = 0.0, roll = 0.0, rails = 0.0, truck = 0.0, ground = 0.0, contact = 0.0;
  double coupler_damping = 0.0, rail_damping = 0.0, tie_damping = 0.0, truck_damping = 0.0, ground_damping = 0.0,
         contact_damping = 0.0;
};

SpatialResponses spatial_responses(const Scenario& s) {
  SpatialResponses r;
  const double sine = s.coupler.break_swing < 0.5 * M_PI ? std::sin(s.coupler.break_swing) : 1.0;
  const double gap = 0.5 * s.coupler.length;
  const std::vector<Car> cars = expand(s.consist);
  const auto square = [](double x) { return x * x; };
  struct Of {
    double pin, swing, pitch, corner;
  };
  const auto of = [&](const Car& c) {
    const double half = 0.5 * c.length, below = std::abs(s.coupler.height - c.centre_height);
    const double levers = square(half / gap + 1.0) + square(half / gap);
    const double across = std::max(c.roof_height - c.centre_height, c.centre_height - c.underframe_height);
    const double pitch = 2.0 / (c.mass * gap * gap) + levers / c.yaw_inertia;
    return Of{
        1.0 / c.mass + (square(half * sine) + below * below) / c.yaw_inertia + square(below * sine) / c.roll_inertia,
        pitch + 2.0 * square(below / gap) / c.roll_inertia, pitch,
        1.0 / c.mass + square(half) / c.yaw_inertia + (square(0.5 * c.width) + across * across) / c.roll_inertia};
  };
  double corner = 0.0, next_corner = 0.0;
  // A body that has lost its trucks is lighter, and gives way the most.
  std::vector<Car> bodies = cars;
  if (s.suspension.part_angle < M_PI) std::transform(cars.begin(), cars.end(), bodies.begin(), without_trucks);
  for (std::size_t i = 0; i < cars.size(); ++i) {
    const Car& c = cars[i];
    const Of here = of(bodies[i]);
    // Bounce and roll, or yaw and pitch, of a car on four sides of trucks.
    const double spread = 0.25 * c.truck_spacing * c.truck_spacing / c.yaw_inertia;
    const double truck = 4.0 * std::max({1.0 / c.mass, spread, square(s.suspension.half_base) / c.roll_inertia});
    const double rails = 2.0 * std::max(1.0 / c.mass + square(c.centre_height) / c.roll_inertia, spread);
    r.truck = std::max(r.truck, truck);
    r.truck_damping = std::max(r.truck_damping, truck * side_damping(s.suspension, c.mass));
    r.rails = std::max(r.rails, rails);
    r.rail_damping = std::max(r.rail_damping, rails * rail_damping(s.rails, c.mass));
    r.tie_damping = std::max(r.tie_damping, rails * tie_damping(s.ties, c.mass));
    // A body lies on a face: six points of it, and friction at each, which acts on the same car.
    const double ground = 6.0 * here.corner;
    r.ground = std::max(r.ground, ground);
    r.ground_damping = std::max(r.ground_damping, ground * ground_damping(s.terrain, c.mass));
    r.contact_damping = std::max(r.contact_damping, 4.0 * here.corner * friction_damping(s.contact, 0.5 * c.mass));
    const bool quickest = here.corner > corner;
    next_corner = std::max(next_corner, quickest ? corner : here.corner);
    corner = std::max(corner, here.corner);
    if (i + 1 == cars.size()) continue;
    const Car& d = cars[i + 1];
    const Of there = of(bodies[i + 1]);
    // Twice: a car has a coupler at either end.
    const double both = 2.0 * (here.pin + there.pin);
    r.pin = std::max(r.pin, both);
    r.coupler_damping = std::max(r.coupler_damping, both * coupler_damping(s.coupler, c.mass, d.mass));
    r.swing = std::max(r.swing, 2.0 * std::max(here.swing, there.swing));
    r.pitch = std::max(r.pitch, 2.0 * std::max(here.pitch, there.pitch));
    r.roll = std::max(r.roll, 2.0 * (1.0 / bodies[i].roll_inertia + 1.0 / bodies[i + 1].roll_inertia));
  }
  // A car in a pile-up is pushed by two others at a time.
  if (cars.size() > 1) r.contact = 2.0 * (corner + next_corner);
  return r;
}

/// Butts are the stiffer, the harder they are pressed. Nineteen of twenty pile-ups have less, whatever is changed
/// (docs/spatial_model.md, "Cliffs"); beyond it a car shakes within the tilt at which a butt bears, no more.
constexpr double kHardBuff = 3000.0 * inputs::kKip;

std::vector<StepLimit> in_order(std::vector<StepLimit> limits) {
  std::stable_sort(limits.begin(), limits.end(),
                   [](const StepLimit& a, const StepLimit& b) { return a.step_max < b.step_max; });
  return limits;
}

}  // namespace

std::vector<StepLimit> step_limits(const Scenario& s) {
  std::vector<StepLimit> limits;
  const auto add = [&](const char* key, double stiffness, double response, double damping) {
    const double rate = std::sqrt(stiffness * response);
    limits.push_back({key, rate, damping, longest_step(s, rate, damping)});
  };
  const bool gear = s.coupler.draft_gear_travel > 0.0 && s.coupler.draft_gear_stiffness > s.coupler.stiffness;
  const char* axial_key = gear ? "coupler.draft_gear_stiffness" : "coupler.stiffness";
  const double axial = gear ? s.coupler.draft_gear_stiffness : s.coupler.stiffness;
  if (inputs::model_of(s) == inputs::Model::spatial) {
    const SpatialResponses r = spatial_responses(s);
    add(axial_key, axial, r.pin, r.coupler_damping);
    add("coupler.swing_stiffness", s.coupler.swing_stiffness, r.swing, 0.0);
    add("coupler.pitch_stiffness", s.coupler.pitch_stiffness, r.pitch, 0.0);
    add("coupler.butt_height", butt_stiffness(s.coupler, kHardBuff), r.pitch, 0.0);
    add("coupler.roll_stiffness", s.coupler.roll_stiffness, r.roll, 0.0);
    add("rails.stiffness", s.rails.stiffness, r.rails, r.rail_damping);
    if (s.ties.law == inputs::TieLaw::guided) add("ties.stiffness", s.ties.stiffness, r.rails, r.tie_damping);
    add("suspension.stiffness", s.suspension.stiffness, r.truck, r.truck_damping);
    add("terrain.body_stiffness", s.terrain.body_stiffness, r.ground, r.ground_damping);
    if (s.contact.law != inputs::ContactLaw::none)
      add("contact.stiffness", s.contact.stiffness, r.contact, r.contact_damping);
    return in_order(limits);
  }
  const Responses r = responses(s);
  add(axial_key, axial, r.pin, r.coupler_damping);
  add("coupler.swing_stiffness", s.coupler.swing_stiffness, r.swing, 0.0);
  if (s.ground.on_track_law == inputs::OnTrackLaw::rails)
    add("rails.stiffness", s.rails.stiffness, r.rails, r.rail_damping);
  if (s.ties.law == inputs::TieLaw::guided) add("ties.stiffness", s.ties.stiffness, r.rails, r.tie_damping);
  // A car in a pile-up is pushed by two others at a time.
  if (s.contact.law != inputs::ContactLaw::none) add("contact.stiffness", s.contact.stiffness, 2.0 * r.contact, 0.0);
  add("ground.regularization_speed", 0.0, 0.0, largest_friction(s) * r.friction / s.ground.regularization_speed);
  return in_order(limits);
}

void check_step(const Scenario& s, const std::string& source) {
  if (!s.solver.fixed_step) return;
  const StepLimit strictest = step_limits(s).front();
  const double h = *s.solver.fixed_step;
  if (h <= strictest.step_max) return;
  throw inputs::InputError(
      source, "solver.fixed_step", fmt::format("{}", h),
      fmt::format("too long for {} with these cars: the motion would be unstable", strictest.key),
      fmt::format("(0, {:.2g}] s, or {}", 0.99 * strictest.step_max,
                  strictest.key == "ground.regularization_speed" ? "a higher speed" : "less stiffness"));
}

}  // namespace train_derail::model
