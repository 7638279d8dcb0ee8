// What the colours of the scene mean.
#pragma once

#include <string>
#include <vector>

#include <visualization_msgs/Marker.h>

namespace train_derail::ros_face {

/// Forces of the couplers as a bar of colours from draft to buff with their arrows, below it the states of cars. Centred
/// at the origin, x to the right, y up as seen from above. `height` of the text [m]. Ids count from 0.
std::vector<visualization_msgs::Marker> make_legend(const std::string& ns, double height);

}  // namespace train_derail::ros_face
