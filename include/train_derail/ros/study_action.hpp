#pragma once

#include <memory>

#include <ros/node_handle.h>

#include "train_derail/ros/file_bounds.hpp"

namespace train_derail::ros_face {

/// ~run_study: studies beside the live simulation, one at a time, each in a process of its own. Knows nothing of the
/// simulation loop. Destruction ends the study under way within a second; its journal is kept.
class StudyAction {
 public:
  StudyAction(const ::ros::NodeHandle& private_handle, const FileBounds& bounds);
  ~StudyAction();

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace train_derail::ros_face
