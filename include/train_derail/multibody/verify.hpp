/// \file
/// Verification: compares the purpose-built model, the paper's or the one in three dimensions, with the multibody
/// engine and gives a verdict (docs/verification.md).
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

/// Limits within which the two engines agree. They are printed with the verdict.
struct Criteria {
  double early = 0.3;           ///< first part of the run, in which the motion is not chaotic yet, at least [s]
  double early_in_space = 2.0;  ///< space: the same, at most; as long as `worth` allows [s]
  double position = 1e-3;       ///< plane, in that part: largest difference of a car's position [m]
  double force = 0.01;          ///< plane, in that part: difference of a coupler force over the largest force so far
  double force_least = 1e3;     ///< the force that it is divided by is at least this [N]
  double worth = 1e-3;  ///< space: the comparison says something while halving the steps allows less than this [m, rad]
  double least = 1e-4;  ///< space, in the first part: what halving allows, or this if it is more [m, rad]
  double short_position = 1e-2;  ///< trains of 1, 2 and 3 cars: largest difference of a car's position [m]
  double short_angle = 1e-2;     ///< space, the same: angle of a car [rad]
  double short_relative = 0.01;  ///< relative difference of speeds, peak force, stop time, in runs judged to their end
  double alpha = 0.01;           ///< ensembles: level of all tests together, the probability of a false alarm
  double power = 0.8;            ///< probability with which the detectable difference is found
  int runs_least = 8;            ///< with fewer runs of an engine there is no verdict
};

/// How finely runs in space are computed that are compared at each time.
struct Steps {
  double step = 4e-5;         ///< of the purpose-built model [s]
  double accuracy = 1e-6;     ///< EngineOptions::accuracy of the multibody engine
  double settle_time = 1e-4;  ///< EngineOptions::settle_time of it [s]

  /// Half the step and the time, a tenth of the tolerance.
  Steps halved() const { return {0.5 * step, 0.1 * accuracy, 0.5 * settle_time}; }
};

/// Options of a verification.
struct VerifyOptions {
  int runs = 40;            ///< runs of each engine in the ensemble
  int jobs = 0;             ///< threads for the ensembles; 0: one for each core
  double accuracy = 1e-11;  ///< plane: tolerance, relative and absolute, of the runs that are compared at each time
  Steps whole;              ///< space: the same runs with steps a whole; a half is Steps::halved()
  double follow = 8.0;      ///< simulated time for which the whole train is compared at each time [s]
  double spacing = 3e-3;    ///< initial.perturbation.spacing of the ensembles [m]
  double yaw_rate = 1e-3;   ///< plane: initial.perturbation.yaw_rate of the ensembles [-]
  double yaw_rate_in_space = 0.1;   ///< space: the same; short trains are less chaotic [-]
  std::string source = "scenario";  ///< name of the scenario in errors: its file
  Criteria criteria;                ///< limits
  Fault fault = Fault::none;        ///< mistake in the multibody engine; for tests
};

/// Result of a comparison.
enum class Verdict { agrees, differs, not_judged };
/// Returns the name of a verdict.
const char* to_string(Verdict verdict);

/// Largest differences between the two engines at one time.
struct Difference {
  double time;                             ///< simulated time [s]
  double position;                         ///< distance of a car's centres of mass [m]
  double angle;                            ///< by which a car is turned against its twin [rad]
  double force;                            ///< difference of a coupler's force, axial or (plane) lateral [N]
  double force_peak;                       ///< largest force of any coupler so far, in the purpose-built model [N]
  double position_allowed, angle_allowed;  ///< up to this time; infinite: not judged [m, rad]
};

