// Finished runs of a study on disk: one line each, written in one piece when the run is done.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail::study {

/// Part `index` of `count` of a study that is spread over machines; runs are dealt out in turn.
struct Shard {
  int index = 1, count = 1;
  bool owns(std::int64_t run) const { return run % count == index - 1; }
};

/// Whose runs a folder holds, and what a row of its journals looks like.
///
/// A journal's first line names its columns, the format (2) and the checksum of the study that it belongs to; every
/// other line ends with a CRC-64 of itself and of that study. A line whose checksum, number of fields, types or place
/// in the plan are wrong is not believed.
struct JournalFormat {
  std::string what;                  // "study", "validation"
  std::string identity;              // what study.json holds
  std::vector<std::string> columns;  // without the computing time; the first: the run's number
  /// What is wrong with a row of as many fields as there are columns; "" if it belongs to the plan.
  std::function<std::string(const std::vector<std::string>&)> flaw;
};
/// Of a study: the run, its place in the plan, its outcome. Inputs are not in it, the plan has them.
JournalFormat journal_format(const Study& study);

/// What is wrong with fields that ought to be a number (whole and not below 0; any), or how a run ended.
std::string flaw_of_count(const std::string& column, const std::string& text);
std::string flaw_of_number(const std::string& column, const std::string& text);
std::string flaw_of_ended(const std::string& text);

/// A folder of results belongs to one study: `study.json` in it says which. Creates both.
/// Throws std::runtime_error: it holds another study (the message names what differs), results of others, or cannot be
/// written; inputs::InputError: study.json cannot be read.
void claim_folder(const std::string& folder, const std::string& identity);
/// The same, but creates nothing: a folder that is none of this study's results is an inputs::InputError.
void check_folder(const std::string& folder, const std::string& identity);

/// A row of a journal that has been found good.
struct JournalRow {
  std::int64_t run = 0;
  std::vector<std::string> fields;  // as JournalFormat::columns
};

/// While it lives, the shard's journal belongs to this object.
class Journal {
 public:
  /// Opens or creates the shard's journal. Calls use() for every good row of all journals in the folder. Lines that are
  /// not good are taken out of the journals; a torn last line (the process was killed) is cut off in silence. Throws
  /// std::runtime_error: another process computes this shard, or there are runs and `resume` is not set;
  /// inputs::InputError: a journal of another study or format, two rows of one run that differ.
  Journal(const std::string& folder, const JournalFormat& format, const Shard& shard, bool resume,
          const std::function<void(const JournalRow&)>& use);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Lines that were not good, "file:line: what is wrong".
  const std::vector<std::string>& problems() const { return problems_; }

  /// Throws std::runtime_error if the line cannot be written whole; the journal then stays as it was.
  void append(const std::vector<std::string>& fields, double wall_time);

 private:
  std::string path_, fingerprint_;
  int lock_ = -1, file_ = -1;
  std::vector<std::string> problems_;
};

/// The fields of a run in a study's journal.
std::vector<std::string> journal_fields(const Run& run, const outcome::Outcome& outcome);

/// Puts the journals of all shards in a folder into `runs.csv`, sorted by run, with the inputs of each; returns how
/// many runs it holds. It is always whole. Throws inputs::InputError, std::runtime_error, Stopped.
std::int64_t write_runs(const std::string& folder, const Study& study, const std::atomic<bool>* stop = nullptr);

struct Gathered {
  std::int64_t runs = 0, total = 0;  // in the folder now; of the study
  std::int64_t added = 0;
  std::vector<std::string> problems;  // lines that were not good, "file:line: what is wrong"
  std::string missing;                // shards and runs that are not there; "" if none
};
/// Adds to `folder` the runs that it lacks and the others have; nothing is taken away or replaced. After a kill it
/// holds what it held, or all. Throws inputs::InputError: a folder is missing or of another study, or two rows of one
/// run differ (both are named); std::runtime_error: a study is being computed in `folder`, or it cannot be written.
Gathered gather(const std::string& folder, const std::vector<std::string>& others, const Study& study);

}  // namespace train_derail::study
