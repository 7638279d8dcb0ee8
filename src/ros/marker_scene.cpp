#include "train_derail/ros/marker_scene.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace train_derail::ros_face {

namespace {

using visualization_msgs::Marker;

/// Places in the array.
enum Slot : std::size_t {
  kBallast,
  kRails,
  kTies,
  kPodLine,
  kPodName,
  kOnTrack,
  kOffTrack,
  kPastPod,
  kOutlines,
  kTrucks,
  kCouplers,
  kForceAxis,
  kForceBars,
  kForceName,
  kStatus,
  kStatusNear,
  kSlots
};

constexpr double kGauge = 1.435;
constexpr double kDeckHeight = 1.3;  // underside of the body above the rail head
constexpr double kRoofHeight = 4.0;
constexpr double kTruckLength = 2.8, kTruckWidth = 2.4;
constexpr double kBolsterLength = 0.5;  // stripe on the roof above a truck centre
constexpr double kCouplerHeight = 0.9;
constexpr double kDraftStripe =
    2.0;  // the coupler's colour is carried on over the roofs' ends, or it would be too small
constexpr double kForceFullColour = 2.0e6;  // N
constexpr double kForcePerMetre = 7.0e4;    // of a bar [N/m]
constexpr double kForceAxisY = 110.0;
constexpr double kStatusY = -90.0;
constexpr double kTieSpacing = 0.8, kTiesReach = 100.0;
/// Bodies may lie across each other (the model has no contact between them): small steps in height keep roofs apart.
constexpr int kLayers = 32;
constexpr double kLayerStep = 0.03;

std_msgs::ColorRGBA colour(double r, double g, double b) {
  std_msgs::ColorRGBA c;
  c.r = static_cast<float>(r);
  c.g = static_cast<float>(g);
  c.b = static_cast<float>(b);
  c.a = 1.0F;
  return c;
}

geometry_msgs::Point point(double x, double y, double z) {
  geometry_msgs::Point p;
  p.x = x;
  p.y = y;
  p.z = z;
  return p;
}

Marker make(const std::string& ns, int id, int type, const std_msgs::ColorRGBA& c, double sx, double sy, double sz) {
  Marker m;
  m.ns = ns;
  m.id = id;
  m.type = type;
  m.action = Marker::ADD;
  m.pose.orientation.w = 1.0;
  m.color = c;
  m.scale.x = sx;
  m.scale.y = sy;
  m.scale.z = sz;
  return m;
}

Marker triangles(const std::string& ns, int id, const std_msgs::ColorRGBA& c) {
  return make(ns, id, Marker::TRIANGLE_LIST, c, 1.0, 1.0, 1.0);
}
Marker lines(const std::string& ns, int id, const std_msgs::ColorRGBA& c, double width) {
  return make(ns, id, Marker::LINE_LIST, c, width, 0.0, 0.0);
}
Marker text(const std::string& ns, int id, double height) {
  return make(ns, id, Marker::TEXT_VIEW_FACING, colour(1.0, 1.0, 1.0), 0.0, 0.0, height);
}

/// A car's axes in the world, to place points given in its own.
struct Place {
  double x, y, c, s;
  explicit Place(const simulation::CarSnapshot& car)
      : x(car.x), y(car.y), c(std::cos(car.theta)), s(std::sin(car.theta)) {}
  geometry_msgs::Point at(double u, double v, double z) const { return point(x + c * u - s * v, y + s * u + c * v, z); }
};

using Points = std::vector<geometry_msgs::Point>;

void add_quad(Points& points, const geometry_msgs::Point& a, const geometry_msgs::Point& b,
              const geometry_msgs::Point& c, const geometry_msgs::Point& d) {
  points.insert(points.end(), {a, b, c, a, c, d});
}

/// Upright box without its underside, corners counter-clockwise from outside; without a lid if `lid` is false.
void add_box(Points& points, const Place& place, double centre, double length, double width, double low, double high,
             bool lid) {
  const double f = centre + 0.5 * length, r = centre - 0.5 * length, w = 0.5 * width;
  const double u[4] = {f, f, r, r}, v[4] = {-w, w, w, -w};
  for (int i = 0; i < 4; ++i) {
    const int j = (i + 1) % 4;
    add_quad(points, place.at(u[i], v[i], low), place.at(u[j], v[j], low), place.at(u[j], v[j], high),
             place.at(u[i], v[i], high));
  }
  if (lid) add_quad(points, place.at(f, -w, high), place.at(f, w, high), place.at(r, w, high), place.at(r, -w, high));
}

/// Light grey without force, red in buff, blue in draft.
std_msgs::ColorRGBA force_colour(double force) {
  const double share = std::sqrt(std::min(std::abs(force) / kForceFullColour, 1.0));
  const double fade = 0.85 * (1.0 - share);
  return force >= 0.0 ? colour(0.85 + 0.15 * share, fade, fade)
                      : colour(fade, fade + 0.25 * share, 0.85 + 0.15 * share);
}

std::string speed_text(double v) { return fmt::format("{:.1f} mph ({:.1f} m/s)", v / inputs::kMph, v); }

}  // namespace

