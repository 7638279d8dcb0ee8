/// \file
/// Warnings of runs in tables, and how many runs have them.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace train_derail::study {

/// Returns all warnings of a run as one field of a table.
std::string warnings_field(const std::vector<std::string>& warnings);

/// Counts how many runs have each warning. Warnings that differ only in their numbers count as one, with the text of
/// the first: a run whose blocks of cars all have it counts once.
class WarningCount {
 public:
  /// Adds the warnings of one run, as warnings_field() has written them.
  void add(const std::string& field);
  /// Returns "3 of 200 runs: energy residual ..." for each warning, in the order of their first run.
  std::vector<std::string> texts(std::int64_t runs) const;

 private:
  struct Found {
    std::string text;
    std::int64_t runs, last;  // the last of them: its number in the order of add()
  };
  std::map<std::string, std::size_t> kinds_;  // text without numbers: index in found_
  std::vector<Found> found_;
  std::int64_t added_ = 0;
};

}  // namespace train_derail::study
