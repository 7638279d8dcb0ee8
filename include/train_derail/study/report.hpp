/// \file
/// The report of a study (`derail report`), as a document that scripts/make_page.py makes a page of.
#pragma once

#include <string>

namespace train_derail::study {

/// Returns what the template `report` shows of a finished study, as JSON: `title`, `warnings`, `facts`, `sections`
/// (tables with texts and numbers, in units that people read), `charts`, and `pictures`, the folder whose pictures are
/// shown. Throws inputs::InputError, which names the file that is missing or wrong.
std::string report_document(const std::string& folder);

}  // namespace train_derail::study