MarkerScene::MarkerScene(const std::vector<model::Car>& cars, double coupler_length, const std::string& frame)
    : cars_(cars), train_length_(static_cast<double>(cars.size() - 1) * coupler_length) {
  for (const model::Car& car : cars_) train_length_ += car.length;

  array_.markers.resize(kSlots);
  auto& m = array_.markers;
  m[kBallast] = triangles("track", 0, colour(0.50, 0.46, 0.41));
  m[kRails] = lines("track", 1, colour(0.80, 0.80, 0.82), 0.15);
  m[kTies] = lines("track", 2, colour(0.26, 0.19, 0.13), 0.25);
  m[kPodLine] = make("point_of_derailment", 0, Marker::CUBE, colour(1.0, 0.9, 0.1), 0.6, 16.0, 0.1);
  m[kPodName] = text("point_of_derailment", 1, 3.0);
  m[kOnTrack] = triangles("cars_on_track", 0, colour(0.42, 0.56, 0.72));
  m[kOffTrack] = triangles("cars_off_track", 0, colour(0.98, 0.75, 0.22));
  m[kPastPod] = triangles("cars_past_pod", 0, colour(0.93, 0.42, 0.12));
  m[kOutlines] = lines("cars_outline", 0, colour(0.08, 0.08, 0.10), 0.2);
  m[kTrucks] = triangles("trucks", 0, colour(0.24, 0.24, 0.26));
  m[kCouplers] = lines("couplers", 0, colour(1.0, 1.0, 1.0), 0.7);
  m[kForceAxis] = lines("coupler_force_bars", 0, colour(0.6, 0.6, 0.6), 0.6);
  m[kForceBars] = lines("coupler_force_bars", 1, colour(1.0, 1.0, 1.0), 4.0);
  const double far_text = std::clamp(0.018 * train_length_, 3.0, 60.0);
  m[kForceName] = text("coupler_force_bars", 2, 0.7 * far_text);
  m[kStatus] = text("status", 0, far_text);
  m[kStatusNear] = text("status_near", 0, 2.6);
  for (Marker& marker : m) marker.header.frame_id = frame;
  add_track();
}

visualization_msgs::MarkerArray MarkerScene::markers_on_empty() const {
  visualization_msgs::MarkerArray all;
  all.markers.reserve(array_.markers.size() + 1);
  all.markers.push_back(make("", 0, Marker::CUBE, colour(1.0, 1.0, 1.0), 1.0, 1.0, 1.0));
  all.markers.front().header = array_.markers.front().header;
  all.markers.front().action = Marker::DELETEALL;
  all.markers.insert(all.markers.end(), array_.markers.begin(), array_.markers.end());
  return all;
}

void MarkerScene::add_track() {
  auto& m = array_.markers;
  const double front = std::max(120.0, 0.15 * train_length_), rear = -train_length_ - 30.0;
  constexpr double kHalfBed = 2.2;
  add_quad(m[kBallast].points, point(rear, -kHalfBed, 0.0), point(front, -kHalfBed, 0.0), point(front, kHalfBed, 0.0),
           point(rear, kHalfBed, 0.0));
  for (const double y : {-0.5 * kGauge, 0.5 * kGauge}) {
    m[kRails].points.push_back(point(rear, y, 0.2));
    m[kRails].points.push_back(point(front, y, 0.2));
  }
  const int reach = static_cast<int>(kTiesReach / kTieSpacing);
  for (int i = -reach; i <= reach; ++i) {
    const double x = i * kTieSpacing;
    if (x < rear || x > front) continue;
    m[kTies].points.push_back(point(x, -1.3, 0.1));
    m[kTies].points.push_back(point(x, 1.3, 0.1));
  }
  m[kForceName].text = "coupler force: up buff, down draft";
  m[kForceName].pose.position = point(-0.85 * train_length_, kForceAxisY - m[kForceName].scale.z, 0.0);
  m[kPodName].text = "point of derailment";
  m[kPodName].pose.position = point(0.0, -11.0, 0.5);
}

void MarkerScene::update(const simulation::Snapshot& now, const outcome::Outcome& outcome, double pile_up_x,
                         double pile_up_y, const ::ros::Time& stamp) {
  for (const Slot slot : {kOnTrack, kOffTrack, kPastPod, kOutlines, kTrucks, kCouplers, kForceAxis, kForceBars}) {
    array_.markers[slot].points.clear();
    array_.markers[slot].colors.clear();
  }
  draw_cars(now);
  draw_couplers(now);
  draw_text(now, outcome, pile_up_x, pile_up_y);
  for (Marker& marker : array_.markers) {
    marker.header.stamp = stamp;
    // RViz complains about lists without points.
    const bool list = marker.type == Marker::TRIANGLE_LIST || marker.type == Marker::LINE_LIST;
    marker.action = list && marker.points.empty() ? Marker::DELETE : Marker::ADD;
  }
}

