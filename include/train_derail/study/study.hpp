/// \file
/// Studies: a base scenario, the inputs that vary, how their values are chosen, and how often each point is repeated.
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

/// Most runs of a study, and most sampled numbers (samples times factors) of a random plan.
inline constexpr std::int64_t kRunsMax = 4'000'000, kSampledMax = 20'000'000;
/// Most factors of a study, and most values of all factors together.
inline constexpr std::size_t kFactorsMax = 1000, kValuesMax = 10'000;

/// Thrown where work was given up because a stop flag was set.
struct Stopped : std::runtime_error {
  Stopped() : std::runtime_error("stopped") {}
};

/// How the points of a study are chosen. The last three are the random plans.
enum class Plan {
  one_at_a_time,    ///< the base, then each value of each factor while the others keep the base's
  grid,             ///< every combination of values
  latin_hypercube,  ///< `samples` random points, stratified in each factor
  sobol,            ///< `samples` points of the Sobol sequence
  saltelli,         ///< `samples` * (factors + 2) points, for Sobol indices
};

/// Distribution of a factor in a random plan.
enum class Distribution { uniform, log_uniform, normal };

/// What computes the runs: the purpose-built model, or the multibody engine that checks it.
enum class EngineChoice { purpose_built, multibody };

/// Names of EngineChoice in files and on the command line, by its value.
inline constexpr std::array<std::string_view, 2> kEngineNames{"purpose_built", "multibody"};
/// Returns the name of an engine.
inline std::string to_string(EngineChoice engine) {
  return std::string(kEngineNames[static_cast<std::size_t>(engine)]);
}
/// Returns the name of a plan in files.
std::string to_string(Plan plan);

/// An input that the study varies.
struct Factor {
  std::string key;                  ///< key of the scenario
  std::string label;                ///< name in pictures
  std::vector<std::string> values;  ///< values for the plans one_at_a_time and grid, in SI units as text
  std::vector<std::string> shown;   ///< the same values for people, "10 mph"
  Distribution distribution = Distribution::uniform;  ///< for random plans
  double low = 0.0,  ///< lower end of the range, SI unit; of a normal distribution its 5 % point
      high = 0.0;    ///< upper end of the range, SI unit; of a normal distribution its 95 % point
  std::string unit,  ///< SI unit, as in inputs::KeyValue
      shown_unit;    ///< unit that people read, as in inputs::KeyValue
};

/// A study.
struct Study {
  std::string source;                 ///< its name in errors: the path of its file
  std::string title;                  ///< one line for tables and pictures
  inputs::Scenario base;              ///< base scenario
  std::vector<Factor> factors;        ///< inputs that vary; none for an ensemble of the base
  Plan plan = Plan::one_at_a_time;    ///< how the points are chosen
  int samples = 0;                    ///< number of samples of a random plan
  int replicates = 1;                 ///< runs for each point, each with its own perturbation
  inputs::Perturbation perturbation;  ///< sizes of the perturbation of every run; its seed is not used
  std::vector<std::string> outcomes;  ///< names of the outcome::quantities() that are summarised and drawn
  std::int64_t seed = 1;              ///< seed of the points and of all perturbations
  EngineChoice engine = EngineChoice::purpose_built;  ///< set by the command line, not by the study file
  std::string fitted_on;  ///< for validations: file that describes the accidents that the base was fitted on, or empty
};

/// Returns an ensemble: `replicates` runs of one scenario that differ by its perturbation only.
Study ensemble_of(const inputs::Scenario& scenario, int replicates);

/// Reads a study file.
/// \param overrides  changes to the scenario that the file names, by a path relative to the file.
/// \param spread     factor on all ranges of a random plan, instead of the one in the file; see widened().
/// Throws inputs::InputError, also if the study has more than kRunsMax runs.
Study read_study_file(const std::string& path, const std::vector<inputs::Override>& overrides = {},
                      std::optional<double> spread = {});
/// Reads a study from the text of a file; `path` is its name in errors, and a relative `scenario` starts from its
/// folder.
Study read_study_text(const std::string& text, const std::string& path);

/// Returns the study with the half-width of every range multiplied by `factor`; the middle of each range stays (of
/// log_uniform the geometric middle). A range above 0 is cut at a twentieth of its middle. For random plans. Throws
/// inputs::InputError if an end of a range is not allowed for its key.
Study widened(Study study, double factor);

/// A point of a study: one value for each factor.
struct Point {
  std::vector<std::string> values;  ///< in SI units as text, in the order of Study::factors
  int factor = -1;                  ///< plan one_at_a_time: index of the factor that differs from the base; else -1
};

/// All points of a study. They are the same for the same study on any machine. A point is made when it is asked for;
/// only the sampled numbers are kept in memory.
class Points {
 public:
  /// Throws inputs::InputError if there are too many points (see run_count()), and Stopped once `stop` is set.
  explicit Points(const Study& study, const std::atomic<bool>* stop = nullptr);
  /// Number of points.
  std::int64_t size() const { return size_; }
  /// Returns point `i`, from 0 to size() - 1.
  Point operator[](std::int64_t i) const;
  /// Returns the name of point `i`: "initial.speed=10 mph", with the values as in the file, or "base"; for a random
  /// plan "point 7".
  std::string name(std::int64_t i) const;

 private:
  /// For the plans one_at_a_time and grid: the index of the value of each factor; -1 means the value of the base.
  std::vector<int> choice(std::int64_t i) const;

  Plan plan_;
  std::vector<Factor> factors_;
  std::vector<std::string> base_;           // base value of each factor, in SI units as text
  std::vector<bool> whole_;                 // whether a factor takes whole numbers only
  std::vector<std::pair<int, int>> alone_;  // one_at_a_time: index of factor and value, for each point but the base
  std::vector<double> places_;              // random plans: numbers in (0, 1), `dimension_` for each sample
  std::size_t dimension_ = 0;
  std::int64_t size_ = 0;
};
/// Returns all points of a study as a list.
std::vector<Point> points(const Study& study);

/// Returns the number of runs, points times replicates. Throws inputs::InputError, which gives number and limit, if
/// there are too many.
std::int64_t run_count(const Study& study);

/// Checks a study before it is run, at some hundred of its points. Returns warnings; none if nothing is unusual. Throws
/// inputs::InputError if the runs of a point cannot differ although there are several, or if the inputs of every point
/// are refused; throws Stopped once `stop` is set.
std::vector<std::string> check(const Study& study, const std::atomic<bool>* stop = nullptr);

/// Returns why runs of this scenario with different seeds would all be equal, or "" if they can differ.
std::string why_equal(const inputs::Scenario& scenario, EngineChoice engine);

/// One run of a study. Runs are numbered point by point: index = point * replicates + replicate, all from 0.
struct Run {
  std::int64_t index,  ///< number of the run
      point;           ///< number of its point
  int replicate;       ///< number of the run among those of its point
  std::int64_t seed;   ///< seed of its perturbation; depends on the seed of the study and on the index only
};
/// Returns the run of number `index`.
Run run_of(const Study& study, std::int64_t index);

/// Returns the scenario of one run. Throws inputs::InputError if a value of the point is not allowed.
inputs::Scenario scenario_of(const Study& study, const Point& point, const Run& run);

/// Returns the whole study as JSON, with its scenario. A results folder belongs to the study of this text.
std::string to_json(const Study& study);

}  // namespace train_derail::study
