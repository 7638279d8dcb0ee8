/// \file
/// Reads a table of real accidents and makes a scenario of each.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::validation {

/// One real accident, a row of the table. Cars are counted without locomotives. Units are those of the table.
struct Accident {
  std::size_t line = 0;             ///< line of the file, from 1
  double speed_mph = 0.0;           ///< speed of the train [mph]
  int n_cars = 0;                   ///< cars in the train
  double tons_per_car = 0.0;        ///< mean weight of a car [short tons]
  int head_end_locos = 0,           ///< locomotives at the front
      mid_locos = 0,                ///< locomotives in the middle of the train
      rear_locos = 0;               ///< locomotives at the rear
  int first_car_position = 0;       ///< position of the first car that derailed, from 1
  int cars_from_pod_to_rear = 0;    ///< cars from that car to the rear, that car included
  int cars_derailed = 0;            ///< cars that really derailed
  std::string cause;                ///< code of the cause in the report; empty if the table does not give it
  std::optional<int> empty_cars;    ///< empty cars in the train; none if the table does not give it
  std::optional<int> loaded_cars;   ///< loaded cars in the train; the others are empties and cabooses; none as above
  std::optional<int> over;          ///< derailed cars that lay on their side or over; none if the table does not tell
  std::vector<std::string> fields;  ///< the row as it is in the table
};

/// A remark about a line of the table.
struct Remark {
  std::size_t line = 0;  ///< line of the file, from 1
  std::string text;      ///< the remark
  std::string why;       ///< of a row that is left out: the reason, the same text for all rows of this reason
};

/// A table of accidents that has been read.
struct AccidentTable {
  std::string path;                  ///< its file
  std::vector<std::string> columns;  ///< names of its columns
  std::vector<Accident> rows;        ///< rows that are used
  std::vector<Remark> left_out;      ///< rows that cannot be used, and second reports of one accident
  std::vector<Remark> notes;         ///< rows that are used but had to be interpreted
};

/// Reads a table of accidents (CSV). It either has the columns of docs/validation.md, in any order and with others
/// beside them, or it holds reports as the FRA publishes them (form 6180.54), which are converted to these columns;
/// those that are no derailment of a freight train on a main track, or lack what is needed, are left out. Or
/// it is a table of posture (column on_side_or_over), which lacks some of them: `notes` says what is assumed then. A
/// line may end with one comma too many. Several reports of one accident count once. Throws inputs::InputError if the
/// file is not a table, or if rows cannot be used; the error gives file, line, column, value and allowed range of each.
/// With `skip_invalid` such rows are left out instead, as long as some remain.
AccidentTable read_accidents(const std::string& path, bool skip_invalid = false);

/// Throws `errors` as one inputs::InputError; does nothing if there are none. `rows` is the number of rows of the
/// table.
void refuse(const std::string& path, std::size_t rows, const std::vector<inputs::InputError>& errors);

/// Returns `base` with the speed, weight, locomotives and cars of an accident. The blocks of the base's consist serve
/// as templates: the first block named locomotive for locomotives, the first other block for cars, the last other block
/// for the last car. Locomotives in the middle and at the rear open the brake pipe when they are told by radio. If the
/// base has no locomotives, none are added. What the table does not tell of the cars is drawn with `seed`
/// (draw_train()). Throws inputs::InputError if the base has no cars.
inputs::Scenario scenario_of(const inputs::Scenario& base, const Accident& accident, std::uint64_t seed = 0);

/// Returns how many rows were left out for each reason, the most frequent first: "12: no derailment".
std::vector<std::string> left_out_counts(const AccidentTable& table);

/// Whether the rows of the table decide the value of a key, so that a study must not vary it.
bool row_decides(const std::string& key);

/// Number of derailed vehicles by kind.
struct Derailed {
  int cars = 0,         ///< cars without locomotives
      locomotives = 0;  ///< locomotives
};
/// Counts the derailed vehicles of a train; `snapshot` must be of a simulation of `scenario`.
Derailed count_derailed(const inputs::Scenario& scenario, const simulation::Snapshot& snapshot);

}  // namespace train_derail::validation
