// Text from anywhere as part of a message.
#pragma once

#include <string>
#include <string_view>

namespace train_derail::files {

/// What a terminal can show of it on one line: control characters and bytes that are not UTF-8 become '?', what is longer than `max`
/// bytes is cut.
std::string printable(std::string_view text, std::size_t max = 200);

}  // namespace train_derail::files
