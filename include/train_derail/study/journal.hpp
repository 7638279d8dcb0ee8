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

/// A folder of results belongs to one study: `study.json` in it says which.
/// Throws std::runtime_error: the folder cannot be used, or holds another study (the message names what differs).
void claim_folder(const std::string& folder, const Study& study);
/// The same for what is more than a study: JSON that tells one from another.
void claim_folder(const std::string& folder, const std::string& description);

class Journal {
 public:
  /// Opens or creates the shard's journal; a torn last line (the process was killed) is cut off.
  /// Throws std::runtime_error, also if another process is writing it.
  Journal(const std::string& folder, const Study& study, const Shard& shard);
  /// Of rows with other columns: names with commas, the first of them the run's number.
  Journal(const std::string& folder, const std::string& columns, const Shard& shard);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Indices of the runs that are in it, as found when it was opened.
  const std::vector<std::int64_t>& finished() const { return finished_; }

  /// Throws std::runtime_error if the line cannot be written whole; the journal then stays as it was.
  void append(const Point& point, const Run& run, const outcome::Outcome& outcome);
  void append(const std::string& row, double wall_time);

 private:
  std::string path_;
  int file_ = -1;
  std::vector<std::int64_t> finished_;
};

/// Calls use(run, row) for every whole row in the journals of a folder, without its computing time. Throws std::runtime_error.
void read_journals(const std::string& folder, const std::string& columns,
                   const std::function<void(std::int64_t, const std::string&)>& use);

/// Puts the journals of all shards in a folder into `runs.csv`, sorted by run; returns how many runs it holds.
/// Written under another name first: runs.csv is always whole. Throws std::runtime_error.
std::int64_t write_runs(const std::string& folder, const Study& study);

/// Copies the journals of other folders of the same study into `folder`. Throws std::runtime_error.
void gather(const std::string& folder, const std::vector<std::string>& others, const Study& study);

}  // namespace train_derail::study
