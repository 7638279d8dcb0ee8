/// \file
/// Validations: runs a study for every accident of a table, and compares the predicted counts of derailed cars with the
/// real ones.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/study/runner.hpp"
#include "train_derail/study/statistics.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/validation/accidents.hpp"
#include "train_derail/validation/fitted_class.hpp"
#include "train_derail/validation/plan.hpp"
#include "train_derail/validation/posture.hpp"
#include "train_derail/validation/scores.hpp"

namespace train_derail::validation {

/// Most runs of a validation, that is rows times members.
inline constexpr std::int64_t kMembersMax = 1'000'000;

/// Share of the real counts that the prediction intervals should hold.
inline constexpr double kIntervalShare = 0.9;

/// One run of a validation.
struct Member {
  std::size_t row = 0;       ///< index of its row in AccidentTable::rows
  std::int64_t member = 0;   ///< number among the members of that row, from 0
  std::int64_t seed = 0;     ///< seed; depends on the study's seed, the line in the file and the member only
  std::string way;           ///< name of the way in which it began, see Plan
  Derailed derailed;         ///< derailed cars and locomotives
  PostureCount posture;      ///< how they lie, locomotives included; models of space only
  outcome::Outcome outcome;  ///< outcome, with locomotives as cars; if read from a journal only `ended` is set
  std::string text;          ///< its line of members.csv
};

/// All runs of a validation.
struct Ensembles {
  std::vector<Member> members;        ///< row by row; complete unless `stopped`
  std::int64_t failed = 0;            ///< members that failed
  bool stopped = false;               ///< whether the stop flag ended the work early
  double wall_time = 0.0;             ///< time that it took [s]
  std::vector<std::string> warnings;  ///< "3 of 200 runs: energy residual ...", and rows whose members cannot differ
  std::vector<std::string> problems;  ///< bad lines of the journal; their runs were computed again
};

/// Returns the points of one row. Each row has a random sample of its own, made from the study's seed and the row's
/// line in the file. With one sample for all rows, the chance of that sample would not average out over the rows.
study::Points points_of(study::Study study, const Accident& accident);

/// Computes all members of all rows. Member j of a row has the inputs of point j / replicates of points_of(). The
/// result depends neither on the number of threads `jobs` (0: one for each core) nor on the other rows of the table.
/// `on_progress` is called from the worker threads, one call at a time. Once `stop` is set, it returns soon and gives
/// up the runs that are being computed. Throws inputs::InputError, also if a row does not fit the base scenario (the
/// message gives the line).
Ensembles run(const Plan& plan, const AccidentTable& accidents, int jobs,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop);

/// Where and how the members are computed.
struct ValidationOptions {
  std::string folder;   ///< results folder with the journal
  int jobs = 0;         ///< threads; 0: one for each core
  bool resume = false;  ///< whether the folder may hold finished runs; only the missing ones are computed then
};
/// Computes all members of all rows with a journal in a folder, so that it can go on after a kill or stop. The folder
/// belongs to this study and these rows. Throws as above, and std::runtime_error if the folder holds other results,
/// holds finished runs without `resume`, or cannot be written; throws inputs::InputError if its files cannot be read.
Ensembles run(const Plan& plan, const AccidentTable& accidents, const ValidationOptions& options,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop);

/// The scores of one way to predict, on a group of rows.
struct Rated {
  /// "simulation": median of the members; "mean": their mean; "stretched": see scores.hpp; or the name of a fit.
  std::string name;
  std::string rows;  ///< rows that it was fitted to: "none", "these", or "the others" (all but the predicted one)
  Score score;       ///< errors
  std::optional<Coverage> coverage;  ///< of the 90 % intervals
  std::optional<double> crps;        ///< crps() of the members, mean over the rows [cars]
};

/// Rows that are scored together.
struct Group {
  std::string name;              ///< name in tables
  std::size_t rows = 0;          ///< number of rows
  std::vector<Rated> rated;      ///< ways to predict, with their scores
  std::vector<Fit> fits;         ///< statistical models, fitted to these rows
  std::vector<SpeedBand> bands;  ///< means by speed
  double exponent_real = 0.0,    ///< speed_exponent() of the real counts
      exponent_predicted = 0.0;  ///< speed_exponent() of the predicted counts
};

/// The result of a validation. "Row by row" means one element for each row, in the order of the table.
struct Validation {
  AccidentTable accidents;                 ///< the table
  Plan plan;                               ///< from what the members were drawn
  std::int64_t members = 0,                ///< all members
      failed = 0;                          ///< those of them that failed
  std::vector<study::Spread> predicted;    ///< row by row, derailed cars over the members that did not fail
  std::vector<study::Interval> intervals;  ///< row by row, study::predictive_interval of kIntervalShare
  std::vector<double> crps;                ///< row by row, crps() [cars]
  Stretched stretched;                     ///< 90 % intervals, stretched with all rows
  std::vector<Fit> fits;                   ///< statistical models, fitted to all rows
  std::vector<Group> groups;  ///< groups that have rows; inside and outside of the fitted class, if any are outside
  std::vector<PostureBand> posture;   ///< by speed; empty if the table does not tell it, or in models of the plane
  FittedClass fitted;                 ///< class of the fit; not known if the study does not name it
  std::vector<std::string> outside;   ///< row by row, outside() of the fitted class; empty if inside
  std::vector<std::string> warnings;  ///< what to check before the numbers are believed; one line each
};
/// Scores a validation. Throws inputs::InputError if the file that study.fitted_on names cannot be read.
Validation evaluate(const Plan& plan, const AccidentTable& accidents, const Ensembles& ensembles);

/// Checks that each row makes a valid scenario in each of its ways. Throws inputs::InputError about all rows that do
/// not, or with `skip_invalid` moves them to accidents.left_out.
void check_scenarios(const Plan& plan, AccidentTable& accidents, bool skip_invalid);

/// Returns the study in full as JSON; of a file of ways, its groups with the codes of their causes, shares and studies.
std::string described(const Plan& plan);
/// Returns the scores as a table for people.
std::string to_table(const Validation& v);
/// Returns everything but the rows as JSON.
std::string to_json(const Validation& v);
/// Returns the rows as CSV: the columns of the table, then the predictions.
std::string rows_csv(const Validation& v);
/// Returns all members as CSV: one line each, with the sampled inputs and all outcome::quantities().
std::string members_csv(const Plan& plan, const Ensembles& ensembles);

}  // namespace train_derail::validation
