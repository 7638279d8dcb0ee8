// A study: a base scenario, the inputs that vary, how they are sampled, how often each point is repeated.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::study {

enum class Plan {
  one_at_a_time,    // the base, then each value of each factor alone
  grid,             // every combination of values
  latin_hypercube,  // `samples` random points, stratified in each factor
  sobol,            // `samples` points of the Sobol sequence
  saltelli,         // `samples` * (factors + 2) points, for Sobol indices
};

enum class Distribution { uniform, log_uniform, normal };

/// What computes the runs: the model, or the multibody engine that checks it.
enum class Engine { purpose_built, multibody };

struct Factor {
  std::string key;                  // of the scenario
  std::string label;                // for pictures; the key if empty
  std::vector<std::string> values;  // of the plans one_at_a_time and grid, SI as text
  Distribution distribution = Distribution::uniform;
  double low = 0.0, high = 0.0;     // SI: range of uniform and log_uniform; 5 % and 95 % points of normal
  std::string unit, shown_unit;     // as in inputs::KeyValue
};

struct Study {
  std::string title;
  inputs::Scenario base;
  std::vector<Factor> factors;
  Plan plan = Plan::one_at_a_time;
  int samples = 0;                      // of the random plans
  int replicates = 1;                   // runs a point, each with its own perturbation
  inputs::Perturbation perturbation;    // sizes of the perturbation of every run; its seed is not used
  std::vector<std::string> outcomes;    // names of outcome::kQuantities that are summarised and drawn
  std::int64_t seed = 1;
  Engine engine = Engine::purpose_built;  // not in the file: asked for on the command line
  std::string fitted_on;                  // path of the class of accidents that the base was fitted on (validation); empty: not said
};

/// `scenario` in the file is a path relative to the file; `overrides` change that scenario, `spread` stands for the file's own (of
/// random plans; see widened()). Throws inputs::InputError.
Study read_study_file(const std::string& path, const std::vector<inputs::Override>& overrides = {}, std::optional<double> spread = {});
/// The same from the file's text; `path` names it in errors and is what a relative `scenario` starts from.
Study read_study_text(const std::string& text, const std::string& path);

/// The same study with the half-width of every range times `factor`, about the range's middle (of log_uniform: the geometric
/// one). A quantity whose range is above 0 stays above a twentieth of its middle. For the random plans. Throws inputs::InputError:
/// an end of a range is not allowed for its key.
Study widened(Study study, double factor);

/// One value a factor (SI as text), in the order of Study::factors.
struct Point {
  std::vector<std::string> values;
  int factor = -1;  // one_at_a_time: the one that differs from the base
};

/// All points; the same for the same study, on any machine. Throws inputs::InputError.
std::vector<Point> points(const Study& study);

/// Runs are numbered point by point: index = point * replicates + replicate.
struct Run {
  std::int64_t index, point;
  int replicate;
  std::int64_t seed;  // of its perturbation: depends on the study's seed and the index alone
};
Run run_of(const Study& study, std::int64_t index);

/// The scenario of one run. Throws inputs::InputError if the point is outside of what inputs allow.
inputs::Scenario scenario_of(const Study& study, const Point& point, const Run& run);

/// The whole study as JSON, scenario included: what a folder of results belongs to.
std::string to_json(const Study& study);

}  // namespace train_derail::study