/// One train, computed by both engines from the same start at a tight tolerance. In space differences are those of the
/// runs with half the step.
struct PairOfRuns {
  int cars = 0;                         ///< cars of the train
  std::vector<Difference> differences;  ///< in the order of time
  Difference worst{};        ///< largest of each over the judged part of the run; `time` is the length of that part
  bool to_the_end = false;   ///< that part is the whole run, and outcomes are judged too
  double force_share = 0.0;  ///< largest difference of a force in that part, over the largest force so far [-]
  double relative = 0.0;     ///< whole runs: largest relative difference of speeds, peak force and stop time [-]
  bool counts_equal = true;  ///< whole runs: same counts of cars past the point of derailment, off the track, over
  outcome::Outcome purpose_built,         ///< outcome of the purpose-built model
      multibody;                          ///< outcome of the multibody engine
  Verdict verdict = Verdict::not_judged;  ///< whether they agree
  std::string failed;                     ///< which engine failed, and why; empty if none did
};

/// One quantity (outcome::quantities()) in the ensembles of both engines. Numbers are in its SI unit.
struct QuantityComparison {
  std::string name;                   ///< name of the quantity
  std::vector<double> purpose_built,  ///< values of the purpose-built model
      multibody;                      ///< values of the multibody engine
  TwoSample test;                     ///< tests of the two samples
  double p_distance = 1.0,            ///< p-value of the distance after Holm's correction
      p_precedence = 1.0;             ///< p-value of the precedence after Holm's correction
  MeanDifference mean;                ///< multibody - purpose-built, with its 95 % interval
  double detectable = 0.0;            ///< shift of the mean that would have been found
};

/// The ensembles of both engines.
struct Ensemble {
  int runs = 0;    ///< runs of each engine
  int failed = 0;  ///< failed runs of both engines; with any the verdict is Verdict::differs
  std::vector<QuantityComparison> quantities;  ///< all quantities
  Verdict verdict = Verdict::not_judged;       ///< whether the ensembles agree
};

/// The whole verification.
struct Verification {
  inputs::Scenario scenario;             ///< scenario that was verified
  VerifyOptions options;                 ///< options
  PairOfRuns early;                      ///< the whole train, judged over criteria.early
  std::vector<PairOfRuns> short_trains;  ///< the first 1, 2 and 3 cars, judged over the whole run
  outcome::Outcome purpose_built,        ///< run of the purpose-built model at the scenario's own tolerance, not judged
      multibody;                         ///< the same run of the multibody engine
  double purpose_built_seconds = 0.0,    ///< processor time of the former [s]
      multibody_seconds = 0.0;           ///< processor time of the latter [s]
  Ensemble ensemble;                     ///< comparison of ensembles

  /// Verdict::differs if any part differs. Parts without a verdict have no influence; the table names them.
  Verdict verdict() const;
};

/// Verifies a scenario.
/// \param on_progress  called as on_progress(done, what) with done in [0, 1], from any thread, one call at a time.
/// \param stop         once it is set, verify() returns soon; the result must not be used then.
/// Throws inputs::InputError, which calls the scenario options.source, if it cannot be verified, also if stop.time_max
/// is less than criteria.early; throws std::runtime_error if this build has no engine.
Verification verify(const inputs::Scenario& scenario, const VerifyOptions& options,
                    const std::function<void(double, const std::string&)>& on_progress,
                    const std::atomic<bool>* stop = nullptr);

/// What ensembles are compared in: names of quantities (outcome::quantities()) of that model.
const std::vector<std::string>& judged_quantities(inputs::Model model);

/// Computes one train by both engines and compares them at each time, for at most `follow` seconds. The first `judged`
/// seconds decide the verdict; in space only as long as the limit is worth it (Criteria::worth).
PairOfRuns follow(const inputs::Scenario& scenario, const VerifyOptions& options, double follow, double judged,
                  const std::atomic<bool>* stop = nullptr);

/// Computes the ensembles of both engines and compares them.
Ensemble compare_ensembles(const inputs::Scenario& scenario, const VerifyOptions& options,
                           const std::function<void(double, const std::string&)>& on_progress,
                           const std::atomic<bool>* stop = nullptr);

/// Returns the result as a table for people.
std::string to_table(const Verification& v);
/// Returns the result as JSON in SI units, with the samples of the ensembles.
std::string to_json(const Verification& v);
/// Returns the differences over time as CSV: one row for each train and time.
std::string differences_csv(const Verification& v);

}  // namespace train_derail::multibody
