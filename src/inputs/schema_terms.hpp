/// \file
/// What the schema is written in: ranges, units, names of choices, and the conditions under which keys act.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

struct Range {
  double min = -kInfinity, max = kInfinity;
  bool min_open = false, infinite = false;  // whether min itself is excluded; whether .inf is allowed

  bool contains(double v) const {
    if (v == kInfinity) return infinite;
    return v != -kInfinity && (min_open ? v > min : v >= min) && v <= max;  // NaN is never allowed
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

inline Range between(double min, double max) { return {min, max, false, false}; }
inline Range above_up_to(double min, double max) { return {min, max, true, false}; }
inline Range between_or_infinite(double min, double max) { return {min, max, false, true}; }

/// Units and ranges of a number. `unit` is the SI unit in UDUNITS notation, `shown` the unit that people read ("" if it
/// is the same). A value outside of `range`, which holds every train that is possible, is refused. A value outside of
/// `usual`, which holds real trains, gives a warning.
struct NumberInput {
  const char* unit;
  const char* shown;
  Range range;
  Range usual{-kInfinity, kInfinity, false, true};
  bool required = false;
};

inline NumberInput required(NumberInput q) {
  q.required = true;
  return q;
}

template <class E>
using Names = std::pair<std::string_view, E>;

/// What a choice is called in files.
template <class E, std::size_t N>
std::string name_of(const std::array<Names<E>, N>& names, E value) {
  const auto found = std::find_if(names.begin(), names.end(), [&](const Names<E>& n) { return n.second == value; });
  return found == names.end() ? "" : std::string(found->first);
}

inline constexpr std::array<Names<OnTrackLaw>, 4> kOnTrackLaws{{{"isotropic", OnTrackLaw::isotropic},
                                                                {"along_track", OnTrackLaw::along_track},
                                                                {"guided", OnTrackLaw::guided},
                                                                {"rails", OnTrackLaw::rails}}};
inline constexpr std::array<Names<Method>, 4> kMethods{{{"cash_karp", Method::cash_karp},
                                                        {"dormand_prince", Method::dormand_prince},
                                                        {"bdf", Method::bdf},
                                                        {"semi_implicit", Method::semi_implicit}}};
inline constexpr std::array<Names<Model>, 4> kModels{{{"by_parts", Model::by_parts},
                                                      {"paper", Model::paper},
                                                      {"extended", Model::extended},
                                                      {"spatial", Model::spatial}}};
inline constexpr std::array<Names<OffTrackLaw>, 2> kOffTrackLaws{
    {{"coulomb", OffTrackLaw::coulomb}, {"by_slip", OffTrackLaw::by_slip}}};
inline constexpr std::array<Names<BrakeLaw>, 2> kBrakeLaws{{{"friction", BrakeLaw::friction}, {"air", BrakeLaw::air}}};
inline constexpr std::array<Names<BrakeSignal>, 2> kBrakeSignals{
    {{"pneumatic", BrakeSignal::pneumatic}, {"electronic", BrakeSignal::electronic}}};
inline constexpr std::array<Names<BodyShape>, 2> kBodyShapes{
    {{"box", BodyShape::box}, {"cylinder", BodyShape::cylinder}}};
inline constexpr std::array<Names<BrakeSource>, 2> kBrakeSources{
    {{"none", BrakeSource::none}, {"remote", BrakeSource::remote}}};
inline constexpr std::array<Names<ContactLaw>, 2> kContactLaws{
    {{"none", ContactLaw::none}, {"elastic", ContactLaw::elastic}}};
inline constexpr std::array<Names<TieLaw>, 2> kTieLaws{{{"none", TieLaw::none}, {"guided", TieLaw::guided}}};
inline constexpr std::array<Names<TractionLaw>, 2> kTractionLaws{
    {{"none", TractionLaw::none}, {"steady", TractionLaw::steady}}};
inline constexpr std::array<Names<Mechanism>, 5> kMechanisms{{{"broken_rail", Mechanism::broken_rail},
                                                              {"bad_track", Mechanism::bad_track},
                                                              {"dragging_truck", Mechanism::dragging_truck},
                                                              {"train_forces", Mechanism::train_forces},
                                                              {"switch", Mechanism::turnout}}};
inline constexpr std::array<Names<FirstTruck>, 3> kFirstTrucks{
    {{"front", FirstTruck::front}, {"rear", FirstTruck::rear}, {"either", FirstTruck::either}}};

inline constexpr int kCarsMax = 1000;
inline const Range kYawInertiaFactors = between(0.01, 0.25), kUsualYawInertiaFactors = between(0.06, 0.13);
inline const Range kPlaces = between(-1e5, 1e5);  // positions along and across the track [m]
inline constexpr double kFullTurn = 360.0 * kDegree;
inline constexpr std::size_t kCurvesMax = 1000, kPatchesMax = 1000;

/// A part that only the extended model has, and that a scenario may switch on.
struct PartInput {
  const char* key;                        ///< that switches it on
  std::string (*value)(const Scenario&);  ///< its value if it is on, else ""
  bool needs_rails;                       ///< acts only with ground.on_track_law: rails
};
inline std::string on_text(bool on, const std::string& value) { return on ? value : ""; }
/// Of a number that switches a part on by any value but the one that it has if nobody sets it.
template <auto part, auto number>
std::string if_set(const Scenario& s) {
  static const Scenario nobody;
  const double value = (s.*part).*number;
  return on_text(value != (nobody.*part).*number, number_text(value));
}
inline const std::array<PartInput, 20> kParts{{
    {"ground.on_track_law",
     [](const Scenario& s) { return on_text(s.ground.on_track_law == OnTrackLaw::rails, "rails"); }, false},
    {"ground.off_track_law",
     [](const Scenario& s) { return on_text(s.ground.off_track_law == OffTrackLaw::by_slip, "by_slip"); }, false},
    {"ground.load_exponent", if_set<&Scenario::ground, &Ground::load_exponent>, false},
    {"rails.load_exponent", if_set<&Scenario::rails, &Rails::load_exponent>, true},
    {"ground.patches",
     [](const Scenario& s) {
       return on_text(!s.ground.patches.empty(), fmt::format("{} patches", s.ground.patches.size()));
     },
     false},
    {"brakes.law", [](const Scenario& s) { return on_text(s.brakes.law == BrakeLaw::air, "air"); }, true},
    {"contact.law", [](const Scenario& s) { return on_text(s.contact.law == ContactLaw::elastic, "elastic"); }, false},
    {"coupler.draft_gear_travel", if_set<&Scenario::coupler, &Coupler::draft_gear_travel>, false},
    {"coupler.damping_ratio", if_set<&Scenario::coupler, &Coupler::damping_ratio>, false},
    {"coupler.break_draft", if_set<&Scenario::coupler, &Coupler::break_draft>, false},
    {"coupler.break_swing", if_set<&Scenario::coupler, &Coupler::break_swing>, false},
    {"coupler.break_moment", if_set<&Scenario::coupler, &Coupler::break_moment>, false},
    {"track.grade", if_set<&Scenario::track, &Track::grade>, true},
    {"track.curves",
     [](const Scenario& s) {
       return on_text(!s.track.curves.empty(), fmt::format("{} curves", s.track.curves.size()));
     },
     true},
    {"traction.law", [](const Scenario& s) { return on_text(s.traction.law == TractionLaw::steady, "steady"); }, true},
    {"ties.law", [](const Scenario& s) { return on_text(s.ties.law == TieLaw::guided, "guided"); }, true},
    {"initial.mechanism",
     [](const Scenario& s) {
       return on_text(s.initial.mechanism != Mechanism::broken_rail, name_of(kMechanisms, s.initial.mechanism));
     },
     true},
    {"initial.cars_ahead",
     [](const Scenario& s) { return on_text(s.initial.cars_ahead > 0, fmt::format("{}", s.initial.cars_ahead)); },
     true},
    {"initial.perturbation.kick",
     [](const Scenario& s) {
       return on_text(s.initial.perturbation.kick > 0.0, number_text(s.initial.perturbation.kick));
     },
     true},
    {"initial.perturbation.alignment",
     [](const Scenario& s) {
       return on_text(s.initial.perturbation.alignment > 0.0, number_text(s.initial.perturbation.alignment));
     },
     true},
}};

/// The condition under which a key has an effect. If the scenario chooses laws that do not use the key, a warning says
/// so.
struct When {
  bool (*holds)(const Scenario&);
  const char* text;  // the condition in words, after "it acts with"
};
inline constexpr When kOnRails{[](const Scenario& s) { return s.ground.on_track_law == OnTrackLaw::rails; },
                               "ground.on_track_law: rails"};
inline constexpr When kYieldingRails{
    [](const Scenario& s) { return s.ground.on_track_law == OnTrackLaw::rails && s.rails.derail_ratio < kInfinity; },
    "ground.on_track_law: rails and a finite rails.derail_ratio"};
inline constexpr When kRolling{
    [](const Scenario& s) { return model_of(s) == Model::extended && kYieldingRails.holds(s); },
    "model: extended, ground.on_track_law: rails and a finite rails.derail_ratio"};
inline constexpr When kFrictionBrakes{[](const Scenario& s) { return s.brakes.law == BrakeLaw::friction; },
                                      "brakes.law: friction"};
inline constexpr When kAirBrakes{[](const Scenario& s) { return s.brakes.law == BrakeLaw::air; }, "brakes.law: air"};
inline constexpr When kPneumatic{
    [](const Scenario& s) { return s.brakes.law == BrakeLaw::air && s.brakes.signal == BrakeSignal::pneumatic; },
    "brakes.law: air and brakes.signal: pneumatic"};
inline constexpr When kRadio{[](const Scenario& s) {
                               const auto remote = [](const CarBlock& b) {
                                 return b.brake_source == BrakeSource::remote;
                               };
                               return kPneumatic.holds(s) && std::any_of(s.consist.begin(), s.consist.end(), remote);
                             },
                             "brakes.law: air, brakes.signal: pneumatic and a block with brake_source: remote"};
inline constexpr When kCoulombGround{[](const Scenario& s) { return s.ground.off_track_law == OffTrackLaw::coulomb; },
                                     "ground.off_track_law: coulomb"};
inline constexpr When kSlipGround{[](const Scenario& s) { return s.ground.off_track_law == OffTrackLaw::by_slip; },
                                  "ground.off_track_law: by_slip"};
inline constexpr When kContact{[](const Scenario& s) { return s.contact.law == ContactLaw::elastic; },
                               "contact.law: elastic"};
inline constexpr When kExtended{[](const Scenario& s) { return model_of(s) == Model::extended; }, "model: extended"};
inline constexpr When kSpatial{[](const Scenario& s) { return s.model == Model::spatial; }, "model: spatial"};
inline constexpr When kFlange{[](const Scenario& s) { return kSpatial.holds(s) && kYieldingRails.holds(s); },
                              "model: spatial, ground.on_track_law: rails and a finite rails.derail_ratio"};
inline constexpr When kDraftGear{[](const Scenario& s) { return s.coupler.draft_gear_travel > 0.0; },
                                 "a coupler.draft_gear_travel above 0"};
inline constexpr When kSwingStop{[](const Scenario& s) { return s.coupler.swing_stiffness > 0.0; },
                                 "a coupler.swing_stiffness above 0"};
inline constexpr When kPerturbed{[](const Scenario& s) {
                                   const Perturbation& p = s.initial.perturbation;
                                   return p.spacing > 0.0 || p.yaw_rate > 0.0 || p.kick > 0.0 || p.alignment > 0.0 ||
                                          p.emergency_time > 0.0 || s.ties.law == TieLaw::guided ||
                                          s.initial.mechanism != Mechanism::broken_rail ||
                                          s.contact.law == ContactLaw::elastic;
                                 },
                                 "a size of initial.perturbation above 0, or a law that leaves something to chance"};
inline bool starts_by_chance(const Scenario& s) {
  return s.initial.mechanism == Mechanism::bad_track || s.initial.mechanism == Mechanism::turnout;
}
inline constexpr When kByChance{starts_by_chance, "initial.mechanism: bad_track or switch"};
inline constexpr When kBadTrack{[](const Scenario& s) { return s.initial.mechanism == Mechanism::bad_track; },
                                "initial.mechanism: bad_track"};
inline constexpr When kTrainForces{[](const Scenario& s) { return s.initial.mechanism == Mechanism::train_forces; },
                                   "initial.mechanism: train_forces"};
inline constexpr When kTurnout{
    [](const Scenario& s) { return s.initial.mechanism == Mechanism::turnout && s.ties.law == TieLaw::guided; },
    "initial.mechanism: switch and ties.law: guided"};
inline constexpr When kFirstTruck{[](const Scenario& s) { return s.initial.mechanism != Mechanism::broken_rail; },
                                  "another initial.mechanism than broken_rail"};
inline constexpr When kTraction{[](const Scenario& s) { return s.traction.law == TractionLaw::steady; },
                                "traction.law: steady"};
inline constexpr When kObstaclesBySpeed{
    [](const Scenario& s) { return s.obstacles.rate > 0.0 && s.obstacles.speed_exponent != 0.0; },
    "an obstacles.rate above 0 and an obstacles.speed_exponent"};
inline constexpr When kOnTies{[](const Scenario& s) { return s.ties.law == TieLaw::guided; }, "ties.law: guided"};
inline constexpr When kPartingPipe{
    [](const Scenario& s) { return s.ties.law == TieLaw::guided && s.brakes.law == BrakeLaw::air; },
    "ties.law: guided and brakes.law: air"};
inline constexpr When kEmergencyTime{
    [](const Scenario& s) { return s.brakes.law == BrakeLaw::air && s.brakes.emergency_time.has_value(); },
    "brakes.law: air and a brakes.emergency_time"};
inline constexpr When kEmergencyBySpeed{
    [](const Scenario& s) { return kEmergencyTime.holds(s) && s.brakes.emergency_speed_exponent != 0.0; },
    "brakes.law: air, a brakes.emergency_time and a brakes.emergency_speed_exponent"};
inline constexpr When kNotPaper{[](const Scenario& s) { return s.model != Model::paper; },
                                "another model than the paper's"};
inline constexpr When kLoadExponent{[](const Scenario& s) { return s.ground.load_exponent != 1.0; },
                                    "another ground.load_exponent than 1"};
inline constexpr When kRailLoadExponent{[](const Scenario& s) { return s.rails.load_exponent != 1.0; },
                                        "another rails.load_exponent than 1"};
inline constexpr When kErrorControl{
    [](const Scenario& s) { return s.solver.method != Method::semi_implicit && !s.solver.fixed_step; },
    "solver.method: cash_karp, dormand_prince or bdf, without solver.fixed_step"};

/// The meaning of a key or group, and when it has an effect; null: always.
struct Doc {
  Doc(const char* meaning, const When* acts_when = nullptr) : text(meaning), when(acts_when) {}
  const char* text;
  const When* when;
};

/// Returns the condition that keeps a key from having an effect in this scenario, or null if it has one. `outer` is the
/// same for the group of the key.
inline const When* idle_because(const Scenario& s, const When* outer, const Doc& doc) {
  return outer != nullptr ? outer : doc.when != nullptr && !doc.when->holds(s) ? doc.when : nullptr;
}

}  // namespace train_derail::inputs
