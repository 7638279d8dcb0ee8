/// \file
/// The moments of a run, kept to be shown again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// Moments of one run on its output grid, within a bound of memory: when it is full every second moment is dropped, and
/// from then on only every second, fourth, ... point of the grid is kept. The first and the newest are always there.
class RunHistory {
 public:
  /// One point of the grid.
  struct Moment {
    simulation::Snapshot now;
    std::shared_ptr<const outcome::Outcome> outcome;  ///< the newest that was known then; several moments share it
  };

  /// Keeps at most about `bytes_max` bytes; with 0 nothing is kept.
  explicit RunHistory(std::size_t bytes_max) : bytes_max_(bytes_max) {}

  /// Forgets everything.
  void clear();
  /// Adds the next moment. Times grow from one call to the next.
  void add(const simulation::Snapshot& now, std::shared_ptr<const outcome::Outcome> outcome);
  /// Gives the newest moment the outcome of the whole run.
  void conclude(std::shared_ptr<const outcome::Outcome> outcome);
  /// Returns the moment nearest to `time` [s]; null if there is none.
  const Moment* nearest(double time) const;
  /// Returns the time of the newest moment; 0 if there is none [s].
  double until() const { return moments_.empty() ? 0.0 : moments_.back().now.time; }
  /// Returns how many moments are kept.
  std::size_t size() const { return moments_.size(); }

 private:
  void thin_out();

  const std::size_t bytes_max_;
  std::vector<Moment> moments_;
  std::uint64_t points_ = 0;  ///< points of the grid so far
  std::uint64_t every_ = 1;   ///< of which one in so many is kept
};

}  // namespace train_derail::ros_face
