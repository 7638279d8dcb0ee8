/// \file
/// How cars stand, as everybody may see it.
#pragma once

namespace train_derail::model {

/// How a car stands, in models of space.
struct Attitude {
  double tilt = 0.0;    ///< angle between the car's own vertical axis and the vertical, 0 to pi [rad]
  double height = 0.0;  ///< of the middle of its body above the top of the rails [m]
  double lowest = 0.0;  ///< of the lowest corner of its body or underframe above the rails beside that corner [m]
};

}  // namespace train_derail::model
