// The purpose-built model against the multibody engine, with a verdict: docs/verification.md.
#pragma once

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/multibody/engine.hpp"
#include "train_derail/multibody/two_sample.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::multibody {

/// What "agrees" means; all of it is printed with the verdict.
struct Criteria {
  double early = 0.3;            // the first seconds, in which the motion is not chaotic yet [s]
  double position = 1e-3;        // there: largest difference of a car's position [m]
  double force = 0.01;           // there: of a coupler's force, as part of the largest force so far
  double force_least = 1e3;      // ... or of this force, if there has been none as large [N]
  double short_position = 1e-2;  // trains of 1, 2 and 3 cars: at any time of the run [m]
  double short_relative = 0.01;  // ... of closing speed, relative speed, peak force, stop time
  double alpha = 0.01;  // probability that ensembles of the same distribution are told apart: of all tests together
  double power = 0.8;   // the detectable difference is found with this probability
  int runs_least = 8;   // fewer runs an engine are reported, not judged
};

struct VerifyOptions {
  int runs = 40;            // of either engine in the ensemble
  int jobs = 0;             // threads of the ensembles; 0: one a core
  double accuracy = 1e-11;  // of the two runs that are compared point by point, and of the short trains
  double follow = 8.0;      // how long those two runs are followed [s]
  double spacing = 3e-3;    // of the ensembles' initial.perturbation [m]
  double yaw_rate = 1e-3;   // ... [-]
  Criteria criteria;
  Fault fault = Fault::none;  // of the multibody engine; for tests
};

enum class Verdict { agrees, differs, not_judged };
const char* to_string(Verdict verdict);

/// Largest difference between the two engines at one time.
struct Difference {
  double time;        // s
  double position;    // of a car's centre [m]
  double heading;     // rad
  double force;       // of a coupler's force, axial and lateral [N]
  double force_peak;  // the largest that any coupler has had in the purpose-built model so far [N]
};

/// One train, followed by both engines from the same start at tight tolerance.
struct PairOfRuns {
  int cars = 0;
  std::vector<Difference> differences;
  Difference worst{};        // largest of each over the time that is judged; `time`: how long that is
  double force_share = 0.0;  // largest force difference there as a part of the largest force so far
  double relative = 0.0;     // whole runs: largest relative difference of the speeds, the peak force, the stop time
  bool counts_equal = true;  // whole runs: cars past the point of derailment and off the track
  outcome::Outcome purpose_built, multibody;
  Verdict verdict = Verdict::not_judged;
  std::string failed;  // which engine could not go on, and why
};

/// One quantity of outcome::quantities() in both ensembles.
struct QuantityComparison {
  std::string name;
  std::vector<double> purpose_built, multibody;
  TwoSample test;
  double p_distance = 1.0, p_precedence = 1.0;  // Holm's
  MeanDifference mean;                          // multibody - purpose-built, 95 %
  double detectable = 0.0;                      // shift of the mean that would have been found; same unit
};

struct Ensemble {
  int runs = 0;    // of either engine
  int failed = 0;  // of both; any makes the verdict fail
  std::vector<QuantityComparison> quantities;
  Verdict verdict = Verdict::not_judged;
};

struct Verification {
  inputs::Scenario scenario;
  VerifyOptions options;
  PairOfRuns early;                           // the whole train; judged over criteria.early
  std::vector<PairOfRuns> short_trains;       // the first 1, 2, 3 cars; judged over the whole run
  outcome::Outcome purpose_built, multibody;  // one run of each at the scenario's own tolerance: reported
  double purpose_built_seconds = 0.0, multibody_seconds = 0.0;  // processor time of these two
  Ensemble ensemble;

  /// Differs if any part does. A part that is not judged decides nothing; the table says which.
  Verdict verdict() const;
};

/// `on_progress(done, what)` with done in [0, 1], from any thread, one call at a time.
/// Once `stop` is set it returns soon, and what it returns is of no use.
/// Throws inputs::InputError, also if the run may not last as long as criteria.early, and std::runtime_error if this
/// build has no engine.
Verification verify(const inputs::Scenario& scenario, const VerifyOptions& options,
                    const std::function<void(double, const std::string&)>& on_progress,
                    const std::atomic<bool>* stop = nullptr);

/// Both engines from the same start, point by point, for `follow` seconds at most; the first `judged` seconds count.
PairOfRuns follow(const inputs::Scenario& scenario, const VerifyOptions& options, double follow, double judged,
                  const std::atomic<bool>* stop = nullptr);

/// The two ensembles.
Ensemble compare_ensembles(const inputs::Scenario& scenario, const VerifyOptions& options,
                           const std::function<void(double, const std::string&)>& on_progress,
                           const std::atomic<bool>* stop = nullptr);

std::string to_table(const Verification& v);
/// SI units; the samples of the ensembles included.
std::string to_json(const Verification& v);
/// Differences over time, one row a train and time.
std::string differences_csv(const Verification& v);

}  // namespace train_derail::multibody
