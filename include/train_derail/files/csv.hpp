// Tables as RFC 4180 has them: the one writer and the one reader of all that this program writes and reads.
#pragma once

#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace train_derail::files {

/// A mistake in a table: "PATH:LINE: what is wrong".
class CsvError : public std::runtime_error {
 public:
  CsvError(const std::string& path, std::size_t line, const std::string& problem);
  std::size_t line() const { return line_; }  // from 1; 0: the file as a whole
  const std::string& problem() const { return problem_; }

 private:
  std::size_t line_;
  std::string problem_;
};

/// A field, between double quotes where it has to be: a comma, a quote, a line end, a blank at an end.
std::string csv_field(std::string_view text);
/// A row without its line end.
std::string csv_row(const std::vector<std::string>& fields);

/// The fields of one row; false if `text` is no row (quotes that do not match), `problem` then says why.
bool csv_fields(std::string_view text, std::vector<std::string>& fields, std::string& problem);

/// Reads row by row. Lines end with LF or CR LF, a byte order mark is passed over, as are lines without anything.
/// Fields may hold line ends. A row is at most kRowMax bytes.
class CsvReader {
 public:
  static constexpr std::size_t kRowMax = 1U << 20U;

  /// Throws CsvError: cannot be read, or is no plain file (nothing is waited for).
  explicit CsvReader(const std::string& path);

  /// The next row; false at the end. Throws CsvError: quotes that do not match, not UTF-8, too long.
  bool next(std::vector<std::string>& fields);
  /// Line of the file where the last row began, from 1.
  std::size_t line() const { return begin_; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::ifstream file_;
  std::size_t begin_ = 0, lines_ = 0;
};

/// A table with names in its first row, read row by row.
class CsvTable {
 public:
  /// Throws CsvError: as CsvReader, or there is no row of names, or a name stands twice.
  explicit CsvTable(const std::string& path);

  const std::vector<std::string>& names() const { return names_; }
  /// Place of a column. Throws CsvError that names it.
  std::size_t column(const std::string& name) const;
  bool has(const std::string& name) const;

  /// The next row, as long as names(); false at the end. Throws CsvError.
  bool next(std::vector<std::string>& fields);
  std::size_t line() const { return reader_.line(); }
  /// An error of the last row. "PATH:LINE: problem".
  [[noreturn]] void fail(const std::string& problem) const;
  /// A field of the last row as a number. Throws CsvError.
  double number(const std::vector<std::string>& fields, std::size_t column) const;

 private:
  CsvReader reader_;
  std::vector<std::string> names_;
};

}  // namespace train_derail::files
