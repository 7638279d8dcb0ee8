/// \file
/// Text from unknown sources: checks that it is UTF-8, and makes it safe to print on a terminal.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace train_derail::files {

/// One character of a text in UTF-8.
struct Character {
  char32_t code = 0;      ///< Unicode number; the first byte if the character is not valid
  std::size_t bytes = 1;  ///< length in the text; 1 if the character is not valid
  bool valid = false;     ///< whether the bytes are valid UTF-8
};

/// Decodes the first character of `text`, which must not be empty. Overlong forms and surrogates are not valid.
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

/// Whether a character acts on a terminal or editor instead of being shown: control characters, line and paragraph
/// separators, marks that change the direction of writing, byte order marks.
inline bool is_control(char32_t c) {
  return c < 0x20 || (c >= 0x7f && c < 0xa0) || c == 0x2028 || c == 0x2029 || (c >= 0x202a && c <= 0x202e) ||
         (c >= 0x2066 && c <= 0x2069) || c == 0xfeff || c == 0xfffe || c == 0xffff;
}

/// Returns `text` with the letters of ASCII in lower case.
std::string lower_case(std::string_view text);
/// Returns `text` without blanks and tabs at its ends; a part of the same text.
std::string_view trimmed(std::string_view text);

/// Whether a text is valid UTF-8 without NUL characters.
bool is_utf8(std::string_view text);

/// Most characters of a key or value that messages show.
inline constexpr std::size_t kShownMax = 200;

/// Returns `text` for messages and titles: on one line and without effect on a terminal. Every byte or character that
/// is not printable is escaped, as \\n, \\x1b or \\u202e. After `most` characters the text is cut and ends with "...".
std::string printable(std::string_view text, std::size_t most = std::string::npos);

}  // namespace train_derail::files
