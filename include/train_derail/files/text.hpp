// Text from anywhere: what of it is UTF-8, and what of it a terminal may be shown.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace train_derail::files {

/// One character at the beginning of a text. `bytes` is 1 and `valid` false if none begins there.
struct Character {
  char32_t code = 0;
  std::size_t bytes = 1;
  bool valid = false;
};

/// `text` is not empty. Overlong forms and halves of surrogates are not valid.
inline Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return {lead, 1, true};
  const std::size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < bytes) return {lead, 1, false};
  char32_t code = lead & (0xffU >> (bytes + 1));
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0U) != 0x80) return {lead, 1, false};
    code = code << 6U | (byte(i) & 0x3fU);
  }
  const bool overlong = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  if (overlong || code > 0x10ffff || (code >= 0xd800 && code < 0xe000)) return {lead, 1, false};
  return {code, bytes, true};
}

/// Characters that do something instead of being seen: control characters, breaks of lines, marks that turn the
/// direction of writing.
inline bool is_control(char32_t c) {
  return c < 0x20 || (c >= 0x7f && c < 0xa0) || c == 0x2028 || c == 0x2029 || (c >= 0x202a && c <= 0x202e) ||
         (c >= 0x2066 && c <= 0x2069) || c == 0xfeff || c == 0xfffe || c == 0xffff;
}

/// Whether a text is UTF-8 without NUL.
bool is_utf8(std::string_view text);

/// Characters of a value or key that messages show at most.
inline constexpr std::size_t kShownMax = 200;

/// `text` for messages and titles, on one line and without effect on a terminal: what is no printable character of
/// valid UTF-8 is written as \n, \x1b or \u202e. Cut behind `most` characters, which "..." shows.
std::string printable(std::string_view text, std::size_t most = std::string::npos);

}  // namespace train_derail::files
