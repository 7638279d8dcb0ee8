#include "train_derail/ros/diagnostics.hpp"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <fmt/format.h>
#include <ros/console.h>
#include <ros/this_node.h>

#include "train_derail/ros/clock_watch.hpp"

namespace train_derail::ros_face {

namespace {

using diagnostic_msgs::DiagnosticStatus;

constexpr double kWarningPeriod = 10.0;  // wall [s]

void add(DiagnosticStatus& status, const std::string& key, const std::string& value) {
  diagnostic_msgs::KeyValue pair;
  pair.key = key;
  pair.value = value;
  status.values.push_back(pair);
}

}  // namespace

Diagnostics::Diagnostics(::ros::NodeHandle& private_handle, double period, double overload_threshold)
    : publisher_(private_handle.advertise<diagnostic_msgs::DiagnosticArray>("/diagnostics", 10)),
      period_(wall_seconds(period)),
      overload_threshold_(overload_threshold),
      due_(WallClock::now()),
      next_warning_(due_) {}

void Diagnostics::report(WallTime now, const ::ros::Time& stamp, const Health& health) {
  due_ = now + period_;
  const outcome::Outcome& o = health.outcome;
  DiagnosticStatus status;
  status.name = ::ros::this_node::getName() + ": simulation";
  status.hardware_id = "none";
  status.level = DiagnosticStatus::OK;
  status.message = health.state;
  if (o.ended == outcome::Ended::integration_failed) {
    status.level = DiagnosticStatus::ERROR;
    status.message = "integration failed: " + o.message;
  } else if (!health.clock_publishers.empty()) {
    status.level = DiagnosticStatus::ERROR;
    status.message = rivals_text(health.clock_publishers);
  } else if (health.lost_share > overload_threshold_) {
    status.level = DiagnosticStatus::WARN;
    status.message =
        fmt::format("cannot keep up: rate {:.3g} instead of {:.3g}", health.achieved_rate.value_or(0.0), health.rate);
    if (now >= next_warning_) {
      ROS_WARN_STREAM_NAMED("pace", status.message);
      next_warning_ = now + wall_seconds(kWarningPeriod);
    }
  }
  add(status, "run id", std::to_string(health.run_id));
  add(status, "state", health.state);
  add(status, "simulated time [s]", fmt::format("{:.6g}", health.time));
  add(status, "wanted rate", fmt::format("{:.6g}", health.rate));
  add(status, "achieved rate", health.achieved_rate.has_value() ? fmt::format("{:.4g}", *health.achieved_rate) : "nan");
  add(status, "lateness, largest [s]", fmt::format("{:.6f}", health.late_max));
  add(status, "share of wall time lost", fmt::format("{:.4f}", health.lost_share));
  add(status, "solver steps", std::to_string(o.solver.steps));
  add(status, "rejected steps", std::to_string(o.solver.rejected_steps));
  add(status, "right-hand sides", std::to_string(o.solver.rhs_evaluations));
  add(status, "time in the solver [s]", fmt::format("{:.6f}", o.wall_time));
  add(status, "energy residual", fmt::format("{:.3g}", o.energy_residual));
  add(status, "ended", std::string(outcome::to_string(o.ended)));

  diagnostic_msgs::DiagnosticArray array;
  array.header.stamp = stamp;
  array.status.push_back(status);
  publisher_.publish(array);
}

}  // namespace train_derail::ros_face
