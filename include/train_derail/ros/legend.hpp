/// \file
/// Legend of the scene: what its colours mean.
#pragma once

#include <string>
#include <vector>

#include <visualization_msgs/Marker.h>

namespace train_derail::ros_face {

/// Markers of a legend.
struct Legend {
  std::vector<visualization_msgs::Marker> markers;  ///< around the origin; as seen from above, x is to the right, y up
  double below;                                     ///< how far it reaches down from the origin [m]
};

/// Makes a legend: coupler forces as a bar of colours from draft to buff with their arrows, and below it the states of
/// cars. With `causes`, where rails yield, it also shows what derailed the cars, and broken couplers. `ns` is the
/// markers' namespace, `height` that of the text [m]. Ids count from 0.
Legend make_legend(const std::string& ns, double height, bool causes);

}  // namespace train_derail::ros_face
