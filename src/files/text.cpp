#include "train_derail/files/text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace train_derail::files {

std::string lower_case(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(),
                 [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c); });
  return out;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t";
  const auto first = text.find_first_not_of(kBlanks);
  return first == std::string_view::npos ? text.substr(0, 0)
                                         : text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const Character c = first_character(text);
    if (!c.valid || c.code == 0) return false;
    text.remove_prefix(c.bytes);
  }
  return true;
}

std::string printable(std::string_view text, std::size_t most) {
  std::string out;
  for (std::size_t shown = 0; !text.empty(); ++shown) {
    if (shown == most) return out + "...";
    const Character c = first_character(text);
    if (c.valid && !is_control(c.code)) {
      out += text.substr(0, c.bytes);
    } else if (c.code == '\n' || c.code == '\t' || c.code == '\r') {
      out += c.code == '\n' ? "\\n" : c.code == '\t' ? "\\t" : "\\r";
    } else {
      out += c.valid && c.code >= 0x80 ? fmt::format("\\u{:04x}", static_cast<unsigned>(c.code))
                                       : fmt::format("\\x{:02x}", static_cast<unsigned>(c.code));
    }
    text.remove_prefix(c.bytes);
  }
  return out;
}

}  // namespace train_derail::files
