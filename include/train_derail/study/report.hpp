#pragma once

#include <string>

namespace train_derail::study {

/// The folder of a finished study as one page of HTML that needs nothing beside itself: tables, the pictures that lie
/// in `folder`/pictures, version and machine. Throws std::runtime_error that names the file that is missing or wrong.
std::string to_html(const std::string& folder);

}  // namespace train_derail::study
