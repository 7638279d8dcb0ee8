#include "train_derail/ros/node.hpp"

#include <atomic>
#include <csignal>
#include <exception>

#include <ros/console.h>
#include <ros/init.h>
#include <ros/this_node.h>

#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/services.hpp"
#include "train_derail/ros/simulation_loop.hpp"
#include "train_derail/ros/study_action.hpp"

namespace train_derail::ros_face {

namespace {

std::atomic<bool> g_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may touch it only then");

void request_stop(int /*signal*/) { g_stop = true; }

constexpr int kExitInput = 2;
constexpr int kExitOther = 1;

int run(::ros::NodeHandle& handle) {
  const std::string& name = ::ros::this_node::getName();
  const XmlRpc::XmlRpcValue tree = fetch_parameters(name);
  const NodeParameters parameters = read_node_parameters(tree, name);
  SimulationLoop loop(handle, parameters, read_scenario_source(tree, name));
  if (parameters.publish_clock && !::ros::Time::isSimTime()) {
    ROS_WARN_NAMED("run", "/use_sim_time is not set: nodes that do not follow /clock will not match the stamps");
  }
  Services services(handle, loop);
  StudyAction study_action(handle);
  return loop.run(g_stop);
}

}  // namespace

int run_node(int argc, char** argv) {
  ::ros::init(argc, argv, "train_derail", ::ros::init_options::NoSigintHandler);
  // Outlives what may throw: with the last handle goes the console.
  ::ros::NodeHandle handle("~");
  // Not before: while the handle waits for a master, the default action is the right one.
  std::signal(SIGINT, request_stop);
  std::signal(SIGTERM, request_stop);
  int code = kExitOther;
  try {
    code = run(handle);
  } catch (const inputs::InputError& e) {
    ROS_FATAL_NAMED("run", "%s", e.what());
    code = kExitInput;
  } catch (const std::exception& e) {
    ROS_FATAL_NAMED("run", "%s", e.what());
  }
  ::ros::shutdown();
  return code;
}

}  // namespace train_derail::ros_face
