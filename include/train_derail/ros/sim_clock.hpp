#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include <ros/duration.h>
#include <ros/time.h>

namespace train_derail::ros_face {

/// The one place where simulated time becomes a stamp. Stamps depend on nothing else, are never 0 and never go back:
/// each run starts at a whole second after everything stamped before it.
class SimClock {
 public:
  /// t: simulated time since the start of the run [s].
  ::ros::Time stamp(double t) const {
    ::ros::Duration since;
    since.fromNSec(static_cast<std::int64_t>(std::llround(t * 1.0e9)));
    return start_ + since;
  }

  /// Stamp of time 0 of the run.
  const ::ros::Time& start() const { return start_; }
  /// Newest stamp in use.
  const ::ros::Time& now() const { return now_; }
  void advance(double t) { now_ = std::max(now_, stamp(t)); }
  /// Past the end of the run.
  void advance_by(double seconds) { now_ += ::ros::Duration(seconds); }

  void start_run() {
    start_ = ::ros::Time(now_.sec + 1, 0);
    now_ = start_;
  }

 private:
  ::ros::Time start_{0, 0};
  ::ros::Time now_{0, 0};
};

}  // namespace train_derail::ros_face
