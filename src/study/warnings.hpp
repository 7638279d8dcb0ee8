// Warnings of runs in tables, and how often each came.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace train_derail::study {

/// All of a run's warnings as one field.
std::string warnings_field(const std::vector<std::string>& warnings);

/// Counts runs by warning. Two that differ in their numbers alone are one kind; the first stands for it.
class WarningCount {
 public:
  /// Of one run, as warnings_field() has them.
  void add(const std::string& field);
  /// "3 of 200 runs: energy residual ...", in the order in which they came up.
  std::vector<std::string> texts(std::int64_t runs) const;

 private:
  std::map<std::string, std::size_t> kinds_;  // without digits: place in found_
  std::vector<std::pair<std::string, std::int64_t>> found_;
};

}  // namespace train_derail::study
