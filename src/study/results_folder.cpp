#include "study/results_folder.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <iterator>
#include <stdexcept>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "study/json_file.hpp"
#include "train_derail/files/output_file.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::study {

namespace fs = std::filesystem;
using inputs::InputError;

namespace {

constexpr const char* kStudyMakesIt = "derail study";

[[noreturn]] void refuse(const std::string& where, const std::string& problem, const std::string& allowed = "") {
  throw InputError(where, "", "", problem, allowed);
}

/// Whether a file has the name of a result of a study or validation.
bool would_be_written(const fs::path& path) {
  constexpr const char* kNames[] = {"runs.csv", "summary.csv", "sobol.csv",      "about.json",
                                    "rows.csv", "members.csv", "validation.json"};
  return shard_of(path).count > 0 ||
         std::find(std::begin(kNames), std::end(kNames), path.filename()) != std::end(kNames);
}

std::string first_difference(const nlohmann::json& was, const nlohmann::json& is) {
  const nlohmann::json patch = nlohmann::json::diff(was, is);
  if (patch.empty()) return "";
  const nlohmann::json& change = patch.at(0);
  const nlohmann::json::json_pointer place(change.at("path").get<std::string>());
  const auto at = [&](const nlohmann::json& j) {
    if (!j.contains(place)) return std::string("nothing");
    constexpr std::size_t kLong = 120;
    const std::string text = j.at(place).dump(-1, ' ', true);  // ASCII only, so that the cut splits no character
    return text.size() > kLong ? text.substr(0, kLong) + "..." : text;
  };
  return fmt::format("{}: was {}, is now {}",
                     files::printable(place.to_string().empty() ? "" : place.to_string().substr(1), files::kShownMax),
                     at(was), at(is));
}

/// Returns how the study in a folder differs from this one; "" if it is the same.
std::string difference(const std::string& folder, const std::string& identity) {
  const nlohmann::json was = read_json(in(folder, "study.json"), kStudyMakesIt);
  const std::string found = first_difference(was, nlohmann::json::parse(identity));
  return found.empty() ? "" : "holds results of another study; " + found;
}

/// Offset of a shard's lock in study.json.
std::int64_t place(const Shard& s) { return (static_cast<std::int64_t>(s.count) << 31) + s.index; }

}  // namespace

void fail(const std::string& path, const std::string& problem) { throw std::runtime_error(path + ": " + problem); }
void fail_errno(const std::string& path) { fail(path, std::strerror(errno)); }

std::string in(const std::string& folder, const std::string& name) { return (fs::path(folder) / name).string(); }

std::string journal_name(const Shard& s) {
  return s.count == 1 ? "journal.csv" : fmt::format("journal.{}-of-{}.csv", s.index, s.count);
}

Shard shard_of(const fs::path& path) {
  const std::string name = path.filename().string();
  Shard s;
  const char* end = name.data() + name.size();
  if (name == journal_name(s)) return s;
  constexpr std::string_view kBegin = "journal.", kOf = "-of-";
  if (name.compare(0, kBegin.size(), kBegin) != 0) return {0, 0};
  const auto index = std::from_chars(name.data() + kBegin.size(), end, s.index);
  const auto of = static_cast<std::size_t>(index.ptr - name.data());
  if (index.ec != std::errc() || name.compare(of, kOf.size(), kOf) != 0) return {0, 0};
  std::from_chars(index.ptr + kOf.size(), end, s.count);
  return s.count > 1 && name == journal_name(s) ? s : Shard{0, 0};
}

std::vector<fs::path> journals_in(const std::string& folder) {
  std::vector<fs::path> paths;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(folder, none)) {
    if (shard_of(entry.path()).count > 0) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

int Lock::open(const std::string& folder) {
  const std::string path = in(folder, "study.json");
  const int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) fail_errno(path);
  return file;
}

bool Lock::try_shard(const Shard& s) const { return set(F_OFD_SETLK, F_WRLCK, place(s), 1); }
bool Lock::try_all_shards() const { return set(F_OFD_SETLK, F_WRLCK, 1, 0); }
void Lock::wait_for_tables() const { set(F_OFD_SETLKW, F_WRLCK, 0, 1); }
void Lock::release_shard(const Shard& s) const { set(F_OFD_SETLK, F_UNLCK, place(s), 1); }

bool Lock::set(int command, short type, std::int64_t from, std::int64_t length) const {
  struct flock range {};
  range.l_type = type;
  range.l_whence = SEEK_SET;
  range.l_start = from;
  range.l_len = length;
  while (fcntl(file_, command, &range) != 0) {
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == EACCES) return false;
    fail("study.json", fmt::format("cannot be locked: {}", std::strerror(errno)));
  }
  return true;
}

HeldLock::~HeldLock() { close(file); }

void claim_folder(const std::string& folder, const std::string& identity) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder, error)) fail(folder, error ? error.message() : "is not a folder");
  const std::string file = in(folder, "study.json");
  if (!fs::exists(file, error)) {
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      // Checked again: another shard may have created study.json in the meantime.
      if (would_be_written(entry.path()) && !fs::exists(file, error)) {
        fail(folder, "holds " + entry.path().filename().string() + " but no study.json: not a folder of this program");
      }
    }
    try {
      files::write_file(file, identity + "\n");
      return;
    } catch (const files::ExistsError&) {  // another shard has created it
    }
  }
  if (const std::string other = difference(folder, identity); !other.empty()) fail(folder, other);
}

void check_folder(const std::string& folder, const std::string& identity) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) refuse(folder, "no such folder", "a folder that derail study has written");
  if (const std::string other = difference(folder, identity); !other.empty()) refuse(folder, other);
}

}  // namespace train_derail::study
