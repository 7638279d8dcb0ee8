/// \file
/// `derail run --bag`: records the topics of the node without a ROS master. ROS libraries are loaded only if this is
/// asked for.
#pragma once

#include <memory>
#include <string>

#include "train_derail/files/output_file.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::apps {

class BagOutput {
 public:
  /// Removes the file if close() was not called.
  virtual ~BagOutput() = default;
  /// Must be called at each point of the output grid.
  virtual void grid_point() = 0;
  /// Completes the file and returns its name. Throws std::runtime_error, as grid_point() does, if the file could not be
  /// written.
  virtual std::string close(const simulation::Simulation& simulation, const outcome::Outcome& outcome) = 0;
};

/// Opens a bag. The simulation must be at time 0. Throws std::runtime_error if the file cannot be written or this build
/// has no ROS; throws files::ExistsError if the file exists.
std::unique_ptr<BagOutput> open_bag(const std::string& path, files::Existing existing,
                                    const simulation::Simulation& simulation);

/// Names of the module and of its function, and the type of that function.
inline constexpr char kBagModule[] = "libtrain_derail_bag.so";
inline constexpr char kBagFunction[] = "train_derail_open_bag";
using OpenBag = BagOutput* (*)(const std::string& path, files::Existing existing,
                               const simulation::Simulation& simulation);

}  // namespace train_derail::apps
