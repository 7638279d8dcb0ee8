/// \file
/// Checksums, which show whether data were changed after they were written.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <string_view>

#include <fmt/format.h>
#include <boost/crc.hpp>

namespace train_derail::study {

/// Returns the CRC-64/XZ of `a` followed by `b`.
inline std::uint64_t crc64(std::string_view a, std::string_view b = {}) {
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693ULL, 0xFFFFFFFFFFFFFFFFULL, 0xFFFFFFFFFFFFFFFFULL, true, true> crc;
  crc.process_bytes(a.data(), a.size());
  crc.process_bytes(b.data(), b.size());
  return crc.checksum();
}

/// Returns the same as 16 hexadecimal digits.
inline std::string crc64_text(std::string_view a, std::string_view b = {}) {
  return fmt::format("{:016x}", crc64(a, b));
}

/// Returns the CRC-32 of a file, the one of zlib, as 8 hexadecimal digits; "" if the file cannot be read. Scripts check
/// it too.
inline std::string crc32_of_file(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return "";
  boost::crc_32_type crc;
  char block[1 << 16];
  do {
    file.read(block, sizeof block);
    crc.process_bytes(block, static_cast<std::size_t>(file.gcount()));
  } while (file);
  return fmt::format("{:08x}", crc.checksum());
}

}  // namespace train_derail::study
