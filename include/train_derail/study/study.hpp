// A study: a base scenario, the inputs that vary, how they are sampled, how often each point is repeated.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::study {

/// Most runs of a study, and most sampled numbers (samples times inputs) of a random plan.
inline constexpr std::int64_t kRunsMax = 4'000'000, kSampledMax = 20'000'000;
inline constexpr std::size_t kFactorsMax = 1000, kValuesMax = 10'000;  // values: of all factors together

/// A stop flag has ended something that was under way.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped") {}
};

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

/// Names of Engine in files and on the command line, by its value.
inline constexpr std::array<std::string_view, 2> kEngineNames{"purpose_built", "multibody"};
inline std::string to_string(Engine engine) { return std::string(kEngineNames[static_cast<std::size_t>(engine)]); }
/// The name of a plan in files.
std::string to_string(Plan plan);

struct Factor {
  std::string key;                  // of the scenario
  std::string label;                // for pictures; the key if empty
  std::vector<std::string> values;  // of the plans one_at_a_time and grid, SI as text
  std::vector<std::string>
      shown;  // the same as the file has them ("10 mph"; multiples of the base in the unit that people read)
  Distribution distribution = Distribution::uniform;
  double low = 0.0, high = 0.0;  // SI: range of uniform and log_uniform; 5 % and 95 % points of normal
  std::string unit, shown_unit;  // as in inputs::KeyValue
};

struct Study {
  std::string source;  // file or what else names it in errors
  std::string title;
  inputs::Scenario base;
  std::vector<Factor> factors;
  Plan plan = Plan::one_at_a_time;
  int samples = 0;                    // of the random plans
  int replicates = 1;                 // runs a point, each with its own perturbation
  inputs::Perturbation perturbation;  // sizes of the perturbation of every run, the scenario's if the study has none;
                                      // its seed is not used
  std::vector<std::string> outcomes;  // names of outcome::quantities() that are summarised and drawn
  std::int64_t seed = 1;
  Engine engine = Engine::purpose_built;  // not in the file: asked for on the command line
  std::string fitted_on;  // path of the class of accidents that the base was fitted on (validation); empty: not said
};

/// `replicates` runs of one scenario with its own perturbation, nothing else varies.
Study ensemble_of(const inputs::Scenario& scenario, int replicates);

/// `scenario` in the file is a path relative to the file; `overrides` change that scenario, `spread` stands for the
/// file's own (of random plans; see widened()). Throws inputs::InputError, also if there are more than kRunsMax runs.
Study read_study_file(const std::string& path, const std::vector<inputs::Override>& overrides = {},
                      std::optional<double> spread = {});
/// The same from the file's text; `path` names it in errors and is what a relative `scenario` starts from.
Study read_study_text(const std::string& text, const std::string& path);

/// The same study with the half-width of every range times `factor`, about the range's middle (of log_uniform: the
/// geometric one). A quantity whose range is above 0 stays above a twentieth of its middle. For the random plans.
/// Throws inputs::InputError: an end of a range is not allowed for its key.
Study widened(Study study, double factor);

/// One value a factor (SI as text), in the order of Study::factors.
struct Point {
  std::vector<std::string> values;
  int factor = -1;  // one_at_a_time: the one that differs from the base
};

/// All points; the same for the same study, on any machine. They are made when asked for: only the sampled numbers are
/// in memory.
class Points {
 public:
  /// Throws inputs::InputError (too many, see run_count()), Stopped.
  explicit Points(const Study& study, const std::atomic<bool>* stop = nullptr);
  std::int64_t size() const { return size_; }
  /// `i` from 0 to size() - 1.
  Point operator[](std::int64_t i) const;
  /// "initial.speed=10 mph", values as the file has them, or "base"; of a random plan "point 7".
  std::string name(std::int64_t i) const;

 private:
  /// Of one_at_a_time, grid: the place of each factor's value; -1: the base's.
  std::vector<int> choice(std::int64_t i) const;

  Plan plan_;
  std::vector<Factor> factors_;
  std::vector<std::string> base_;  // SI text of each factor
  std::vector<bool> whole_;
  std::vector<std::pair<int, int>> alone_;  // one_at_a_time: factor and value of each point but the base
  std::vector<double> places_;              // random plans: in (0, 1), `dimension_` a sample
  std::size_t dimension_ = 0;
  std::int64_t size_ = 0;
};
/// The same as a list.
std::vector<Point> points(const Study& study);

/// Points times replicates. Throws inputs::InputError that names number and limit.
std::int64_t run_count(const Study& study);

/// What is to be said before a study is run; empty if all is well. Looks at some hundred points. Throws
/// inputs::InputError if the study cannot mean what it says: runs of a point that cannot differ, inputs that every
/// point refuses; Stopped.
std::vector<std::string> check(const Study& study, const std::atomic<bool>* stop = nullptr);

/// Why runs of this scenario with different seeds are all the same run; "" if they can differ.
std::string why_equal(const inputs::Scenario& scenario, Engine engine);

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
