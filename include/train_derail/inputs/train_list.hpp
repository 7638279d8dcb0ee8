/// \file
/// Train lists: tables with one row a car, as railroads have them, become blocks of a scenario.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// A train that was read from a table, and all that was assumed.
struct TrainList {
  /// Equal neighbours.
  struct Block {
    CarBlock cars;                ///< as in a scenario; heights only where the type has its own
    int first = 1;                ///< number of its first car in the train, from 1
    std::string type;             ///< name of its type
    std::vector<int> hazmat;      ///< numbers of its cars with hazardous material
    bool weight_of_type = false;  ///< the list has no weight
    bool length_of_type = false;  ///< the list has no length
  };
  std::vector<Block> blocks;             ///< from the foremost car back
  const CouplerType* coupler = nullptr;  ///< that all cars have; null if the list does not say, or not one for all
  std::vector<std::string> assumptions;  ///< each a line of text
};

/// Reads a train list. Its columns are described by describe_train_lists().
/// \param types           car types; must outlive the result.
/// \param coupler_length  gap between the pins [m]: L is the length over the pulling faces less that.
/// Throws InputError, which gives line, column, value and what is allowed. Nothing is guessed: what the list does not
/// say, and is taken from the type of a car, stands in `assumptions`.
TrainList read_train_list(const std::string& path, const CarTypes& types, double coupler_length);

/// A value of a block, as its key has it.
struct BlockEntry {
  const char* key;    ///< "weight"
  std::string si;     ///< number in SI units, or text
  std::string shown;  ///< the same as YAML in the unit that people read: "286 kip"
};
/// Returns the values of a block that do not stand at their default, and those that every block has.
std::vector<BlockEntry> entries(const CarBlock& block);

/// Returns coupler.length [m] of a tree that need not be a whole scenario; the default if it has none. Throws
/// InputError, which names `source` or the file of the tree, if a key of the group coupler is wrong.
double coupler_length(const Layers& layers, const std::string& source, const std::vector<Override>& overrides = {});

/// Returns the scenario of a train list as YAML, with each assumption as a comment.
/// \param source  name of the table, for its title and comments.
/// \param base    scenario file for all but the consist, as it is to be written; "": none, and speed and yaw rate are
///                assumed too. They are added to the assumptions of `train`.
std::string to_scenario(TrainList& train, const std::string& source, const std::string& base);

/// Returns the tables of docs/import.md: columns with their other names, units, car types, couplers.
std::string describe_train_lists(const CarTypes& types);

}  // namespace train_derail::inputs
