// The one typed reader: files, the command line and the parameter server all become a YAML tree and pass here.
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

/// One changed input: `key` as in "initial.speed" or "consist[0].count", `value` as it would stand in the file.
struct Override {
  std::string key;
  std::string value;
};

/// Splits "key=value". Throws InputError if there is no '='.
Override parse_override(std::string_view text);

/// The content of a file. Throws InputError if it cannot be read, has more than `bytes_max` bytes, or is a folder, a
/// pipe, a device.
std::string read_file(const std::string& path, std::size_t bytes_max);

/// A YAML file, or text that `source` names, as a tree; merge keys (<<) are resolved. Throw InputError: unreadable, not
/// YAML, too long, nested too deeply, too many values (with aliases expanded), or something that roslaunch (YAML 1.1)
/// would read as another value.
YAML::Node load_file(const std::string& path);
YAML::Node load_text(const std::string& text, const std::string& source);

/// A tree whose key `base` names another scenario file, if it has one: that file's values where the tree has none of
/// its own. Groups are filled up key by key, lists are taken as a whole. A relative name starts from `folder`.
struct Layers {
  YAML::Node tree;  ///< without `base`
  /// Which file a key, and all below it, comes from; "" is the key of what is named nowhere else. Empty without a base.
  std::map<std::string, std::string> sources;
};
/// Throws InputError, which names the chain: a base that cannot be read, one that leads back to itself, more than
/// kBasesMax of them. `before_reading`, if given, is called with the path of each before it is opened, and may throw.
Layers layers(const YAML::Node& tree, const std::string& source, const std::string& folder,
              const std::function<void(const std::string&)>& before_reading = {});
inline constexpr std::size_t kBasesMax = 8;

/// Reads and validates a scenario file. Throws InputError (unreadable file, YAML syntax, key, type, unit, range).
Scenario read_scenario_file(const std::string& path, const std::vector<Override>& overrides = {});

/// The same from a tree; `source` names it in errors ("scenario.yaml", "/train_derail/scenario"). A relative `base`
/// starts from the folder of `source`.
Scenario read_scenario(const YAML::Node& tree, const std::string& source, const std::vector<Override>& overrides = {});
Scenario read_scenario(const Layers& layers, const std::string& source, const std::vector<Override>& overrides = {});

/// Range and cross-field checks of a scenario that was built or changed in code. Throws InputError.
void validate(const Scenario& scenario);

}  // namespace train_derail::inputs
