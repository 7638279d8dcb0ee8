// Scenario files that can be run from the panel, and the command line that repeats a run. Knows neither Qt nor RViz.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::rviz_panel {

struct ScenarioFile {
  std::string path;
  std::string title;  // of the scenario, or the name of the file if it has none
};

/// Those in a folder, by name; what is no scenario is left out. A folder that is missing has none.
std::vector<ScenarioFile> scenario_files(const std::string& folder);

/// The whole scenario of a file as YAML, its bases filled in: a node on another machine has none of the files. Throws
/// inputs::InputError.
std::string whole_scenario(const std::string& path);

/// Commands for a shell that repeat a run. `yaml`: the scenario of the run. `files`: files that it may have come from;
/// the first from which a few changed inputs lead to exactly this scenario is named, otherwise the commands hold the
/// whole scenario. Throws inputs::InputError if `yaml` is no scenario.
std::string command_line(const std::string& yaml, const std::vector<std::string>& files);

/// Inputs in which two scenarios differ, for people: "initial.speed: 50 mph, before 37 mph".
struct InputChange {
  std::string key, before, now;  // values in the unit that people read; empty: not in that scenario
};
std::vector<InputChange> input_changes(const inputs::Scenario& before, const inputs::Scenario& now);

}  // namespace train_derail::rviz_panel
