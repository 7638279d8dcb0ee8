#pragma once

#include <iosfwd>

#include "train_derail/simulation/simulation.hpp"

namespace train_derail::simulation {

/// Header line of a tidy table: one row a car and time; columns of the coupler behind it are empty for the last car.
void write_csv_header(std::ostream& out);
void write_csv_rows(std::ostream& out, const Snapshot& snapshot);

}  // namespace train_derail::simulation
