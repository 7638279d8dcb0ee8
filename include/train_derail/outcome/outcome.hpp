/// \file
/// The outcome of a run. Cars and couplers are numbered from 1 as in the paper; 0 means "none". Numbers are in SI
/// units. outcome/fields.hpp gives each value its name and explanation in JSON, tables and messages.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/solver/integrator.hpp"

namespace train_derail::outcome {

/// Why a run ended.
enum class Ended {
  running,             ///< it has not ended yet
  at_rest,             ///< every truck is slower than stop.speed
  time_max,            ///< stop.time_max was reached
  integration_failed,  ///< the integration failed, see Outcome::message
  rolled_away,         ///< all that does not rest rolls away downhill for good, with nothing near (extended model)
};
/// Names of Ended in files and messages, by its value.
inline constexpr std::array<std::string_view, 5> kEndedNames{"running", "at_rest", "time_max", "integration_failed",
                                                             "rolled_away"};
/// Returns the name of `ended`.
inline std::string_view to_string(Ended ended) { return kEndedNames[static_cast<std::size_t>(ended)]; }

/// Those that a run can end with.
inline constexpr std::array<Ended, 4> kEnds{Ended::at_rest, Ended::time_max, Ended::integration_failed,
                                            Ended::rolled_away};

/// Ended in words for people, by its value.
inline constexpr std::array<std::string_view, 5> kEndedTexts{
    "running", "all cars at rest", "time limit reached", "integration failed", "at rest but for cars that roll away"};

/// A touch of two cars: their footprints (rectangles, length by width) begin to overlap. Speeds are those of the two
/// bodies at the point of the touch, in the sample in which the overlap is first seen. Without contact forces bodies
/// pass through each other; then a pair of cars counts once until their footprints have parted again.
struct FirstTouch {
  double speed = 0.0;         ///< closing speed: magnitude of the relative velocity [m/s]
  double speed_normal = 0.0;  ///< closing speed normal: the component that closes the gap [m/s]
  int car_a = 0, car_b = 0;   ///< the two cars, car_a < car_b
  double time = 0.0;          ///< simulated time [s]
  double x = 0.0, y = 0.0;    ///< point of the touch, world frame [m]
};

/// Largest relative speed of two neighbouring cars whose coupler is not broken, either of their facing pins or of their
/// centres of mass.
struct RelativeSpeed {
  double speed = 0.0;  ///< magnitude of the relative velocity [m/s]
  int coupler = 0;     ///< coupler between the cars `coupler` and `coupler + 1`
  double time = 0.0;   ///< simulated time [s]
};

/// Largest force of any coupler.
struct PeakForce {
  double force = 0.0;  ///< magnitude [N]
  int coupler = 0;     ///< coupler between the cars `coupler` and `coupler + 1`
  double time = 0.0;   ///< simulated time [s]
};

/// How far the cars that have derailed or are off the track reach from the centre line: what setbacks and crash walls
/// are judged by.
struct LateralReach {
  double farthest = 0.0;  ///< of the farthest corner of any footprint [m]
  /// Cars that reach farther than 10, 20 and 30 m.
  int beyond_10 = 0, beyond_20 = 0, beyond_30 = 0;

  /// Adds a car that reaches so far [m].
  void add(double reach) {
    farthest = reach > farthest ? reach : farthest;
    beyond_10 += reach > 10.0 ? 1 : 0;
    beyond_20 += reach > 20.0 ? 1 : 0;
    beyond_30 += reach > 30.0 ? 1 : 0;
  }
};

/// The pile-up: the cars that have derailed or are off the track, and what their footprints cover.
struct PileUp {
  double length = 0.0;       ///< along the track [m]
  double width = 0.0;        ///< across the track [m]
  double area = 0.0;         ///< area of the convex hull of the footprints [m^2]
  int cars_across = 0;       ///< cars at more than 60 degrees to the track
  int groups = 0;            ///< groups of counted cars that are next to each other in the train
  int main_cars = 0;         ///< cars in the main pile: turned by more than 30 degrees, no gap longer than kMainPileGap
  double main_length = 0.0;  ///< length of the main pile along the track [m]
  LateralReach lateral_reach;
};
/// Largest gap between neighbours in the main pile, along the track [m].
inline constexpr double kMainPileGap = 15.0;
/// Cosine of the angle of 30 degrees beyond which a car counts as turned.
inline constexpr double kMainPileCosine = 0.86602540378443865;

/// How the cars lie that have derailed or are off the track, by the angle between a car's own vertical axis and the
/// vertical. Models of space only; all zero in models of the plane.
struct Posture {
  int upright = 0;        ///< cars tilted by less than kLeaning
  int leaning = 0;        ///< cars tilted by less than kOver
  int on_side = 0;        ///< cars tilted by at most kInverted
  int inverted = 0;       ///< cars tilted by more
  int on_top = 0;         ///< cars the middle of whose body is more than kOnTop above that of a car below them
  double drop_max = 0.0;  ///< of the lowest point of any of them below the top of the rails [m]

