/// \file
/// Table of the states of a run (CSV): one row a car and time, with what belongs to the coupler behind the car.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/fields/field.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::simulation {

/// What of the states a table has. `time_s` and `car` are always there, as its first columns.
class TableChoice {
 public:
  /// Everything.
  TableChoice();
  /// Only some columns, in this order, and some cars.
  /// \param columns  names as in the header ("x_m") or as in car_fields() and coupler_fields() ("x"); empty: all.
  /// \param cars     numbers of cars from 1, in any order; empty: all.
  /// Throws std::invalid_argument, which gives the name and those that are near it, if there is no such column.
  explicit TableChoice(const std::vector<std::string>& columns, std::vector<int> cars = {});

  /// A column: of the car or of the coupler behind it.
  struct Column {
    const fields::Field<CarSnapshot>* car = nullptr;          ///< null if it is the coupler's
    const fields::Field<CouplerSnapshot>* coupler = nullptr;  ///< null if it is the car's
  };
  /// Columns in their order.
  const std::vector<Column>& columns() const { return columns_; }
  /// Numbers of the cars from 1, rising; empty: all.
  const std::vector<int>& cars() const { return cars_; }

 private:
  std::vector<Column> columns_;
  std::vector<int> cars_;
};

/// Writes the names of the columns.
void write_csv_header(std::ostream& out, const TableChoice& choice = {});
/// Writes one moment; columns of the coupler are empty for the last car.
void write_csv_rows(std::ostream& out, const Snapshot& snapshot, const TableChoice& choice = {});

/// Gives `now` those largest forces of `before`, the moment before it, that are larger than its own: the peaks of both.
void keep_peaks(const Snapshot& before, Snapshot& now);

/// Keeps every n-th state of the output grid, and the first and the last one. What it keeps is what a table of all
/// states has, but for the peaks: they are those of all states since the one that was kept before.
class ThinnedStates {
 public:
  /// \param every  n, from 1.
  explicit ThinnedStates(std::int64_t every) : every_(every) {}

  /// Takes the state at point `tick` of the output grid. Returns the state to be kept, or null.
  const Snapshot* add(std::int64_t tick, Snapshot state);
  /// Returns the last state if it has not been kept, or null.
  const Snapshot* last() const { return kept_ || !state_ ? nullptr : &*state_; }

 private:
  std::int64_t every_;
  std::optional<Snapshot> state_;  // the last one, with the peaks since the one that was kept
  bool kept_ = true;
};

}  // namespace train_derail::simulation
