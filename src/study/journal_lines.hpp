/// \file
/// Lines of journals: makes, checks, reads and copies them.
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

/// Returns the checksum of the study that a journal belongs to.
std::string fingerprint_of(const JournalFormat& format);
/// Returns the first line of a journal, without its end.
std::string head_of(const JournalFormat& format);
/// Returns a row as a line with its computing time [s] and checksum, without its end.
std::string line_of(const std::vector<std::string>& fields, double wall_time, const std::string& fingerprint);
/// Returns the part of a line before its computing time and checksum.
std::string_view outcome_part(std::string_view line);

/// Where a good row is.
struct RowPlace {
  std::int64_t run;
  std::size_t journal;  // index of the journal in a list of paths
  std::uintmax_t offset;
  std::size_t line;
  std::uint64_t crc;  // checksum of the row without its computing time
};

struct Scan {
  std::vector<RowPlace> rows;         // good rows, journal by journal
  std::vector<std::string> problems;  // bad lines, "file:line: what is wrong"
  bool damaged = false;               // whether the head or a line is bad, so that the journal must be written again
  std::uintmax_t whole = 0;           // bytes up to the end of the last complete line
  bool head = false;                  // whether there is a first line
};

/// Reads a journal, which has the index `number` in a list, and calls use() for each good row. An incomplete last line
/// is skipped. Throws InputError if the file is not a journal of this study.
Scan scan(const std::filesystem::path& path, std::size_t number, const JournalFormat& format,
          const std::function<void(const JournalRow&)>& use);

/// Sorts good rows by run and keeps one row for each run. Throws InputError if two rows of one run differ.
void sort_out(std::vector<RowPlace>& rows, const std::vector<std::filesystem::path>& journals);

/// Reads single lines of journals.
class Lines {
 public:
  explicit Lines(const std::vector<std::filesystem::path>& journals) : paths_(journals), files_(journals.size()) {}
  /// Returns the line at a place. Throws std::runtime_error if it cannot be read.
  const std::string& at(const RowPlace& place);

 private:
  const std::vector<std::filesystem::path>& paths_;
  std::vector<std::ifstream> files_;
  std::string line_;
};

/// Writes a journal that consists of the first line and of these rows.
void write_journal(const std::filesystem::path& path, const JournalFormat& format, const std::vector<RowPlace>& rows,
                   Lines& lines);

}  // namespace train_derail::study
