/// \file
/// Single runs that stand for all runs of a finished study, to be computed again and shown.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::study {

/// One run of a study.
struct Member {
  std::int64_t run = 0;       ///< its number in runs.csv
  std::string caption;        ///< "median: 12 cars, run 37"
  std::string si;             ///< the outcome by which it was chosen, as in runs.csv
  inputs::Scenario scenario;  ///< its inputs, seed included
};

/// A small, a median and a large run of a study.
struct Members {
  std::string title;            ///< of the study
  std::string chosen;           ///< one sentence: by which outcome, which quantiles, of which runs
  std::string outcome;          ///< name of that outcome
  std::string version;          ///< of the program that has computed the study
  std::vector<Member> members;  ///< from small to large; fewer than three if the study has fewer runs
};

/// Which runs, and by what.
struct MemberChoice {
  std::optional<std::string> outcome;  ///< left out: the first one of the study
  std::optional<std::int64_t> point;   ///< number of a point; left out: all points of a random plan, else the first one
};

/// Returns the runs of a finished study that are nearest to the 5 %, 50 % and 95 % quantile of an outcome; failed runs
/// are left out. Throws inputs::InputError if the folder is not whole, was changed, has no such outcome or point, or
/// was computed by the multibody engine.
Members typical_members(const std::string& folder, const MemberChoice& choice);

/// Throws std::runtime_error if `outcome`, of the run that was computed again, is not the one that the study has.
void require_same(const Members& members, const Member& member, const outcome::Outcome& outcome);

}  // namespace train_derail::study
