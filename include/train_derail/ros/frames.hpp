#pragma once

#include <string>

namespace train_derail::ros_face {

/// Names of the tf frames of one node. All hang directly below `world`.
struct Frames {
  std::string world = "map";
  std::string prefix;

  /// At a car's centre of mass, x towards its front.
  std::string car(int number) const {
    const std::string digits = std::to_string(number);
    return prefix + "car_" + std::string(digits.size() < 3 ? 3 - digits.size() : 0, '0') + digits;
  }
  /// Point of derailment; static.
  std::string pod() const { return prefix + "pod"; }
  /// Follows the middle of the derailed cars, not turned; for cameras.
  std::string pile_up() const { return prefix + "pile_up"; }
};

}  // namespace train_derail::ros_face
