#pragma once

#include <optional>
#include <string>
#include <vector>

#include <ros/node_handle.h>
#include <ros/publisher.h>

#include "train_derail/outcome/outcome.hpp"
#include "train_derail/ros/pacer.hpp"

namespace train_derail::ros_face {

/// What ~run_info does not say because it depends on the machine.
struct Health {
  std::uint32_t run_id = 0;
  std::string state;
  double time = 0.0;                    // simulated [s]
  double rate = 0.0;                    // wanted; 0: as fast as the integrator goes
  std::optional<double> achieved_rate;  // since the last report; empty if nothing ran
  double lost_share = 0.0;              // of the wall time since the last report, given up as it could not be made good
  double late_max = 0.0;                // latest grid point since the last report [s]
  std::vector<std::string> clock_publishers;  // if more than one
  outcome::Outcome outcome;
};

/// Reports on /diagnostics by the wall clock, as simulated time may stand still. Simulation thread only.
class Diagnostics {
 public:
  /// `period`: wall [s]. `overload_threshold`: share of the wall time lost that is complained about [-].
  Diagnostics(::ros::NodeHandle& private_handle, double period, double overload_threshold);

  WallTime due() const { return due_; }
  void report(WallTime now, const ::ros::Time& stamp, const Health& health);

 private:
  ::ros::Publisher publisher_;
  const WallClock::duration period_;
  const double overload_threshold_;
  WallTime due_, next_warning_;
};

}  // namespace train_derail::ros_face
