/// \file
/// A run, saved at one moment: it can be gone on with bit for bit, in another process, or with other inputs from there.
#pragma once

#include <cstdint>
#include <iosfwd>
#include <string>
#include <vector>

namespace train_derail::simulation {

/// All that a run's future depends on. Made by Simulation::checkpoint(), taken by a constructor of Simulation.
struct Checkpoint {
  std::string source = "checkpoint";  ///< what errors call it: the path of its file
  std::string scenario;               ///< YAML in SI units, all defaults filled in (inputs::to_yaml)
  double time = 0.0;                  ///< simulated [s]
  std::vector<std::uint8_t> bytes;    ///< for files::Archive
};

/// Writes it to a stream, best of a files::OutputFile: whole or not at all.
void write_checkpoint(const Checkpoint& checkpoint, std::ostream& out);

/// Throws inputs::InputError if the file cannot be read, is no checkpoint, is damaged, or was written by another
/// version of train_derail (whose arithmetic may differ).
Checkpoint read_checkpoint(const std::string& path);

}  // namespace train_derail::simulation
