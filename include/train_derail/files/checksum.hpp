/// \file
/// What shows that bytes are no longer those that were written.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace train_derail::files {

/// CRC-64/XZ of `a` followed by `b`.
std::uint64_t crc64(std::string_view a, std::string_view b = {});

/// The same as 16 hexadecimal digits.
std::string crc64_text(std::string_view a, std::string_view b = {});

/// CRC-32 of a file, as of zlib (scripts check it too), as 8 hexadecimal digits; "" if it cannot be read.
std::string crc32_of_file(const std::string& path);

}  // namespace train_derail::files
