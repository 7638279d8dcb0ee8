/// \file
/// Finds what may have been meant by a name that is not known.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace train_derail::files {

/// Whether `a` becomes `b` by one slip: a letter added, left out or changed, or two neighbours exchanged.
bool one_slip(std::string_view a, std::string_view b);
/// Returns those of `names` that may have been meant by `written`, at most five: one slip away, or one holds the other.
/// Upper and lower case are the same.
std::vector<std::string> near_misses(std::string_view written, const std::vector<std::string>& names);

}  // namespace train_derail::files
