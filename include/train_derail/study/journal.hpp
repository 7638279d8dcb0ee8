/// \file
/// Journals: the finished runs of a study on disk. Each run is one line, which is written at once when the run has
/// ended.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

/// Part `index` of `count` of a study that is spread over machines. The runs are dealt out to the shards in turn.
struct Shard {
  int index = 1,  ///< from 1 to count
      count = 1;  ///< number of shards
  /// Whether the run of this number (from 0) belongs to the shard.
  bool owns(std::int64_t run) const { return run % count == index - 1; }
};

/// Which study a folder of results belongs to, and what a row of its journals looks like.
///
/// The first line of a journal holds the names of the columns, the number of the format (2) and the checksum of the
/// study. Every other line ends with a CRC-64 of the study and of the line itself. A line is not used if its checksum,
/// its number of fields or the type of a field is wrong, or if it does not fit the plan of the study.
struct JournalFormat {
  std::string what;                  ///< kind of work in words: "study", "validation"
  std::string identity;              ///< description of the study, the content of study.json
  std::vector<std::string> columns;  ///< columns without the computing time; the first is the number of the run
  /// Returns what is wrong with a row, or "" if it fits the plan. The row must have one field for each column.
  std::function<std::string(const std::vector<std::string>&)> flaw;
};
/// Returns the format of a study's journal. A row holds the run, its place in the plan and its outcome, but not its
/// inputs, since they follow from the plan.
JournalFormat journal_format(const Study& study);

/// Returns what is wrong with a field that must be a whole number of at least 0; "" if nothing is.
std::string flaw_of_count(const std::string& column, const std::string& text);
/// Returns what is wrong with a field that must be a number; "" if nothing is.
std::string flaw_of_number(const std::string& column, const std::string& text);
/// Returns what is wrong with a field that must say how a run ended (outcome::Ended); "" if nothing is.
std::string flaw_of_ended(const std::string& text);

/// Makes a folder the results folder of one study, which `study.json` in it describes. Creates both if they are
/// missing. Throws std::runtime_error if the folder belongs to another study (the message says what differs), holds
/// other results or cannot be written; throws inputs::InputError if study.json cannot be read.
void claim_folder(const std::string& folder, const std::string& identity);
/// Checks the same without creating anything. Throws inputs::InputError if the folder does not hold results of this
/// study.
void check_folder(const std::string& folder, const std::string& identity);

/// A row of a journal that has passed all checks.
struct JournalRow {
  std::int64_t run = 0;             ///< number of the run, from 0
  std::vector<std::string> fields;  ///< one for each of JournalFormat::columns
};

/// The journal of one shard, locked against other processes as long as this object lives.
class Journal {
 public:
  /// Opens or creates the journal of the shard, and reads all journals in the folder.
  /// \param resume  whether the folder may already hold finished runs.
  /// \param use     called for each good row of all journals.
  /// Bad lines are removed from the journals; see problems(). An incomplete last line, which a killed process leaves,
  /// is removed without a report. Throws std::runtime_error if another process computes this shard, or if there are
  /// finished runs and `resume` is false; throws inputs::InputError if a journal belongs to another study or format, or
  /// if two rows of one run differ.
  Journal(const std::string& folder, const JournalFormat& format, const Shard& shard, bool resume,
          const std::function<void(const JournalRow&)>& use);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Bad lines that were found, as "file:line: what is wrong".
  const std::vector<std::string>& problems() const { return problems_; }

  /// Adds a finished run; `wall_time` is its computing time [s]. Throws std::runtime_error if the line cannot be
  /// written; the journal is then unchanged.
  void append(const std::vector<std::string>& fields, double wall_time);

 private:
  std::string path_, fingerprint_;
  int lock_ = -1, file_ = -1;
  std::vector<std::string> problems_;
};

/// Returns the fields of a run for the journal of a study, see journal_format().
std::vector<std::string> journal_fields(const Run& run, const outcome::Outcome& outcome);

/// Writes `runs.csv` from the journals of all shards in a folder: one row for each run, sorted by run, with its inputs.
/// Returns the number of runs. The file is replaced only when the new one is complete. Throws inputs::InputError if a
/// journal cannot be used, std::runtime_error if the file cannot be written, and Stopped.
std::int64_t write_runs(const std::string& folder, const Study& study, const std::atomic<bool>* stop = nullptr);

/// What gather() has done.
struct Gathered {
  std::int64_t runs = 0,              ///< runs that the folder holds now
      total = 0;                      ///< runs of the whole study
  std::int64_t added = 0;             ///< runs that were added
  std::vector<std::string> problems;  ///< bad lines that were left out, "file:line: what is wrong"
  std::string missing;                ///< shards and runs that are still missing; "" if none
};
/// Adds to `folder` the runs that it lacks and the folders `others` have. Nothing is removed or replaced. If the
/// process is killed, either all runs have been added or none. Throws inputs::InputError if a folder is missing or
/// belongs to another study, or if two rows of one run differ (the message names both); throws std::runtime_error if a
/// study is being computed in `folder`, or if it cannot be written.
Gathered gather(const std::string& folder, const std::vector<std::string>& others, const Study& study);

}  // namespace train_derail::study
