// Real accidents from a table, and the scenario of each.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::validation {

/// One row. Cars are counted without locomotives; units as in the table.
struct Accident {
  std::size_t line = 0;  // of the file
  double speed_mph = 0.0;
  int n_cars = 0;
  double tons_per_car = 0.0;  // short tons
  int head_end_locos = 0, mid_locos = 0, rear_locos = 0;
  int first_car_position = 0;       // of the first car that derailed, from 1
  int cars_from_pod_to_rear = 0;    // that car counted
  int cars_derailed = 0;            // what really happened
  std::string cause;                // code of the report; empty if the table does not say
  std::optional<int> empty_cars;    // in the train; none if the table does not say
  std::vector<std::string> fields;  // the row as it stands
};

/// A line of the table and what is to be said about it.
struct Remark {
  std::size_t line = 0;
  std::string text;
};

struct AccidentTable {
  std::string path;
  std::vector<std::string> columns;
  std::vector<Accident> rows;
  std::vector<Remark> left_out;  ///< rows that cannot be used, and further reports of an accident
  std::vector<Remark> notes;     ///< rows that are used but had to be interpreted
};

/// Columns named as in docs/validation.md, in any order, others beside them; or reports as published (form 6180.54), of
/// which rows with these columns are made. Lines may end with a comma more than there are columns. Several reports of
/// one accident count once. Throws inputs::InputError about all rows that cannot be used: file, line, column, value,
/// what is allowed; with `skip_invalid` these rows are left out instead, as long as any is left. A file that is no
/// table is an InputError too.
AccidentTable read_accidents(const std::string& path, bool skip_invalid = false);

/// What is wrong with some rows, as one error. Does nothing if nothing is.
void refuse(const std::string& path, std::size_t rows, const std::vector<inputs::InputError>& errors);

/// `base` with the accident's speed, weight, locomotives and cars. Blocks of the base's consist are templates: the
/// first one named locomotive; the first other one for cars; the last other one for the last car. Locomotives in the
/// middle and at the rear vent the brake pipe by radio; a base without locomotives gets none. Throws inputs::InputError
/// if the base has no cars.
inputs::Scenario scenario_of(const inputs::Scenario& base, const Accident& accident);

/// Keys of a scenario that the rows decide: a study may not vary them.
bool row_decides(const std::string& key);

struct Derailed {
  int cars = 0, locomotives = 0;
};
/// The derailed of a train by kind; `snapshot` is one of the scenario's simulation.
Derailed count_derailed(const inputs::Scenario& scenario, const simulation::Snapshot& snapshot);

}  // namespace train_derail::validation
