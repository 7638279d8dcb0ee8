#include "train_derail/ros/legend.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "marker_parts.hpp"

namespace train_derail::ros_face {

namespace {

using visualization_msgs::Marker;

constexpr double kHalfBar = 10.0;  // in heights of the text, as all that follows
constexpr int kSegments = 20;      // of the bar
// Above the board, so that a camera that looks aslant sees all of it.
constexpr double kSwatchZ = 0.1, kTextZ = 1.2;

class Drawing {
 public:
  Drawing(const std::string& ns, double height)
      : ns_(ns), height_(height), markers_{make_triangles(ns, 0, colour(1.0, 1.0, 1.0))} {}

  void rectangle(double x0, double x1, double y0, double y1, double z, const std_msgs::ColorRGBA& c) {
    add_quad(list().points, at(x0, y0, z), at(x1, y0, z), at(x1, y1, z), at(x0, y1, z));
    paint(list(), c);
  }
  void arrow(double tip, double tail, double y, const std_msgs::ColorRGBA& c) {
    const double half = 0.5;
    list().points.insert(list().points.end(),
                         {at(tail, y - half, kSwatchZ), at(tip, y, kSwatchZ), at(tail, y + half, kSwatchZ)});
    paint(list(), c);
  }
  void text(double x, double y, const std::string& words) {
    Marker m = make_text(ns_, static_cast<int>(markers_.size()), height_);
    m.text = words;
    m.pose.position = at(x, y, kTextZ);
    markers_.push_back(m);
  }
  std::vector<Marker> take() { return std::move(markers_); }

 private:
  Marker& list() { return markers_.front(); }
  geometry_msgs::Point at(double x, double y, double z) const {
    return make_point(x * height_, y * height_, z * height_);
  }

  const std::string ns_;
  const double height_;
  std::vector<Marker> markers_;
};

std::string force_text(double force) {
  return force == 0.0 ? "0" : fmt::format("{:.0f} kip\n{:.0f} kN", force / inputs::kKip, force / 1000.0);
}

/// Colour of a car's body, and why.
struct State {
  double x;
  const char* name;
  std_msgs::ColorRGBA c;
};

void draw_states(Drawing& d) {
  for (const State& s :
       {State{-8.0, "on the track", on_track_colour()}, State{0.0, "off the track", off_track_colour()},
        State{8.0, "past the point", past_pod_colour()}}) {
    d.rectangle(s.x - 2.0, s.x + 2.0, -3.1, -2.2, kSwatchZ, s.c);
    d.text(s.x, -4.1, s.name);
  }
}

void draw_causes(Drawing& d) {
  d.text(3.25, -2.8, "derailed");
  for (const State& s :
       {State{-9.75, "on the\ntrack", on_track_colour()}, State{-3.25, "at the\npoint", by_pod_colour()},
        State{3.25, "by lateral\nforce", by_lateral_colour()}, State{9.75, "on torn\ntrack", by_torn_track_colour()}}) {
    d.rectangle(s.x - 2.0, s.x + 2.0, -4.8, -3.9, kSwatchZ, s.c);
    d.text(s.x, -6.3, s.name);
  }
  // As at the cars' ends.
  for (const double side : {-1.0, 1.0}) {
    const double tip = side - 6.0, tail = tip + side * 1.2;
    d.rectangle(std::min(tip, tail), std::max(tip, tail), -8.6, -8.4, kSwatchZ, broken_colour());
    d.rectangle(tip - 0.1, tip + 0.1, -9.1, -7.9, kSwatchZ, broken_colour());
  }
  d.text(1.5, -8.5, "broken coupler");
}

}  // namespace

Legend make_legend(const std::string& ns, double height, bool causes) {
  Drawing d(ns, height);
  const double bottom = causes ? -9.6 : -5.2;
  d.rectangle(-kHalfBar - 3.0, kHalfBar + 3.0, bottom, 6.2, 0.0, colour(0.16, 0.18, 0.16));
  d.text(0.0, 5.0, "coupler force");
  const auto force_at = [](double x) { return x * std::abs(x) / (kHalfBar * kHalfBar) * kForceFull; };
  for (int i = 0; i < kSegments; ++i) {
    const double x0 = kHalfBar * (2.0 * i / kSegments - 1.0), x1 = kHalfBar * (2.0 * (i + 1) / kSegments - 1.0);
    d.rectangle(x0, x1, 1.0, 2.0, kSwatchZ, force_colour(force_at(0.5 * (x0 + x1))));
  }
  // As on the cars' ends: away from the coupler in draft, towards it in buff.
  for (const double side : {-1.0, 1.0}) {
    const double x = side * kHalfBar * 0.85, near = side < 0.0 ? 0.2 : 1.4, far = side < 0.0 ? 1.4 : 0.2;
    d.arrow(x + far, x + near, 3.0, force_colour(side * kForceFull));
    d.arrow(x - far, x - near, 3.0, force_colour(side * kForceFull));
    d.text(x - side * 4.6, 3.0, side < 0.0 ? "draft (pull)" : "buff (push)");
  }
  for (const double share : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    d.text(share * kHalfBar, share == 0.0 ? 0.3 : -0.2, force_text(std::abs(force_at(share * kHalfBar))));
  }
  if (causes) {
    draw_causes(d);
  } else {
    draw_states(d);
  }
  return {d.take(), -bottom * height};
}

}  // namespace train_derail::ros_face
