// What the fuzz targets have in common. A target is LLVMFuzzerTestOneInput(): libFuzzer calls it with inputs that it
// makes up, replay.cpp with those that are kept in corpus/. An exception that leaves it is a finding, as is what the
// sanitizers see.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

#include <unistd.h>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace train_derail::fuzz {

inline void expect(bool condition, const std::string& what) {
  if (condition) return;
  std::cerr << "finding: " << what << std::endl;
  std::abort();
}

/// What is said to people: one line that can be read on a terminal.
inline void expect_readable(const std::string& said) {
  constexpr std::size_t kLong = 20000;
  expect(!said.empty(), "a refusal without a reason");
  expect(said.size() <= kLong, "a refusal of " + std::to_string(said.size()) + " characters");
  expect(std::none_of(said.begin(), said.end(), [](unsigned char c) { return (c < 0x20 && c != '\n') || c == 0x7f; }),
         "control characters in a refusal: " + said);
}

/// Calls it; a refusal is fine if it is an E that can be read.
template <class E, class F>
void may_refuse(F call) {
  try {
    call();
  } catch (const E& e) {
    expect_readable(e.what());
  }
}

/// A folder of this process's own, in memory where there is such a place.
inline const std::filesystem::path& folder() {
  struct Folder {
    Folder() {
      std::string name =
          (access("/dev/shm", W_OK) == 0 ? "/dev/shm" : std::filesystem::temp_directory_path().string()) +
          "/derail_fuzz_XXXXXX";
      expect(mkdtemp(name.data()) != nullptr, name + ": cannot be made");
      path = name;
    }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
    std::filesystem::path path;
  };
  static const Folder made;
  return made.path;
}

inline std::string text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

inline void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

/// Decisions taken from an input; zeros once it is used up.
class Decisions {
 public:
  Decisions(const std::uint8_t* data, std::size_t size) : data_(data), end_(data + size) {}
  bool more() const { return data_ != end_; }
  unsigned byte() { return more() ? *data_++ : 0U; }
  /// One of [0, count).
  std::size_t below(std::size_t count) { return (byte() * 256U + byte()) % count; }

 private:
  const std::uint8_t *data_, *end_;
};

}  // namespace train_derail::fuzz
