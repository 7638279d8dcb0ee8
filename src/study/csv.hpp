// Tables as this program writes them: comma, double quotes where needed, one line a row.
#pragma once

#include <string>
#include <vector>

namespace train_derail::study {

struct Table {
  std::string path;
  std::vector<std::string> names;
  std::vector<std::vector<std::string>> rows;  // each as long as `names`

  /// Place of a column. Throws std::runtime_error that names file and column.
  std::size_t column(const std::string& name) const;
};

/// Of one line.
std::vector<std::string> fields_of(std::string line);

/// A field between double quotes; line ends become spaces.
std::string quoted(const std::string& text);

/// Lines may end with CR LF. Throws std::runtime_error: the file cannot be read, or a row has not as many fields as there are columns.
Table read_csv(const std::string& path);

}  // namespace train_derail::study