  /// Cars on the side or inverted: what reports call overturned.
  int over() const { return on_side + inverted; }
  /// Cars that it tells of.
  int cars() const { return upright + leaning + over(); }
};
/// Bounds of the angle of Posture: 10, 45 and 135 degrees [rad].
inline constexpr double kLeaning = 10.0 * inputs::kDegree, kOver = 45.0 * inputs::kDegree,
                        kInverted = 135.0 * inputs::kDegree;
/// Half the height of a body: a car lies on another from here on [m].
inline constexpr double kOnTop = 1.5;

/// Impacts of car bodies with contact forces (contact.law). Those whose closing speed normal is below kImpactSpeedMin
/// are left out.
struct Impacts {
  int count = 0;                          ///< number of impacts
  double closing_speed_normal_max = 0.0;  ///< largest closing speed normal [m/s]
  double peak_force = 0.0;                ///< largest normal force [N]
  double impulse_max = 0.0;               ///< largest impulse of the normal force [N s]
};
/// Least closing speed normal of an impact that is counted, 1 mph [m/s].
inline constexpr double kImpactSpeedMin = inputs::kMph;

/// Derailed cars by the cause that took their first truck off the rails; only for rails that yield.
struct DerailedBy {
  int pod = 0,         ///< at the point of derailment
      lateral = 0,     ///< by lateral force
      torn_track = 0,  ///< on track that another truck had torn up
      bad_track = 0,   ///< on bad track, or at a switch
      defect = 0;      ///< by a defect of its own
};

/// Trucks that ran on the ties (ties.law: guided).
struct OnTies {
  int trucks = 0;             ///< that ran on the ties
  double distance_max = 0.0;  ///< longest distance that one of them ran, along the track [m]
  int obstacles = 0;          ///< obstacles that they met
  int thrown_off = 0;         ///< trucks that left the track bed
};

/// Tank cars that released what they hold, by the law of inputs::Release.
struct Released {
  int cars = 0;           ///< in this run, by its seed
  double expected = 0.0;  ///< mean over all seeds, for these impacts
};

/// All that a run yields.
struct Outcome {
  int cars = 0;                  ///< cars in the train
  int cars_past_pod = 0;         ///< cars whose centre of mass has reached x >= 0 ("derailed" in the paper's text)
  int cars_derailed = 0;         ///< cars with a truck off the rails; where rails never yield: cars_past_pod
  DerailedBy derailed_by;        ///< the derailed cars by cause; rails that yield only
  int cars_off_track = 0;        ///< cars of which a truck centre was ever farther off than outcome.off_track_threshold
  FirstTouch closing_speed_max;  ///< the touch with the largest closing speed
  int touches = 0;               ///< number of touches
  RelativeSpeed relative_speed_max;  ///< of the facing pins of neighbours
  RelativeSpeed centre_speed_max;    ///< of the centres of mass of neighbours
  PeakForce coupler_buff_peak;       ///< largest compression
  PeakForce coupler_draft_peak;      ///< largest tension
  double stop_time = 0.0;            ///< simulated time at the end, or so far [s]
  PileUp pile_up;
  Posture posture;
  OnTies on_ties;
  Released released;
  int couplers_broken = 0;  ///< couplers that broke, by draft force, swing or moment
  Impacts impacts;
  double blockage_force = 0.0;        ///< mean buff force on the foremost car on the rails behind the derailed
                                      ///< cars, while their coupler holds [N]
  model::EnergyLedger energy;         ///< energies and works at stop_time
  double energy_initial = 0.0;        ///< kinetic and strain energy at the start [J]
  double energy_residual = 0.0;       ///< |total - initial| / initial; for a train that stood: / work of the grade [-]
  Ended ended = Ended::running;       ///< why the run ended
  std::string message;                ///< why the integration failed; empty otherwise
  std::vector<std::string> warnings;  ///< what to check before the numbers are believed; one line each
  solver::Statistics solver;          ///< counters of the integrator
  double step = 0.0;                  ///< fixed step of the integrator [s]; 0: error control chooses each
  double step_max = 0.0;              ///< longest stable step (model::step_limits) [s]; 0 with error control
  std::string step_limited_by;        ///< input that makes a longer one unstable; empty with error control
  double wall_time = 0.0;             ///< computing time of integration and monitoring [s]

  /// Largest coupler force, buff or draft, a magnitude [N].
  double coupler_force_peak() const {
    return coupler_buff_peak.force > coupler_draft_peak.force ? coupler_buff_peak.force : coupler_draft_peak.force;
  }
};

}  // namespace train_derail::outcome
