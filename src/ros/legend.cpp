#include "train_derail/ros/legend.hpp"

#include <fmt/format.h>

#include "marker_parts.hpp"

namespace train_derail::ros_face {

namespace {

using visualization_msgs::Marker;

constexpr double kHalfBar = 10.0;  // in heights of the text, as all that follows
constexpr int kSegments = 20;      // of the bar

class Drawing {
 public:
  Drawing(const std::string& ns, double height)
      : ns_(ns), height_(height), markers_{make_triangles(ns, 0, colour(1.0, 1.0, 1.0))} {}

  void rectangle(double x0, double x1, double y0, double y1, const std_msgs::ColorRGBA& c) {
    add_quad(list().points, at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1));
    paint(list(), c);
  }
  void arrow(double tip, double tail, double y, const std_msgs::ColorRGBA& c) {
    const double half = 0.5;
    list().points.insert(list().points.end(), {at(tail, y - half), at(tip, y), at(tail, y + half)});
    paint(list(), c);
  }
  void text(double x, double y, const std::string& words, double size = 1.0) {
    Marker m = make_text(ns_, static_cast<int>(markers_.size()), size * height_);
    m.text = words;
    m.pose.position = at(x, y);
    markers_.push_back(m);
  }
  std::vector<Marker> take() { return std::move(markers_); }

 private:
  Marker& list() { return markers_.front(); }
  geometry_msgs::Point at(double x, double y) const { return make_point(x * height_, y * height_, 0.0); }

  const std::string ns_;
  const double height_;
  std::vector<Marker> markers_;
};

std::string force_text(double force) {
  return force == 0.0 ? "0" : fmt::format("{:.0f} kip\n{:.0f} kN", force / inputs::kKip, force / 1000.0);
}

}  // namespace

std::vector<Marker> make_legend(const std::string& ns, double height) {
  Drawing d(ns, height);
  d.rectangle(-kHalfBar - 2.5, kHalfBar + 2.5, -4.7, 5.5, colour(0.16, 0.18, 0.16));
  d.text(0.0, 4.5, "coupler force");
  const auto force_at = [](double x) { return x * std::abs(x) / (kHalfBar * kHalfBar) * kForceFull; };
  for (int i = 0; i < kSegments; ++i) {
    const double x0 = kHalfBar * (2.0 * i / kSegments - 1.0), x1 = kHalfBar * (2.0 * (i + 1) / kSegments - 1.0);
    d.rectangle(x0, x1, 1.0, 2.0, force_colour(force_at(0.5 * (x0 + x1))));
  }
  // As on the cars' ends: away from the coupler in draft, towards it in buff.
  for (const double side : {-1.0, 1.0}) {
    const double x = side * kHalfBar * 0.85, near = side < 0.0 ? 0.2 : 1.4, far = side < 0.0 ? 1.4 : 0.2;
    d.arrow(x + far, x + near, 3.0, force_colour(side * kForceFull));
    d.arrow(x - far, x - near, 3.0, force_colour(side * kForceFull));
    d.text(x - side * 3.6, 3.0, side < 0.0 ? "draft (pull)" : "buff (push)", 0.8);
  }
  for (const double share : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    d.text(share * kHalfBar, share == 0.0 ? 0.4 : 0.0, force_text(std::abs(force_at(share * kHalfBar))), 0.8);
  }
  struct State {
    double x;
    const char* name;
    std_msgs::ColorRGBA c;
  };
  for (const State& s :
       {State{-8.0, "on the track", on_track_colour()}, State{0.0, "off the track", off_track_colour()},
        State{8.0, "past the point", past_pod_colour()}}) {
    d.rectangle(s.x - 2.0, s.x + 2.0, -2.8, -2.0, s.c);
    d.text(s.x, -3.6, s.name, 0.8);
  }
  return d.take();
}

}  // namespace train_derail::ros_face
