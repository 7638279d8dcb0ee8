#include "train_derail/simulation/checkpoint.hpp"

#include <ostream>
#include <string_view>

#include <fmt/format.h>

#include "train_derail/files/archive.hpp"
#include "train_derail/files/checksum.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::simulation {

namespace {

constexpr std::size_t kBytesMax = 1U << 30U;
constexpr std::string_view kMark = "train_derail checkpoint, of version ";

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void walk(Checkpoint& checkpoint, files::Archive& archive) {
  archive.value("scenario", checkpoint.scenario);
  archive.value("time", checkpoint.time);
  archive.value("run", checkpoint.bytes);
}

}  // namespace

void write_checkpoint(const Checkpoint& checkpoint, std::ostream& out) {
  files::Archive archive;
  Checkpoint copy = checkpoint;  // a walk may change what it walks over
  walk(copy, archive);
  const std::vector<std::uint8_t> bytes = archive.bytes();
  out << kMark << TRAIN_DERAIL_VERSION << ", checksum " << files::crc64_text(text_of(bytes)) << "\n" << text_of(bytes);
}

Checkpoint read_checkpoint(const std::string& path) {
  const std::string content = inputs::read_file(path, kBytesMax);
  const auto refuse = [&path](const std::string& problem, const std::string& allowed) {
    throw inputs::InputError(path, "", "", problem, allowed);
  };
  const std::size_t end = content.find('\n');
  if (end == std::string::npos || content.compare(0, kMark.size(), kMark) != 0)
    refuse("not a checkpoint", "a file that derail run --checkpoint has written");
  const std::string head = content.substr(0, end);
  const std::string version = head.substr(kMark.size(), head.find(", checksum ") - kMark.size());
  if (version != TRAIN_DERAIL_VERSION) {
    refuse(fmt::format("a checkpoint of train_derail {}", version),
           "one of train_derail " TRAIN_DERAIL_VERSION ": another version need not compute the same");
  }
  const std::string_view rest = std::string_view(content).substr(end + 1);
  if (head != fmt::format("{}{}, checksum {}", kMark, version, files::crc64_text(rest)))
    refuse("a damaged checkpoint: its checksum differs", "a whole one");
  Checkpoint checkpoint;
  checkpoint.source = path;
  try {
    files::Archive archive(std::vector<std::uint8_t>(rest.begin(), rest.end()));
    walk(checkpoint, archive);
  } catch (const files::ArchiveError& e) {
    refuse(e.what(), "a file that derail run --checkpoint has written");
  }
  return checkpoint;
}

}  // namespace train_derail::simulation
