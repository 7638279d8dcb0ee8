// What a run yields. Cars and couplers are numbered from 1 as in the paper; 0 means "none".
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

enum class Ended {
  running,             // not yet
  at_rest,             // every truck slower than stop.speed
  time_max,            // stop.time_max reached
  integration_failed,  // see message
};
inline constexpr std::array<std::string_view, 4> kEndedNames{"running", "at_rest", "time_max", "integration_failed"};
inline std::string_view to_string(Ended ended) { return kEndedNames[static_cast<std::size_t>(ended)]; }

/// Two cars whose footprints (length x width rectangles) come to touch: the relative speed of the two bodies at the
/// point of first touch, at the sample in which it is first seen. The model lets bodies pass through each other: only
/// the first touch of a pair counts, and again after they have parted.
struct Closing {
  double speed = 0.0;         // magnitude of the relative velocity [m/s]
  double normal_speed = 0.0;  // its component that closes the gap [m/s]
  int car_a = 0, car_b = 0;   // a < b
  double time = 0.0;          // s
  double x = 0.0, y = 0.0;    // where [m]
};

/// Largest relative speed of two neighbouring cars whose coupler holds: of their facing pins, or of their centres of
/// mass.
struct RelativeSpeed {
  double speed = 0.0;  // m/s
  int coupler = 0;     // between cars `coupler` and `coupler + 1`
  double time = 0.0;   // s
};

struct PeakForce {
  double force = 0.0;  // magnitude [N]
  int coupler = 0;
  double time = 0.0;  // s
};

/// Extent of the footprints of the cars that have derailed or are off the track.
struct PileUp {
  double length = 0.0;       // along the track [m]
  double width = 0.0;        // across it [m]
  double area = 0.0;         // of the convex hull [m^2]
  int cars_across = 0;       // stand at more than 60 degrees to the track
  int groups = 0;            // of derailed cars next to each other in the train
  int main_cars = 0;         // in the main pile: cars turned by more than 30 degrees, no gap longer than kMainPileGap
  double main_length = 0.0;  // of the main pile, along the track [m]
};
inline constexpr double kMainPileGap = 15.0;                    // along the track [m]
inline constexpr double kMainPileCosine = 0.86602540378443865;  // of 30 degrees

/// Bodies that hit each other (contact.law); those that close at less than 1 mph are not counted.
struct Impacts {
  int count = 0;
  double closing_normal_max = 0.0;  // speed at which the gap closed [m/s]
  double peak_force = 0.0;          // normal [N]
  double impulse_max = 0.0;         // [N s]
};
inline constexpr double kImpactSpeedMin = inputs::kMph;

/// Cars by what took their first truck off the rails.
struct DerailedBy {
  int pod = 0, lateral = 0, torn_track = 0;
};

struct Outcome {
  int cars = 0;
  int cars_past_pod = 0;      // centre of mass has reached x >= 0 (the paper's definition in its text)
  int cars_derailed = 0;      // a truck off the rails; where rails never yield, the cars past the point of derailment
  DerailedBy derailed_by;     // rails that yield only
  int cars_off_track = 0;     // a truck centre has ever been sideways by more than outcome.off_track_threshold
  Closing closing_speed_max;  // the fastest
  int touches = 0;            // first touches of footprints that were counted
  RelativeSpeed relative_speed_max;  // of facing pins
  RelativeSpeed centre_speed_max;    // of centres of mass
  PeakForce coupler_buff_peak;
  PeakForce coupler_draft_peak;
  double stop_time = 0.0;  // simulated time at the end, or so far [s]
  PileUp pile_up;
  int couplers_broken = 0;
  Impacts impacts;
  double blockage_force = 0.0;   // mean buff force on the foremost car that stands on the rails behind the derailed
                                 // ones, while their coupler holds [N]
  model::EnergyLedger energy;    // at stop_time
  double energy_initial = 0.0;   // J
  double energy_residual = 0.0;  // |total - initial| / initial, or / what a grade has given a train that stood
  Ended ended = Ended::running;
  std::string message;                // why the integration failed
  std::vector<std::string> warnings;  // what should be looked at before the numbers are believed; one line each
  solver::Statistics solver;
  double wall_time = 0.0;  // spent in integrating and monitoring [s]

  double coupler_force_peak() const {
    return coupler_buff_peak.force > coupler_draft_peak.force ? coupler_buff_peak.force : coupler_draft_peak.force;
  }
};

}  // namespace train_derail::outcome
