// What a car looks like: a few dozen triangles and lines in the car's own axes, x forward, y left, z above the rail
// head, origin between the truck centres.
#pragma once

#include <string>
#include <vector>

#include <geometry_msgs/Point.h>

#include "train_derail/model/train.hpp"

namespace train_derail::ros_face {

using Points = std::vector<geometry_msgs::Point>;

struct CarShape {
  Points body;   // triangles in the colour of the car's state, counter-clockwise from outside
  Points dark;   // triangles: trucks, underframe, doors, openings
  Points edges;  // ends of lines; the first eight are the four sides of the footprint
};

/// Top of every body [m].
inline constexpr double kRoofHeight = 4.2;

/// By the name of the car's block: tank_car, hopper, boxcar, locomotive; a plain box for any other.
CarShape car_shape(const model::Car& car);

/// Corners a, b, c, d counter-clockwise as seen from outside.
void add_quad(Points& points, const geometry_msgs::Point& a, const geometry_msgs::Point& b,
              const geometry_msgs::Point& c, const geometry_msgs::Point& d);

geometry_msgs::Point make_point(double x, double y, double z);

}  // namespace train_derail::ros_face
