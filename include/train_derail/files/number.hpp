// Numbers in text, read the same under every locale.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace train_derail::files {

/// The number that the whole of `text` is, in the C locale; none if it is anything else, or beyond what the type N
/// holds.
template <class N>
std::optional<N> number(std::string_view text) {
  N value{};
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || rest != end) return std::nullopt;
  return value;
}

}  // namespace train_derail::files
