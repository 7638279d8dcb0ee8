// Example of a subscriber in C++: reports the couplers of a simulated train whose axial force exceeds a threshold.
//
// Parameters: ~simulator, name of the simulator's node (default: train_derail); ~threshold, N or with a unit (default:
// 1000 kip); ~resume, start a paused simulator once its topics arrive, so that nothing of the run is missed (default:
// false). Publishes ~report, latched: first a summary, then one status a coupler and direction that has been above.
// Exit codes: 0 done, 2 a parameter is not valid.
#include <algorithm>
#include <atomic>
#include <csignal>
#include <exception>

#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include "overload_watch.hpp"
#include "train_derail/CouplerForces.h"
#include "train_derail/RunInfo.h"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/ros/parameter_reader.hpp"
#include "train_derail/ros/parameters.hpp"

namespace train_derail::examples {

namespace {

using diagnostic_msgs::DiagnosticArray;
using diagnostic_msgs::DiagnosticStatus;

constexpr std::uint32_t kQueue = 1000;  // as deep as the simulator's: at rate 0 it does not wait for anybody
constexpr double kWait = 0.1;           // longest that a signal goes unseen, wall [s]

std::atomic<bool> g_stop{false};
void request_stop(int /*signal*/) { g_stop = true; }

struct Parameters {
  std::string simulator = "train_derail";
  double threshold = 1000.0 * inputs::kKip;  // N
  bool resume = false;
};

Parameters read_parameters(const XmlRpc::XmlRpcValue& tree, const std::string& node_name) {
  ros_face::ParameterReader reader(tree, node_name);
  Parameters p;
  p.simulator = reader.graph_name("simulator", p.simulator);
  p.threshold = reader.number("threshold", "N", p.threshold, 1.0, 1.0e12);
  p.resume = reader.flag("resume", p.resume);
  reader.refuse_unknown();
  return p;
}

void add(DiagnosticStatus& status, const std::string& key, const std::string& value) {
  diagnostic_msgs::KeyValue pair;
  pair.key = key;
  pair.value = value;
  status.values.push_back(pair);
}

DiagnosticStatus make_status(const std::string& name, bool overloaded, const std::string& message) {
  DiagnosticStatus status;
  status.level = overloaded ? DiagnosticStatus::WARN : DiagnosticStatus::OK;
  status.name = ::ros::this_node::getName() + ": " + name;
  status.message = message;
  return status;
}

void add_load(DiagnosticArray& array, const RunReport& report, std::size_t coupler, const char* direction,
              const Load& load) {
  if (load.points_above == 0) return;
  DiagnosticStatus status = make_status(fmt::format("coupler {} {}", coupler, direction), true,
                                        fmt::format("above from {:.3f} s on, peak {:.0f} kN ({:.0f} kip)",
                                                    load.first_time, load.peak / 1000.0, load.peak / inputs::kKip));
  add(status, "coupler", std::to_string(coupler));
  add(status, "direction", direction);
  add(status, "first_time_s", ros_face::number_text(load.first_time));
  if (const auto above = report.time_above(load)) add(status, "time_above_s", ros_face::number_text(*above));
  add(status, "peak_N", ros_face::number_text(load.peak));
  add(status, "peak_time_s", ros_face::number_text(load.peak_time));
  array.status.push_back(status);
}

DiagnosticArray to_message(const RunReport& report, const ::ros::Time& stamp) {
  DiagnosticArray array;
  array.header.stamp = stamp;
  DiagnosticStatus summary =
      make_status("couplers", report.overloaded() > 0,
                  fmt::format("run {}: {} of {} couplers above {:.0f} kN", report.run_id, report.overloaded(),
                              report.loads.size(), report.threshold / 1000.0));
  add(summary, "run_id", std::to_string(report.run_id));
  add(summary, "complete", report.complete ? "true" : "false");
  add(summary, "time_s", ros_face::number_text(report.time));
  add(summary, "threshold_N", ros_face::number_text(report.threshold));
  add(summary, "points_missed", std::to_string(report.missed()));
  array.status.push_back(summary);
  for (std::size_t i = 0; i < report.loads.size(); ++i) {
    add_load(array, report, i + 1, "buff", report.loads[i].buff);
    add_load(array, report, i + 1, "draft", report.loads[i].draft);
  }
  return array;
}

class CouplerOverloadMonitor {
 public:
  CouplerOverloadMonitor(::ros::NodeHandle& private_handle, const Parameters& parameters)
      : watch_(parameters.threshold), resume_(parameters.resume) {
    report_ = private_handle.advertise<DiagnosticArray>("report", kQueue, true);
    ::ros::NodeHandle handle;
    simulator_ = handle.resolveName(parameters.simulator);
    run_info_ = handle.subscribe(simulator_ + "/run_info", kQueue, &CouplerOverloadMonitor::on_run_info, this);
    couplers_ = handle.subscribe(simulator_ + "/couplers", kQueue, &CouplerOverloadMonitor::on_couplers, this);
  }

