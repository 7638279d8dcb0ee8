/// \file
/// Emergency application of air brakes: a signal runs along the pipe, each car's valve waits its dead time, force
/// builds up linearly. After: National Academies 24698, fig. F-9 (all brakes of 150 cars built up within 16 s, with a
/// second source at the rear), 280 m/s along the pipe.
#pragma once

#include <algorithm>
#include <cmath>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/simd/lanes.hpp"

namespace train_derail::model {

/// Share of the full force, 0 to 1; `since`: time since the signal reached the car [s], negative before it.
template <class T>
T brake_build_up(const inputs::Brakes& b, const T& since) {
  const double rate = b.build_up_time > 0.0 ? 1.0 / b.build_up_time : 0.0;  // outside the loops over cars
  const T t = since - b.dead_time, share = rate > 0.0 ? T(t * rate) : T(1.0);
  return select(t < T(0.0), T(0.0), select(share < T(1.0), share, T(1.0)));
}

/// Full brake force over the weight of a car of the block [-]. One force behind all loads: a share of the loaded
/// weight.
inline double brake_ratio(const inputs::Brakes& b, const inputs::CarBlock& block) {
  return block.brake_share * b.force * (block.loaded_weight ? *block.loaded_weight / block.weight : 1.0);
}

/// When the emergency application comes to a train of the speed V [m/s]: t (V / reference_speed)^-k, in seconds; a day
/// at most. `b` has the time t.
inline double emergency_moment(const inputs::Brakes& b, double speed) {
  constexpr double kDay = 86400.0;
  if (b.emergency_speed_exponent == 0.0) return *b.emergency_time;
  const double scaled = *b.emergency_time * std::pow(speed / b.reference_speed, -b.emergency_speed_exponent);
  return *b.emergency_time == 0.0 ? 0.0 : std::min(scaled, kDay);
}

/// Time that the signal takes over `distance` of pipe [m], in seconds.
inline double brake_signal_delay(const inputs::Brakes& b, double distance) {
  return b.signal == inputs::BrakeSignal::electronic ? 0.0 : std::abs(distance) / b.propagation_speed;
}

}  // namespace train_derail::model
