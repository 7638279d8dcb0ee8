/// \file
/// Pages of HTML: made from a document in JSON by scripts/make_page.py and the templates beside it.
#pragma once

#include <string>

namespace train_derail::apps {

/// Throws std::runtime_error if the script or what it needs is missing, so that this is said before the computing.
void require_page_maker();

/// Returns the page. `template_name` is a file of scripts/derail_pages/templates without its ending, `document` what
/// it shows. Throws std::runtime_error with the script's message if it fails.
std::string make_page(const std::string& template_name, const std::string& document);

}  // namespace train_derail::apps
