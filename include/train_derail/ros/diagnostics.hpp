/// \file
/// How the node tells of its own health.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/ros/pacer.hpp"

namespace train_derail::ros_face {

/// State of the node that depends on the machine and is therefore not in ~run_info.
struct Health {
  std::uint32_t run_id = 0;  ///< counts the runs of the node from 1
  std::string state;         ///< "running", "paused", "stepping", "ended" or "failed"
  double time = 0.0;         ///< simulated time of the run [s]
  double rate = 0.0;         ///< wanted simulated seconds per wall second [-]; 0: as fast as the integrator goes
  std::optional<double> achieved_rate;  ///< rate since the last report [-]; empty if nothing ran
  double lost_share = 0.0;              ///< share of the wall time since the last report that was lost for good [-]
  double late_max = 0.0;                ///< largest delay of a grid point since the last report, wall [s]
  std::vector<std::string> clock_publishers;  ///< nodes that publish /clock, if there is more than one
  outcome::Outcome outcome;                   ///< outcome so far
};

/// Reports on /diagnostics by the wall clock, as simulated time may stand still. For the simulation thread only.
class Diagnostics {
 public:
  /// Reports every `period` of wall time [s], and warns if the lost share of wall time exceeds `overload_threshold`
  /// [-].
  Diagnostics(::ros::NodeHandle& private_handle, double period, double overload_threshold);

  /// Returns when the next report is due.
  WallTime due() const { return due_; }
  /// Publishes `health`. `now` is the wall time, `stamp` the simulated time of the message.
  void report(WallTime now, const ::ros::Time& stamp, const Health& health);

 private:
  ::ros::Publisher publisher_;
  const WallClock::duration period_;
  const double overload_threshold_;
  WallTime due_, next_warning_;
};

}  // namespace train_derail::ros_face
