/// \file
/// Where files may be read and written on behalf of those who speak to the node.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace train_derail::ros_face {

/// The folders below which files may be named by a topic, a service or a parameter. A ROS 1 network has no users:
/// whoever reaches the master can call everything. Paths are resolved (relative ones, "..", symbolic links) before they
/// are judged, and a refusal does not say whether the file exists.
class FileBounds {
 public:
  /// `results` is the one folder below which results and bags are written. `further` are folders that may be read too.
  FileBounds(std::string results, std::vector<std::string> further)
      : results_(std::move(results)), further_(std::move(further)) {}

  /// Returns the resolved path of a file or folder that is to be written. A relative `path` starts from the folder of
  /// results. With `or_all` the folder of results itself is allowed. Throws inputs::InputError with `where` and `key`
  /// if the path is empty, too long, holds control characters, or leads out of the folder of results.
  std::string writable(const std::string& where, const std::string& key, const std::string& path,
                       bool or_all = false) const;

  /// Returns the resolved path of a file that is to be read. A relative `path` starts from the first of the folders
  /// that has it. Throws inputs::InputError as writable() does.
  std::string readable(const std::string& where, const std::string& key, const std::string& path) const;

  /// Returns what asks readable() for every file that a scenario named `where` names. It must not outlive the bounds.
  std::function<void(const std::string&)> asking(const std::string& where) const;
  /// Lets one more file be read, wherever it is.
  void allow(const std::string& path);

  /// Returns the folder below which results are written.
  const std::string& results() const { return results_; }
  /// Returns the folders that may be read besides it.
  const std::vector<std::string>& further() const { return further_; }

 private:
  std::string results_;
  std::vector<std::string> further_;
  std::vector<std::string> files_;  // resolved
};

/// Returns the folder of results unless a parameter names another: train_derail in ROS_HOME, which is ~/.ros if it is
/// not set.
std::string default_results_folder();

}  // namespace train_derail::ros_face
