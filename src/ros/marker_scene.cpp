#include "train_derail/ros/marker_scene.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <fmt/format.h>

#include "marker_parts.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/ros/legend.hpp"

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
  kByPod,
  kByLateral,
  kByTornTrack,
  kDark,
  kEdges,
  kCouplers,
  kArrows,
  kBroken,
  kForceAxis,
  kForceBars,
  kForceName,
  kStatus,
  kStatusNear,
  kStars,
  kSpeeds,
  kSpeedsEnd = kSpeeds + 12,
  kLegends = kSpeedsEnd
};

constexpr double kGauge = 1.435;
constexpr double kCouplerHeight = 0.9;
constexpr double kArrowLength = 2.6, kArrowWidth = 2.4;  // on the roofs' ends, at full force
constexpr double kArrowForceMin = 1.0e3;                 // N
constexpr double kForceAxisAside = 110.0;                // of the track [m]
constexpr double kBar = 22.0;                            // at full force [m]
constexpr double kBarMax = 3.0;                          // longest over that
constexpr double kBrokenStub = 0.9, kBrokenWidth = 3.0;  // a T at either end of the gap
constexpr double kTieSpacing = 0.8, kTiesReach = 100.0;
constexpr double kTrackPiece = 10.0;  // longest straight piece of a drawn curve
constexpr double kRollOn = 25.0;      // s: at their initial speed, cars ahead of the point stay on the drawn track
// Of rviz/train_derail.rviz' view of the whole train: x in its middle, text with which legend and status fit in.
constexpr double kViewMiddle = -550.0, kFarTextMax = 21.0;
constexpr double kNearText = 3.0;
/// Bodies may lie across each other (the model has no contact between them): small steps in height keep roofs apart.
constexpr int kLayers = 32;
constexpr double kLayerStep = 0.03;
constexpr double kAboveRoofs = kRoofHeight + kLayerStep * kLayers;

constexpr double kFlashTime = 1.0;                                     // simulated [s]
constexpr double kSpeedTextMin = 1.0;                                  // slower touches have no text [m/s]
constexpr double kSpeedTextAside = 14.0;                               // m
constexpr int kSpeedRows = 6;                                          // on both sides together
constexpr double kStarMin = 1.5, kStarPerSpeed = 0.5, kStarMax = 8.0;  // radius [m], [m per m/s], [m]

/// A car's axes in the world, to place points given in its own.
struct Place {
  double x, y, c, s;
  explicit Place(const simulation::CarSnapshot& car)
      : x(car.x), y(car.y), c(std::cos(car.theta)), s(std::sin(car.theta)) {}
  geometry_msgs::Point at(double u, double v, double z) const {
    return make_point(x + c * u - s * v, y + s * u + c * v, z);
  }
  void add(Points& points, const Points& own, double lift) const {
    for (const geometry_msgs::Point& p : own) points.push_back(at(p.x, p.y, p.z + lift));
  }
};

/// Arc lengths from rear to front between which the track may be drawn straight.
std::vector<double> stations(const std::vector<inputs::Curve>& curves, double rear, double front) {
  std::vector<double> all{rear};
  for (const inputs::Curve& curve : curves) {
    const int pieces = std::max(1, static_cast<int>(std::ceil(curve.length / kTrackPiece)));
    for (int i = 0; i <= pieces; ++i) {
      const double s = curve.start + curve.length * i / pieces;
      if (s > all.back() && s < front) all.push_back(s);
    }
  }
  all.push_back(front);
  return all;
}

/// Point of the track, `left` of its centre line.
geometry_msgs::Point beside(const model::Track::Node& node, double left, double z) {
  return make_point(node.point.x() - left * node.tangent.y(), node.point.y() + left * node.tangent.x(), z);
}

/// Upwards in buff; short enough for the strongest not to reach the train.
double bar_length(double force) {
  return std::copysign(kBar * std::min(std::sqrt(std::abs(force) / kForceFull), kBarMax), force);
}

std::string speed_text(double v) { return fmt::format("{:.1f} mph ({:.1f} m/s)", v / inputs::kMph, v); }

}  // namespace

