/// \file
/// Incidents of a run as a table (`derail run --incidents`).
#pragma once

#include <iosfwd>

#include "train_derail/model/incidents.hpp"

namespace train_derail::outcome {

/// Writes the incidents as CSV in the order of time: trucks that left the rails, couplers that broke, impacts. Numbers
/// are in SI units. Cars and couplers are numbered from 1 as in Outcome. Columns that do not apply to a row are empty.
void write_incidents_csv(std::ostream& out, const model::Incidents& incidents);

}  // namespace train_derail::outcome
