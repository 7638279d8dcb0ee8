// Every key of a scenario: name, unit, range, meaning. The one place; reading, checking, writing and listing all walk it.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

struct Range {
  double min = -kInfinity, max = kInfinity;
  bool min_open = false, infinite = false;  // is min itself excluded; is .inf allowed

  bool contains(double v) const {
    if (v == kInfinity) return infinite;
    return v != -kInfinity && (min_open ? v > min : v >= min) && v <= max;  // false for NaN
  }
  std::string text(const std::string& unit) const {
    const std::string u = unit == "1" ? "" : " " + unit;
    std::string s;
    if (min == -kInfinity && max == kInfinity) s = "any finite number" + (u.empty() ? u : " in" + u);
    else if (max == kInfinity) s = fmt::format("{} {:.6g}{}", min_open ? ">" : ">=", min, u);
    else s = fmt::format("{}{:.6g}, {:.6g}]{}", min_open ? '(' : '[', min, max, u);
    return infinite ? s + " or .inf" : s;
  }
};

inline std::string number_text(double v) { return v == kInfinity ? ".inf" : fmt::format("{}", v); }

inline Range any() { return {}; }
inline Range above(double min) { return {min, kInfinity, true, false}; }
inline Range at_least(double min) { return {min, kInfinity, false, false}; }
inline Range between(double min, double max) { return {min, max, false, false}; }
inline Range above_up_to(double min, double max) { return {min, max, true, false}; }
inline Range at_least_or_infinite(double min) { return {min, kInfinity, false, true}; }
inline Range above_or_infinite(double min) { return {min, kInfinity, true, true}; }

/// `unit` is the SI unit in UDUNITS notation, `shown` the one people read ("" if the same).
struct Quantity {
  const char* unit;
  const char* shown;
  Range range;
  bool required = false;
};

inline Quantity required(Quantity q) {
  q.required = true;
  return q;
}

template <class E>
using Names = std::pair<std::string_view, E>;

inline constexpr std::array<Names<OnTrackLaw>, 4> kOnTrackLaws{{{"isotropic", OnTrackLaw::isotropic},
                                                                {"along_track", OnTrackLaw::along_track},
                                                                {"guided", OnTrackLaw::guided},
                                                                {"rails", OnTrackLaw::rails}}};
inline constexpr std::array<Names<Method>, 4> kMethods{{{"cash_karp", Method::cash_karp},
                                                        {"dormand_prince", Method::dormand_prince},
                                                        {"bdf", Method::bdf},
                                                        {"semi_implicit", Method::semi_implicit}}};
inline constexpr std::array<Names<OffTrackLaw>, 2> kOffTrackLaws{
    {{"coulomb", OffTrackLaw::coulomb}, {"by_slip", OffTrackLaw::by_slip}}};
inline constexpr std::array<Names<BrakeLaw>, 2> kBrakeLaws{{{"friction", BrakeLaw::friction}, {"air", BrakeLaw::air}}};
inline constexpr std::array<Names<BrakeSignal>, 2> kBrakeSignals{
    {{"pneumatic", BrakeSignal::pneumatic}, {"electronic", BrakeSignal::electronic}}};
inline constexpr std::array<Names<BrakeSource>, 2> kBrakeSources{
    {{"none", BrakeSource::none}, {"remote", BrakeSource::remote}}};
inline constexpr std::array<Names<ContactLaw>, 2> kContactLaws{
    {{"none", ContactLaw::none}, {"elastic", ContactLaw::elastic}}};

inline constexpr int kCarsMax = 1000;

// A visitor has text, number, integer, choice, group, list. S, C, ... are const or not as the visitor needs.

template <class V, class C>
void describe_block(V& v, C& c) {
  v.text("name", c.name, "Body shown in pictures: tank_car, hopper, boxcar, locomotive; a plain box for any other name.");
  v.integer("count", c.count, between(1, kCarsMax), true, "Number of equal cars in this block.");
  v.number("length", c.length, required({"m", "ft", above(0)}), "L, between the coupler pins.");
  v.number("weight", c.weight, required({"N", "kip", above(0)}), "W, on the rails (a force).");
  v.number("width", c.width, {"m", "ft", above(0)}, "Width of the footprint, for contacts and pictures.");
  v.number("truck_spacing", c.truck_spacing, {"m", "ft", above(0)}, "D, between truck centres; or truck_spacing_factor.");
  v.number("truck_spacing_factor", c.truck_spacing_factor, {"1", "", above_up_to(0, 1)}, "D / L (0.71 if neither is given).");
  v.number("yaw_inertia", c.yaw_inertia, {"kg m2", "slug ft2", above(0)},
           "I, about the vertical axis through the centre of mass; or yaw_inertia_factor.");
  v.number("yaw_inertia_factor", c.yaw_inertia_factor, {"1", "", above_up_to(0, 0.25)},
           "I / (M L^2) (0.093 if neither is given; a slender rod has 1/12).");
  v.number("brake_share", c.brake_share, {"1", "", between(0, 10)}, "Share of brakes.force that these cars develop; 0: cut out.");
  v.choice("brake_source", c.brake_source, kBrakeSources,
           "remote: distributed power or an end-of-train device, which vents the brake pipe by radio.");
}

