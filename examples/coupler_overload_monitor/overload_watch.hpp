// Which couplers of a run were overloaded, when, for how long, how much. Knows no ROS.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace train_derail::examples {

/// What has happened to one coupler since the point before: the largest compression and tension, magnitudes [N].
struct Peaks {
  double buff = 0.0, draft = 0.0;
};

/// One coupler in one direction, from point to point of the grid of simulated time.
struct Load {
  std::size_t points_above =
      0;  // points of the grid up to which, from the one before, the force has been above the threshold
  double first_time = 0.0;  // the first of them [s]
  double peak = 0.0;        // largest magnitude, also between points [N]
  double peak_time = 0.0;   // of the point after it [s]
};

struct CouplerLoads {
  Load buff, draft;
};

struct RunReport {
  std::uint32_t run_id = 0;
  double threshold = 0.0;           // N
  bool complete = false;            // seen to its end; false: under way, or cut short by a restart
  double time = 0.0;                // of the last point [s]
  std::optional<double> interval;   // spacing of the grid, if the simulator has told [s]
  std::size_t points = 0;           // of the grid that were seen
  std::vector<CouplerLoads> loads;  // loads[0] is coupler 1

  /// Each point above the threshold stands for the interval before it; nothing while the interval is not known [s].
  std::optional<double> time_above(const Load& load) const;
  /// Points between time 0 and the last one that never came; 0 while the interval is not known.
  std::size_t missed() const;
  /// Couplers above the threshold in either direction.
  std::size_t overloaded() const;
};

/// Follows a simulator from run to run. Its topics come by connections of their own: what it says of a run may overtake
/// the forces, or lag behind.
class OverloadWatch {
 public:
  /// A coupler is overloaded while the magnitude of its axial force is above `threshold` [N].
  explicit OverloadWatch(double threshold) : threshold_(threshold) {}

  /// What is known of a run: spacing of its grid, and the time of its last point once it has ended [s].
  void run_info(std::uint32_t run_id, double interval, std::optional<double> end);

  /// Peaks of all couplers up to one point of the grid. A point seen before is passed over; another run, or an earlier
  /// time, begins anew. True if a coupler is above in one direction for the first time in the run.
  bool observe(std::uint32_t run_id, double time, const std::vector<Peaks>& peaks);

  /// Runs that are over, oldest first, each given once.
  std::vector<RunReport> take_finished();
  /// The run that is under way, so far; the last one if none is.
  RunReport report() const;
  /// Whether anything of a run has been seen that take_finished() has not given yet.
  bool unfinished() const { return run_ && !reported_; }

 private:
  struct Info {
    double interval;
    std::optional<double> end;
  };
  bool ended() const;

  double threshold_;
  std::map<std::uint32_t, Info> infos_;  // by run_id; of the current run and later ones
  std::optional<RunReport> run_;
  bool reported_ = false;
  std::vector<RunReport> cut_short_;
};

/// Table for people, kN beside kip; one line a coupler and direction that was above.
std::string to_table(const RunReport& report);

}  // namespace train_derail::examples
