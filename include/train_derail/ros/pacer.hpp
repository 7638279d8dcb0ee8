/// \file
/// Keeps simulated time in step with the wall clock. It knows neither ROS nor how to wait; it only says when.
#pragma once

#include <chrono>
#include <utility>

namespace train_derail::ros_face {

using WallClock = std::chrono::steady_clock;
using WallTime = WallClock::time_point;

/// Converts seconds to a duration of the wall clock.
inline WallClock::duration wall_seconds(double s) {
  return std::chrono::duration_cast<WallClock::duration>(std::chrono::duration<double>(s));
}
/// Converts a duration of the wall clock to seconds.
inline double to_seconds(WallClock::duration d) { return std::chrono::duration<double>(d).count(); }

/// Fixes a pair (wall time, simulated time) as an anchor and lets simulated time run from it at a rate. If the run
/// falls behind by more than one tick, the anchor is set anew: lost time is not made good, so ticks never come in
/// bursts.
class Pacer {
 public:
  /// `rate` is in simulated seconds per wall second [-]; 0 means as fast as possible. `interval` is the simulated time
  /// between two ticks [s].
  Pacer(double rate, double interval) : rate_(rate), interval_(interval) {}

  /// Returns the wanted rate [-].
  double rate() const { return rate_; }
  /// Returns whether there is a rate to be kept.
  bool paced() const { return rate_ > 0.0; }

  /// Says that the simulated time is `t` [s] now. To be called after a start, pause or restart, and whenever the rate
  /// or the interval has changed.
  void anchor(WallTime now, double t);
  void set_rate(double rate) { rate_ = rate; }
  void set_interval(double interval) { interval_ = interval; }

  /// Returns when the simulated time `t` [s] is due; if the rate is 0, the wall time of the anchor.
  WallTime due(double t) const;

  /// To be called when the tick of simulated time `t` [s] has been sent. Returns how late it was, wall [s], at least 0.
  double done(WallTime now, double t);

  /// Returns the simulated seconds per wall second since the last call or anchor; 0 if no wall time has passed.
  double take_achieved_rate(WallTime now, double t);
  /// Returns the wall time over which take_achieved_rate() would average [s].
  double window(WallTime now) const { return to_seconds(now - window_wall_); }

  /// Returns the wall time lost for lack of computing power since the last call or anchor [s].
  double take_lost() { return std::exchange(lost_, 0.0); }

 private:
  double rate_, interval_;
  WallTime anchor_wall_{};
  double anchor_time_ = 0.0;
  WallTime window_wall_{};
  double window_time_ = 0.0;
  double lost_ = 0.0;
};

}  // namespace train_derail::ros_face
