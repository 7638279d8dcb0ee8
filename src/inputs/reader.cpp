#include "train_derail/inputs/reader.hpp"

#include <charconv>
#include <filesystem>
#include <fstream>

#include "schema.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/units.hpp"
#include "tree_reader.hpp"

namespace train_derail::inputs {

namespace {

/// Steps of a key: "consist[0].count" is consist, 0, count.
struct Step {
  std::string name;
  int index = -1;  // of a list if not negative
};

std::vector<Step> split(const Override& o) {
  const auto bad = [&] {
    throw InputError("override", o.key, o.value, "malformed key", "names joined by '.', list items as [0], [1], ...");
  };
  std::vector<Step> steps;
  std::string_view rest = o.key;
  bool name_next = true;
  while (!rest.empty()) {
    if (rest.front() == '[') {
      const auto close = rest.find(']');
      Step step;
      if (name_next || close == std::string_view::npos) bad();
      const auto [end, error] = std::from_chars(rest.data() + 1, rest.data() + close, step.index);
      if (error != std::errc() || end != rest.data() + close || step.index < 0) bad();
      steps.push_back(step);
      rest.remove_prefix(close + 1);
    } else {
      if (!name_next) {
        if (rest.front() != '.') bad();
        rest.remove_prefix(1);
      }
      const auto end = std::min(rest.find_first_of(".["), rest.size());
      if (end == 0) bad();
      steps.push_back({std::string(rest.substr(0, end)), -1});
      rest.remove_prefix(end);
    }
    name_next = false;
  }
  if (steps.empty()) bad();
  return steps;
}

void apply(YAML::Node& root, const Override& o) {
  YAML::Node value;
  try {
    value = YAML::Load(o.value);
  } catch (const YAML::Exception& e) {
    throw InputError("override", o.key, o.value, e.msg, "");
  }
  const std::vector<Step> steps = split(o);
  YAML::Node node;
  node.reset(root);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const bool last = i + 1 == steps.size();
    if (step.index >= 0) {
      if (!node.IsSequence() || static_cast<std::size_t>(step.index) >= node.size()) {
        throw InputError("override", o.key, o.value, fmt::format("there is no item [{}]", step.index),
                         node.IsSequence() ? fmt::format("[0] to [{}]", node.size() - 1) : "not a list");
      }
      if (last) node[step.index] = value;
      else node.reset(node[step.index]);
    } else {
      if (!node.IsMap() && !node.IsNull()) {
        throw InputError("override", o.key, o.value, fmt::format("'{}' is not inside a group", step.name), "");
      }
      if (last) {
        node[step.name] = value;
      } else {
        if (!node[step.name]) node[step.name] = YAML::Node(YAML::NodeType::Map);
        node.reset(node[step.name]);
      }
    }
  }
}

}  // namespace

Override parse_override(std::string_view text) {
  const auto equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw InputError("override", "", std::string(text), "not an override", "key=value, as in \"initial.speed=50 mph\"");
  }
  const auto trim = [](std::string_view s) {
    const auto first = s.find_first_not_of(" \t");
    if (first == std::string_view::npos) return std::string();
    return std::string(s.substr(first, s.find_last_not_of(" \t") - first + 1));
  };
  return {trim(text.substr(0, equals)), trim(text.substr(equals + 1))};
}

Scenario read_scenario(const YAML::Node& tree, const std::string& source, const std::vector<Override>& overrides) {
  YAML::Node root = YAML::Clone(tree);
  if (!overrides.empty() && !root.IsMap()) throw InputError(source, "", written(root), "not a group of keys", "key: value lines");
  for (const Override& o : overrides) apply(root, o);

  Places places;
  Scenario scenario;
  TreeReader reader(overrides.empty() ? tree : root, "", source, overrides, places);
  describe(reader, scenario);
  reader.finish();
  try {
    validate(scenario);
  } catch (const InputError& e) {
    const auto place = places.find(e.key());
    if (place == places.end()) throw InputError(source, e.key(), e.value(), e.problem(), e.allowed());
    throw InputError(place->second.where, e.key(), place->second.value, e.problem(), e.allowed());
  }
  return scenario;
}

YAML::Node load_file(const std::string& path) {
  std::ifstream file(path);
  // A folder opens, but nothing can be read from it; yaml-cpp would leak its buffer over that.
  std::error_code unknown;
  if (!file || std::filesystem::is_directory(path, unknown)) throw InputError(path, "", "", "cannot be read", "");
  try {
    return YAML::Load(file);
  } catch (const YAML::ParserException& e) {
    throw InputError(located(path, e.mark), "", "", "not YAML: " + e.msg, "");
  }
}

YAML::Node load_text(const std::string& text, const std::string& source) {
  try {
    return YAML::Load(text);
  } catch (const YAML::ParserException& e) {
    throw InputError(located(source, e.mark), "", "", "not YAML: " + e.msg, "");
  }
}

Scenario read_scenario_file(const std::string& path, const std::vector<Override>& overrides) {
  return read_scenario(load_file(path), path, overrides);
}

}  // namespace train_derail::inputs
