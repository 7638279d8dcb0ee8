/// \file
/// The report of a study as a page of HTML (`derail report`).
#pragma once

#include <string>

namespace train_derail::study {

/// Returns the report of a finished study as one page of HTML without links to other files: tables, the pictures in
/// `folder`/pictures, version and machine. Throws std::runtime_error, which names the file that is missing or wrong.
std::string to_html(const std::string& folder);

}  // namespace train_derail::study
