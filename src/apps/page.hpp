/// \file
/// Pages of HTML: made from a document in JSON by scripts/make_page.py and the templates beside it.
#pragma once

#include <string>
#include <vector>

namespace train_derail::apps {

/// Runs a script of this package. Returns its standard output; `input` is its standard input. Throws
/// std::runtime_error if it is not found or fails, with its name, its exit code or signal, and what it says.
std::string run_script(const std::string& script, std::vector<std::string> arguments, const std::string& input);

/// Throws std::runtime_error if the script or what this template needs is missing, so that this is said before the
/// computing.
void require_page_maker(const std::string& template_name);

/// Returns the page. `template_name` is a file of scripts/derail_pages/templates without its ending, `document` what
/// it shows. Throws std::runtime_error with the script's message if it fails.
std::string make_page(const std::string& template_name, const std::string& document);

}  // namespace train_derail::apps