void MarkerScene::draw_cars(const simulation::Snapshot& now) {
  auto& m = array_.markers;
  for (std::size_t i = 0; i < now.cars.size(); ++i) {
    const simulation::CarSnapshot& state = now.cars[i];
    const model::Car& car = cars_[i];
    const Place place(state);
    const double lift = kLayerStep * static_cast<double>(i % kLayers);
    const double roof = kRoofHeight + lift;
    const Slot body = state.past_pod ? kPastPod : state.off_track ? kOffTrack : kOnTrack;
    add_box(m[body].points, place, 0.0, car.length, car.width, kDeckHeight, roof, true);

    const double f = 0.5 * car.length, w = 0.5 * car.width, edge = roof + 0.01;
    const geometry_msgs::Point corner[4] = {place.at(f, -w, edge), place.at(f, w, edge), place.at(-f, w, edge),
                                            place.at(-f, -w, edge)};
    for (int k = 0; k < 4; ++k) m[kOutlines].points.insert(m[kOutlines].points.end(), {corner[k], corner[(k + 1) % 4]});

    Points& trucks = m[kTrucks].points;
    for (const double centre : {0.5 * car.truck_spacing, -0.5 * car.truck_spacing}) {
      add_box(trucks, place, centre, kTruckLength, std::min(kTruckWidth, car.width), 0.1, kDeckHeight, false);
      const double a = centre + 0.5 * kBolsterLength, b = centre - 0.5 * kBolsterLength;
      add_quad(trucks, place.at(a, -w, edge), place.at(a, w, edge), place.at(b, w, edge), place.at(b, -w, edge));
    }
  }
}

void MarkerScene::draw_couplers(const simulation::Snapshot& now) {
  auto& m = array_.markers;
  if (now.couplers.empty()) return;
  m[kForceAxis].points = {point(now.cars.front().x, kForceAxisY, 0.0), point(now.cars.back().x, kForceAxisY, 0.0)};
  for (std::size_t i = 0; i < now.couplers.size(); ++i) {
    const Place lead(now.cars[i]), trail(now.cars[i + 1]);
    const double rear = -0.5 * cars_[i].length, front = 0.5 * cars_[i + 1].length;
    const double roof = kRoofHeight + kLayerStep * kLayers;
    const double force = now.couplers[i].axial_force;
    const geometry_msgs::Point a = lead.at(rear, 0.0, kCouplerHeight), b = trail.at(front, 0.0, kCouplerHeight);
    const double x = 0.5 * (a.x + b.x);
    m[kCouplers].points.insert(m[kCouplers].points.end(),
                               {lead.at(rear + kDraftStripe, 0.0, roof), lead.at(rear, 0.0, roof), a, b,
                                trail.at(front, 0.0, roof), trail.at(front - kDraftStripe, 0.0, roof)});
    m[kCouplers].colors.insert(m[kCouplers].colors.end(), 6, force_colour(force));
    m[kForceBars].points.insert(m[kForceBars].points.end(),
                                {point(x, kForceAxisY, 0.0), point(x, kForceAxisY + force / kForcePerMetre, 0.0)});
    m[kForceBars].colors.insert(m[kForceBars].colors.end(), 2, force_colour(force));
  }
}

void MarkerScene::draw_text(const simulation::Snapshot& now, const outcome::Outcome& outcome, double pile_up_x,
                            double pile_up_y) {
  auto& m = array_.markers;
  const simulation::CarSnapshot& last = now.cars.back();
  const bool buff = outcome.coupler_buff_peak.force >= outcome.coupler_draft_peak.force;
  const outcome::PeakForce& peak = buff ? outcome.coupler_buff_peak : outcome.coupler_draft_peak;
  std::string text = fmt::format("t = {:.2f} s   last car {}\nderailed: {} past the point, {} off the track, of {}",
                                 now.time, speed_text(std::hypot(last.vx, last.vy)), outcome.cars_past_pod,
                                 outcome.cars_off_track, now.cars.size());
  if (peak.coupler > 0) {
    text += fmt::format("\npeak coupler force {:.0f} kip ({:.0f} kN) {}, coupler {}", peak.force / inputs::kKip,
                        peak.force / 1000.0, buff ? "buff" : "draft", peak.coupler);
  }
  if (outcome.touches > 0) {
    text += fmt::format("\nclosing {}, cars {} and {}", speed_text(outcome.closing_speed_max.speed),
                        outcome.closing_speed_max.car_a, outcome.closing_speed_max.car_b);
  }
  if (outcome.ended != outcome::Ended::running) text += fmt::format("\n{}", outcome::to_string(outcome.ended));
  m[kStatus].text = m[kStatusNear].text = text;
  m[kStatus].pose.position = point(-0.5 * train_length_, kStatusY, 0.0);
  m[kStatusNear].pose.position = point(pile_up_x, pile_up_y + 38.0, 5.0);
}

}  // namespace train_derail::ros_face
