// A run of a validation as a line of members.csv and of the journal.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "train_derail/study/journal.hpp"
#include "train_derail/validation/validation.hpp"

namespace train_derail::validation {

/// The columns of a validation's journal, the run's number first, and what a row must be.
study::JournalFormat journal_format(const study::Study& study, const AccidentTable& accidents,
                                    const std::string& identity);

/// Unlike its place among the rows asked for, it belongs to line and member.
std::int64_t run_number(const Accident& accident, std::int64_t members, std::int64_t member);

/// A member as a row of the journal.
std::vector<std::string> fields_of(const Accident& accident, std::int64_t number, const Member& m);

/// What evaluate() needs of a member, back from a row that has been found good.
Member member_from(const std::vector<std::string>& fields);

/// A row of the journal as a line of members.csv, with the inputs of its point.
std::string line_of(std::vector<std::string> fields, const study::Point& point);

}  // namespace train_derail::validation
