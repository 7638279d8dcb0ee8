/// \file
/// Names of tf frames.
#pragma once

#include <string>

namespace train_derail::ros_face {

/// Names of the tf frames of one node. All are direct children of `world`.
struct Frames {
  std::string world = "map";  ///< parent of all frames: x along the track from the point of derailment, y left, z up
  std::string prefix;         ///< put before every other name, for several nodes side by side

  /// Returns the frame of car `number`, from 1: at the point of the car that lies below its centre of mass at the top
  /// of the rails when it stands on them; x towards its front, z towards its roof.
  std::string car(int number) const {
    const std::string digits = std::to_string(number);
    return prefix + "car_" + std::string(digits.size() < 3 ? 3 - digits.size() : 0, '0') + digits;
  }
  /// Returns the frame of the point of derailment. It does not move.
  std::string pod() const { return prefix + "pod"; }
  /// Returns a frame for cameras that follows the middle of the derailed cars and does not turn.
  std::string pile_up() const { return prefix + "pile_up"; }
};

}  // namespace train_derail::ros_face
