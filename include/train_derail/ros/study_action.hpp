#pragma once

#include <memory>

#include <ros/node_handle.h>

namespace train_derail::ros_face {

/// ~run_study: studies beside the live simulation, one at a time, on threads of lower priority. Knows nothing of the
/// simulation loop. Destruction stops the study under way after the runs in flight; its journal is kept.
class StudyAction {
 public:
  explicit StudyAction(const ::ros::NodeHandle& private_handle);
  ~StudyAction();

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace train_derail::ros_face