MarkerScene::MarkerScene(const inputs::Scenario& scenario, const std::vector<model::Car>& cars,
                         const std::string& frame, double interval)
    : cars_(cars),
      rails_yield_(scenario.ground.on_track_law == inputs::OnTrackLaw::rails),
      train_length_(static_cast<double>(cars.size() - 1) * scenario.coupler.length),
      flash_time_(std::max(kFlashTime, interval)) {
  for (const model::Car& car : cars_) {
    train_length_ += car.length;
    shapes_.push_back(car_shape(car));
  }
  far_text_ = std::clamp(0.018 * train_length_, 3.0, kFarTextMax);

  array_.markers.resize(kLegends);
  auto& m = array_.markers;
  m[kBallast] = make_triangles("track", 0, colour(0.50, 0.46, 0.41));
  m[kRails] = make_lines("track", 1, colour(0.80, 0.80, 0.82), 0.15);
  m[kTies] = make_lines("track", 2, colour(0.26, 0.19, 0.13), 0.25);
  m[kPodLine] = make_marker("point_of_derailment", 0, Marker::CUBE, colour(1.0, 0.9, 0.1), 0.6, 16.0, 0.1);
  m[kPodName] = make_text("point_of_derailment", 1, 3.0);
  m[kOnTrack] = make_triangles("cars_on_track", 0, on_track_colour());
  m[kOffTrack] = make_triangles("cars_off_track", 0, off_track_colour());
  m[kPastPod] = make_triangles("cars_past_pod", 0, past_pod_colour());
  m[kByPod] = make_triangles("cars_derailed_pod", 0, by_pod_colour());
  m[kByLateral] = make_triangles("cars_derailed_lateral", 0, by_lateral_colour());
  m[kByTornTrack] = make_triangles("cars_derailed_torn_track", 0, by_torn_track_colour());
  m[kDark] = make_triangles("cars_dark", 0, colour(0.20, 0.20, 0.22));
  m[kEdges] = make_lines("cars_outline", 0, colour(0.08, 0.08, 0.10), 0.15);
  m[kCouplers] = make_lines("couplers", 0, colour(1.0, 1.0, 1.0), 0.7);
  m[kArrows] = make_triangles("coupler_arrows", 0, colour(1.0, 1.0, 1.0));
  m[kBroken] = make_lines("couplers_broken", 0, broken_colour(), 0.6);
  m[kForceAxis] = make_lines("coupler_force_bars", 0, colour(0.6, 0.6, 0.6), 0.6);
  m[kForceBars] = make_lines("coupler_force_bars", 1, colour(1.0, 1.0, 1.0), 4.0);
  m[kForceName] = make_text("coupler_force_bars", 2, 0.7 * far_text_);
  m[kStatus] = make_text("status", 0, far_text_);
  m[kStatusNear] = make_text("status_near", 0, kNearText);
  m[kStars] = make_triangles("touches", 0, colour(1.0, 1.0, 1.0));
  for (std::size_t i = kSpeeds; i < kSpeedsEnd; ++i) {
    m[i] = make_text("touches", static_cast<int>(i - kSpeeds) + 1, kNearText);
  }
  add_track(scenario);
  add_legends();
  for (Marker& marker : m) marker.header.frame_id = frame;
}

visualization_msgs::MarkerArray MarkerScene::markers_on_empty() const {
  visualization_msgs::MarkerArray all;
  all.markers.reserve(array_.markers.size() + 1);
  all.markers.push_back(make_marker("", 0, Marker::CUBE, colour(1.0, 1.0, 1.0), 1.0, 1.0, 1.0));
  all.markers.front().header = array_.markers.front().header;
  all.markers.front().action = Marker::DELETEALL;
  all.markers.insert(all.markers.end(), array_.markers.begin(), array_.markers.end());
  return all;
}