template <class V, class C>
void describe_coupler(V& v, C& c) {
  v.number("length", c.length, {"m", "ft", above(0)}, "G0, between the pins at mid-slack.");
  v.number("slack", c.slack, {"m", "ft", at_least(0)}, "s, whole dead band of the gap, half to either side of G0.");
  v.number("stiffness", c.stiffness, {"N/m", "lbf/ft", at_least(0)}, "K, in buff and in draft, outside the slack.");
  v.number("swing_limit", c.swing_limit, {"rad", "deg", between(0, 3.14159265358979)}, "S, free swing to either side.");
  v.number("swing_stiffness", c.swing_stiffness, {"N m/rad", "lbf ft/rad", at_least(0)}, "K_m, slope of the end moment beyond the limit.");
  v.number("swing_moment_max", c.swing_moment_max, {"N m", "lbf ft", at_least_or_infinite(0)}, "m_max, plateau of the end moment.");
  v.number("draft_gear_stiffness", c.draft_gear_stiffness, {"N/m", "lbf/ft", above(0)}, "k_1, over the first draft_gear_travel beyond the slack.");
  v.number("draft_gear_travel", c.draft_gear_travel, {"m", "ft", at_least(0)}, "Travel of the draft gears of a coupled pair; then K. 0: none, K at once.");
  v.number("damping_ratio", c.damping_ratio, {"1", "", between(0, 2)}, "Of two cars on the first spring; damping never turns the force round.");
  v.number("break_draft", c.break_draft, {"N", "kip", above_or_infinite(0)}, "Draft force at which the coupler breaks.");
  v.number("break_swing", c.break_swing, {"rad", "deg", above_or_infinite(0)}, "Swing angle, at either end, at which it breaks.");
  v.number("break_moment", c.break_moment, {"N m", "lbf ft", above_or_infinite(0)}, "Sum of the end moments at which it breaks.");
}

template <class V, class G>
void describe_ground(V& v, G& g) {
  v.number("on_track_friction", g.on_track_friction, {"1", "", between(0, 10)}, "mu of a car before the point of derailment (emergency braking).");
  v.number("off_track_friction", g.off_track_friction, {"1", "", between(0, 10)}, "mu of a car past it.");
  v.choice("on_track_law", g.on_track_law, kOnTrackLaws, "What a car on the track feels sideways (docs/model.md).");
  v.number("regularization_speed", g.regularization_speed, {"m/s", "ft/s", above(0)}, "v_eps: the friction force is mu W / 2 * v / sqrt(v^2 + v_eps^2).");
  v.choice("off_track_law", g.off_track_law, kOffTrackLaws, "coulomb: off_track_friction; by_slip: grows with slip angle and distance from the track.");
  v.number("in_line_friction", g.in_line_friction, {"1", "", between(0, 10)}, "mu_0 of by_slip: along the car's axis, on the track's bed.");
  v.number("broadside_friction", g.broadside_friction, {"1", "", between(0, 10)}, "mu_1 of by_slip: across the axis, or far from the track.");
  v.number("slip_ratio", g.slip_ratio, {"1", "", above_up_to(0, 1)}, "|v across the axis| / |v| at which mu_1 is reached.");
  v.number("far_distance", g.far_distance, {"m", "ft", above(0)}, "Distance beyond the rail at which mu_1 is reached.");
  v.list("patches", g.patches, [](auto& w, auto& p) { describe_patch(w, p); }, "Rectangles of other ground.", false);
}

template <class V, class P>
void describe_patch(V& v, P& p) {
  v.number("x_from", p.x_from, required({"m", "ft", any()}), "Along the track, from the point of derailment.");
  v.number("x_to", p.x_to, required({"m", "ft", any()}), "");
  v.number("y_from", p.y_from, required({"m", "ft", any()}), "Across it, to the left.");
  v.number("y_to", p.y_to, required({"m", "ft", any()}), "");
  v.number("factor", p.factor, required({"1", "", between(0, 10)}), "Friction there over friction elsewhere.");
}

