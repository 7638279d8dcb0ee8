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
    return (min_open ? v > min : v >= min) && v <= max;  // false for NaN
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

inline constexpr std::array<Names<OnTrackLaw>, 3> kOnTrackLaws{
    {{"isotropic", OnTrackLaw::isotropic}, {"along_track", OnTrackLaw::along_track}, {"guided", OnTrackLaw::guided}}};
inline constexpr std::array<Names<Method>, 3> kMethods{
    {{"cash_karp", Method::cash_karp}, {"dormand_prince", Method::dormand_prince}, {"bdf", Method::bdf}}};

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
}

template <class V, class C>
void describe_coupler(V& v, C& c) {
  v.number("length", c.length, {"m", "ft", above(0)}, "G0, between the pins at mid-slack.");
  v.number("slack", c.slack, {"m", "ft", at_least(0)}, "s, whole dead band of the gap, half to either side of G0.");
  v.number("stiffness", c.stiffness, {"N/m", "lbf/ft", at_least(0)}, "K, in buff and in draft, outside the slack.");
  v.number("swing_limit", c.swing_limit, {"rad", "deg", between(0, 3.14159265358979)}, "S, free swing to either side.");
  v.number("swing_stiffness", c.swing_stiffness, {"N m/rad", "lbf ft/rad", at_least(0)}, "K_m, slope of the end moment beyond the limit.");
  v.number("swing_moment_max", c.swing_moment_max, {"N m", "lbf ft", at_least_or_infinite(0)}, "m_max, plateau of the end moment.");
}

template <class V, class G>
void describe_ground(V& v, G& g) {
  v.number("on_track_friction", g.on_track_friction, {"1", "", between(0, 10)}, "mu of a car before the point of derailment (emergency braking).");
  v.number("off_track_friction", g.off_track_friction, {"1", "", between(0, 10)}, "mu of a car past it.");
  v.choice("on_track_law", g.on_track_law, kOnTrackLaws, "What a car on the track feels sideways (docs/model.md).");
  v.number("regularization_speed", g.regularization_speed, {"m/s", "ft/s", above(0)}, "v_eps: the friction force is mu W / 2 * v / sqrt(v^2 + v_eps^2).");
}

template <class V, class P>
void describe_perturbation(V& v, P& p) {
  v.number("spacing", p.spacing, {"m", "ft", at_least(0)}, "Every car but the first starts set back by this times |N(0,1)|.");
  v.number("yaw_rate", p.yaw_rate, {"1", "", at_least(0)}, "Omega is multiplied by 1 + this times N(0,1).");
  v.integer("seed", p.seed, between(0, 9007199254740992.0), false, "Seed of both.");
}

template <class V, class I>
void describe_initial(V& v, I& i) {
  v.number("speed", i.speed, required({"m/s", "mph", at_least(0)}), "V of all cars, forward along the track.");
  v.number("yaw_rate", i.yaw_rate, required({"rad/s", "", any()}), "Omega of the first car, counter-clockwise.");
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
  v.choice("method", s.method, kMethods, "cash_karp, dormand_prince: explicit Runge-Kutta 5(4); bdf: implicit, banded Newton.");
  v.number("rtol", s.rtol, {"1", "", above_up_to(0, 0.1)}, "Relative tolerance of the local error.");
  v.number("atol", s.atol, {"1", "", above_up_to(0, 0.1)}, "Absolute tolerance of the local error in m, rad, m/s, rad/s.");
  v.number("fixed_step", s.fixed_step, {"s", "", above_up_to(0, 1)}, "Explicit methods only: this step instead of error control.");
  v.integer("steps_max", s.steps_max, between(1, 9007199254740992.0), false, "More steps are taken for a failure.");
}

template <class V, class S>
void describe(V& v, S& s) {
  v.text("title", s.title, "One line for tables and pictures.");
  v.list("consist", s.consist, [](auto& w, auto& c) { describe_block(w, c); }, "Blocks of equal cars, counted back from the first car to derail.");
  v.group("coupler", s.coupler, [](auto& w, auto& c) { describe_coupler(w, c); }, "Couplers, all alike.");
  v.group("ground", s.ground, [](auto& w, auto& g) { describe_ground(w, g); }, "Friction under the trucks.");
  v.group("initial", s.initial, [](auto& w, auto& i) { describe_initial(w, i); }, "Motion at time 0, in mid-slack on the track.");
  v.group("stop", s.stop, [](auto& w, auto& r) { describe_stop(w, r); }, "When the run ends.");
  v.group("outcome", s.outcome, [](auto& w, auto& o) { describe_outcome(w, o); }, "How the outcome is counted.");
  v.group("output", s.output, [](auto& w, auto& o) { describe_output(w, o); }, "What is published and written.");
  v.group("solver", s.solver, [](auto& w, auto& o) { describe_solver(w, o); }, "Integration.");
}

}  // namespace train_derail::inputs
