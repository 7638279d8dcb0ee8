// Coupler forces of one run as the panel plots them: along the train now and at their largest, and over time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "train_derail/CouplerForces.h"

namespace train_derail::rviz_panel {

/// Forces are in N; draft is a magnitude.
struct ForceRecord {
  struct Sample {
    double time;         // simulated, at the start of the sample [s]
    double buff, draft;  // largest of all couplers within the sample
  };

  /// Later samples are joined so that there are never more; what is largest in them is kept.
  static constexpr std::size_t kSamplesMax = 1000;

  std::uint32_t run_id = 0;                   // 0: no message yet
  double time = 0.0;                          // simulated, of the last message [s]
  double time_max = 0.0;                      // largest of the run so far [s]
  std::vector<double> now;                    // by coupler, buff positive
  std::vector<double> buff_peak, draft_peak;  // by coupler, since the run was first seen
  std::vector<Sample> history;
  double sample_width = 0.0;  // s

  /// Begins anew when the message is of another run. One that is earlier than the last, of a run that stands still and
  /// is looked back at, changes `time` and `now` alone.
  void add(const CouplerForces& message);
  /// Largest of all couplers since the run was first seen.
  double buff_max() const;
  double draft_max() const;

 private:
  void join_pairs();
};

}  // namespace train_derail::rviz_panel
