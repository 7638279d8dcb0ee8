// Simulated time against the wall clock. Knows neither ROS nor how to wait: it says when.
#pragma once

#include <chrono>
#include <utility>

namespace train_derail::ros_face {

using WallClock = std::chrono::steady_clock;
using WallTime = WallClock::time_point;

inline WallClock::duration wall_seconds(double s) {
  return std::chrono::duration_cast<WallClock::duration>(std::chrono::duration<double>(s));
}
inline double to_seconds(WallClock::duration d) { return std::chrono::duration<double>(d).count(); }

/// Fixes a pair (wall time, simulated time) as anchor and lets simulated time run from it at `rate`.
/// Who falls behind by more than one tick gets a new anchor: time lost is lost, ticks never come in bursts.
class Pacer {
 public:
  /// `interval`: of the grid, simulated [s].
  Pacer(double rate, double interval) : rate_(rate), interval_(interval) {}

  double rate() const { return rate_; }
  bool paced() const { return rate_ > 0.0; }

  /// Simulated time t is now: after start, pause, restart, and whenever rate or interval change.
  void anchor(WallTime now, double t);
  void set_rate(double rate) { rate_ = rate; }
  void set_interval(double interval) { interval_ = interval; }

  /// When t is due; the anchor's wall time if the rate is 0.
  WallTime due(double t) const;

  /// To be called when tick t has been sent. Returns how late it was [s], at least 0.
  double done(WallTime now, double t);

  /// Simulated seconds per wall second since the last call or anchor; 0 if no wall time has passed.
  double take_achieved_rate(WallTime now, double t);
  /// Wall time over which take_achieved_rate() would average [s].
  double window(WallTime now) const { return to_seconds(now - window_wall_); }

  /// Wall time given up for lack of computing power since the last call or anchor [s].
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
