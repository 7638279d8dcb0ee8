#include "train_derail/files/text.hpp"

#include <fmt/format.h>

namespace train_derail::files {

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