  /// What has been seen of a run that is still under way.
  void finish() {
    if (watch_.unfinished()) send(watch_.report());
  }

 private:
  void on_run_info(const RunInfo& info) {
    const bool over = info.state == RunInfo::ENDED || info.state == RunInfo::FAILED;
    stamp_ = std::max(stamp_, info.header.stamp);
    watch_.run_info(info.run_id, info.interval, over ? std::optional<double>(info.time) : std::nullopt);
    paused_ = info.state == RunInfo::PAUSED;
    after_message();
  }

  void on_couplers(const CouplerForces& message) {
    stamp_ = std::max(stamp_, message.header.stamp);
    peaks_.clear();
    // What a coupler carries at the point itself belongs to what it has carried since the last one.
    for (const CouplerForce& c : message.couplers) {
      peaks_.push_back({std::max(c.buff_peak, c.axial_force), std::max(c.draft_peak, -c.axial_force)});
    }
    if (watch_.observe(message.run_id, message.time, peaks_)) report_.publish(to_message(watch_.report(), stamp_));
    after_message();
  }

  void after_message() {
    for (const RunReport& report : watch_.take_finished()) send(report);
    // Both topics are latched: once something has come, nothing is missed from here on.
    if (!resume_ || !paused_ || !watch_.unfinished()) return;
    resume_ = false;
    std_srvs::Trigger trigger;
    // Persistent: of a call that ends its connection, roscpp may drop the answer on a busy machine.
    if (!::ros::service::createClient<std_srvs::Trigger>(simulator_ + "/resume", true).call(trigger)) {
      ROS_ERROR("%s/resume does not answer", simulator_.c_str());
    } else if (!trigger.response.success) {
      ROS_ERROR("%s/resume: %s", simulator_.c_str(), trigger.response.message.c_str());
    }
  }

  void send(const RunReport& report) {
    report_.publish(to_message(report, stamp_));
    ROS_INFO("%s", to_table(report).c_str());
  }

  OverloadWatch watch_;
  bool resume_;  // still to be done
  bool paused_ = false;
  ::ros::Time stamp_;  // newest one seen
  std::vector<Peaks> peaks_;
  std::string simulator_;
  ::ros::Publisher report_;
  ::ros::Subscriber run_info_, couplers_;
};

void run(::ros::NodeHandle& private_handle) {
  const std::string& name = ::ros::this_node::getName();
  CouplerOverloadMonitor monitor(private_handle, read_parameters(ros_face::fetch_parameters(name), name));
  while (!g_stop && ::ros::ok()) ::ros::getGlobalCallbackQueue()->callAvailable(::ros::WallDuration(kWait));
  // What has arrived already still counts.
  ::ros::getGlobalCallbackQueue()->callAvailable();
  monitor.finish();
}

}  // namespace

}  // namespace train_derail::examples

int main(int argc, char** argv) {
  ::ros::init(argc, argv, "coupler_overload_monitor", ::ros::init_options::NoSigintHandler);
  ::ros::NodeHandle private_handle("~");
  std::signal(SIGINT, train_derail::examples::request_stop);
  std::signal(SIGTERM, train_derail::examples::request_stop);
  int code = 0;
  try {
    train_derail::examples::run(private_handle);
  } catch (const train_derail::inputs::InputError& e) {
    ROS_FATAL("%s", e.what());
    code = 2;
  }
  ::ros::shutdown();
  return code;
}
