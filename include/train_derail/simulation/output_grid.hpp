/// \file
/// The output grid of a run: multiples of output.interval, at which states are recorded.
#pragma once

#include <atomic>
#include <cstdint>

#include "train_derail/simulation/simulation.hpp"

namespace train_derail::simulation {

/// Takes a run from point to point of its output grid.
class OutputGrid {
 public:
  /// \param simulation  must outlive the grid; nobody else may advance it meanwhile.
  explicit OutputGrid(Simulation& simulation);

  /// Runs on to the next point, or to the end of the run if that comes first, or until soon after `stop` is set.
  /// Returns whether time has gone on: then there is a state to be recorded.
  bool advance(const std::atomic<bool>* stop = nullptr);
  /// Number of the point that advance() was to reach last; 0: that of time 0.
  std::int64_t point() const { return point_; }

 private:
  Simulation& simulation_;
  std::int64_t point_;
};

}  // namespace train_derail::simulation
