/// \file
/// Reads scenarios. Files, the command line and the ROS parameter server are all turned into a YAML tree first, which
/// is then read here.
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

/// InputError::where() of a mistake in a changed input.
inline constexpr char kOverride[] = "override";

/// One changed input.
struct Override {
  std::string key;    ///< as in "initial.speed" or "consist[0].count"
  std::string value;  ///< as it would be written in the file, "50 mph"
};

/// Splits a text "key=value". Throws InputError if there is no '='.
Override parse_override(std::string_view text);

/// Throws InputError if there is no file at `path`, or a folder, a pipe or a device.
void require_file(const std::string& path);

/// Returns the content of a file. Throws InputError if the file cannot be read, has more than `bytes_max` bytes, or is
/// a folder, a pipe or a device.
std::string read_file(const std::string& path, std::size_t bytes_max);

/// Reads a YAML file as a tree, with merge keys (<<) resolved. Throws InputError if the file cannot be read, is not
/// YAML, is too long, is nested too deeply, has too many values (aliases count as often as they are used), or holds a
/// value that roslaunch (YAML 1.1) would read as another one.
YAML::Node load_file(const std::string& path);
/// Reads YAML from a text in the same way; `source` is its name in errors.
YAML::Node load_text(const std::string& text, const std::string& source);

/// A scenario tree that has been completed by its base files (key `base`).
struct Layers {
  YAML::Node tree;  ///< the whole tree, without the key `base`
  /// File from which a key and all keys below it come. The entry "" is for all keys without an entry of their own.
  /// Empty if the tree had no base.
  std::map<std::string, std::string> sources;
  std::string consist_folder;  ///< from which the files of a train list start that the key `consist` names
};
/// Completes `tree` by the scenario file that its key `base` names, and by the base of that file in turn. Values of the
/// tree itself win. Groups are completed key by key; lists are taken as a whole.
/// \param source          name of the tree in errors.
/// \param folder          folder from which a relative `base` starts.
/// \param before_reading  called with the path of each base before it is opened, if given; it may throw.
/// Throws InputError, which lists the chain of files, if a base cannot be read or leads back to itself, or if there are
/// more than kBasesMax of them.
Layers layers(const YAML::Node& tree, const std::string& source, const std::string& folder,
              const std::function<void(const std::string&)>& before_reading = {});
/// Most base files of one scenario, one behind the other.
inline constexpr std::size_t kBasesMax = 8;

/// Reads and validates a scenario file. Throws InputError if the file cannot be read, is not YAML, or has an unknown
/// key or a value of wrong type, unit or range.
Scenario read_scenario_file(const std::string& path, const std::vector<Override>& overrides = {});

/// Reads and validates a scenario from a tree; `source` is its name in errors ("scenario.yaml",
/// "/train_derail/scenario"). A relative `base` starts from the folder of `source`.
Scenario read_scenario(const YAML::Node& tree, const std::string& source, const std::vector<Override>& overrides = {});
/// Reads and validates a scenario from a tree whose bases have been read.
Scenario read_scenario(const Layers& layers, const std::string& source, const std::vector<Override>& overrides = {});

/// Checks a scenario that was built or changed in code: the range of each value, and values that must fit each other.
/// Throws InputError for the first mistake.
void validate(const Scenario& scenario);

}  // namespace train_derail::inputs