template <class V, class R>
void describe_rails(V& v, R& r) {
  v.number("stiffness", r.stiffness, {"N/m", "lbf/ft", above(0)}, "k_r, lateral stiffness of the rails under a truck.");
  v.number("damping_ratio", r.damping_ratio, {"1", "", between(0, 2)}, "Of half a car on k_r.");
  v.number("derail_ratio", r.derail_ratio, {"1", "", at_least_or_infinite(0)}, "L/V: lateral force over load of a truck beyond which it leaves the rails.");
  v.number("derail_time", r.derail_time, {"s", "", between(0, 1)}, "... if exceeded for longer than this.");
  v.number("torn_length", r.torn_length, {"m", "ft", between(0, 100)}, "Length of track that a truck tears up where it leaves the rails; 0: none.");
}

template <class V, class C>
void describe_curve(V& v, C& c) {
  v.number("start", c.start, required({"m", "ft", any()}), "Along the track from the point of derailment, forward.");
  v.number("length", c.length, required({"m", "ft", above(0)}), "Of the arc.");
  v.number("curvature", c.curvature, required({"1/m", "deg/(100 ft)", between(-0.02, 0.02)}), "One over the radius, to the left positive.");
}

template <class V, class T>
void describe_track(V& v, T& t) {
  v.number("grade", t.grade, {"1", "percent", between(-0.1, 0.1)}, "Rise over run in the direction of travel.");
  v.list("curves", t.curves, [](auto& w, auto& c) { describe_curve(w, c); }, "Arcs; straight between and outside of them.", false);
}

template <class V, class B>
void describe_brakes(V& v, B& b) {
  v.choice("law", b.law, kBrakeLaws, "friction: ground.on_track_friction on every car at once, as in the paper; air: an emergency application.");
  v.number("rolling_resistance", b.rolling_resistance, {"1", "", between(0, 1)}, "Of a car on the rails, over its weight.");
  v.number("force", b.force, {"1", "", between(0, 1)}, "B: brake force over weight, built up; 0: a runaway.");
  v.number("build_up_time", b.build_up_time, {"s", "", at_least(0)}, "t_b, from nothing to B.");
  v.number("dead_time", b.dead_time, {"s", "", at_least(0)}, "Of each car's valve, after the signal.");
  v.number("propagation_speed", b.propagation_speed, {"m/s", "ft/s", above_or_infinite(0)}, "Of the signal along the brake pipe.");
  v.number("radio_delay", b.radio_delay, {"s", "", at_least(0)}, "Of brake sources that vent by radio.");
  v.choice("signal", b.signal, kBrakeSignals, "electronic (ECP): all cars at once.");
  v.number("emergency_time", b.emergency_time, {"s", "", any()}, "Of the application; left out: when the first coupler breaks.");
}

template <class V, class C>
void describe_contact(V& v, C& c) {
  v.choice("law", c.law, kContactLaws, "none: bodies pass through each other, as in the paper; elastic: they push each other apart.");
  v.number("stiffness", c.stiffness, {"N/m", "lbf/ft", above(0)}, "k_c, force over depth of two footprints.");
  v.number("restitution", c.restitution, {"1", "", between(0, 1)}, "Speed after over speed before, of a central hit.");
  v.number("friction", c.friction, {"1", "", between(0, 10)}, "Between two bodies.");
  v.number("crush_force", c.crush_force, {"N", "kip", above_or_infinite(0)}, "Force at which the bodies yield.");
}

template <class V, class P>
void describe_perturbation_sizes(V& v, P& p) {
  v.number("spacing", p.spacing, {"m", "ft", at_least(0)}, "Every car but the first starts set back by this times |N(0,1)|.");
  v.number("yaw_rate", p.yaw_rate, {"1", "", at_least(0)}, "Omega is multiplied by 1 + this times N(0,1).");
  v.number("kick", p.kick, {"m/s", "ft/s", at_least(0)}, "A truck that runs off at the point of derailment gets this times N(0,1) sideways (rails).");
  v.number("alignment", p.alignment, {"m", "ft", at_least(0)}, "Standard deviation of the lateral alignment of the rails.");
}

