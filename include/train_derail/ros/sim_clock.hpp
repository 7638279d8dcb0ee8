/// \file
/// Stamps of simulated time.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <ros/duration.h>
#include <ros/time.h>

namespace train_derail::ros_face {

/// The one place where simulated time becomes a stamp. Stamps depend on nothing else, are never 0 and never go back:
/// each run starts at a whole second after every stamp before it.
class SimClock {
 public:
  /// Returns the stamp of the simulated time `t` since the start of the run [s].
  ::ros::Time stamp(double t) const {
    ::ros::Duration since;
    since.fromNSec(static_cast<std::int64_t>(std::llround(t * 1.0e9)));
    return start_ + since;
  }

  /// Returns the stamp of time 0 of the run.
  const ::ros::Time& start() const { return start_; }
  /// Returns the newest stamp in use.
  const ::ros::Time& now() const { return now_; }
  /// Goes on to the simulated time `t` of the run [s], never back.
  void advance(double t) { now_ = std::max(now_, stamp(t)); }
  /// Goes on by `seconds` of time, past the end of the run.
  void advance_by(double seconds) { now_ += ::ros::Duration(seconds); }

  /// Goes on by `seconds` within a run: its time 0 and all later stamps move with it.
  void slip(double seconds) {
    start_ += ::ros::Duration(seconds);
    now_ += ::ros::Duration(seconds);
  }

  /// Begins a run at the next whole second.
  void start_run() {
    start_ = ::ros::Time(now_.sec + 1, 0);
    now_ = start_;
  }

 private:
  ::ros::Time start_{0, 0};
  ::ros::Time now_{0, 0};
};

}  // namespace train_derail::ros_face
