/// \file
/// Tables of comma-separated values after RFC 4180. All tables of this program are written and read here.
#pragma once

#include <cstddef>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace train_derail::files {

/// A mistake in a table. what() reads "PATH:LINE: problem", or "PATH: problem" if the file as a whole is meant.
class CsvError : public std::runtime_error {
 public:
  /// \param line  line of the file from 1; 0 means the file as a whole.
  CsvError(const std::string& path, std::size_t line, const std::string& problem);
  /// Line of the file from 1; 0 means the file as a whole.
  std::size_t line() const { return line_; }
  /// What is wrong, without path and line.
  const std::string& problem() const { return problem_; }

 private:
  std::size_t line_;
  std::string problem_;
};

/// Returns `text` as one field of a table. It stands between double quotes only if it must: if it holds a comma, a
/// double quote or a line end, or begins or ends with a blank.
std::string csv_field(std::string_view text);
/// Returns the fields as one row, without a line end.
std::string csv_row(const std::vector<std::string>& fields);

/// Splits one row into its fields. Returns false if `text` is not one row, for example if a double quote is not
/// closed; `problem` then says why.
bool csv_fields(std::string_view text, std::vector<std::string>& fields, std::string& problem);

/// Reads a table row by row. Lines end with LF or CR LF. A byte order mark and empty lines are skipped. A field between
/// double quotes may hold line ends.
class CsvReader {
 public:
  /// Most bytes of one row.
  static constexpr std::size_t kRowMax = 1U << 20U;

  /// Opens the file. Throws CsvError if it cannot be read or is not a regular file; pipes are refused, because
  /// reading one could wait for ever.
  explicit CsvReader(const std::string& path);

  /// Reads the next row; returns false at the end of the file. Throws CsvError if a double quote is not closed, the
  /// text is not UTF-8, or the row is longer than kRowMax.
  bool next(std::vector<std::string>& fields);
  /// Line of the file, from 1, in which the last row began.
  std::size_t line() const { return begin_; }
  /// Path that was given to the constructor.
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::ifstream file_;
  std::size_t begin_ = 0, lines_ = 0;
};

/// A table whose first row holds the names of its columns. The other rows are read one by one.
class CsvTable {
 public:
  /// Opens the file and reads the names. Throws CsvError as CsvReader does, and if the file is empty or two columns
  /// have one name.
  explicit CsvTable(const std::string& path);

  /// Names of the columns, in the order of the file.
  const std::vector<std::string>& names() const { return names_; }
  /// Index of a column, from 0. Throws CsvError, which gives the name, if there is no such column.
  std::size_t column(const std::string& name) const;
  /// Whether there is a column of this name.
  bool has(const std::string& name) const;

  /// Reads the next row; returns false at the end of the file. Throws CsvError, also if the row has more or fewer
  /// fields than there are columns.
  bool next(std::vector<std::string>& fields);
  /// Line of the file, from 1, in which the last row began.
  std::size_t line() const { return reader_.line(); }
  /// Throws CsvError about the last row.
  [[noreturn]] void fail(const std::string& problem) const;
  /// Returns field `column` of the last row as a number. Throws CsvError if it is not a number.
  double number(const std::vector<std::string>& fields, std::size_t column) const;

 private:
  CsvReader reader_;
  std::vector<std::string> names_;
};

}  // namespace train_derail::files
