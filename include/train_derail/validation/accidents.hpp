// Real accidents from a table, and the scenario of each.
#pragma once

#include <string>
#include <vector>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::validation {

/// One row. Cars are counted without locomotives; units as in the table.
struct Accident {
  std::size_t line = 0;  // of the file
  double speed_mph = 0.0;
  int n_cars = 0;
  double tons_per_car = 0.0;       // short tons
  int head_end_locos = 0, mid_locos = 0, rear_locos = 0;
  int first_car_position = 0;      // of the first car that derailed, from 1
  int cars_from_pod_to_rear = 0;   // that car counted
  int cars_derailed = 0;           // what really happened
  std::vector<std::string> fields; // the row as it stands
};

struct AccidentTable {
  std::string path;
  std::vector<std::string> columns;
  std::vector<Accident> rows;
};

/// Columns named as in docs/validation.md, in any order, others beside them. Throws inputs::InputError that names file, line,
/// column, value and what is allowed, also if the file is no table.
AccidentTable read_accidents(const std::string& path);

/// `base` with the accident's speed, weight, locomotives and cars. Blocks of the base's consist are templates: the first one named
/// locomotive; the first other one for cars; the last other one for the last car. Locomotives in the middle and at the rear vent
/// the brake pipe by radio; a base without locomotives gets none. Throws inputs::InputError if the base has no cars.
inputs::Scenario scenario_of(const inputs::Scenario& base, const Accident& accident);

/// Keys of a scenario that the rows decide: a study may not vary them.
bool row_decides(const std::string& key);

struct Derailed {
  int cars = 0, locomotives = 0;
};
/// The derailed of a train by kind; `snapshot` is one of the scenario's simulation.
Derailed count_derailed(const inputs::Scenario& scenario, const simulation::Snapshot& snapshot);

}  // namespace train_derail::validation