template <class V, class P>
void describe_perturbation(V& v, P& p) {
  describe_perturbation_sizes(v, p);
  v.integer("seed", p.seed, between(0, 9007199254740992.0), false, "Seed of them all.");
}

template <class V, class I>
void describe_initial(V& v, I& i) {
  v.number("speed", i.speed, required({"m/s", "mph", at_least(0)}), "V of all cars, forward along the track.");
  v.number("yaw_rate", i.yaw_rate, required({"rad/s", "", any()}), "Omega of the first car to derail, counter-clockwise; on rails (on_track_law) about its rear truck.");
  v.integer("cars_ahead", i.cars_ahead, between(0, kCarsMax - 1), false, "Cars of the consist that have passed the point of derailment unharmed (rails).");
  v.group("perturbation", i.perturbation, [](auto& w, auto& p) { describe_perturbation(w, p); }, "Small random differences between members of an ensemble.");
}

template <class V, class S>
void describe_stop(V& v, S& s) {
  v.number("speed", s.speed, {"m/s", "ft/s", at_least(0)}, "The run ends when every truck is slower than this.");
  v.number("time_max", s.time_max, {"s", "", above(0)}, "The run ends at this simulated time at the latest.");
}

template <class V, class O>
void describe_outcome(V& v, O& o) {
  v.number("off_track_threshold", o.off_track_threshold, {"m", "ft", above(0)}, "A car counts as off the track once a truck centre has been sideways by more.");
  v.number("sample_interval", o.sample_interval, {"s", "", above_up_to(0, 1)}, "Spacing of the samples in which counts, contacts and the stop rule are looked at.");
}

template <class V, class O>
void describe_output(V& v, O& o) {
  v.number("interval", o.interval, {"s", "", above_up_to(0, 10)}, "Grid of simulated time on which states are published and written.");
}

template <class V, class S>
void describe_solver(V& v, S& s) {
  v.choice("method", s.method, kMethods, "cash_karp, dormand_prince: explicit Runge-Kutta 5(4); bdf: implicit, banded Newton; semi_implicit: Euler's, for all parts beyond the paper.");
  v.number("rtol", s.rtol, {"1", "", above_up_to(0, 0.1)}, "Relative tolerance of the local error.");
  v.number("atol", s.atol, {"1", "", above_up_to(0, 0.1)}, "Absolute tolerance of the local error in m, rad, m/s, rad/s.");
  v.number("fixed_step", s.fixed_step, {"s", "", above_up_to(0, 1)}, "This step instead of error control; not for bdf; semi_implicit must have it.");
  v.integer("steps_max", s.steps_max, between(1, 9007199254740992.0), false, "More steps are taken for a failure.");
  v.number("wall_time_max", s.wall_time_max, {"s", "", above_or_infinite(0)}, "More computing than this, by the clock on the wall, is taken for a failure.");
}

template <class V, class S>
void describe(V& v, S& s) {
  v.text("title", s.title, "One line for tables and pictures.");
  v.list("consist", s.consist, [](auto& w, auto& c) { describe_block(w, c); }, "Blocks of equal cars, counted back from the foremost.", true);
  v.group("coupler", s.coupler, [](auto& w, auto& c) { describe_coupler(w, c); }, "Couplers, all alike.");
  v.group("ground", s.ground, [](auto& w, auto& g) { describe_ground(w, g); }, "Friction under the trucks.");
  v.group("rails", s.rails, [](auto& w, auto& r) { describe_rails(w, r); }, "Rails that yield (ground.on_track_law: rails).");
  v.group("track", s.track, [](auto& w, auto& t) { describe_track(w, t); }, "Curves and grade (ground.on_track_law: rails).");
  v.group("brakes", s.brakes, [](auto& w, auto& b) { describe_brakes(w, b); }, "Brakes of the cars on the track.");
  v.group("contact", s.contact, [](auto& w, auto& c) { describe_contact(w, c); }, "Contact of car bodies.");
  v.group("initial", s.initial, [](auto& w, auto& i) { describe_initial(w, i); }, "Motion at time 0, in mid-slack on the track.");
  v.group("stop", s.stop, [](auto& w, auto& r) { describe_stop(w, r); }, "When the run ends.");
  v.group("outcome", s.outcome, [](auto& w, auto& o) { describe_outcome(w, o); }, "How the outcome is counted.");
  v.group("output", s.output, [](auto& w, auto& o) { describe_output(w, o); }, "What is published and written.");
  v.group("solver", s.solver, [](auto& w, auto& o) { describe_solver(w, o); }, "Integration.");
}

}  // namespace train_derail::inputs
