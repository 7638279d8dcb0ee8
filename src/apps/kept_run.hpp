/// \file
/// A run that is kept for a page while it is computed.
#pragma once

#include <string>

#include "train_derail/scene/event_detector.hpp"
#include "train_derail/scene/replay.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::apps {

class KeptRun {
 public:
  /// Keeps the first moment.
  explicit KeptRun(const simulation::Simulation& simulation)
      : replay_(simulation.scenario(), simulation.cars()), events_(scene::kEventCouplerForce) {
    add(simulation);
  }
  /// To be called at each point of the output grid.
  void add(const simulation::Simulation& simulation) {
    const simulation::Snapshot now = simulation.snapshot();
    replay_.add(now, events_.observe(now, simulation));
  }
  /// See scene::Replay::document().
  std::string document(const scene::ReplayNames& names, const simulation::Simulation& simulation,
                       const outcome::Outcome& outcome) const {
    return replay_.document(names, outcome, simulation.touches());
  }

 private:
  scene::Replay replay_;
  scene::EventDetector events_;
};

}  // namespace train_derail::apps
