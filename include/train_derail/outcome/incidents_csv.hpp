#pragma once

#include <iosfwd>

#include "train_derail/model/incidents.hpp"

namespace train_derail::outcome {

/// Table of what happened, in the order of time: trucks that left the rails, couplers that broke, impacts. Cars and
/// couplers are numbered from 1 as in Outcome; SI; columns that do not apply are empty.
void write_incidents_csv(std::ostream& out, const model::Incidents& incidents);

}  // namespace train_derail::outcome
