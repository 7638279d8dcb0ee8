/// \file
/// The action ~run_study.
#pragma once

#include <memory>

#include <ros/node_handle.h>

#include "train_derail/ros/file_bounds.hpp"

namespace train_derail::ros_face {

/// Serves the action ~run_study: studies beside the live simulation, one at a time, each in a process of its own. It
/// knows nothing of the simulation loop. Its destruction ends the study under way within a second; the journal is kept.
class StudyAction {
 public:
  /// Serves goals below `private_handle` ("~"). Files of goals must lie within `bounds`.
  StudyAction(const ::ros::NodeHandle& private_handle, const FileBounds& bounds);
  ~StudyAction();

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace train_derail::ros_face
