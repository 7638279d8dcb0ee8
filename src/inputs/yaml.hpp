/// \file
/// Reads YAML within limits of size. Only text that YAML 1.1 (PyYAML under roslaunch) and YAML 1.2 (yaml-cpp) read in
/// the same way is accepted.
#pragma once

#include <cstddef>
#include <string>

#include <yaml-cpp/yaml.h>

namespace train_derail::inputs {

/// Limits of one text. A train of a thousand different cars with a thousand curves needs less than half of each.
inline constexpr std::size_t kYamlBytesMax = 512 * 1024;
inline constexpr std::size_t kYamlNodesMax = 50'000;  // scalars, lists and maps; an alias counts as what it stands for
inline constexpr std::size_t kYamlDepthMax = 50;

/// A mistake in a text: its line (from 1; 0: the text as a whole), value, problem and what is allowed.
struct YamlMistake {
  int line;
  std::string value, problem, allowed;
};

/// Returns the tree of the one document in `text`, with merge keys (<<) resolved. Nodes with aliases are shared, but
/// going through the tree visits at most kYamlNodesMax nodes and kYamlDepthMax levels. Throws YamlMistake if the text
/// is not YAML or exceeds a limit. If `roslaunch_reads_it`, throws it too if roslaunch would read another value.
YAML::Node parse_yaml(const std::string& text, bool roslaunch_reads_it);

/// Returns what PyYAML reads if a scalar is written without quotes, "a truth value", or "" if it reads the same text or
/// number.
std::string other_reading(const std::string& plain);

/// Whether PyYAML reads a scalar without quotes as a number and would write it in another way ("1.50" becomes 1.5).
bool rewritten_number(const std::string& plain);

}  // namespace train_derail::inputs
