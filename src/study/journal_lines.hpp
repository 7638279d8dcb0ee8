// The lines of journals: made, read with all that can be wrong with them, and copied.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "train_derail/study/journal.hpp"

namespace train_derail::study {

/// Checksum of the study that a journal belongs to.
std::string fingerprint_of(const JournalFormat& format);
/// First line, without its end.
std::string head_of(const JournalFormat& format);
/// A row with its checksum, without a line end.
std::string line_of(const std::vector<std::string>& fields, double wall_time, const std::string& fingerprint);
/// The part of a line that says what came out, without computing time and checksum.
std::string_view outcome_part(std::string_view line);

/// Where a good row lies.
struct RowPlace {
  std::int64_t run;
  std::size_t journal;  // in a list of paths
  std::uintmax_t offset;
  std::size_t line;
  std::uint64_t crc;  // of what came out
};

struct Scan {
  std::vector<RowPlace> rows;         // journal by journal
  std::vector<std::string> problems;  // "file:line: what is wrong"
  bool damaged = false;               // ... or the head: the journal is to be written anew
  std::uintmax_t whole = 0;           // bytes up to the end of the last whole line
  bool head = false;                  // there is a first line
};

/// Reads a journal, the `number`-th of a list. A torn last line is passed over. Throws InputError if it is no journal
/// of this study.
Scan scan(const std::filesystem::path& path, std::size_t number, const JournalFormat& format,
          const std::function<void(const JournalRow&)>& use);

/// Good rows of journals in the order of runs, each run once. Throws InputError if two rows of a run differ.
void sort_out(std::vector<RowPlace>& rows, const std::vector<std::filesystem::path>& journals);

/// Lines of journals by their places.
class Lines {
 public:
  explicit Lines(const std::vector<std::filesystem::path>& journals) : paths_(journals), files_(journals.size()) {}
  /// Throws std::runtime_error.
  const std::string& at(const RowPlace& place);

 private:
  const std::vector<std::filesystem::path>& paths_;
  std::vector<std::ifstream> files_;
  std::string line_;
};

/// A journal of the head and these lines, whole.
void write_journal(const std::filesystem::path& path, const JournalFormat& format, const std::vector<RowPlace>& rows,
                   Lines& lines);

}  // namespace train_derail::study
