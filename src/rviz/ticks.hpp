// How far apart the ticks of an axis stand.
#pragma once

#include <algorithm>
#include <cmath>

namespace train_derail::rviz_panel {

/// 1 to 5 times a power of ten, not less than `raw`.
inline double nice_interval(double raw) {
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 3.0, 4.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10.0 * power;
}

/// Of an axis from `low` <= 0 to `high` >= 0 with a tick at 0: at least about `part` of its length, but never so much
/// that the tick at 0 is alone.
inline double tick_interval(double low, double high, double part) {
  const double wanted = nice_interval(part * (high - low)), reach = std::max(-low, high);
  if (wanted <= reach) return wanted;
  const double power = std::pow(10.0, std::floor(std::log10(reach)));
  return std::floor(reach / power) * power;
}

}  // namespace train_derail::rviz_panel
