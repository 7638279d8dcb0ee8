/// \file
/// What the messages of a run are made from, whether it is computed now or was recorded.
#pragma once

#include <vector>

#include "train_derail/scene/event_detector.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// One run as it stands. For the thread that advances it.
class RunView {
 public:
  virtual ~RunView() = default;

  virtual const inputs::Scenario& scenario() const = 0;
  /// Returns the cars in the order of the train.
  virtual const std::vector<model::Car>& cars() const = 0;
  /// Returns the simulated time [s].
  virtual double time() const = 0;
  virtual bool ended() const = 0;
  virtual simulation::Snapshot snapshot() const = 0;
  virtual outcome::Outcome outcome() const = 0;
  /// Returns the first touches so far, in the order of time.
  virtual const std::vector<outcome::FirstTouch>& touches() const = 0;
  /// Returns the impacts so far.
  virtual const std::vector<model::Impact>& impacts() const = 0;
  /// Returns what has happened since the last call. `now` is the snapshot of this moment.
  virtual std::vector<scene::Occurrence> take_events(const simulation::Snapshot& now) = 0;
  /// The same at the end of the run, with how it ended.
  virtual std::vector<scene::Occurrence> take_last_events(const simulation::Snapshot& now,
                                                          const outcome::Outcome& outcome) = 0;
};

/// A simulation as it stands.
class SimulationView final : public RunView {
 public:
  /// `simulation` must outlive the view. `coupler_force`: see scene::EventDetector.
  SimulationView(const simulation::Simulation& simulation, double coupler_force)
      : simulation_(simulation), events_(coupler_force) {}

  const inputs::Scenario& scenario() const override { return simulation_.scenario(); }
  const std::vector<model::Car>& cars() const override { return simulation_.cars(); }
  double time() const override { return simulation_.time(); }
  bool ended() const override { return simulation_.ended(); }
  simulation::Snapshot snapshot() const override { return simulation_.snapshot(); }
  outcome::Outcome outcome() const override { return simulation_.outcome(); }
  const std::vector<outcome::FirstTouch>& touches() const override { return simulation_.touches(); }
  const std::vector<model::Impact>& impacts() const override { return simulation_.incidents().impacts; }
  std::vector<scene::Occurrence> take_events(const simulation::Snapshot& now) override {
    return events_.observe(now, simulation_);
  }
  std::vector<scene::Occurrence> take_last_events(const simulation::Snapshot& now,
                                                  const outcome::Outcome& outcome) override {
    return events_.observe(now, outcome, simulation_.incidents());
  }

 private:
  const simulation::Simulation& simulation_;
  scene::EventDetector events_;
};

}  // namespace train_derail::ros_face
