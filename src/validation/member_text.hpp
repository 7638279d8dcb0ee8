/// \file
/// A run of a validation as a line of members.csv and of the journal.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "train_derail/study/journal.hpp"
#include "train_derail/validation/validation.hpp"

namespace train_derail::validation {

/// Returns the format of a validation's journal: its columns, the number of the run first, and the check of a row.
study::JournalFormat journal_format(const Plan& plan, const AccidentTable& accidents, const std::string& identity);

/// Returns the number of a run. It depends only on the line of the row in the file and on the member, not on which
/// other rows are used.
std::int64_t run_number(const Accident& accident, std::int64_t members, std::int64_t member);

/// Returns a member as a row of the journal.
std::vector<std::string> fields_of(const Accident& accident, std::int64_t number, const Member& m);

/// Returns what evaluate() needs of a member, from a good row of the journal.
Member member_from(const std::vector<std::string>& fields);

/// Returns a row of the journal as a line of members.csv, with its way and the position of its first car (`accident`:
/// as the member has it), if the plan is by cause, and its inputs: those of plan.keys(), empty where the way does not
/// vary them.
std::string line_of(std::vector<std::string> fields, const Plan& plan, const Way& way, const study::Point& point,
                    const Accident& accident);

}  // namespace train_derail::validation
