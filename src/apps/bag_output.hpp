// `derail run --bag`: the node's topics in a bag, without a master. What it needs of ROS is loaded only when asked for.
#pragma once

#include <memory>
#include <string>

#include "train_derail/files/output_file.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::apps {

class BagOutput {
 public:
  /// What has not been closed is removed.
  virtual ~BagOutput() = default;
  /// Whenever the simulation has reached a point of the output grid.
  virtual void grid_point(const simulation::Simulation& simulation) = 0;
  /// Returns the file's name. Throws std::runtime_error, as grid_point() does, if the file could not be written.
  virtual std::string close(const simulation::Simulation& simulation, const outcome::Outcome& outcome) = 0;
};

/// The simulation must be at time 0. Throws std::runtime_error if the file cannot be written or this build has no ROS,
/// files::ExistsError.
std::unique_ptr<BagOutput> open_bag(const std::string& path, files::Existing existing,
                                    const simulation::Simulation& simulation);

/// Name and type of the function that the module libtrain_derail_bag.so offers.
inline constexpr char kBagModule[] = "libtrain_derail_bag.so";
inline constexpr char kBagFunction[] = "train_derail_open_bag";
using OpenBag = BagOutput* (*)(const std::string& path, files::Existing existing,
                               const simulation::Simulation& simulation);

}  // namespace train_derail::apps