void MarkerScene::add_track(const inputs::Scenario& scenario) {
  auto& m = array_.markers;
  double front = std::max(120.0, 0.15 * train_length_);
  const double rear = -train_length_ - 30.0;
  if (scenario.initial.cars_ahead > 0) {
    front += kRollOn * scenario.initial.speed;
    for (int i = 0; i < scenario.initial.cars_ahead; ++i) front += cars_[static_cast<std::size_t>(i)].length;
  }
  const model::Track track(scenario, rear, front);
  constexpr double kHalfBed = 2.2;
  const std::vector<double> s = stations(scenario.track.curves, rear, front);
  double lowest = 0.0, highest = 0.0;
  for (std::size_t i = 0; i + 1 < s.size(); ++i) {
    const model::Track::Node from = track.at(s[i]), to = track.at(s[i + 1]);
    add_quad(m[kBallast].points, beside(from, -kHalfBed, 0.0), beside(to, -kHalfBed, 0.0), beside(to, kHalfBed, 0.0),
             beside(from, kHalfBed, 0.0));
    for (const double left : {-0.5 * kGauge, 0.5 * kGauge}) {
      m[kRails].points.push_back(beside(from, left, 0.2));
      m[kRails].points.push_back(beside(to, left, 0.2));
    }
    lowest = std::min({lowest, from.point.y(), to.point.y()});
    highest = std::max({highest, from.point.y(), to.point.y()});
  }
  force_axis_y_ = highest + kForceAxisAside;
  status_y_ = lowest - 90.0;
  // Of a long train the middle is not in view.
  middle_x_ = std::max(-0.5 * train_length_, kViewMiddle);
  const int reach = static_cast<int>(kTiesReach / kTieSpacing);
  for (int i = -reach; i <= reach; ++i) {
    const double at = i * kTieSpacing;
    if (at < rear || at > front) continue;
    m[kTies].points.push_back(beside(track.at(at), -1.3, 0.1));
    m[kTies].points.push_back(beside(track.at(at), 1.3, 0.1));
  }
  m[kForceName].text = "coupler force (root): up buff, down draft";
  m[kForceName].pose.position =
      make_point(std::max(-0.85 * train_length_, kViewMiddle - 300.0), force_axis_y_ - m[kForceName].scale.z, 0.0);
  m[kPodName].text = "point of derailment";
  m[kPodName].pose.position = make_point(0.0, -11.0, 0.5);
}

void MarkerScene::add_legends() {
  auto& m = array_.markers;
  const double height = 0.7 * far_text_;
  Legend far = make_legend("legend", height, rails_yield_);
  for (Marker& marker : far.markers) {
    marker.pose.position.x += middle_x_;
    marker.pose.position.y += force_axis_y_ + (kBarMax + 0.25) * kBar + 0.3 * height + far.below;
    m.push_back(marker);
  }
  for (const Marker& marker : make_legend("legend_near", 0.75 * kNearText, rails_yield_).markers) {
    near_legend_.push_back(marker.pose.position);
    m.push_back(marker);
  }
}

void MarkerScene::update(const simulation::Snapshot& now, const outcome::Outcome& outcome,
                         const std::vector<outcome::FirstTouch>& touches, double pile_up_x, double pile_up_y,
                         const ::ros::Time& stamp) {
  for (const Slot slot : {kOnTrack, kOffTrack, kPastPod, kByPod, kByLateral, kByTornTrack, kDark, kEdges, kCouplers,
                          kArrows, kBroken, kForceAxis, kForceBars, kStars}) {
    array_.markers[slot].points.clear();
    array_.markers[slot].colors.clear();
  }
  draw_cars(now);
  draw_couplers(now);
  draw_text(now, outcome, pile_up_x, pile_up_y);
  draw_flashes(now.time, touches);
  for (Marker& marker : array_.markers) {
    marker.header.stamp = stamp;
    // RViz complains about lists without points and texts without words.
    const bool list = marker.type == Marker::TRIANGLE_LIST || marker.type == Marker::LINE_LIST;
    const bool empty = list ? marker.points.empty() : marker.type == Marker::TEXT_VIEW_FACING && marker.text.empty();
    marker.action = empty ? Marker::DELETE : Marker::ADD;
  }
}

std::size_t MarkerScene::body_slot(const simulation::CarSnapshot& car) const {
  if (!rails_yield_) return car.past_pod ? kPastPod : car.off_track ? kOffTrack : kOnTrack;
  switch (car.cause) {
    case model::Cause::none: return kOnTrack;
    case model::Cause::pod: return kByPod;
    case model::Cause::lateral: return kByLateral;
    case model::Cause::torn_track: return kByTornTrack;
  }
  return kOnTrack;
}

void MarkerScene::draw_cars(const simulation::Snapshot& now) {
  auto& m = array_.markers;
  for (std::size_t i = 0; i < now.cars.size(); ++i) {
    const simulation::CarSnapshot& state = now.cars[i];
    const Place place(state);
    const double lift = kLayerStep * static_cast<double>(i % kLayers);
    place.add(m[body_slot(state)].points, shapes_[i].body, lift);
    place.add(m[kDark].points, shapes_[i].dark, lift);
    place.add(m[kEdges].points, shapes_[i].edges, lift);
  }
}

