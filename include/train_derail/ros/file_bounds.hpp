// Where files may be read and written on behalf of whoever speaks to the node.
#pragma once

#include <string>
#include <vector>

namespace train_derail::ros_face {

/// A ROS 1 network has no users: who reaches the master can call everything. So what comes by a topic, a service or a
/// parameter may name files below a few folders only. Paths are resolved (relative ones, "..", symbolic links) before
/// they are judged, and a refusal says nothing of what is or is not there.
class FileBounds {
 public:
  /// `results`: the one folder below which results and bags are written. `further`: folders that may be read besides
  /// it.
  FileBounds(std::string results, std::vector<std::string> further)
      : results_(std::move(results)), further_(std::move(further)) {}

  /// The resolved path of a file or folder to be written, below the results; a relative one starts from there.
  /// `or_all`: the folder of results itself will do. Throws inputs::InputError.
  std::string writable(const std::string& where, const std::string& key, const std::string& path,
                       bool or_all = false) const;

  /// The resolved path of a file to be read. A relative one starts from the first of the folders that has it.
  /// Throws inputs::InputError.
  std::string readable(const std::string& where, const std::string& key, const std::string& path) const;

  const std::string& results() const { return results_; }
  const std::vector<std::string>& further() const { return further_; }

 private:
  std::string results_;
  std::vector<std::string> further_;
};

/// A folder of its own in ROS_HOME; ROS_HOME is ~/.ros if it is not set.
std::string default_results_folder();

}  // namespace train_derail::ros_face
