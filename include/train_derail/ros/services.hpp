/// \file
/// The services of the node.
#pragma once

#include <mutex>
#include <vector>

#include <ros/callback_queue.h>
#include <ros/node_handle.h>
#include <ros/service_server.h>
#include <ros/spinner.h>
#include <std_srvs/Trigger.h>

#include "train_derail/GetInputs.h"
#include "train_derail/Restart.h"
#include "train_derail/Seek.h"
#include "train_derail/SetColours.h"
#include "train_derail/SetRate.h"
#include "train_derail/Step.h"
#include "train_derail/ros/simulation_loop.hpp"

namespace train_derail::ros_face {

/// Offers the services of the node. Hands each call to the simulation thread and waits for its answer; decides nothing.
/// A call that is refused is answered with success = false, as the transport has worked. Runs on threads and a callback
/// queue of its own.
class Services {
 public:
  /// Offers the services below `private_handle` ("~") until it is destroyed. `loop` must outlive it.
  Services(const ::ros::NodeHandle& private_handle, SimulationLoop& loop);
  ~Services();

 private:
  bool pause(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool resume(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool step(Step::Request& request, Step::Response& response);
  bool restart(Restart::Request& request, Restart::Response& response);
  bool seek(Seek::Request& request, Seek::Response& response);
  bool set_colours(SetColours::Request& request, SetColours::Response& response);
  bool set_rate(SetRate::Request& request, SetRate::Response& response);
  bool get_inputs(GetInputs::Request& request, GetInputs::Response& response);

  SimulationLoop& loop_;
  std::mutex restart_mutex_;
  ::ros::CallbackQueue queue_;
  ::ros::NodeHandle handle_;
  std::vector<::ros::ServiceServer> servers_;
  ::ros::AsyncSpinner spinner_;
};

}  // namespace train_derail::ros_face
