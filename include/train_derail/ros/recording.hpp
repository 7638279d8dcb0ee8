/// \file
/// A run that was recorded in a bag, to be shown again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "train_derail/ros/run_view.hpp"

namespace train_derail::ros_face {

/// Which run of a bag.
struct RunInBag {
  std::string node;      ///< full name of the node that sent it, "/train_derail"
  std::uint32_t run_id;  ///< counts the runs of this node from 1
};
/// Returns the runs that a bag tells the inputs of, by node and number. Throws inputs::InputError if
/// it cannot be read or holds no run of train_derail.
std::vector<RunInBag> runs_in_bag(const std::string& path);

/// One run of a bag, read whole into memory. It is advanced as a simulation is.
class Recording final : public RunView {
 public:
  /// Reads the run with the number `run_id` of the first node that has one; 0: the last one of the bag. Throws
  /// inputs::InputError if it cannot be read, holds no run of train_derail, or not this one.
  Recording(const std::string& path, std::uint32_t run_id);
  /// Reads a run of runs_in_bag().
  Recording(const std::string& path, const RunInBag& run);

  /// Goes on to the last recorded moment that is not later than `t` [s]; back, if `t` is earlier.
  void advance(double t);
  /// Returns the last recorded moment that is not later than `t` [s].
  const simulation::Snapshot& at(double t) const { return moments_[index(t)]; }
  /// Returns what the run had yielded by `t` [s].
  outcome::Outcome outcome_at(double t) const;
  /// Returns all moments, in the order of time; at least one.
  const std::vector<simulation::Snapshot>& moments() const { return moments_; }
  /// Returns the time of the last moment [s].
  double until() const { return moments_.back().time; }

  const inputs::Scenario& scenario() const override { return scenario_; }
  const std::vector<model::Car>& cars() const override { return cars_; }
  double time() const override { return moments_[at_].time; }
  bool ended() const override { return at_ + 1 == moments_.size(); }
  simulation::Snapshot snapshot() const override { return moments_[at_]; }
  outcome::Outcome outcome() const override { return outcome_at(time()); }
  const std::vector<outcome::FirstTouch>& touches() const override { return touches_; }
  const std::vector<model::Impact>& impacts() const override;
  std::vector<scene::Occurrence> take_events(const simulation::Snapshot& now) override;
  std::vector<scene::Occurrence> take_last_events(const simulation::Snapshot& now,
                                                  const outcome::Outcome& /*outcome*/) override {
    return take_events(now);
  }

 private:
  /// Something that was sent at a moment of the run.
  template <class T>
  struct Sent {
    double time;  ///< simulated [s]
    T content;
  };

  std::size_t index(double t) const;

  inputs::Scenario scenario_;
  std::vector<model::Car> cars_;
  std::vector<simulation::Snapshot> moments_;  ///< at least one
  std::vector<Sent<outcome::Outcome>> outcomes_;
  std::vector<Sent<std::vector<model::Impact>>> impacts_;
  std::vector<Sent<scene::Occurrence>> events_;  ///< by the time at which they were sent
  std::vector<outcome::FirstTouch> touches_;
  std::size_t at_ = 0, events_taken_ = 0;
};

}  // namespace train_derail::ros_face
