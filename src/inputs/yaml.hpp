// YAML as this program takes it: bounded, and read by YAML 1.1 (PyYAML under roslaunch) and 1.2 (yaml-cpp) alike.
#pragma once

#include <cstddef>
#include <string>

#include <yaml-cpp/yaml.h>

namespace train_derail::inputs {

/// Bounds of one text. A train of a thousand unlike cars with a thousand curves stays below half of each.
inline constexpr std::size_t kYamlBytesMax = 512 * 1024;
inline constexpr std::size_t kYamlNodesMax = 50'000;  // scalars, lists, maps, with aliases expanded
inline constexpr std::size_t kYamlDepthMax = 50;

/// What is wrong in a text, and in which line of it (from 1; 0: in all of it).
struct YamlMistake {
  int line;
  std::string value, problem, allowed;
};

/// The tree of the one document in `text`, its merge keys resolved; aliased nodes are shared, but no walk of it sees
/// more than kYamlNodesMax nodes or kYamlDepthMax levels. Throws YamlMistake: not YAML, beyond the bounds, or, if
/// roslaunch may read the text as well, read differently there.
YAML::Node parse_yaml(const std::string& text, bool roslaunch_reads_it);

/// What PyYAML would make of a scalar without quotes if it is not the text as it stands nor the same number: "the truth
/// value true". Empty if both agree.
std::string other_reading(const std::string& plain);

/// Whether PyYAML makes a number of a scalar without quotes that it hands over as another text ("1.50" becomes 1.5).
bool rewritten_number(const std::string& plain);

}  // namespace train_derail::inputs
