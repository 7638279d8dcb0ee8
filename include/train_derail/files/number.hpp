/// \file
/// Numbers in text, read in the same way under every locale.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace train_derail::files {

/// Reads a number of type N in the C locale. Returns nothing if `text` as a whole is not a number, or if the number
/// does not fit into N.
template <class N>
std::optional<N> number(std::string_view text) {
  N value{};
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || rest != end) return std::nullopt;
  return value;
}

}  // namespace train_derail::files
