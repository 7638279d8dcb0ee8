#include "train_derail/files/checksum.hpp"

#include <fstream>

#include <fmt/format.h>
#include <boost/crc.hpp>

namespace train_derail::files {

std::uint64_t crc64(std::string_view a, std::string_view b) {
  boost::crc_optimal<64, 0x42F0E1EBA9EA3693ULL, 0xFFFFFFFFFFFFFFFFULL, 0xFFFFFFFFFFFFFFFFULL, true, true> crc;
  crc.process_bytes(a.data(), a.size());
  crc.process_bytes(b.data(), b.size());
  return crc.checksum();
}

std::string crc64_text(std::string_view a, std::string_view b) { return fmt::format("{:016x}", crc64(a, b)); }

std::string crc32_of_file(const std::string& path) {
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

}  // namespace train_derail::files
