// A study of every accident of a table: predicted counts of derailed cars, with their spread, against the real ones.
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
#include "train_derail/validation/scores.hpp"

namespace train_derail::validation {

/// Most runs of a validation: rows times members.
inline constexpr std::int64_t kMembersMax = 1'000'000;

/// Share of the real counts that an interval is to hold.
inline constexpr double kIntervalShare = 0.9;

/// The same study without its factors: members differ by their seed alone, as many as before.
study::Study seeds_only(study::Study study);

/// Runs a row: points of the study times replicates. Throws inputs::InputError unless the study can be used: a latin
/// hypercube or no factors, none that the rows decide, an engine that knows rails.
std::int64_t members_a_row(const study::Study& study);

/// One run: row `row` of the table with the inputs of one of its points.
struct Member {
  std::size_t row = 0;  // place in AccidentTable::rows
  std::int64_t member = 0;
  std::int64_t seed = 0;  // depends on the study's seed, the line in the file and the member alone
  Derailed derailed;
  outcome::Outcome outcome;  // locomotives count in it; of a member from a journal only how it ended
  std::string text;          // its line of members.csv
};

struct Ensembles {
  std::vector<Member> members;  // row by row; all there unless stopped
  std::int64_t failed = 0;
  bool stopped = false;
  double wall_time = 0.0;             // s
  std::vector<std::string> warnings;  // "3 of 200 runs: energy residual ...", and of rows whose members cannot differ
  std::vector<std::string> problems;  // lines of the journal that were not good: their runs have been computed anew
};

/// Each row's own sample of the inputs, from the study's seed and the row's line in the file: with one sample for all,
/// its luck would not average out over rows.
study::Points points_of(study::Study study, const Accident& accident);

/// Member j of a row has the inputs of point j / replicates of points_of(). Does not depend on `jobs` (0: one a core),
/// nor on which other rows the table has. `on_progress` is called from the worker threads, one at a time. `stop` makes
/// it return soon: runs under way are given up. Throws inputs::InputError, also if a row and the base scenario do not
/// go together (the message names the line).
Ensembles run(const study::Study& study, const AccidentTable& accidents, int jobs,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop);

/// The same with a journal in `folder`, as studies have: after a kill or stop, `resume` computes what is missing. The
/// folder belongs to this study and these rows. Throws std::runtime_error: it holds others, or runs and is not to be
/// resumed, or cannot be written; inputs::InputError: what lies in it cannot be read.
struct RunOptions {
  std::string folder;
  int jobs = 0;
  bool resume = false;
};
Ensembles run(const study::Study& study, const AccidentTable& accidents, const RunOptions& options,
              const std::function<void(const study::Progress&)>& on_progress, const std::atomic<bool>& stop);

/// One way to predict, scored on a group of rows.
struct Rated {
  std::string
      name;  // "simulation" (median of its members), their "mean", "stretched" of it (scores.hpp), or that of a fit
  std::string rows;  // that it was made from: "none", "these", "the others" (leave one out)
  Score score;
  std::optional<Coverage> coverage;  // of the 90 % interval
  std::optional<double> crps;        // of the members, mean over rows [cars]
};

/// Rows that are scored together; fits are made from these rows.
struct Group {
  std::string name;
  std::size_t rows = 0;
  std::vector<Rated> rated;
  std::vector<Fit> fits;
  std::vector<SpeedBand> bands;
  double exponent_real = 0.0, exponent_predicted = 0.0;  // of the count over speed
};

struct Validation {
  AccidentTable accidents;
  study::Study study;
  std::int64_t members = 0, failed = 0;
  std::vector<study::Spread> predicted;    // row by row, derailed cars; count: members that did not fail
  std::vector<study::Interval> intervals;  // row by row, study::predictive_interval of kIntervalShare
  std::vector<double> crps;                // row by row
  Stretched stretched;                     // 90 % intervals, from all rows
  std::vector<Fit> fits;                   // from all rows
  std::vector<Group> groups;  // with at least one row; if any is outside of the fitted class, inside and outside apart
  FittedClass fitted;         // not known if the study does not say
  std::vector<std::string> outside;   // row by row, in what it lies outside of the fitted class; empty: in nothing
  std::vector<std::string> warnings;  // what should be looked at before the numbers are believed; one line each
};
/// Throws inputs::InputError: the file that study.fitted_on names.
Validation evaluate(const study::Study& study, const AccidentTable& accidents, const Ensembles& ensembles);

/// Of rows that make no scenario of the study: throws inputs::InputError about all of them, or leaves them out.
void check_scenarios(const study::Study& study, AccidentTable& accidents, bool skip_invalid);

/// For people.
std::string to_table(const Validation& v);
/// Everything but the rows.
std::string to_json(const Validation& v);
/// The table's own columns, then what was predicted; one line a row.
std::string rows_csv(const Validation& v);
/// One line a run: inputs sampled, all of outcome::quantities().
std::string members_csv(const study::Study& study, const Ensembles& ensembles);

}  // namespace train_derail::validation
