/// \file
/// From what the members of an accident are drawn: one study for all rows of the table, or by the cause of each some
/// ways in which it may have begun, each with its share and its study.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/study/study.hpp"
#include "train_derail/validation/causes.hpp"
#include "train_derail/validation/fitted_class.hpp"

namespace train_derail::validation {

/// Speed at which Way::share holds as it is [mph].
inline constexpr double kShareSpeed = 25.0;

/// A way in which a derailment begins.
struct Way {
  std::string name;             ///< name in tables; of a plan of one study empty
  double share = 1.0;           ///< its share of the members of a row at kShareSpeed; those of a group add up to 1 [-]
  double speed_exponent = 0.0;  ///< k: the share goes with (V / kShareSpeed)^k, V the speed of the row [-]
  study::Study study;           ///< base scenario, inputs that vary
};

/// Accidents that have a study of their own, whatever their cause: those inside of a class.
struct ClassWay {
  FittedClass of;  ///< the class
  Way way;         ///< its study; it is the only way of these rows
};

/// From what the members of each row are drawn.
class Plan {
 public:
  /// One study for all rows. Implicit: what takes a plan takes a study.
  Plan(study::Study study);  // NOLINT(google-explicit-constructor)
  /// By cause: `ways` has the ways of each group, by its name. Throws inputs::InputError if a group has none, or if the
  /// ways differ in the number of members.
  /// `classes`: rows inside of one of these have its way; the first that fits counts.
  Plan(std::string title, CauseGroups causes, std::map<std::string, std::vector<Way>> ways,
       const std::vector<ClassWay>& classes = {});

  const std::string& title() const { return title_; }
  void rename(std::string title) { title_ = std::move(title); }
  /// Groups of causes; no path if one study is for all rows.
  const CauseGroups& causes() const { return causes_; }
  bool by_cause() const { return !causes_.path.empty(); }
  /// Name of the group of the cause of an accident; empty if one study is for all rows.
  std::string group_of(const Accident& accident) const;
  /// Ways of an accident: that of the class that it is inside of, else those of the group of its cause.
  const std::vector<Way>& ways_of(const Accident& accident) const;
  /// Ways of the classes that go before the groups, with the path of each class.
  std::vector<std::pair<std::string, const Way*>> class_ways() const;
  /// Ways of a group, by its name.
  const std::vector<Way>& ways_of_group(const std::string& group) const;
  /// Shares of the ways of an accident at its speed, in their order. They add up to 1.
  std::vector<double> shares_of(const Accident& accident) const;
  /// The way of a member of an accident, from 0. Of the members of an accident each way has its share, up to one
  /// member; which ones depends on the seed of the study and the line of the accident only.
  const Way& way_of(const Accident& accident, std::int64_t member) const;
  /// The accident as a member of it has it: for a share of the members, positions_counting_locomotives, the position in
  /// the train counts the locomotives at its head, so that the first car to derail stands that many farther ahead. Not
  /// for rows inside of a class. It depends on the seed of the study, the line and the member only.
  Accident seen_by(const Accident& accident, std::int64_t member) const;
  /// All ways, group by group.
  std::vector<const Way*> all_ways() const;
  /// The study of the first way: of a plan of one study that one.
  const study::Study& first() const;
  /// Factors of all ways, each key once.
  std::vector<std::string> keys() const;

  std::string source;                           ///< its name in errors: the path of its file
  double positions_counting_locomotives = 0.0;  ///< see seen_by() [-]
  std::string fitted_on;                        ///< file that describes the accidents that it was fitted on, or empty

 private:
  std::string title_;
  CauseGroups causes_;
  std::map<std::string, std::vector<Way>> ways_;  // by group; "" if one study is for all rows
  struct ClassWays {
    FittedClass of;
    std::vector<Way> ways;  // one
  };
  std::vector<ClassWays> classes_;
};

/// How a plan is changed as it is read.
struct PlanChanges {
  std::vector<inputs::Override> overrides;  ///< changes of all base scenarios
  std::optional<double> spread;             ///< factor on all ranges instead of those in the files
  int members = 0;                          ///< members of a row instead of those in the files; 0: as there
  bool seeds_only = false;                  ///< inputs stay at those of the base scenarios
};
/// Reads a file of ways by cause (key `groups`; or `base` and `studies`: those of another file, without its classes,
/// but with other studies), or of a study. Throws inputs::InputError.
Plan read_plan(const std::string& path, const PlanChanges& changes = {});

/// Returns the study without its factors and with as many members: they differ only by their seeds.
study::Study seeds_only(study::Study study);

/// Returns the number of runs for each row: points of the study times replicates. Throws inputs::InputError if a study
/// cannot be used. It must have the plan latin_hypercube or no factors, no factor that row_decides(), and an engine
/// that knows rails that yield.
std::int64_t members_a_row(const Plan& plan);

}  // namespace train_derail::validation
