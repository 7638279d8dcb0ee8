// A study over one input, as the panel starts it: from the current scenario, from one value to another. Knows neither
// Qt nor RViz.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/study/summary.hpp"

namespace train_derail::rviz_panel {

struct Sweep {
  std::string key;
  std::string from, to;  // as typed; a bare number is in the unit that people read
  int points = 0, runs_per_point = 0;
};

/// Inputs that a sweep can change: numbers that act in this scenario.
std::vector<std::string> sweep_keys(const inputs::Scenario& scenario);

/// The study as YAML, the scenario in it. Runs of a point differ as the scenario's perturbation says, or if it says
/// nothing by 0.01 ft of spacing and 0.1 % of the yaw rate. Throws inputs::InputError.
std::string sweep_study(const inputs::Scenario& scenario, const Sweep& sweep);

/// What a sweep has yielded.
struct SweepResult {
  std::string key, label;  // of the input, and its unit as people read it
  std::string unit;
  std::vector<double> values;               // of the input, in `unit`, rising
  std::vector<std::string> outcomes;        // names of the outcome::Quantities
  std::vector<study::PointSpread> spreads;  // all outcomes of the first value, of the second, ...
};
/// Reads it from the folder of the study's results. Throws inputs::InputError or std::runtime_error.
SweepResult read_sweep(const std::string& study_text, const std::string& folder);

}  // namespace train_derail::rviz_panel
