/// \file
/// The schema: every key of a scenario with its name, unit, range and meaning. Reading, checking, writing and listing
/// of scenarios all go through these functions, so a key is described nowhere else.
#pragma once

#include "inputs/schema_terms.hpp"

namespace train_derail::inputs {

// Each function below shows one group of keys to a visitor, which has the members text, number, integer, choice, group
// and list. The group (S, C, ...) is const or not, as the visitor needs.

template <class V, class C>
void describe_block(V& v, C& c) {
  v.text("name", c.name,
         "Body shown in pictures: tank_car, hopper, boxcar, locomotive; a plain box for any other name.");
  v.integer("count", c.count, between(1, kCarsMax), true, "Number of equal cars in this block.");
  v.number("length", c.length, required({"m", "ft", between(1, 100), between(5, 30)}),
           "L, length between the coupler pins.");
  v.number("weight", c.weight, required({"N", "kip", between(1e3, 1e7), between(1e5, 2.5e6)}),
           "W, weight of a car (a force).");
  v.number(
      "loaded_weight", c.loaded_weight, {"N", "kip", between(1e3, 1e7), between(1e5, 2.5e6)},
      {"Weight with a full load: brakes.force is a share of it, since a car brakes with one force, loaded or empty; "
       "left out: weight.",
       &kAirBrakes});
  v.number("width", c.width, {"m", "ft", between(0.01, 20), between(2, 4.5)},
           "Width of the footprint, for contacts and pictures.");
  v.number("truck_spacing", c.truck_spacing, {"m", "ft", between(0.5, 100), between(2, 25)},
           "D, distance between the truck centres; or give truck_spacing_factor.");
  v.number("truck_spacing_factor", c.truck_spacing_factor, {"1", "", between(0.05, 1), between(0.4, 0.9)},
           "D / L (0.71 if neither is given).");
  v.number("yaw_inertia", c.yaw_inertia, {"kg m2", "slug ft2", between(1, 1e10)},
           "I, about the vertical axis through the centre of mass; or give yaw_inertia_factor.");
  v.number("yaw_inertia_factor", c.yaw_inertia_factor, {"1", "", kYawInertiaFactors, kUsualYawInertiaFactors},
           "I / (M L^2) (0.093 if neither is given; a slender rod has 1/12).");
  v.number("centre_height", c.centre_height, {"m", "in", between(0.1, 5), between(0.8, 2.6)},
           {"Centre of mass above the rail; left out: by name and weight (docs/spatial_model.md).", &kSpatial});
  v.number("floor_height", c.floor_height, {"m", "in", between(0.1, 4), between(0.3, 2)},
           {"Underside of the body above the rail; left out: by name.", &kSpatial});
  v.number("roof_height", c.roof_height, {"m", "ft", between(0.5, 10), between(1.5, 6.5)},
           {"Top of the body above the rail; left out: by name.", &kSpatial});
  v.number("underframe_height", c.underframe_height, {"m", "in", between(0.1, 4), between(0.2, 1.2)},
           {"Of the lowest part of the body above the rail, on which it lies without trucks: bolsters, centre sill, "
            "outlets of a hopper; left out: by name, but no higher than the floor. As high as the floor: none.",
            &kSpatial});
  v.number("underframe_width", c.underframe_width, {"m", "in", between(0.1, 10), between(0.3, 3.2)},
           {"Width of that part; left out: by name, but no wider than the body.", &kSpatial});
  v.number(
      "truck_weight", c.truck_weight, {"N", "kip", between(0, 1e6), between(0, 3e5)},
      {"Of one truck with its wheels: a body that has lost both is so much lighter, and its centre of mass higher; "
       "left out: by name.",
       &kSpatial});
  v.number("roll_inertia", c.roll_inertia, {"kg m2", "lb ft2", between(1, 1e9), between(1e4, 1e6)},
           {"About the axis along the car; left out: of a box, for tank_car of a cylinder.", &kSpatial});
  v.text("coupler_type", c.coupler_type,
         {"Couplers of the block: a type as coupler.type has it; left out: that.", &kSpatial});
  v.choice("shape", c.shape, kBodyShapes,
           {"Of the body; cylinder: a tank along the car, as wide or as high as the box, whichever is less, with heads "
            "that are half spheres.",
            &kSpatial});
  v.number("tank_strength", c.tank_strength, {"1", "", between_or_infinite(0.01, 1e3), between_or_infinite(0.3, 5)},
           {"Speeds of release.* for these cars over those of a bare tank; .inf: nothing to release; left out: 1 for "
            "tank_car, .inf for any other name.",
            &kContact});
  v.number("brake_share", c.brake_share, {"1", "", between(0, 10), between(0, 3)},
           {"Share of brakes.force that these cars develop; 0: cut out.", &kAirBrakes});
  v.choice("brake_source", c.brake_source, kBrakeSources,
           {"remote: distributed power or an end-of-train device, which opens the brake pipe when it is told by radio.",
            &kPneumatic});
}

template <class V, class C>
void describe_coupler(V& v, C& c) {
  v.number("length", c.length, {"m", "ft", between(0.1, 10), between(0.4, 3)},
           "G0, gap between the pins at mid-slack.");
  v.number("slack", c.slack, {"m", "ft", between(0, 5), between(0, 0.3)},
           "s, whole range of the gap without axial force, half on either side of G0.");
  v.number("stiffness", c.stiffness, {"N/m", "lbf/ft", between(0, 1e12), between(1e6, 1e10)},
           "K, in buff and in draft, outside the slack.");
  v.number("swing_limit", c.swing_limit, {"rad", "deg", between(0, 3.14159265358979), between(0, 0.8)},
           "S, swing to either side at which the swing stop begins.");
  v.number("swing_stiffness", c.swing_stiffness, {"N m/rad", "lbf ft/rad", between(0, 1e12), between(0, 1e9)},
           "K_m, stiffness of the swing stop.");
  v.number("swing_moment_max", c.swing_moment_max,
           {"N m", "lbf ft", between_or_infinite(0, 1e12), between_or_infinite(1e3, 1e8)},
           {"m_max, largest moment of the swing stop.", &kSwingStop});
  v.number("draft_gear_stiffness", c.draft_gear_stiffness, {"N/m", "lbf/ft", between(1, 1e12), between(1e5, 1e9)},
           {"k_1, stiffness over draft_gear_travel, beyond the slack.", &kDraftGear});
  v.number("draft_gear_travel", c.draft_gear_travel, {"m", "ft", between(0, 2), between(0, 0.5)},
           "Travel of the draft gears of both cars; beyond it K acts. 0: no draft gear.");
  v.number("damping_ratio", c.damping_ratio, {"1", "", between(0, 2), between(0, 1)},
           "Damping ratio of two cars on the first spring; damping never changes the sign of the force.");
  v.number("break_draft", c.break_draft, {"N", "kip", between_or_infinite(1, 1e12), between_or_infinite(3e5, 6e6)},
           "Draft force at which the coupler breaks.");
  v.number("break_swing", c.break_swing, {"rad", "deg", between_or_infinite(1e-3, 100), between_or_infinite(0.1, 2)},
           "Swing at either end at which the coupler breaks.");
  v.number("break_moment", c.break_moment,
           {"N m", "lbf ft", between_or_infinite(1, 1e12), between_or_infinite(1e4, 1e8)},
           "Sum of the end moments at which the coupler breaks.");
  v.text("type", c.type,
         {"E, E_shelf, F, rotary, or another word for them (docs/import.md): what is left out of pitch_limit, "
          "slip_height, vertical_hold and roll_limit follows from it.",
          &kSpatial});
  v.number("height", c.height, {"m", "in", between(0.1, 3), between(0.6, 1.2)}, {"Pins above the rail.", &kSpatial});
  v.number(
      "butt_height", c.butt_height, {"m", "in", between(0, 1), between(0, 0.3)},
      {"Height of the faces on which couplers and cars press in buff: half of it is the lever that keeps cars level; "
       "within the slack.",
       &kSpatial});
  v.number("pitch_limit", c.pitch_limit, {"rad", "deg", between(0, 1.5), between(0.02, 0.6)},
           {"Swing up and down at which the vertical stop begins: type E with shelves and F 6-7 deg.", &kSpatial});
  v.number("pitch_stiffness", c.pitch_stiffness, {"N m/rad", "lbf ft/rad", between(0, 1e12), between(0, 1e9)},
           {"Stiffness of the vertical stop.", &kSpatial});
  v.number("slip_height", c.slip_height, {"m", "in", between_or_infinite(0.01, 1e6), between_or_infinite(0.1, 1)},
           {"Pins that far apart in height let go; type E without shelves 0.25 m.", &kSpatial});
  v.number("vertical_hold", c.vertical_hold, {"N", "kip", between_or_infinite(1, 1e12), between_or_infinite(1e5, 5e6)},
           {"Vertical force at which the coupler breaks; shelves hold 200 kip (49 CFR 179.14).", &kSpatial});
  v.number("roll_limit", c.roll_limit, {"rad", "deg", between_or_infinite(0, 100), between_or_infinite(0.02, 4)},
           {"Roll of one car against the next at which they bind; .inf: rotary.", &kSpatial});
  v.number("roll_stiffness", c.roll_stiffness, {"N m/rad", "lbf ft/rad", between(0, 1e12), between(0, 1e8)},
           {"Stiffness in roll beyond it.", &kSpatial});
  v.number("break_twist", c.break_twist, {"N m", "lbf ft", between_or_infinite(1, 1e12), between_or_infinite(1e4, 1e7)},
           {"Torque between two cars at which the coupler breaks.", &kSpatial});
}

template <class V, class G>
void describe_ground(V& v, G& g) {
  v.number("on_track_friction", g.on_track_friction, {"1", "", between(0, 10), between(0, 0.5)},
           {"mu of a car before the point of derailment (emergency braking).", &kFrictionBrakes});
  v.number("off_track_friction", g.off_track_friction, {"1", "", between(0, 10), between(0.05, 1.5)},
           {"mu of a car past the point of derailment.", &kCoulombGround});
  v.choice("on_track_law", g.on_track_law, kOnTrackLaws, "Lateral force on a car on the track (docs/model.md).");
  v.number("regularization_speed", g.regularization_speed, {"m/s", "ft/s", between(1e-6, 100), between(1e-3, 2)},
           "v_eps: the friction force is mu W / 2 * v / sqrt(v^2 + v_eps^2).");
  v.choice("off_track_law", g.off_track_law, kOffTrackLaws,
           "coulomb: off_track_friction; by_slip: grows with slip angle and distance from the track.");
  v.number("in_line_friction", g.in_line_friction, {"1", "", between(0, 10), between(0, 1)},
           {"mu_0 of by_slip: for a truck that slides along its car's axis on the track bed.", &kSlipGround});
  v.number("broadside_friction", g.broadside_friction, {"1", "", between(0, 10), between(0.05, 1.5)},
           {"mu_1 of by_slip: for a truck that slides across that axis, or far from the track.", &kSlipGround});
  v.number("slip_ratio", g.slip_ratio, {"1", "", between(1e-3, 1), between(0.05, 1)},
           {"|v across the axis| / |v| at which mu_1 is reached.", &kSlipGround});
  v.number("far_distance", g.far_distance, {"m", "ft", between(1e-3, 1e3), between(0.3, 30)},
           {"Distance beyond the rail at which mu_1 is reached.", &kSlipGround});
  v.number("load_exponent", g.load_exponent, {"1", "", between(0, 2), between(0.4, 1)},
           {"Friction off the rails grows with the weight of a car to this power; 1: Coulomb's.", &kNotPaper});
  v.number("reference_weight", g.reference_weight, {"N", "kip", between(1e3, 1e7), between(1e5, 2.5e6)},
           {"Weight of a car at which that power changes nothing.", &kLoadExponent});
  v.number("rest_speed", g.rest_speed, {"m/s", "ft/s", between(0, 1), between(0, 0.3)},
           {"A car off the rails that stays slower for half a second is held still by friction until more than that "
            "friction pushes it; 0: never.",
            &kExtended});
  v.list(
      "patches", g.patches, [](auto& w, auto& p) { describe_patch(w, p); }, "Rectangles of ground with other friction.",
      false);
}

template <class V, class P>
void describe_patch(V& v, P& p) {
  v.number("x_from", p.x_from, required({"m", "ft", kPlaces}), "Along the track, from the point of derailment.");
  v.number("x_to", p.x_to, required({"m", "ft", kPlaces}), "");
  v.number("y_from", p.y_from, required({"m", "ft", kPlaces}), "Across it, to the left.");
  v.number("y_to", p.y_to, required({"m", "ft", kPlaces}), "");
  v.number("factor", p.factor, required({"1", "", between(0, 10), between(0, 3)}),
           "Friction there over friction elsewhere.");
}

template <class V, class R>
void describe_rails(V& v, R& r) {
  v.number("stiffness", r.stiffness, {"N/m", "lbf/ft", between(1, 1e12), between(1e6, 1e9)},
           "k_r, lateral stiffness of the rails under a truck.");
  v.number("damping_ratio", r.damping_ratio, {"1", "", between(0, 2), between(0, 1)},
           "Damping ratio of half a car on k_r.");
  v.number(
      "derail_ratio", r.derail_ratio, {"1", "", between_or_infinite(0, 1e3), between_or_infinite(0.3, 3)},
      "L/V: lateral force over load of a truck beyond which it leaves the rails. In space no more load counts than "
      "twice that of the side whose flange is pressed.");
  v.number("derail_time", r.derail_time, {"s", "", between(0, 1), between(0, 0.3)},
           {"Time for which derail_ratio must be exceeded before the truck leaves the rails.", &kYieldingRails});
  v.number("flange_height", r.flange_height, {"m", "in", between_or_infinite(0, 1), between_or_infinite(0.02, 0.04)},
           {"Lift of the wheels of one side above the rail beyond which nothing guides a truck: after derail_time it "
            "leaves the rails.",
            &kFlange});
  v.number("torn_length", r.torn_length, {"m", "ft", between(0, 100), between(0, 30)},
           {"Length of track that a truck tears up where it leaves the rails; 0: none.", &kYieldingRails});
  v.number("rolling_share", r.rolling_share, {"1", "", between(0, 1), between(0, 0.5)},
           {"Cars on sound rails, far from what is off them, only roll along the track while L/V stays below this "
            "share of derail_ratio; 0: "
            "they never do.",
            &kRolling});
  v.number(
      "load_exponent", r.load_exponent, {"1", "", between(0, 2), between(0, 1)},
      {"The lateral force at which a truck leaves the rails grows with the weight of its car to this power; 1: L/V "
       "decides.",
       &kYieldingRails});
  v.number("reference_weight", r.reference_weight, {"N", "kip", between(1e3, 1e7), between(1e5, 2.5e6)},
           {"Weight of a car at which derail_ratio is L/V.", &kRailLoadExponent});
}

template <class V, class T>
void describe_ties(V& v, T& t) {
  v.choice(
      "law", t.law, kTieLaws,
      "guided: a truck off the rails runs on the ties until it is thrown off the track bed; none: the ground alone "
      "acts on it. A truck that a broken rail, torn track or lateral force takes off is not guided.");
  v.number("drag", t.drag, {"1", "", between(0, 10), between(0.05, 0.5)},
           {"Along the track, over its load.", &kOnTies});
  v.number("stiffness", t.stiffness, {"N/m", "lbf/ft", between(1, 1e12), between(1e5, 1e9)},
           {"k_t, lateral stiffness under a truck, up to the limit.", &kOnTies});
  v.number("damping_ratio", t.damping_ratio, {"1", "", between(0, 2), between(0, 1)},
           {"Damping ratio of half a car on k_t.", &kOnTies});
  v.number("lateral_ratio", t.lateral_ratio, {"1", "", between_or_infinite(0, 1e3), between_or_infinite(0.1, 2)},
           {"Limit of the lateral force over its load; where more is needed the truck drifts.", &kOnTies});
  v.number("drift_max", t.drift_max, {"m", "ft", between_or_infinite(1e-3, 100), between_or_infinite(0.1, 2)},
           {"A truck that has drifted farther leaves the track bed.", &kOnTies});
  v.number("parting_rate", t.parting_rate, {"1/m", "1/km", between(0, 10), between(0, 0.1)},
           {"A truck on the ties parts the brake pipe at its car at this rate, by the distance that it runs; 0: never.",
            &kPartingPipe});
}

template <class V, class P>
void describe_obstacle(V& v, P& p) {
  v.number("at", p.at, required({"m", "ft", kPlaces}), "Along the track from the point of derailment, forward.");
  v.number("throw_probability", p.throw_probability, {"1", "", between(0, 1)},
           "Left out: obstacles.throw_probability.");
}

template <class V, class O>
void describe_obstacles(V& v, O& o) {
  v.number("rate", o.rate, {"1/m", "1/km", between(0, 1), between(0, 0.02)},
           "Obstacles at random places along the track, by its length: turnouts, crossings, bridges.");
  v.number("speed_exponent", o.speed_exponent, {"1", "", between(-5, 5), between(0, 3)},
           "k: the rate is that much times (speed of the train / reference_speed)^-k. Slow track has more of them.");
  v.number("reference_speed", o.reference_speed, {"m/s", "mph", between(0.01, 200), between(1, 45)},
           {"Speed of a train at which the rate is rate.", &kObstaclesBySpeed});
  v.number("throw_probability", o.throw_probability, {"1", "", between(0, 1)},
           "That an obstacle throws a truck that runs on the ties off the track bed.");
  v.number("throw_speed", o.throw_speed, {"m/s", "ft/s", between(0, 100), between(0, 5)},
           "Sideways speed of a truck that is thrown off, to either side.");
  v.list(
      "places", o.places, [](auto& w, auto& p) { describe_obstacle(w, p); }, "Obstacles whose places are known.",
      false);
}

template <class V, class C>
void describe_curve(V& v, C& c) {
  v.number("start", c.start, required({"m", "ft", kPlaces}), "Along the track from the point of derailment, forward.");
  v.number("length", c.length, required({"m", "ft", between(0.01, 1e5)}), "Length of the arc.");
  v.number("curvature", c.curvature, required({"1/m", "deg/(100 ft)", between(-0.02, 0.02), between(-0.012, 0.012)}),
           "One over the radius, to the left positive.");
  v.number("superelevation", c.superelevation, {"m", "in", between(0, 0.3), between(0, 0.18)},
           {"Of the outer rail over the inner one; it runs in over 200 ft about the ends of the arc, or 3/4 of a "
            "shorter arc.",
            &kSpatial});
}

template <class V, class G>
void describe_grade(V& v, G& g) {
  v.number("start", g.start, required({"m", "ft", kPlaces}), "Along the track from the point of derailment, forward.");
  v.number("length", g.length, required({"m", "ft", between(0.01, 1e5)}), "Length of the stretch.");
  v.number(
      "grade", g.grade, required({"1", "percent", between(-0.1, 0.1), between(-0.04, 0.04)}),
      {"Rise over run in the direction of travel; it changes over 200 ft about the ends of the stretch.", &kSpatial});
}

template <class V, class T>
void describe_track(V& v, T& t) {
  v.number("heading", t.heading, {"rad", "deg", between(0, kFullTurn)},
           "Compass direction of travel at the point of derailment, clockwise from north; pictures then show north.");
  v.number("grade", t.grade, {"1", "percent", between(-0.1, 0.1), between(-0.04, 0.04)},
           {"Rise over run in the direction of travel, of the whole track.", &kOnRails});
  v.list(
      "curves", t.curves, [](auto& w, auto& c) { describe_curve(w, c); },
      {"Arcs; straight between and outside of them.", &kOnRails}, false);
  v.list(
      "grades", t.grades, [](auto& w, auto& g) { describe_grade(w, g); },
      {"Stretches that rise or fall, beside grade; level between and outside of them.", &kSpatial}, false);
}

template <class V, class B>
void describe_brakes(V& v, B& b) {
  v.choice("law", b.law, kBrakeLaws,
           "friction: ground.on_track_friction on every car at once, as in the paper; air: an emergency application.");
  v.number("rolling_resistance", b.rolling_resistance, {"1", "", between(0, 1), between(0, 0.02)},
           {"Rolling resistance of a car on the rails over its weight.", &kAirBrakes});
  v.number("force", b.force, {"1", "", between(0, 1), between(0, 0.2)},
           {"B: full brake force over weight; 0: a runaway train.", &kAirBrakes});
  v.number("build_up_time", b.build_up_time, {"s", "", between(0, 1e3), between(0, 60)},
           {"t_b, time in which the force rises from 0 to B.", &kAirBrakes});
  v.number("dead_time", b.dead_time, {"s", "", between(0, 1e3), between(0, 10)},
           {"Delay of each car's valve after the signal.", &kAirBrakes});
  v.number("propagation_speed", b.propagation_speed,
           {"m/s", "ft/s", between_or_infinite(1, 1e5), between_or_infinite(100, 400)},
           {"Speed of the signal along the brake pipe.", &kPneumatic});
  v.number("radio_delay", b.radio_delay, {"s", "", between(0, 1e3), between(0, 20)},
           {"Delay of brake sources that are told by radio.", &kRadio});
  v.choice("signal", b.signal, kBrakeSignals, {"electronic (ECP): all cars at once.", &kAirBrakes});
  v.number(
      "emergency_time", b.emergency_time, {"s", "", between(-1e4, 1e5), between(-120, 300)},
      {"Time of the crew's emergency application, at the front; left out: none. A coupler that breaks makes one where "
       "it breaks.",
       &kAirBrakes});
  v.number(
      "emergency_speed_exponent", b.emergency_speed_exponent, {"1", "", between(-5, 5), between(0, 3)},
      {"k: that time is emergency_time (speed of the train / reference_speed)^-k. A faster derailment parts the pipe, "
       "or alarms the crew, sooner.",
       &kEmergencyTime});
  v.number("reference_speed", b.reference_speed, {"m/s", "mph", between(0.01, 200), between(1, 45)},
           {"Speed of a train at which that time is emergency_time.", &kEmergencyBySpeed});
}

template <class V, class T>
void describe_traction(V& v, T& t) {
  v.choice(
      "law", t.law, kTractionLaws,
      "none: locomotives coast; steady: they go on with the power, or downhill with the force, that held the train "
      "at its speed, until the emergency signal comes to them. Locomotives are blocks with that word in the name.");
  v.number("adhesion", t.adhesion, {"1", "", between(0, 1), between(0.1, 0.45)},
           {"Largest force of a locomotive along the track over its weight.", &kTraction});
}

template <class V, class C>
void describe_contact(V& v, C& c) {
  v.choice("law", c.law, kContactLaws,
           "none: bodies pass through each other, as in the paper; elastic: they push each other apart.");
  v.number("stiffness", c.stiffness, {"N/m", "lbf/ft", between(1, 1e12), between(1e6, 1e9)},
           {"k_c, force over depth of the overlap of two footprints.", &kContact});
  v.number("restitution", c.restitution, {"1", "", between(0, 1), between(0, 0.9)},
           {"Speed after over speed before a central impact.", &kContact});
  v.number("friction", c.friction, {"1", "", between(0, 10), between(0, 1)},
           {"Friction coefficient between two bodies.", &kContact});
  v.number("crush_force", c.crush_force, {"N", "kip", between_or_infinite(1, 1e12), between_or_infinite(1e6, 2e7)},
           {"Largest normal force; beyond it the bodies are crushed.", &kContact});
  v.number("side_crush_force", c.side_crush_force,
           {"N", "kip", between_or_infinite(1, 1e12), between_or_infinite(5e5, 2e7)},
           {"The same where a side, a roof or a floor is pressed; the smaller of both acts.", &kSpatial});
}

template <class V, class S>
void describe_suspension(V& v, S& s) {
  v.number("stiffness", s.stiffness, {"N/m", "kip/in", between(1e3, 1e12), between(1e6, 2e7)},
           {"Vertical, of one side of a truck.", &kSpatial});
  v.number("damping_ratio", s.damping_ratio, {"1", "", between(0, 2), between(0, 1)},
           {"Damping ratio of a quarter of the car on one side.", &kSpatial});
  v.number("half_base", s.half_base, {"m", "in", between(0.1, 3), between(0.5, 1)},
           {"Support of a side from the middle of the track.", &kSpatial});
  v.number("part_angle", s.part_angle, {"rad", "deg", between(0.01, 4), between(0.3, 2)},
           {"Roll of the body at which a truck that carries nothing parts from it.", &kSpatial});
}

template <class V, class S>
void describe_terrain_section(V& v, S& s) {
  const NumberInput height{"m", "ft", between(-100, 100), between(-20, 20)};
  v.number("start", s.start, required({"m", "ft", kPlaces}), "Along the track from the point of derailment, forward.");
  v.number("length", s.length, required({"m", "ft", between(0.01, 1e5)}), "Length of the stretch.");
  v.number("ballast_height", s.ballast_height, {"m", "in", between(0, 5), between(0, 1)}, "");
  v.number("ballast_half_width", s.ballast_half_width, {"m", "ft", between(0.5, 1e3), between(1.2, 5)}, "");
  v.number("ballast_slope", s.ballast_slope, {"1", "", between(0.001, 10), between(0.3, 1)}, "");
  v.number("crown", s.crown, {"m", "ft", between(0.5, 1e3), between(1.5, 10)}, "");
  v.number("bank_slope", s.bank_slope, {"1", "", between(0.001, 10), between(0.1, 1.5)}, "");
  v.number("bank_left", s.bank_left, height, "");
  v.number("bank_right", s.bank_right, height, "");
}

template <class V, class G>
void describe_terrain_grid(V& v, G& g) {
  v.number("spacing", g.spacing, {"m", "ft", between(0.1, 1e3), between(1, 20)},
           {"Between neighbouring heights, along x and along y.", &kSpatial});
  v.number("x_from", g.x_from, {"m", "ft", kPlaces},
           {"Place of the first row, ahead of the point of derailment.", &kSpatial});
  v.number("y_from", g.y_from, {"m", "ft", kPlaces},
           {"Place of the first height of each row, to the left of the point of derailment.", &kSpatial});
  v.number("seam", g.seam, {"m", "ft", between(0.01, 1e3), between(0.5, 10)},
           {"Width beyond the crown of the roadbed over which the roadbed becomes the grid.", &kSpatial});
  v.list(
      "rows", g.rows,
      [](auto& w, auto& r) {
        w.text(
            "heights", r.heights,
            {"Heights in m above the top of the rails at the point of derailment, from right to left, apart by blanks.",
             &kSpatial});
      },
      {"Heights of the ground (derail import terrain), one row for each place along x; none: no grid.", &kSpatial},
      false);
}

template <class V, class T>
void describe_terrain(V& v, T& t) {
  v.number("rail_height", t.rail_height, {"m", "in", between(0, 2), between(0, 0.5)},
           {"Top of the rails above the ballast.", &kSpatial});
  v.number("ballast_height", t.ballast_height, {"m", "in", between(0, 5), between(0, 1)},
           {"Top of the ballast above the crown of the roadbed; 0: no ballast stands out.", &kSpatial});
  v.number("ballast_half_width", t.ballast_half_width, {"m", "ft", between(0.5, 1e3), between(1.2, 5)},
           {"Half the width of the top of the ballast; its sides begin there.", &kSpatial});
  v.number("ballast_slope", t.ballast_slope, {"1", "", between(0.001, 10), between(0.3, 1)},
           {"Fall over run of the sides of the ballast.", &kSpatial});
  v.number("crown", t.crown, {"m", "ft", between(0.5, 1e3), between(1.5, 10)},
           {"Half the width of the crown of the roadbed; banks begin there.", &kSpatial});
  v.number("bank_slope", t.bank_slope, {"1", "", between(0.001, 10), between(0.1, 1.5)},
           {"Fall over run of the banks.", &kSpatial});
  v.number("bank_left", t.bank_left, {"m", "ft", between(-100, 100), between(-20, 20)},
           {"Height of the bank on the left; negative: a cut.", &kSpatial});
  v.number("bank_right", t.bank_right, {"m", "ft", between(-100, 100), between(-20, 20)},
           {"Height of the bank on the right; negative: a cut.", &kSpatial});
  v.number("transition", t.transition, {"m", "ft", between(0.1, 1e4), between(1, 200)},
           {"Over which a cross-section changes into the next, half before and half beyond the end of a section.",
            &kSpatial});
  v.list(
      "sections", t.sections, [](auto& w, auto& s) { describe_terrain_section(w, s); },
      {"Stretches with another cross-section; what one leaves out is as terrain has it.", &kSpatial}, false);
  v.group("grid", t.grid, [](auto& w, auto& g) { describe_terrain_grid(w, g); },
          {"Ground from a map of heights, instead of banks and sections.", &kSpatial});
  v.number("body_friction", t.body_friction, {"1", "", between(0, 10), between(0.1, 1.5)},
           {"Friction of a body on the ground.", &kSpatial});
  v.number("body_stiffness", t.body_stiffness, {"N/m", "lbf/ft", between(1e3, 1e12), between(1e6, 1e8)},
           {"Of the ground under a corner of a body.", &kSpatial});
  v.number("body_damping_ratio", t.body_damping_ratio, {"1", "", between(0, 2), between(0, 1)},
           {"Damping ratio of a quarter of the car on that ground.", &kSpatial});
  v.number("rolling_resistance", t.rolling_resistance, {"1", "", between(0, 10), between(0, 0.5)},
           {"Of a body of shape cylinder that rolls on the ground: force over load, at its radius.", &kSpatial});
  v.number("rest_speed", t.rest_speed, {"m/s", "ft/s", between(0, 1), between(0, 0.05)},
           {"A car that stays within a quarter of the way of this speed for half a second is held until it is pushed; "
            "0: never.",
            &kSpatial});
}

template <class V, class P>
void describe_perturbation_sizes(V& v, P& p) {
  v.number("spacing", p.spacing, {"m", "ft", between(0, 10), between(0, 0.1)},
           "Every car but the first starts set back by this times |N(0,1)|.");
  v.number("yaw_rate", p.yaw_rate, {"1", "", between(0, 10), between(0, 0.5)},
           "Omega is multiplied by 1 + this times N(0,1).");
  v.number("emergency_time", p.emergency_time, {"1", "", between(0, 5), between(0, 1.5)},
           {"brakes.emergency_time is multiplied by exp(this times N(0,1)).", &kEmergencyTime});
  v.number("kick", p.kick, {"m/s", "ft/s", between(0, 100), between(0, 2)},
           "A truck that derails at the point of derailment or on bad track, and is not guided by ties, gets this "
           "times N(0,1) "
           "sideways (rails).");
  v.number("alignment", p.alignment, {"m", "ft", between(0, 10), between(0, 0.05)},
           "Standard deviation of the lateral alignment of the rails.");
}

template <class V, class P>
void describe_perturbation(V& v, P& p) {
  describe_perturbation_sizes(v, p);
  v.integer("seed", p.seed, between(0, 9007199254740992.0), false,
            {"Seed of all random differences of the run.", &kPerturbed});
}

template <class V, class I>
void describe_initial(V& v, I& i) {
  v.number("speed", i.speed, required({"m/s", "mph", between(0, 200), between(0.5, 45)}),
           "V of all cars, forward along the track.");
  v.number("yaw_rate", i.yaw_rate, required({"rad/s", "", between(-100, 100), between(-1, 1)}),
           "Omega of the first car to derail, counter-clockwise; on rails (on_track_law) about its rear truck.");
  v.integer("cars_ahead", i.cars_ahead, between(0, kCarsMax - 1), false,
            {"Cars of the consist that have passed the point of derailment unharmed (rails).", &kOnRails});
  v.choice(
      "mechanism", i.mechanism, kMechanisms,
      "broken_rail: every truck that comes to the point of derailment leaves the rails; bad_track: trucks leave them "
      "on a stretch from there on, by chance; switch: there, by chance; dragging_truck: one truck is off, the track "
      "is sound; train_forces: the same in a train in buff.");
  v.choice("truck", i.truck, kFirstTrucks,
           {"Truck of the first car that is off the rails at time 0; either: the seed decides.", &kFirstTruck});
  v.number("truck_probability", i.truck_probability, {"1", "", between(0, 1)},
           {"Of every truck but the first, to leave the rails on bad track or at a switch.", &kByChance});
  v.number("persistence", i.persistence, {"1", "", between(0, 1)},
           {"The same of a truck behind one that has left the rails there: it has spread them. Left out: "
            "truck_probability.",
            &kByChance});
  v.number("bad_track_length", i.bad_track_length, {"m", "ft", between(0, 1e4), between(0, 500)},
           {"From the point of derailment on; a truck leaves the rails anywhere on it.", &kBadTrack});
  v.number("frog_distance", i.frog_distance, {"m", "ft", between(0, 1e4), between(5, 100)},
           {"From the point of a switch to its frog, which is an obstacle.", &kTurnout});
  v.number("buff_force", i.buff_force, {"N", "kip", between(-1e8, 1e8), between(-2e6, 4e6)},
           {"Buff force at the first car at time 0, less and less towards both ends of the train; negative: draft.",
            &kTrainForces});
  v.group(
      "perturbation", i.perturbation, [](auto& w, auto& p) { describe_perturbation(w, p); },
      "Small random differences between members of an ensemble.");
}

template <class V, class S>
void describe_stop(V& v, S& s) {
  v.number("speed", s.speed, {"m/s", "ft/s", between(0, 100), between(0, 0.5)},
           "The run ends when every truck is slower than this.");
  v.number("time_max", s.time_max, {"s", "", between(1e-6, 1e5), between(1, 1e3)},
           "The run ends at this simulated time at the latest.");
}

template <class V, class R>
void describe_release(V& v, R& r) {
  v.number("fittings", r.fittings, {"1", "", between(0, 1), between(0, 0.2)},
           "Probability that a derailed tank car releases by its valves or fittings, whatever hits it.");
  v.number("threshold_speed", r.threshold_speed, {"m/s", "mph", between(0, 100), between(0, 15)},
           "Closing speed normal of an impact from which on a tank may release.");
  v.number("end_speed", r.end_speed, {"m/s", "mph", between_or_infinite(0.01, 1e4), between_or_infinite(2, 200)},
           "Beyond it, where a head is hit: 1 - exp(-1) of the tanks release at so much more.");
  v.number("side_speed", r.side_speed, {"m/s", "mph", between_or_infinite(0.01, 1e4), between_or_infinite(2, 200)},
           "The same where a shell is hit.");
}

template <class V, class O>
void describe_outcome(V& v, O& o) {
  v.number("off_track_threshold", o.off_track_threshold, {"m", "ft", between(1e-4, 100), between(0.02, 1)},
           "A car is off the track once a truck centre has been farther than this from the centre line.");
  v.number("sample_interval", o.sample_interval, {"s", "", between(1e-6, 1), between(1e-4, 0.1)},
           "Time between the samples in which counts, touches and the stop rule are checked.");
}

template <class V, class O>
void describe_output(V& v, O& o) {
  v.number("interval", o.interval, {"s", "", between(1e-6, 10)},
           "Grid of simulated time on which states are published and written.");
}

template <class V, class S>
void describe_solver(V& v, S& s) {
  v.choice("method", s.method, kMethods,
           "cash_karp, dormand_prince: explicit Runge-Kutta 5(4); bdf: implicit, banded Newton; semi_implicit: "
           "Euler's, the one for the extended model.");
  v.number("rtol", s.rtol, {"1", "", between(1e-15, 0.1), between(1e-14, 1e-3)},
           {"Relative tolerance of the local error.", &kErrorControl});
  v.number("atol", s.atol, {"1", "", between(1e-18, 0.1), between(1e-16, 1e-3)},
           {"Absolute tolerance of the local error in m, rad, m/s, rad/s.", &kErrorControl});
  v.number("fixed_step", s.fixed_step, {"s", "", between(1e-8, 1), between(1e-6, 0.01)},
           "This step instead of error control; not for bdf; semi_implicit must have it.");
  v.integer("steps_max", s.steps_max, between(1, 1e12), false, "A run that needs more steps has failed.");
  v.number("wall_time_max", s.wall_time_max, {"s", "", between_or_infinite(1e-9, 1e9)},
           "A run that needs more computing time, by the clock on the wall, has failed.");
}

template <class V, class S>
void describe(V& v, S& s) {
  v.text("title", s.title, "One line for tables and pictures.");
  v.choice("model", s.model, kModels,
           "paper: of 2007; extended: with rails, brakes, contact and all other parts; spatial: the same in three "
           "dimensions; by_parts: extended if one of these parts is switched on.");
  v.list(
      "consist", s.consist, [](auto& w, auto& c) { describe_block(w, c); },
      "Blocks of equal cars, counted back from the foremost.", true);
  v.group(
      "coupler", s.coupler, [](auto& w, auto& c) { describe_coupler(w, c); }, "Couplers, all alike.");
  v.group(
      "ground", s.ground, [](auto& w, auto& g) { describe_ground(w, g); }, "Friction under the trucks.");
  v.group("rails", s.rails, [](auto& w, auto& r) { describe_rails(w, r); }, {"Rails that yield.", &kOnRails});
  v.group("ties", s.ties, [](auto& w, auto& t) { describe_ties(w, t); }, {"Trucks that run on the ties.", &kOnRails});
  v.group("obstacles", s.obstacles, [](auto& w, auto& o) { describe_obstacles(w, o); },
          {"What throws trucks on the ties off the track bed.", &kOnTies});
  v.group(
      "track", s.track, [](auto& w, auto& t) { describe_track(w, t); }, "Direction, curves and grades of the track.");
  v.group(
      "brakes", s.brakes, [](auto& w, auto& b) { describe_brakes(w, b); }, "Brakes of the cars on the track.");
  v.group("traction", s.traction, [](auto& w, auto& t) { describe_traction(w, t); },
          {"What locomotives pull until the brakes come.", &kOnRails});
  v.group(
      "contact", s.contact, [](auto& w, auto& c) { describe_contact(w, c); }, "Contact of car bodies.");
  v.group("suspension", s.suspension, [](auto& w, auto& g) { describe_suspension(w, g); },
          {"Springs of the trucks.", &kSpatial});
  v.group("terrain", s.terrain, [](auto& w, auto& g) { describe_terrain(w, g); },
          {"Ground beside the track.", &kSpatial});
  v.group(
      "initial", s.initial, [](auto& w, auto& i) { describe_initial(w, i); },
      "Motion at time 0, in mid-slack on the track.");
  v.group(
      "stop", s.stop, [](auto& w, auto& r) { describe_stop(w, r); }, "When the run ends.");
  v.group("release", s.release, [](auto& w, auto& r) { describe_release(w, r); },
          {"When tank cars release what they hold.", &kContact});
  v.group(
      "outcome", s.outcome, [](auto& w, auto& o) { describe_outcome(w, o); }, "How the outcome is counted.");
  v.group(
      "output", s.output, [](auto& w, auto& o) { describe_output(w, o); }, "What is published and written.");
  v.group(
      "solver", s.solver, [](auto& w, auto& o) { describe_solver(w, o); }, "Integration.");
}

}  // namespace train_derail::inputs
