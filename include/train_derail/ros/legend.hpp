// What the colours of the scene mean.
#pragma once

#include <string>
#include <vector>

#include <visualization_msgs/Marker.h>

namespace train_derail::ros_face {

struct Legend {
  std::vector<visualization_msgs::Marker> markers;  // about the origin, x to the right, y up as seen from above
  double below;                                     // reach from the origin downwards [m]
};

/// Forces of the couplers as a bar of colours from draft to buff with their arrows, below it the states of cars; where
/// rails yield (`causes`) what derailed them, and broken couplers. `height` of the text [m]. Ids count from 0.
Legend make_legend(const std::string& ns, double height, bool causes);

}  // namespace train_derail::ros_face
