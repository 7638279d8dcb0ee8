#include "rviz/scenario_files.hpp"

#include <algorithm>
#include <filesystem>
#include <optional>

#include <fmt/format.h>

#include "rviz/input_table.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail::rviz_panel {

namespace {

namespace fs = std::filesystem;

/// A longer list of --set is harder to read than the scenario.
constexpr std::size_t kOverridesMax = 20;

/// As a shell takes it for one word.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') result += "'\\''";
    else result += c;
  }
  return result + "'";
}

/// Changed inputs that make exactly `wanted` of the scenario in `file`; none if there are no such few.
std::optional<std::vector<inputs::Override>> overrides_from(const std::string& file, const inputs::Scenario& wanted) {
  try {
    // With all defaults filled in, as `wanted` has them.
    const inputs::Scenario start = inputs::read_scenario(YAML::Load(whole_scenario(file)), file);
    const InputTable table = make_input_table(wanted);
    std::vector<inputs::Override> overrides;
    for (const InputChange& change : input_changes(start, wanted)) {
      if (change.now.empty() || overrides.size() == kOverridesMax) return {};
      overrides.push_back({change.key, change.now});
    }
    // What is rounded for people is not enough where it matters.
    const InputTable reached = make_input_table(inputs::read_scenario_file(file, overrides));
    for (inputs::Override& o : overrides) {
      if (reached.at(o.key).exact != table.at(o.key).exact) o.value = inputs::key_value(wanted, o.key).value;
    }
    if (inputs::to_yaml(inputs::read_scenario_file(file, overrides)) != inputs::to_yaml(wanted)) return {};
    return overrides;
  } catch (const std::exception&) {  // gone, changed since, or of another kind
    return {};
  }
}

}  // namespace

std::vector<ScenarioFile> scenario_files(const std::string& folder) {
  std::vector<ScenarioFile> all;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    const std::string path = entry.path().string();
    if (entry.path().extension() != ".yaml") continue;
    try {
      const YAML::Node tree = inputs::load_file(path);
      const bool is_scenario = tree.IsMap() && (tree["consist"] || tree["base"]);
      if (!is_scenario) continue;
      const YAML::Node title = tree["title"];
      all.push_back({path, title && title.IsScalar() ? title.Scalar() : entry.path().filename().string()});
    } catch (const std::exception&) {  // somebody's broken file is none of the presets
    }
  }
  std::sort(all.begin(), all.end(), [](const ScenarioFile& a, const ScenarioFile& b) { return a.path < b.path; });
  return all;
}

std::string whole_scenario(const std::string& path) { return inputs::to_yaml(inputs::read_scenario_file(path)); }

std::string command_line(const std::string& yaml, const std::vector<std::string>& files) {
  const inputs::Scenario wanted = inputs::read_scenario(inputs::load_text(yaml, "inputs"), "inputs");
  for (const std::string& file : files) {
    const auto overrides = overrides_from(file, wanted);
    if (!overrides) continue;
    std::string command = "rosrun train_derail derail run " + quoted(file);
    for (const inputs::Override& o : *overrides) command += " --set " + quoted(o.key + "=" + o.value);
    return command + "\n";
  }
  // No file is overwritten; a line of the scenario never is the word that ends it.
  return "scenario=$(mktemp --suffix=.yaml)\ncat > \"$scenario\" <<'END_OF_SCENARIO'\n" + yaml +
         (yaml.empty() || yaml.back() != '\n' ? "\n" : "") +
         "END_OF_SCENARIO\nrosrun train_derail derail run \"$scenario\"\n";
}

std::vector<InputChange> input_changes(const inputs::Scenario& before, const inputs::Scenario& now) {
  const InputTable old_table = make_input_table(before), new_table = make_input_table(now);
  const auto shown = [](const InputTable& table, const std::string& key) {
    const auto item = table.find(key);
    return item == table.end() ? std::string() : item->second.value;
  };
  std::vector<InputChange> changes;
  for (const auto& [key, item] : new_table) {
    const auto other = old_table.find(key);
    if (other == old_table.end() || other->second.exact != item.exact)
      changes.push_back({key, shown(old_table, key), item.value});
  }
  for (const auto& [key, item] : old_table) {
    if (new_table.count(key) == 0) changes.push_back({key, item.value, ""});
  }
  return changes;
}

}  // namespace train_derail::rviz_panel
