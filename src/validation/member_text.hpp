// A run of a validation as a line of members.csv and of the journal.
#pragma once

#include <string>

#include "train_derail/validation/validation.hpp"

namespace train_derail::validation {

std::string columns_of_members(const study::Study& study);

std::string line_of(const Accident& accident, std::int64_t member, const study::Point& point, const Member& m);

/// What evaluate() needs of a member, back from its line. Throws std::runtime_error.
Member member_from(const std::string& line, const std::string& columns);

}  // namespace train_derail::validation