void MarkerScene::draw_couplers(const simulation::Snapshot& now) {
  auto& m = array_.markers;
  if (now.couplers.empty()) return;
  m[kForceAxis].points = {make_point(now.cars.front().x, force_axis_y_, 0.0),
                          make_point(now.cars.back().x, force_axis_y_, 0.0)};
  for (std::size_t i = 0; i < now.couplers.size(); ++i) {
    const Place lead(now.cars[i]), trail(now.cars[i + 1]);
    const double rear = -0.5 * cars_[i].length, front = 0.5 * cars_[i + 1].length;
    if (now.couplers[i].broken) {
      for (const auto& [car, pin, out] : {std::tuple(lead, rear, -1.0), std::tuple(trail, front, 1.0)}) {
        const double end = pin + out * kBrokenStub, half = 0.5 * kBrokenWidth;
        m[kBroken].points.insert(m[kBroken].points.end(),
                                 {car.at(pin, 0.0, kAboveRoofs), car.at(end, 0.0, kAboveRoofs),
                                  car.at(end, -half, kAboveRoofs), car.at(end, half, kAboveRoofs)});
      }
      continue;
    }
    const double force = now.couplers[i].axial_force;
    const std_msgs::ColorRGBA c = force_colour(force);
    const geometry_msgs::Point a = lead.at(rear, 0.0, kCouplerHeight), b = trail.at(front, 0.0, kCouplerHeight);
    const double x = 0.5 * (a.x + b.x);
    m[kCouplers].points.insert(m[kCouplers].points.end(), {a, b});
    paint(m[kCouplers], c);
    m[kForceBars].points.insert(m[kForceBars].points.end(), {make_point(x, force_axis_y_, 0.0),
                                                             make_point(x, force_axis_y_ + bar_length(force), 0.0)});
    paint(m[kForceBars], c);
    if (std::abs(force) < kArrowForceMin) continue;
    // On both roofs, with the tip at the coupler in buff, the base in draft.
    const double size = 0.5 + 0.5 * force_share(force), length = size * kArrowLength, w = 0.5 * size * kArrowWidth;
    const double tip = force > 0.0 ? 0.0 : length, base = length - tip;
    m[kArrows].points.insert(m[kArrows].points.end(),
                             {lead.at(rear + tip, 0.0, kAboveRoofs), lead.at(rear + base, w, kAboveRoofs),
                              lead.at(rear + base, -w, kAboveRoofs), trail.at(front - tip, 0.0, kAboveRoofs),
                              trail.at(front - base, -w, kAboveRoofs), trail.at(front - base, w, kAboveRoofs)});
    paint(m[kArrows], c);
  }
}

std::string MarkerScene::status_text(const simulation::Snapshot& now, const outcome::Outcome& outcome) const {
  const simulation::CarSnapshot& last = now.cars.back();
  const bool buff = outcome.coupler_buff_peak.force >= outcome.coupler_draft_peak.force;
  const outcome::PeakForce& peak = buff ? outcome.coupler_buff_peak : outcome.coupler_draft_peak;
  std::string text = fmt::format("t = {:.2f} s   last car {}\n", now.time, speed_text(std::hypot(last.vx, last.vy)));
  if (rails_yield_) {
    const outcome::DerailedBy& by = outcome.derailed_by;
    text += fmt::format("derailed: {} (point {}, lateral {}, torn {}) of {}", outcome.cars_derailed, by.pod, by.lateral,
                        by.torn_track, now.cars.size());
  } else {
    text += fmt::format("derailed: {} past the point, {} off the track, of {}", outcome.cars_past_pod,
                        outcome.cars_off_track, now.cars.size());
  }
  if (outcome.couplers_broken > 0 || outcome.impacts.count > 0) {
    text += fmt::format("\ncouplers broken {}, impacts {}", outcome.couplers_broken, outcome.impacts.count);
  }
  if (peak.coupler > 0) {
    text += fmt::format("\npeak coupler force {:.0f} kip ({:.0f} kN) {}, coupler {}", peak.force / inputs::kKip,
                        peak.force / 1000.0, buff ? "buff" : "draft", peak.coupler);
  }
  if (outcome.touches > 0) {
    text += fmt::format("\nclosing {}, cars {} and {}", speed_text(outcome.closing_speed_max.speed),
                        outcome.closing_speed_max.car_a, outcome.closing_speed_max.car_b);
  }
  if (outcome.ended != outcome::Ended::running) text += fmt::format("\n{}", outcome::to_string(outcome.ended));
  return text;
}

