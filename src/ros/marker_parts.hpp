// What the markers of the scene are made of.
#pragma once

#include <string>
#include <vector>

#include <visualization_msgs/Marker.h>

#include "train_derail/scene/car_shape.hpp"
#include "train_derail/scene/palette.hpp"

namespace train_derail::ros_face {

inline geometry_msgs::Point message_point(double x, double y, double z) {
  geometry_msgs::Point p;
  p.x = x;
  p.y = y;
  p.z = z;
  return p;
}

inline std::vector<geometry_msgs::Point> to_message(const scene::Points& points) {
  std::vector<geometry_msgs::Point> all;
  all.reserve(points.size());
  for (const scene::Point& p : points) all.push_back(message_point(p.x, p.y, p.z));
  return all;
}

inline std_msgs::ColorRGBA colour(scene::Rgb rgb) {
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(rgb.r) / 255.0F;
  c.g = static_cast<float>(rgb.g) / 255.0F;
  c.b = static_cast<float>(rgb.b) / 255.0F;
  c.a = 1.0F;
  return c;
}

inline visualization_msgs::Marker make_marker(const std::string& frame, const std::string& ns, int id, int type,
                                              const std_msgs::ColorRGBA& c, double sx, double sy, double sz) {
  visualization_msgs::Marker m;
  m.header.frame_id = frame;
  m.ns = ns;
  m.id = id;
  m.type = type;
  m.action = visualization_msgs::Marker::ADD;
  m.pose.orientation.w = 1.0;
  m.color = c;
  m.scale.x = sx;
  m.scale.y = sy;
  m.scale.z = sz;
  return m;
}

inline visualization_msgs::Marker make_triangles(const std::string& frame, const std::string& ns, int id,
                                                 scene::Rgb c) {
  return make_marker(frame, ns, id, visualization_msgs::Marker::TRIANGLE_LIST, colour(c), 1.0, 1.0, 1.0);
}
inline visualization_msgs::Marker make_text(const std::string& frame, const std::string& ns, int id, double height) {
  return make_marker(frame, ns, id, visualization_msgs::Marker::TEXT_VIEW_FACING, colour({255, 255, 255}), 0.0, 0.0,
                     height);
}
inline visualization_msgs::Marker make_deletion(const std::string& frame, const std::string& ns, int id) {
  visualization_msgs::Marker m;
  m.header.frame_id = frame;
  m.ns = ns;
  m.id = id;
  m.action = visualization_msgs::Marker::DELETE;
  m.pose.orientation.w = 1.0;
  return m;
}

}  // namespace train_derail::ros_face
