#include "train_derail/outcome/posture.hpp"

#include <algorithm>

namespace train_derail::outcome {

Posture posture(const std::vector<Standing>& cars) {
  Posture p;
  for (const Standing& car : cars) {
    const double tilt = car.attitude.tilt;
    ++(tilt < kLeaning ? p.upright : tilt < kOver ? p.leaning : tilt <= kInverted ? p.on_side : p.inverted);
    p.drop_max = std::max(p.drop_max, -car.attitude.lowest);
    p.on_top += std::any_of(cars.begin(), cars.end(), [&](const Standing& below) {
      return car.attitude.height > below.attitude.height + kOnTop && model::touch(car.footprint, below.footprint);
    });
  }
  return p;
}

}  // namespace train_derail::outcome