void MarkerScene::draw_text(const simulation::Snapshot& now, const outcome::Outcome& outcome, double pile_up_x,
                            double pile_up_y) {
  auto& m = array_.markers;
  m[kStatus].text = m[kStatusNear].text = status_text(now, outcome);
  m[kStatus].pose.position = make_point(middle_x_, status_y_, 0.0);
  m[kStatusNear].pose.position = make_point(pile_up_x, pile_up_y + 42.0, 5.0);
  for (std::size_t i = 0; i < near_legend_.size(); ++i) {
    const geometry_msgs::Point& own = near_legend_[i];
    m[m.size() - near_legend_.size() + i].pose.position =
        make_point(pile_up_x + own.x, pile_up_y - 38.0 + own.y, own.z);
  }
}

void MarkerScene::draw_flashes(double time, const std::vector<outcome::FirstTouch>& touches) {
  auto& m = array_.markers;
  std::vector<const outcome::FirstTouch*> told;
  for (auto touch = touches.rbegin(); touch != touches.rend() && time - touch->time < flash_time_; ++touch) {
    const double age = (time - touch->time) / flash_time_;
    const double radius = std::clamp(kStarPerSpeed * touch->speed, kStarMin, kStarMax) * (1.0 - 0.7 * age);
    const std_msgs::ColorRGBA rim = colour(1.0, 0.9 - 0.5 * age, 0.2);
    constexpr int kRays = 8;
    for (int i = 0; i < 2 * kRays; ++i) {
      const auto corner = [&](int k) {
        const double r = radius * (k % 2 == 0 ? 1.0 : 0.4), angle = k * 3.14159265358979323846 / kRays;
        return make_point(touch->x + r * std::cos(angle), touch->y + r * std::sin(angle), kAboveRoofs + 0.5);
      };
      m[kStars].points.insert(m[kStars].points.end(),
                              {make_point(touch->x, touch->y, kAboveRoofs + 0.5), corner(i), corner(i + 1)});
      m[kStars].colors.insert(m[kStars].colors.end(), {colour(1.0, 1.0, 1.0), rim, rim});
    }
    if (touch->speed >= kSpeedTextMin) told.push_back(&*touch);
  }
  constexpr std::size_t kTold = kSpeedsEnd - kSpeeds;
  if (told.size() > kTold) {
    std::stable_sort(told.begin(), told.end(), [](const auto* a, const auto* b) { return a->speed > b->speed; });
    told.resize(kTold);
  }
  std::stable_sort(told.begin(), told.end(), [](const auto* a, const auto* b) { return a->time < b->time; });
  for (std::size_t i = 0; i < kTold; ++i) {
    Marker& text = m[kSpeeds + i];
    text.text.clear();
    if (i >= told.size()) continue;
    text.text = speed_text(told[i]->speed);
    text.color.a = static_cast<float>(1.0 - 0.6 * (time - told[i]->time) / flash_time_);
    // Beside the cars with a pointer to the place, farther out where an older one is in the way.
    double offset = 0.0;
    for (int row = 0; row < kSpeedRows; ++row) {
      const double side = (told[i]->car_a + row) % 2 == 0 ? 1.0 : -1.0;
      offset = side * (kSpeedTextAside + row / 2 * 1.7 * kNearText);
      const auto in_the_way = [&](const Marker& other) {
        return std::abs(other.pose.position.x - told[i]->x) < 9.0 * kNearText &&
               std::abs(other.pose.position.y - told[i]->y - offset) < 1.2 * kNearText;
      };
      const auto first = m.begin() + kSpeeds;
      if (std::none_of(first, first + static_cast<std::ptrdiff_t>(i), in_the_way)) break;
    }
    const double z = kAboveRoofs + 0.4, end = told[i]->y + offset - std::copysign(0.7 * kNearText, offset);
    text.pose.position = make_point(told[i]->x, told[i]->y + offset, z);
    m[kStars].points.insert(m[kStars].points.end(),
                            {make_point(told[i]->x, told[i]->y, z), make_point(told[i]->x + 0.3, end, z),
                             make_point(told[i]->x - 0.3, end, z)});
    paint(m[kStars], colour(1.0, 0.95, 0.7));
  }
}

}  // namespace train_derail::ros_face
