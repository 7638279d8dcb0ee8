/// \file
/// MonitorLoops of the monitor over cars and couplers, several side by side. Arrays have one entry a car unless said
/// otherwise.
#pragma once

#include <cstddef>
#include <vector>

namespace train_derail::outcome {

/// Cars as seen from above, column by column.
struct MonitoredCars {
  const double *x, *y;                                    ///< centre of mass [m]
  const double *sine, *cosine;                            ///< of the heading
  const double *vx, *vy;                                  ///< m/s
  const double* omega;                                    ///< yaw rate [rad/s]
  const double *half_length, *half_width, *half_spacing;  ///< m
};

/// Largest and smallest values so far, and when they were.
struct Extremes {
  double *highest, *highest_time, *lowest, *lowest_time;
};

/// Gaps of couplers [m] and how fast they grow [m/s] at both ends of a step of length h [s].
struct GapStep {
  double h;
  const double *from, *rate_from, *to, *rate_to;
};

struct GapRange {
  double least, most;  ///< m
};

/// One version of the loops, for one instruction set.
struct MonitorLoops {
  const char* instruction_set;
  std::ptrdiff_t lanes;
  /// Of either truck of any car [m^2/s^2].
  double (*truck_speed_squared_max)(std::ptrdiff_t n, const MonitoredCars&);
  /// Raises `astray` to the largest distance of either truck from the x axis [m].
  void (*extend_astray)(std::ptrdiff_t n, const MonitoredCars&, double* astray);
  /// Speeds of car i against car i + 1, squared, of `n` pairs: of the pins between them, and of the centres [m^2/s^2].
  void (*neighbour_speeds)(std::ptrdiff_t n, const MonitoredCars&, double* pins, double* centres);
  double (*largest_of)(std::ptrdiff_t n, const double* values);
  /// Extents of the cars along x, and half of that across [m].
  void (*boxes)(std::ptrdiff_t n, const MonitoredCars&, double* rearmost, double* foremost, double* half_breadth);
  /// Puts `n` values at time t into extremes where they go beyond them.
  void (*widen)(std::ptrdiff_t n, const double* value, double t, const Extremes&);
  /// What no gap has been below or above within the step, be it at a turning point: of the cubics through both ends.
  GapRange (*reach)(std::ptrdiff_t n, const GapStep&);
  /// Whether the negative of any of `n` gaps can have turned round beyond its extremes within the step.
  bool (*can_turn_beyond)(std::ptrdiff_t n, const GapStep&, const Extremes&);
};

extern const MonitorLoops kLoopsPlain, kLoopsSse2, kLoopsAvx2, kLoopsAvx512;

/// The fastest that this processor can run.
const MonitorLoops& loops();
/// All that this processor can run, fastest first.
std::vector<const MonitorLoops*> usable_loops();

}  // namespace train_derail::outcome
