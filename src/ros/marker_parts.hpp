// What the markers of the scene and of its legend are made of.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include <visualization_msgs/Marker.h>

#include "train_derail/ros/car_shape.hpp"

namespace train_derail::ros_face {

inline std_msgs::ColorRGBA colour(double r, double g, double b, double a = 1.0) {
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(r);
  c.g = static_cast<float>(g);
  c.b = static_cast<float>(b);
  c.a = static_cast<float>(a);
  return c;
}

// Dark, middle, light: what state a car is in can be told in grey.
inline std_msgs::ColorRGBA on_track_colour() { return colour(0.20, 0.38, 0.68); }
inline std_msgs::ColorRGBA past_pod_colour() { return colour(1.0, 0.50, 0.13); }
inline std_msgs::ColorRGBA off_track_colour() { return colour(1.0, 0.92, 0.55); }

// Of derailed cars where rails yield: what took them off, still apart in grey.
inline std_msgs::ColorRGBA by_pod_colour() { return past_pod_colour(); }
inline std_msgs::ColorRGBA by_torn_track_colour() { return colour(0.85, 0.68, 1.0); }
inline std_msgs::ColorRGBA by_lateral_colour() { return off_track_colour(); }

inline std_msgs::ColorRGBA broken_colour() { return colour(1.0, 0.2, 0.8); }

/// Full colour and full length of an arrow [N]; half of it at a quarter.
inline constexpr double kForceFull = 800.0 * inputs::kKip;

/// Share of the full colour, 0 to 1.
inline double force_share(double force) { return std::sqrt(std::min(std::abs(force) / kForceFull, 1.0)); }

/// Light grey without force, dark red in buff, bright blue in draft.
inline std_msgs::ColorRGBA force_colour(double force) {
  const double share = force_share(force), none = 0.85 * (1.0 - share);
  return force >= 0.0 ? colour(none + 0.85 * share, none, none)
                      : colour(none + 0.15 * share, none + 0.65 * share, none + 1.0 * share);
}

inline visualization_msgs::Marker make_marker(const std::string& ns, int id, int type, const std_msgs::ColorRGBA& c,
                                              double sx, double sy, double sz) {
  visualization_msgs::Marker m;
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

inline visualization_msgs::Marker make_triangles(const std::string& ns, int id, const std_msgs::ColorRGBA& c) {
  return make_marker(ns, id, visualization_msgs::Marker::TRIANGLE_LIST, c, 1.0, 1.0, 1.0);
}
inline visualization_msgs::Marker make_lines(const std::string& ns, int id, const std_msgs::ColorRGBA& c,
                                             double width) {
  return make_marker(ns, id, visualization_msgs::Marker::LINE_LIST, c, width, 0.0, 0.0);
}
inline visualization_msgs::Marker make_text(const std::string& ns, int id, double height) {
  return make_marker(ns, id, visualization_msgs::Marker::TEXT_VIEW_FACING, colour(1.0, 1.0, 1.0), 0.0, 0.0, height);
}

/// Gives the points that were added to a list of points one colour.
inline void paint(visualization_msgs::Marker& list, const std_msgs::ColorRGBA& c) {
  list.colors.resize(list.points.size(), c);
}

}  // namespace train_derail::ros_face
