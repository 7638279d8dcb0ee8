#pragma once

#include <string>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// One entry of ~events; types as in Event.msg.
struct Occurrence {
  int type = 0;
  double time = 0.0;  // simulated [s]
  int car = 0, other_car = 0, coupler = 0;
  double value = 0.0;
  std::string text;
};

/// Finds what happened between two points of the output grid. One object a run.
class EventDetector {
 public:
  /// A coupler whose force goes over `coupler_force` [N] yields one event, with its peak, when it has fallen to half.
  explicit EventDetector(double coupler_force) : threshold_(coupler_force) {}

  /// `incidents` of the same run, which only grow.
  std::vector<Occurrence> observe(const simulation::Snapshot& now, const outcome::Outcome& outcome,
                                  const model::Incidents& incidents);

 private:
  struct Peak {
    bool over = false;
    double force = 0.0;  // buff positive [N]
    double time = 0.0;   // s
  };
  void observe_incidents(const simulation::Snapshot& now, const model::Incidents& incidents,
                         std::vector<Occurrence>& found);
  void observe_coupler(int number, double time, double force, bool last, std::vector<Occurrence>& found);

  double threshold_;
  std::vector<bool> past_pod_, off_track_, derailed_;
  std::size_t derailments_ = 0, broken_ = 0;  // of the incidents, seen so far
  std::vector<Peak> peaks_;
  int touches_ = 0;
  double fastest_ = -1.0;
  bool ended_ = false;
};

}  // namespace train_derail::ros_face
