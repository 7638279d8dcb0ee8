#pragma once

#include <fstream>
#include <stdexcept>
#include <string>

namespace train_derail::apps {

/// Throws std::runtime_error.
inline void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace train_derail::apps
