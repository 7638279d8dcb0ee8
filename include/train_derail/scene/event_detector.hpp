/// \file
/// Events of a run, found by comparing one point of the output grid with the one before.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/scene/marks.hpp"
#include "train_derail/scene/palette.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::scene {

/// What can happen; the numbers are those of Event.msg.
enum EventType : int {
  kCarPastPod = 1,
  kCarOffTrack,
  kContact,
  kCouplerPeak,
  kEnd,
  kCarDerailed,
  kCouplerBroken,
};

/// What a kind of event is called, and its colour on a time line.
struct EventFacts {
  const char* name;
  Rgb colour;
};
/// By EventType; the first one is none.
inline constexpr std::array<EventFacts, 8> kEventFacts{{{"", {0, 0, 0}},
                                                        {"past the point", {86, 180, 233}},
                                                        {"off the track", {184, 168, 0}},
                                                        {"fastest touch so far", kStarRim},
                                                        {"peak coupler force", {0, 114, 178}},
                                                        {"end", {85, 91, 102}},
                                                        {"car derailed", {213, 94, 0}},
                                                        {"coupler broken", {0, 0, 0}}}};

/// One event; on the topics a message of ~events.
struct Occurrence {
  int type = 0;        ///< an EventType
  double time = 0.0;   ///< simulated time [s]
  int car = 0;         ///< car that it happened to, from 1; 0: none
  int other_car = 0;   ///< second car of a touch, from 1; 0: none
  int coupler = 0;     ///< coupler that it happened to, from 1; 0: none
  double value = 0.0;  ///< its size, SI; Event.msg says what it is for each type
  std::string text;    ///< one line for people
};

/// Threshold of COUPLER_PEAK events unless something else is asked for [N].
inline constexpr double kEventCouplerForce = 1000.0 * inputs::kKip;

/// Finds what happened between two points of the output grid. Each run needs an object of its own.
class EventDetector {
 public:
  /// A coupler whose axial force exceeds `coupler_force` [N], in buff or draft, yields one event with its peak once the
  /// force has fallen to half of that.
  explicit EventDetector(double coupler_force) : threshold_(coupler_force) {}

  /// Returns what has happened since the last call. `incidents` are those of the same run so far; they only grow.
  std::vector<Occurrence> observe(const simulation::Snapshot& now, const outcome::Outcome& outcome,
                                  const model::Incidents& incidents);
  /// The same of a simulation, where nobody else asks for its outcome at this moment: that would cost more.
  std::vector<Occurrence> observe(const simulation::Snapshot& now, const simulation::Simulation& simulation);

 private:
  struct Peak {
    bool over = false;   ///< whether the force is above the threshold
    double force = 0.0;  ///< force at the peak, buff positive [N]
    double time = 0.0;   ///< simulated time of the peak [s]
  };
  void observe_incidents(const simulation::Snapshot& now, const model::Incidents& incidents,
                         std::vector<Occurrence>& found);
  void observe_coupler(int number, double time, double force, bool last, std::vector<Occurrence>& found);

  double threshold_;
  std::vector<bool> past_pod_, off_track_, derailed_;
  std::size_t derailments_ = 0, broken_ = 0;  ///< counts of incidents seen so far
  std::vector<Peak> peaks_;
  int touches_ = 0;
  double fastest_ = -1.0;
  bool ended_ = false;
};

}  // namespace train_derail::scene
