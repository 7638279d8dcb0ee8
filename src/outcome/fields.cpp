#include "train_derail/outcome/fields.hpp"

#include <cmath>

#include <fmt/format.h>

#include "train_derail/fields/units.hpp"
#include "train_derail/model/incidents.hpp"
#include "train_derail/outcome/quantities.hpp"

namespace train_derail::outcome {

using namespace fields;

namespace {

std::string at_coupler(int coupler, double time) {
  return coupler == 0 ? "" : fmt::format("coupler {}-{} at {:.2f} s", coupler, coupler + 1, time);
}

std::string at_touch(const Outcome& o) {
  const FirstTouch& c = o.closing_speed_max;
  if (c.car_a == 0) return "no footprints touched";
  return fmt::format("cars {} and {} at {:.2f} s, ({:.1f}, {:.1f}) m; normal {}", c.car_a, c.car_b, c.time, c.x, c.y,
                     in_shown(c.speed_normal, kSpeed));
}

std::string by_cause(const Outcome& o) {
  const DerailedBy& by = o.derailed_by;
  if (by.pod + by.lateral + by.torn_track + by.bad_track + by.defect == 0) return "";
  std::string note;
  const auto add = [&note](int cars, model::Cause cause) {
    note += fmt::format("{}{} {}", note.empty() ? "" : ", ", cars, model::kCauseTexts[static_cast<std::size_t>(cause)]);
  };
  const bool others = by.bad_track + by.defect > 0;
  if (!others || by.pod > 0) add(by.pod, model::Cause::pod);
  if (by.bad_track > 0) add(by.bad_track, model::Cause::bad_track);
  if (by.defect > 0) add(by.defect, model::Cause::defect);
  add(by.lateral, model::Cause::lateral);
  add(by.torn_track, model::Cause::torn_track);
  return note;
}

bool has_impacts(const Outcome& o) { return o.impacts.count > 0; }
bool has_broken(const Outcome& o) { return o.couplers_broken > 0; }
bool has_posture(const Outcome& o) { return o.posture.cars() > 0; }
bool has_tie_runs(const Outcome& o) { return o.on_ties.trucks > 0; }
bool has_released(const Outcome& o) { return o.released.expected > 0.0; }
bool has_blockage(const Outcome& o) { return o.blockage_force > 0.0; }
/// A car that stands in line just past the point, as the first one does when a run begins, is no heap.
bool has_pile_up(const Outcome& o) { return o.cars_off_track > 0 || o.cars_derailed > 1; }

void add_counts(Fields<Outcome>& f) {
  f.add(
       "cars", kCars, "cars", "Number of cars in the train.", [](auto& o) -> auto& { return o.cars; })
      .as_headline();
  f.add(
       "cars_past_pod", kCars, "cars past the point of derailment",
       "Cars whose centre of mass has passed the point of derailment; those that were ahead of it at the start do not "
       "count.",
       [](auto& o) -> auto& { return o.cars_past_pod; })
      .in_studies()
      .as_headline();
  f.add(
       "cars_off_track", kCars, "cars off the track",
       "Cars of which a truck centre has been farther from the centre line than outcome.off_track_threshold.",
       [](auto& o) -> auto& { return o.cars_off_track; })
      .in_studies()
      .as_headline();
  f.add(
       "cars_derailed", kCars, "cars derailed",
       "Cars with a truck off the rails; where rails never yield: cars_past_pod.",
       [](auto& o) -> auto& { return o.cars_derailed; })
      .noting(by_cause)
      .in_studies()
      .as_leading_headline();
  f.add(
      "derailed_by_pod", kCars, "",
      "Derailed cars whose first truck left the rails at the point of derailment; only for rails that yield.",
      [](auto& o) -> auto& { return o.derailed_by.pod; });
  f.add(
      "derailed_by_lateral", kCars, "",
      "Derailed cars whose first truck left the rails by lateral force; only for rails that yield.",
      [](auto& o) -> auto& { return o.derailed_by.lateral; });
  f.add(
      "derailed_by_torn_track", kCars, "",
      "Derailed cars whose first truck left the rails on track that another truck had torn up; only for rails that "
      "yield.",
      [](auto& o) -> auto& { return o.derailed_by.torn_track; });
  f.add(
      "derailed_by_bad_track", kCars, "",
      "Derailed cars whose first truck left the rails on bad track or at a switch; only for rails that yield.",
      [](auto& o) -> auto& { return o.derailed_by.bad_track; });
  f.add(
      "derailed_by_defect", kCars, "",
      "Derailed cars whose first truck left the rails by a defect of its own; only for rails that yield.",
      [](auto& o) -> auto& { return o.derailed_by.defect; });
}

void add_ties(Fields<Outcome>& f) {
  f.add(
       "trucks_on_ties", kTrucks, "trucks that ran on the ties",
       "Trucks that ran on the ties, off the rails but still guided (ties.law).",
       [](auto& o) -> auto& { return o.on_ties.trucks; })
      .shown_when(has_tie_runs)
      .in_studies()
      .as_headline();
  f.add(
       "ties_distance_max", kLength, "longest run on the ties",
       "Longest distance that a truck ran on the ties, along the track.",
       [](auto& o) -> auto& { return o.on_ties.distance_max; })
      .shown_when(has_tie_runs)
      .in_studies()
      .as_headline();
  f.add(
       "obstacles_struck", kCount, "obstacles struck", "Obstacles that trucks on the ties met, each truck by itself.",
       [](auto& o) -> auto& { return o.on_ties.obstacles; })
      .shown_when(has_tie_runs)
      .in_studies();
  f.add(
       "trucks_thrown_off", kTrucks, "trucks thrown off the track bed",
       "Trucks on the ties that an obstacle or their drift took off the track bed.",
       [](auto& o) -> auto& { return o.on_ties.thrown_off; })
      .shown_when(has_tie_runs)
      .in_studies()
      .as_headline();
}

void add_released(Fields<Outcome>& f) {
  f.add(
       "cars_released", kCars, "tank cars that released",
       "Tank cars that released what they hold, by release.* and the seed.",
       [](auto& o) -> auto& { return o.released.cars; })
      .shown_when(has_released)
      .in_studies()
      .as_headline();
  f.add(
       "cars_released_expected", kMeanCars, "tank cars that released, expected",
       "Mean of cars_released over all seeds, for these impacts.", [](auto& o) -> auto& { return o.released.expected; })
      .shown_when(has_released)
      .in_studies();
}

void add_closing(Fields<Outcome>& f) {
  f.add(
       "closing_speed_max", kSpeed, "largest closing speed at touch",
       "Largest relative speed of two bodies, at the point where their footprints begin to touch.",
       [](auto& o) -> auto& { return o.closing_speed_max.speed; })
      .noting(at_touch)
      .in_studies()
      .as_leading_headline();
  f.add(
      "closing_speed_normal", kSpeed, "", "The part of closing_speed_max that closes the gap between the two bodies.",
      [](auto& o) -> auto& { return o.closing_speed_max.speed_normal; });
  f.add(
      "closing_car_a", kCount, "",
      "First car of the touch with closing_speed_max; closing_car_a < closing_car_b; 0: none.",
      [](auto& o) -> auto& { return o.closing_speed_max.car_a; });
  f.add(
      "closing_car_b", kCount, "", "The other car of that touch.",
      [](auto& o) -> auto& { return o.closing_speed_max.car_b; });
  f.add(
      "closing_time", kTime, "", "Simulated time of that touch.",
      [](auto& o) -> auto& { return o.closing_speed_max.time; });
  f.add(
      "closing_x", kLength, "", "Point of that touch, world frame, x.",
      [](auto& o) -> auto& { return o.closing_speed_max.x; });
  f.add(
      "closing_y", kLength, "", "Point of that touch, world frame, y.",
      [](auto& o) -> auto& { return o.closing_speed_max.y; });
  f.add(
      "touches", kCount, "", "Touches of two footprints; a pair counts again after it has parted.",
      [](auto& o) -> auto& { return o.touches; });
  f.add(
       "relative_speed_max", kSpeed, "largest relative speed of car ends",
       "Largest relative speed of the facing pins of two neighbouring cars whose coupler is not broken.",
       [](auto& o) -> auto& { return o.relative_speed_max.speed; })
      .noting([](const Outcome& o) { return at_coupler(o.relative_speed_max.coupler, o.relative_speed_max.time); })
      .in_studies();
  f.add(
      "relative_speed_coupler", kCount, "", "Coupler of relative_speed_max, between cars i and i + 1; 0: none.",
      [](auto& o) -> auto& { return o.relative_speed_max.coupler; });
  f.add(
      "relative_speed_time", kTime, "", "Simulated time of relative_speed_max.",
      [](auto& o) -> auto& { return o.relative_speed_max.time; });
  f.add(
       "centre_speed_max", kSpeed, "largest relative speed of car centres",
       "Largest relative speed of the centres of mass of two neighbouring cars whose coupler is not broken.",
       [](auto& o) -> auto& { return o.centre_speed_max.speed; })
      .noting([](const Outcome& o) { return at_coupler(o.centre_speed_max.coupler, o.centre_speed_max.time); })
      .in_studies();
  f.add(
      "centre_speed_coupler", kCount, "", "Coupler of centre_speed_max, between cars i and i + 1; 0: none.",
      [](auto& o) -> auto& { return o.centre_speed_max.coupler; });
  f.add(
      "centre_speed_time", kTime, "", "Simulated time of centre_speed_max.",
      [](auto& o) -> auto& { return o.centre_speed_max.time; });
}

void add_couplers(Fields<Outcome>& f) {
  f.derive("coupler_force_peak", kForce, "peak coupler force",
           "The larger of coupler_buff_peak and coupler_draft_peak.",
           [](const Outcome& o) { return o.coupler_force_peak(); })
      .in_studies();
  f.add(
       "coupler_buff_peak", kForce, "peak buff force", "Largest compression of any coupler, a magnitude.",
       [](auto& o) -> auto& { return o.coupler_buff_peak.force; })
      .noting([](const Outcome& o) { return at_coupler(o.coupler_buff_peak.coupler, o.coupler_buff_peak.time); })
      .in_studies()
      .as_leading_headline();
  f.add(
      "coupler_buff_peak_coupler", kCount, "", "Coupler of coupler_buff_peak, between cars i and i + 1; 0: none.",
      [](auto& o) -> auto& { return o.coupler_buff_peak.coupler; });
  f.add(
      "coupler_buff_peak_time", kTime, "", "Simulated time of coupler_buff_peak.",
      [](auto& o) -> auto& { return o.coupler_buff_peak.time; });
  f.add(
       "coupler_draft_peak", kForce, "peak draft force", "Largest tension of any coupler, a magnitude.",
       [](auto& o) -> auto& { return o.coupler_draft_peak.force; })
      .noting([](const Outcome& o) { return at_coupler(o.coupler_draft_peak.coupler, o.coupler_draft_peak.time); })
      .in_studies()
      .as_leading_headline();
  f.add(
      "coupler_draft_peak_coupler", kCount, "", "Coupler of coupler_draft_peak, between cars i and i + 1; 0: none.",
      [](auto& o) -> auto& { return o.coupler_draft_peak.coupler; });
  f.add(
      "coupler_draft_peak_time", kTime, "", "Simulated time of coupler_draft_peak.",
      [](auto& o) -> auto& { return o.coupler_draft_peak.time; });
  f.add(
       "couplers_broken", kCouplers, "couplers broken",
       "Couplers that broke, by draft force, swing or moment; in space also by slipping, vertical force or twist.",
       [](auto& o) -> auto& { return o.couplers_broken; })
      .shown_when(has_broken)
      .in_studies()
      .as_headline();
  f.add(
       "impacts", kImpacts, "impacts of car bodies",
       "Impacts with a closing speed normal of 1 mph or more; 0 where bodies pass through each other.",
       [](auto& o) -> auto& { return o.impacts.count; })
      .shown_when(has_impacts)
      .in_studies()
      .as_headline();
  f.add(
       "impact_speed_max", kSpeed, "largest closing speed normal of an impact",
       "Largest closing speed normal of an impact.",
       [](auto& o) -> auto& { return o.impacts.closing_speed_normal_max; })
      .shown_when(has_impacts)
      .in_studies()
      .as_headline();
  f.add(
       "impact_force_peak", kForce, "peak force of an impact", "Largest normal force of an impact, a magnitude.",
       [](auto& o) -> auto& { return o.impacts.peak_force; })
      .shown_when(has_impacts)
      .in_studies()
      .as_headline();
  f.add(
       "impact_impulse_max", kImpulse, "largest impulse of an impact",
       "Largest impulse of the normal force of an impact, a magnitude.",
       [](auto& o) -> auto& { return o.impacts.impulse_max; })
      .shown_when(has_impacts);
  f.add(
       "blockage_force", kForce, "mean blockage force",
       "Mean buff force on the foremost car on the rails behind the derailed cars, while the coupler between them "
       "holds.",
       [](auto& o) -> auto& { return o.blockage_force; })
      .shown_when(has_blockage)
      .in_studies()
      .as_headline();
}

void add_pile_up(Fields<Outcome>& f) {
  f.add(
       "pile_up_length", kLength, "pile-up length",
       "Length along the track that the footprints of all cars derailed or off the track cover.",
       [](auto& o) -> auto& { return o.pile_up.length; })
      .shown_when(has_pile_up)
      .in_studies()
      .as_leading_headline();
  f.add(
       "pile_up_width", kLength, "pile-up width", "Their width across the track.",
       [](auto& o) -> auto& { return o.pile_up.width; })
      .shown_when(has_pile_up)
      .in_studies()
      .as_leading_headline();
  f.add(
       "pile_up_area", kArea, "pile-up area", "Area of the convex hull of these footprints.",
       [](auto& o) -> auto& { return o.pile_up.area; })
      .shown_when(has_pile_up)
      .in_studies()
      .as_headline();
  f.add(
       "main_pile_cars", kCars, "cars in the main pile",
       "Largest group of cars turned by more than 30 degrees, with no more than 15 m of track between neighbours.",
       [](auto& o) -> auto& { return o.pile_up.main_cars; })
      .shown_when(has_pile_up)
      .in_studies();
  f.add(
       "main_pile_length", kLength, "length of the main pile", "Length of that group along the track.",
       [](auto& o) -> auto& { return o.pile_up.main_length; })
      .shown_when(has_pile_up)
      .in_studies();
  f.add(
       "cars_across", kCars, "cars at more than 60 degrees",
       "Cars of the pile-up at more than 60 degrees to the track.",
       [](auto& o) -> auto& { return o.pile_up.cars_across; })
      .shown_when(has_pile_up)
      .in_studies()
      .as_headline();
  f.add(
       "groups", kGroups, "separate groups of derailed cars",
       "Groups of cars of the pile-up that are next to each other in the train.",
       [](auto& o) -> auto& { return o.pile_up.groups; })
      .shown_when(has_pile_up)
      .in_studies()
      .as_headline();
}

void add_lateral_reach(Fields<Outcome>& f) {
  f.add(
       "lateral_reach", kLength, "lateral reach",
       "Largest distance from the centre line of any corner of a car derailed or off the track.",
       [](auto& o) -> auto& { return o.pile_up.lateral_reach.farthest; })
      .shown_when(has_pile_up)
      .in_studies()
      .as_headline();
  f.add(
       "cars_beyond_10m", kCars, "cars reaching beyond 10 m", "Cars that reach more than 10 m from the centre line.",
       [](auto& o) -> auto& { return o.pile_up.lateral_reach.beyond_10; })
      .shown_when([](const Outcome& o) { return o.pile_up.lateral_reach.beyond_10 > 0; })
      .in_studies();
  f.add(
       "cars_beyond_20m", kCars, "cars reaching beyond 20 m", "Cars that reach more than 20 m from the centre line.",
       [](auto& o) -> auto& { return o.pile_up.lateral_reach.beyond_20; })
      .shown_when([](const Outcome& o) { return o.pile_up.lateral_reach.beyond_20 > 0; })
      .in_studies();
  f.add(
       "cars_beyond_30m", kCars, "cars reaching beyond 30 m", "Cars that reach more than 30 m from the centre line.",
       [](auto& o) -> auto& { return o.pile_up.lateral_reach.beyond_30; })
      .shown_when([](const Outcome& o) { return o.pile_up.lateral_reach.beyond_30 > 0; })
      .in_studies();
}

void add_posture(Fields<Outcome>& f) {
  f.derive("cars_over", kCars, "cars on their side or over",
           "Cars of the pile-up tilted by 45 degrees or more: cars_on_side and cars_inverted.",
           [](const Outcome& o) { return o.posture.over(); })
      .shown_when(has_posture)
      .in_studies()
      .as_leading_headline();
  f.add(
       "cars_upright", kCars, "cars upright",
       "Cars of the pile-up tilted by less than 10 degrees; these four: 0 in models of the plane.",
       [](auto& o) -> auto& { return o.posture.upright; })
      .shown_when(has_posture)
      .in_studies()
      .as_headline();
  f.add(
       "cars_leaning", kCars, "cars leaning", "Cars of the pile-up tilted by 10 to 45 degrees.",
       [](auto& o) -> auto& { return o.posture.leaning; })
      .shown_when(has_posture)
      .in_studies()
      .as_headline();
  f.add(
       "cars_on_side", kCars, "cars on their side", "Cars of the pile-up tilted by 45 to 135 degrees.",
       [](auto& o) -> auto& { return o.posture.on_side; })
      .shown_when(has_posture)
      .in_studies();
  f.add(
       "cars_inverted", kCars, "cars inverted", "Cars of the pile-up tilted by more than 135 degrees.",
       [](auto& o) -> auto& { return o.posture.inverted; })
      .shown_when(has_posture)
      .in_studies();
  f.add(
       "cars_on_top", kCars, "cars on top of others",
       "Cars of the pile-up the middle of whose body is more than 1.5 m above that of a car below them.",
       [](auto& o) -> auto& { return o.posture.on_top; })
      .shown_when(has_posture)
      .in_studies();
  f.add(
       "drop_max", kHeight, "largest drop",
       "Largest depth of the lowest point of a car of the pile-up, body or underframe, below the rails beside it; 0 in "
       "models of the plane.",
       [](auto& o) -> auto& { return o.posture.drop_max; })
      .shown_when(has_posture)
      .in_studies();
}

void add_energy(Fields<Outcome>& f) {
  f.add(
       "energy_initial", kEnergy, "energy at the start", "Kinetic and strain energy at the start.",
       [](auto& o) -> auto& { return o.energy_initial; })
      .as_headline();
  for (const model::EnergyTerm& t : model::kEnergyTerms) {
    f.add(
         t.name, kEnergy, t.title, t.meaning, [term = t.term](auto& o) -> auto& { return o.energy.*term; })
        .shown_when([term = t.term](const Outcome& o) { return o.energy.*term != 0.0; });
  }
  f.add(
       "energy_residual", kResidual, "energy unaccounted for",
       "Size of (sum of energies and works - energy_initial) / energy_initial; for a train that stood: / work_grade.",
       [](auto& o) -> auto& { return o.energy_residual; })
      .in_studies()
      .as_headline();
}

void add_run(Fields<Outcome>& f) {
  f.add(
       "stop_time", kTime, "simulated time", "Simulated time at the end, or so far.",
       [](auto& o) -> auto& { return o.stop_time; })
      .in_studies();
  f.add(
       "ended", kNoUnit, "ended", "Why the run ended.", [](auto& o) -> auto& { return o.ended; })
      .named({kEndedNames.begin(), kEndedNames.end()})
      .worded({kEndedTexts.begin(), kEndedTexts.end()})
      .noting([](const Outcome& o) { return o.message; });
  f.add(
      "message", kNoUnit, "", "Why the integration failed; empty otherwise.",
      [](auto& o) -> auto& { return o.message; });
  f.add(
      "warnings", kNoUnit, "", "What to check before the numbers are believed; one line each.",
      [](auto& o) -> auto& { return o.warnings; });
  f.add(
      "steps", kCount, "steps", "Accepted steps of the integrator.", [](auto& o) -> auto& { return o.solver.steps; });
  const auto fixed = [](const Outcome& o) { return o.step > 0.0; };
  f.add(
       "step", kStep, "step", "Fixed step of the integrator; 0 where error control chooses each.",
       [](auto& o) -> auto& { return o.step; })
      .shown_when(fixed);
  f.add(
       "step_max", kStep, "longest stable step", "Bound of the step, beyond which the motion would be unstable.",
       [](auto& o) -> auto& { return o.step_max; })
      .shown_when(fixed)
      .noting([](const Outcome& o) { return o.step_limited_by; });
  f.add(
      "step_limited_by", kNoUnit, "", "The input that sets step_max: the stiffest part.",
      [](auto& o) -> auto& { return o.step_limited_by; });
  f.add(
      "rejected_steps", kCount, "rejected steps", "Rejected steps of the integrator.",
      [](auto& o) -> auto& { return o.solver.rejected_steps; });
  f.add(
      "rhs_evaluations", kCount, "right-hand sides", "Evaluations of the equations of motion.",
      [](auto& o) -> auto& { return o.solver.rhs_evaluations; });
  f.add(
       "jacobian_evaluations", kCount, "Jacobians", "Evaluations of the Jacobian by implicit methods.",
       [](auto& o) -> auto& { return o.solver.jacobian_evaluations; })
      .shown_when([](const Outcome& o) { return o.solver.jacobian_evaluations > 0; });
  f.add(
       "wall_time", kComputingTime, "computing time", "Computing time of integration and monitoring.",
       [](auto& o) -> auto& { return o.wall_time; })
      .shown_when([](const Outcome& o) { return o.wall_time > 0.0; });  // a recording does not tell it
}

}  // namespace

const Fields<Outcome>& outcome_fields() {
  static const Fields<Outcome> all = [] {
    Fields<Outcome> f;
    add_counts(f);
    add_ties(f);
    add_closing(f);
    add_couplers(f);
    add_released(f);
    add_pile_up(f);
    add_lateral_reach(f);
    add_posture(f);
    add_energy(f);
    add_run(f);
    return f;
  }();
  return all;
}

FieldRow row_of(const Field<Outcome>& field, const Outcome& o) {
  FieldRow row;
  const Value value = field.get(o);
  if (const auto* number = std::get_if<double>(&value)) {
    row.si = in_si(*number, field.unit);
    row.shown = in_shown(*number, field.unit);
  } else {
    row.si = text(value, field.words.empty() ? field.names : field.words);
  }
  if (field.note) row.note = field.note(o);
  return row;
}

const std::vector<Quantity>& quantities() {
  static const std::vector<Quantity> all = [] {
    std::vector<Quantity> some;
    for (const Field<Outcome>& field : outcome_fields()) {
      if (!field.compared) continue;
      const auto& unit = field.unit;
      some.push_back({field.name, unit.si, unit.shown.empty() && unit.si != "1" ? unit.si : unit.shown, unit.per_shown,
                      field.title, field.number});
    }
    return some;
  }();
  return all;
}

const Quantity* find_quantity(std::string_view name) {
  for (const Quantity& q : quantities()) {
    if (q.name == name) return &q;
  }
  return nullptr;
}

}  // namespace train_derail::outcome
