#include "train_derail/scene/track_picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "train_derail/model/spatial_bed.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/model/track_profile.hpp"
#include "train_derail/scene/painted_text.hpp"

namespace train_derail::scene {

namespace {

// All lengths in m.
constexpr double kGauge = 1.435, kRailWidth = 0.15, kRailHeight = 0.25;  // rails are drawn twice as wide as they are
constexpr double kTieSpacing = 0.5, kTieLength = 2.6, kTieWidth = 0.23, kTieHeight = 0.12;
constexpr double kTiesAhead = 200.0, kTiesBehind = 400.0;
constexpr double kBallastTop = 1.8, kBallastFoot = 3.2, kBallastHeight = 0.06;
constexpr double kTrackPiece = 10.0;  // longest straight piece of a drawn curve
constexpr double kRollOn = 25.0;      // s: at their initial speed, cars ahead of the point stay on the drawn track
constexpr double kGroundBeyond = 3000.0;
constexpr double kGroundBesideCurve = 150.0;  // sharper curves would fold it
constexpr double kRulerReach = 45.0, kRulerWidth = 0.25, kRulerHeight = 0.03, kRulerText = 5.0;
constexpr double kRulerAhead = 400.0;
constexpr double kFoot = 0.3048;
constexpr double kNorthBeside = 66.0, kNorthLength = 14.0;  // beyond the numbers of the ruler
constexpr double kPodWidth = 0.6, kPodHeight = kRailHeight + 0.05;

/// Arc lengths from rear to front between which the track may be drawn straight. Hills are drawn in short pieces.
std::vector<double> stations(const std::vector<inputs::Curve>& curves, bool hilly, double rear, double front) {
  std::vector<double> all{rear};
  if (hilly) {
    const double pieces = std::ceil((front - rear) / kTrackPiece);
    for (double i = 1.0; i < pieces; ++i) all.push_back(rear + (front - rear) * i / pieces);
    all.push_back(front);
    return all;
  }
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

/// Point of the track, `along` and `left` of it.
Point beside(const model::Track::Node& node, double along, double left, double z) {
  return make_point(node.point.x() + along * node.tangent.x() - left * node.tangent.y(),
                    node.point.y() + along * node.tangent.y() + left * node.tangent.x(), z);
}

/// The ground across the track. Heights here are above the ballast, or the crown where no ballast stands out, at the
/// point of derailment.
struct Ground {
  explicit Ground(const inputs::Scenario& scenario) : terrain(scenario.terrain), bed(scenario) {
    const inputs::Terrain& t = terrain;
    if (t.ballast_height > 0.0) {
      ballast_top = t.ballast_half_width;
      ballast_foot = ballast_top + t.ballast_height / t.ballast_slope;
    }
    add_bends(model::CrossSection(t));
    for (const inputs::TerrainSection& section : t.sections) add_bends(model::CrossSection(t, section));
    if (!t.grid.rows.empty()) {
      for (const double side : {-1.0, 1.0}) {
        for (const double beyond : {0.0, t.grid.seam}) bends.push_back(side * (t.crown + beyond));
        for (double left = t.grid.spacing; left < kGroundBesideCurve; left += t.grid.spacing)
          bends.push_back(side * left);
      }
    }
    std::sort(bends.begin(), bends.end());
    bends.erase(std::unique(bends.begin(), bends.end()), bends.end());
  }
  void add_bends(const model::CrossSection& c) {
    for (const double side : {-1.0, 1.0}) {
      const double bank = std::abs(side < 0.0 ? c.bank_right : c.bank_left), top = c.ballast_half_width;
      if (bank > 0.0) bends.insert(bends.end(), {side * c.crown, side * (c.crown + bank / c.bank_slope)});
      if (c.ballast_height > 0.0)
        bends.insert(bends.end(), {side * top, side * (top + c.ballast_height / c.ballast_slope)});
    }
  }
  double height(double s, double left) const { return bed.beside(s, left).z + terrain.rail_height; }
  /// Of the plane that both rails lie on; no lower than the bed, which the ballast is not to sink into.
  double bank(double s, double left) const {
    const model::TrackProfile::Place place = bed.profile.at(s);
    return std::max(place.bed, place.height + place.tilt * left);
  }
  /// Offsets from `right` to `left` between which the ground is straight.
  std::vector<double> between(double right, double left) const {
    std::vector<double> all{right};
    for (const double bend : bends) {
      if (bend > right && bend < left) all.push_back(bend);
    }
    all.push_back(left);
    return all;
  }
  bool level() const { return bends.empty() && even(); }
  /// The same all along.
  bool even() const { return bed.profile.flat() && terrain.sections.empty() && terrain.grid.rows.empty(); }

  const inputs::Terrain& terrain;
  model::SpatialBed bed;
  double ballast_top = kBallastTop, ballast_foot = kBallastFoot;  // offsets where its sides begin and end
  std::vector<double> bends;                                      // offsets, left positive, rising
};

/// A strip across the track at `s` from `right` to `left`, `z` above the ground, or above the plane of the rails.
void add_across(Points& points, const Ground& ground, const model::Track& track, double s, double right, double left,
                double width, double z, bool banked = false) {
  const model::Track::Node at = track.at(s);
  const double half = 0.5 * width;
  const std::vector<double> offsets = ground.between(right, left);
  for (std::size_t i = 0; i + 1 < offsets.size(); ++i) {
    const double a = offsets[i], b = offsets[i + 1], z_a = z + (banked ? ground.bank(s, a) : ground.height(s, a)),
                 z_b = z + (banked ? ground.bank(s, b) : ground.height(s, b));
    add_quad(points, beside(at, -half, a, z_a), beside(at, half, a, z_a), beside(at, half, b, z_b),
             beside(at, -half, b, z_b));
  }
}

/// A place of the track.
struct Station {
  double s;
  model::Track::Node node;
};

/// A strip along the track between two offsets. `height(s, left)` is that of its edges.
template <class Height>
void add_strip(Points& points, const Station& from, const Station& to, double right, double left, Height height) {
  const auto corner = [&](const Station& at, double offset) {
    return beside(at.node, 0.0, offset, height(at.s, offset));
  };
  add_quad(points, corner(from, right), corner(to, right), corner(to, left), corner(from, left));
}

/// Lines across the ground on one side, each with its distance from the point of derailment.
void add_ruler(Points& points, const Ground& ground, const model::Track& track, double rear, double front, double unit,
               int step, bool left, const char* name) {
  const double side = left ? 1.0 : -1.0;
  const int first = static_cast<int>(std::ceil(rear / (unit * step))),
            last = static_cast<int>(std::floor(front / (unit * step)));
  for (int i = first; i <= last; ++i) {
    const double s = i * unit * step;
    const model::Track::Node at = track.at(s);
    const double inner = side * ground.ballast_foot, outer = side * kRulerReach;
    add_across(points, ground, track, s, std::min(inner, outer), std::max(inner, outer), kRulerWidth, kRulerHeight);
    Points text;
    paint_text(text, fmt::format("{} {}", i * step, name), kRulerText, kRulerHeight);
    for (const Point& p : text) {
      const double left_of = p.y + side * (kRulerReach + kRulerText);
      points.push_back(beside(at, p.x, left_of, p.z + ground.height(s, left_of)));
    }
  }
}

/// An arrow with the letter N beside the point of derailment, along `north`.
void add_north(Points& points, const Ground& ground, const Point& north) {
  const auto add = [&](double ahead, double left) {
    const double x = ahead * north.x - left * north.y, y = kNorthBeside + ahead * north.y + left * north.x;
    points.push_back(make_point(x, y, kRulerHeight + ground.height(x, y)));
  };
  const auto half_arrow = [&](double side) {
    const double tip = 0.5 * kNorthLength;
    for (const auto& [ahead, left] :
         {std::pair{tip, 0.0}, std::pair{-tip, side * 0.6 * tip}, std::pair{-0.5 * tip, 0.0}})
      add(ahead, left);
  };
  half_arrow(1.0);
  half_arrow(-1.0);
  Points letter;
  paint_text(letter, "N", kRulerText, kRulerHeight);
  // To be read with north up.
  for (const Point& p : letter) add(0.5 * kNorthLength + kRulerText + p.y, -p.x);
}

/// Level ground as far as one sees, or what lies along the track as far as it is not too far from it.
void add_ground(Points& points, const Ground& ground, const model::Track& track, std::vector<Station> stations) {
  const double rear = stations.front().s, front = stations.back().s;
  if (ground.level()) {
    add_quad(points, make_point(rear - kGroundBeyond, -kGroundBeyond, 0.0),
             make_point(front + kGroundBeyond, -kGroundBeyond, 0.0),
             make_point(front + kGroundBeyond, kGroundBeyond, 0.0),
             make_point(rear - kGroundBeyond, kGroundBeyond, 0.0));
    return;
  }
  const double banks = ground.bends.empty() ? 0.0 : std::max(-ground.bends.front(), ground.bends.back());
  const double reach = std::max(track.straight() ? kGroundBeyond : kGroundBesideCurve, banks + kRulerReach);
  const std::vector<double> offsets = ground.between(-reach, reach);
  stations.front().node.point -= kGroundBeyond * stations.front().node.tangent;
  stations.back().node.point += kGroundBeyond * stations.back().node.tangent;
  for (std::size_t i = 0; i + 1 < stations.size(); ++i) {
    for (std::size_t j = 0; j + 1 < offsets.size(); ++j) {
      add_strip(points, stations[i], stations[i + 1], offsets[j], offsets[j + 1],
                [&](double s, double left) { return ground.height(s, left); });
    }
  }
}

}  // namespace

TrackPicture track_picture(const inputs::Scenario& scenario, const std::vector<model::Car>& cars) {
  double train_length = static_cast<double>(cars.size() - 1) * scenario.coupler.length;
  for (const model::Car& car : cars) train_length += car.length;
  double front = std::max(120.0, 0.15 * train_length);
  const double rear = -train_length - 30.0;
  if (scenario.initial.cars_ahead > 0) {
    front += kRollOn * scenario.initial.speed;
    for (int i = 0; i < scenario.initial.cars_ahead; ++i) front += cars[static_cast<std::size_t>(i)].length;
  }
  const model::Track track(scenario, rear, front);

  TrackPicture t;
  const Ground ground(scenario);
  std::vector<Station> places;
  for (const double s : stations(scenario.track.curves, !ground.even(), rear, front))
    places.push_back({s, track.at(s)});
  add_ground(t.ground, ground, track, places);
  const auto on_ground = [&](double s, double left) { return ground.height(s, left); };
  const auto above_rails = [&](double z) {
    return [&ground, z](double s, double left) { return z + ground.bank(s, left); };
  };
  for (std::size_t i = 0; i + 1 < places.size(); ++i) {
    const Station &from = places[i], &to = places[i + 1];
    const double top = ground.ballast_top, foot = ground.ballast_foot;
    const auto shoulder = [&](double s, double left) {
      return std::abs(left) > top ? on_ground(s, left) : kBallastHeight + ground.bank(s, left);
    };
    add_strip(t.ballast, from, to, -foot, -top, shoulder);
    add_strip(t.ballast, from, to, -top, top, above_rails(kBallastHeight));
    add_strip(t.ballast, from, to, top, foot, shoulder);
    for (const double left : {-0.5 * kGauge, 0.5 * kGauge}) {
      add_strip(t.rails, from, to, left - 0.5 * kRailWidth, left + 0.5 * kRailWidth, above_rails(kRailHeight));
    }
  }
  for (int i = static_cast<int>(-kTiesBehind / kTieSpacing); i * kTieSpacing <= kTiesAhead; ++i) {
    const double at = i * kTieSpacing;
    if (at < rear || at > front) continue;
    add_across(t.ties, ground, track, at, -0.5 * kTieLength, 0.5 * kTieLength, kTieWidth, kTieHeight, true);
  }
  const double ruler_front = std::min(front, kRulerAhead);
  add_ruler(t.ruler, ground, track, rear, ruler_front, 1.0, 50, true, "m");
  add_ruler(t.ruler, ground, track, rear, ruler_front, kFoot, 100, false, "ft");
  const model::Track::Node origin = track.at(0.0);
  add_across(t.pod, ground, track, 0.0, -kRulerReach, kRulerReach, kPodWidth, kPodHeight);
  // Beyond the numbers of the ruler.
  t.pod_name = beside(origin, 0.0, -kRulerReach - 3.0 * kRulerText, 0.5 * kPodTextHeight);

  // In space the top of the rails is at height 0; models of the plane leave the ground there.
  if (inputs::model_of(scenario) == inputs::Model::spatial) t.height = -scenario.terrain.rail_height;
  if (const std::optional<double> heading = scenario.track.heading) {
    t.north = make_point(std::cos(*heading), std::sin(*heading), 0.0);
    add_north(t.ruler, ground, *t.north);
  }
  return t;
}

}  // namespace train_derail::scene
