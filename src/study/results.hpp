/// \file
/// The results of a study, read back from its folder.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::study {

using Row = std::vector<std::string>;

/// What writes the tables: for errors.
inline constexpr char kResultsWriter[] = "derail study, at its end, or derail merge";

/// A column of runs.csv, as about.json describes it.
struct Number {
  std::string name, title, shown_unit;
  bool numeric;
  double per_shown;

  /// A text of a table in the unit that people read; NaN if it is no number.
  double shown(const std::string& si) const;
  /// The same in four digits; a dash for NaN.
  std::string number(const std::string& si) const;
  /// The same with its unit; a text as it is.
  std::string text(const std::string& si) const;
  /// "train speed (mph)".
  std::string label() const;
};

/// Four digits, of numbers up to ten millions all before the point; a dash for NaN.
std::string digits(double value);

/// A table that was read into memory.
struct Table {
  std::string path;
  std::vector<std::string> names;
  std::vector<Row> rows;

  /// Throws inputs::InputError if there is none of this name.
  std::size_t column(const std::string& name) const;
};

/// Smallest and largest value of an outcome over the runs that did not fail, in the shown unit.
struct Extent {
  double low = 0.0, high = 0.0;
  bool whole = true;        ///< all of them are whole numbers
  std::int64_t values = 0;  ///< how many there are
};

/// What the tables of a finished study hold, but for single runs.
struct Results {
  std::string folder;
  nlohmann::ordered_json about, study;
  std::vector<Number> factors, outcomes;
  Table summary;
  std::int64_t runs = 0;
  std::optional<Table> sobol;
  std::map<std::string, Row> points;  ///< inputs of each point, SI units as text
  std::vector<Extent> extents;        ///< of each outcome
  std::size_t failed = 0;
  std::vector<Row> failures;  ///< the first failed runs: number, inputs, reason

  bool one_at_a_time() const;
  bool by_point() const;
  std::string base(const Number& factor) const { return study.at("scenario").at(factor.name).get<std::string>(); }
};

/// Most failed runs that Results::failures holds.
inline constexpr std::size_t kFailedShown = 100;

/// Returns the base scenario of the study. Throws inputs::InputError if this version cannot read it.
inputs::Scenario base_of(const Results& results);
/// Returns the path of a file in a folder.
std::string in_folder(const std::string& folder, const char* name);
/// Reads the results in a folder. A table that was changed since it was written (its checksum in about.json differs)
/// is refused. Throws inputs::InputError.
Results read_results(const std::string& folder);

}  // namespace train_derail::study
