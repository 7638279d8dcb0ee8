#include "train_derail/ros/file_bounds.hpp"

#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "train_derail/inputs/error.hpp"

namespace train_derail::ros_face {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPathMax = 4096;

void check_text(const std::string& where, const std::string& key, const std::string& path, const std::string& allowed) {
  if (path.empty()) throw inputs::InputError(where, key, "", "missing", allowed);
  if (path.size() >= kPathMax)
    throw inputs::InputError(where, key, path.substr(0, inputs::kShownMax), "too long for a path", allowed);
  const auto control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  if (std::any_of(path.begin(), path.end(), control))
    throw inputs::InputError(where, key, path, "holds control characters", allowed);
}

/// Empty if it cannot be told where it leads.
fs::path resolved(const fs::path& path) {
  std::error_code error;
  // A link to what is not there yet would lead there once it is written through.
  fs::path here;
  for (const fs::path& part : path) {
    here /= part;
    if (fs::is_symlink(fs::symlink_status(here, error)) && !fs::exists(here, error)) return {};
  }
  const fs::path real = fs::weakly_canonical(path, error);
  return error ? fs::path() : real;
}

bool is_below(const fs::path& path, const fs::path& folder, bool or_same) {
  if (path.empty() || folder.empty()) return false;
  const fs::path way = path.lexically_relative(folder);
  if (way.empty() || *way.begin() == "..") return false;
  return or_same || way != ".";
}

/// Without the mark of a folder at its end, which would count as a part.
fs::path stripped(fs::path path) {
  while (!path.has_filename() && path.has_relative_path()) path = path.parent_path();
  return path;
}

}  // namespace

std::string FileBounds::writable(const std::string& where, const std::string& key, const std::string& path,
                                 bool or_all) const {
  const std::string allowed = "a path below " + results_;
  check_text(where, key, path, allowed);
  const fs::path real = stripped(resolved(fs::path(results_) / path));
  if (!is_below(real, resolved(results_), or_all)) {
    throw inputs::InputError(where, key, path, "outside of the folder of results", allowed);
  }
  return real;
}

std::string FileBounds::readable(const std::string& where, const std::string& key, const std::string& path) const {
  std::vector<std::string> folders = further_;
  folders.push_back(results_);
  std::string allowed = "a file below ";
  for (const std::string& folder : folders) allowed += (&folder == &folders.front() ? "" : " or ") + folder;
  check_text(where, key, path, allowed);
  const std::string direct = resolved(path);
  if (!direct.empty() && std::find(files_.begin(), files_.end(), direct) != files_.end()) return direct;
  fs::path fallback;
  std::error_code error;
  for (const std::string& start : folders) {
    const fs::path real = stripped(resolved(fs::path(start) / path));
    const bool inside = std::any_of(folders.begin(), folders.end(),
                                    [&](const std::string& folder) { return is_below(real, resolved(folder), false); });
    if (!inside) continue;
    if (fs::exists(real, error)) return real;
    if (fallback.empty()) fallback = real;
  }
  if (fallback.empty()) throw inputs::InputError(where, key, path, "outside of what may be read", allowed);
  return fallback;
}

std::function<void(const std::string&)> FileBounds::asking(const std::string& where) const {
  return [this, where](const std::string& path) { readable(where, "base or consist", path); };
}

void FileBounds::allow(const std::string& path) {
  if (const fs::path real = resolved(path); !real.empty()) files_.push_back(real);
}

std::string default_results_folder() {
  const char* ros_home = std::getenv("ROS_HOME");
  if (ros_home != nullptr && *ros_home == '/') return std::string(ros_home) + "/train_derail";
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home != '/') {
    const passwd* user = getpwuid(geteuid());
    home = user != nullptr ? user->pw_dir : "/";
  }
  return std::string(home) + "/.ros/train_derail";
}

}  // namespace train_derail::ros_face
