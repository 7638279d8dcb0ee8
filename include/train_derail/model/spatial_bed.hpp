/// \file
/// Where rails and ground are in the spatial model: the track, its heights, and the terrain beside it.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include <Eigen/Geometry>

#include "train_derail/inputs/extent.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/ball_on_ground.hpp"
#include "train_derail/model/ground_law.hpp"
#include "train_derail/model/height_grid.hpp"
#include "train_derail/model/terrain.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/model/track_profile.hpp"

namespace train_derail::model {

/// Ground under a point: height and the upward vector (not of length 1) along which it pushes.
struct Under {
  double z;
  Eigen::Vector3d up;
};

/// The bed of one scenario, which must outlive it. Heights [m] are above the top of the rails at the point of
/// derailment.
class SpatialBed {
 public:
  explicit SpatialBed(const inputs::Scenario& s)
      : track(s, inputs::track_extent(s).from, inputs::track_extent(s).to),
        profile(s),
        patches_(s.ground.patches),
        terrain_(s.terrain),
        usual_(s.terrain),
        grid_(s.terrain.grid),
        outline_(usual_),
        level_(model::level(s.terrain) && s.track.grades.empty()),
        prism_(track.straight() && profile.flat() && terrain_.sections.empty() && grid_.empty()),
        highest_(model::highest_ground(s.terrain)) {}

  Track track;
  const TrackProfile profile;

  /// All ground is one level plane.
  bool level() const { return level_; }
  /// Of the ground where it is the same all along the x axis, with offsets y; else nothing.
  const CrossSection* section_all_along() const { return level_ || prism_ ? &usual_ : nullptr; }

  /// Under a point that is near arc length s_near of the track.
  Under ground(const Eigen::Vector3d& p, double s_near) const {
    if (level_) return {-terrain_.rail_height, Eigen::Vector3d::UnitZ()};
    if (prism_) {
      const GroundHeight<double> g = ground_height(usual_, p.y());
      return {g.z, {0.0, -g.slope, 1.0}};
    }
    const double s = track.foot({p.x(), p.y()}, s_near);
    return ground_at(p, s, track.at(s));
  }
  /// The same for a point that is no farther than `reach` from where the track is at s: its foot on the track is looked
  /// for from where it was before.
  Under ground(const Eigen::Vector3d& p, double s, double reach, double& foot) const {
    if (level_ || track.straight()) return ground(p, s);
    if (!(std::abs(foot - s) < reach)) foot = s;
    const Vector2 place(p.x(), p.y());
    const Track::Node node = track.at(foot);
    const double ahead = (place - node.point).dot(node.tangent);
    // Looked for twice, a foot stays where it is: a run that is resumed finds the same.
    if (std::abs(ahead) < 1e-6) return ground_at(p, foot, node);
    foot = track.foot(place, foot + ahead);
    return ground_at(p, foot, track.at(foot));
  }
  /// At arc length s of the track, `left` of it.
  Under beside(double s, double left) const {
    const Track::Node node = track.at(s);
    return ground_at({node.point.x() - left * node.tangent.y(), node.point.y() + left * node.tangent.x(), 0.0}, s,
                     node);
  }
  /// Calls what(place, up, depth, number) for each touch of a ball whose centre is near arc length s_near, as
  /// ball_on_ground finds them: where it presses, along what (height 1), and how deep [m].
  template <class What>
  void touches_of_ball(const Eigen::Vector3d& centre, double radius, double s_near, const What& what) const {
    if (level_) {
      const double depth = radius - terrain_.rail_height - centre.z();
      if (depth > 0.0) what(centre - radius * Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitZ(), depth, 0);
      return;
    }
    if (!grid_.empty()) {
      // Smooth but for its cells: where the ground looks to the centre is found in few steps.
      Eigen::Vector3d place = centre;
      Under under{};
      for (int i = 0; i < 4; ++i) {
        under = ground(place, s_near);
        place = centre - radius * under.up.normalized();
      }
      const double depth = ground(place, s_near).z - place.z();
      if (depth > 0.0) what(place, under.up, depth, 0);
      return;
    }
    const double s = track.foot({centre.x(), centre.y()}, s_near);
    const Track::Node node = track.at(s);
    const TrackProfile::Place along = profile.at(s);
    const double offset = offset_of(centre, node), height = centre.z() - along.bed;
    const BallTouches found = terrain_.sections.empty()
                                  ? ball_on_ground(outline_, offset, height, radius)
                                  : ball_on_ground(GroundOutline(cross_section(terrain_, s)), offset, height, radius);
    for (std::size_t i = 0; i < found.count; ++i) {
      const BallTouch& t = found.at[i];
      double rise = along.grade;
      if (!terrain_.sections.empty()) rise += change_along(s, offset - radius * t.aside);
      const Eigen::Vector3d up(-t.aside * node.tangent.y() / t.up - rise * node.tangent.x(),
                               t.aside * node.tangent.x() / t.up - rise * node.tangent.y(), 1.0);
      what(centre - radius * up.normalized(), up, t.depth, t.number);
    }
  }
  /// No ground within `reach` of the track's place at s is higher.
  double highest_ground(double s, double reach) const {
    const double beside = profile.flat() ? highest_ : highest_ + profile.at(s).bed + reach * profile.steepest();
    return grid_.empty() ? beside : std::max(beside, grid_.highest());
  }
  /// Product of the factors of the patches that a point near arc length s_near lies on.
  double patch_factor(const Eigen::Vector3d& p, double s_near) const {
    if (patches_.empty()) return 1.0;
    if (track.straight()) return model::patch_factor(patches_, p.x(), p.y());
    const double s = track.foot({p.x(), p.y()}, s_near);
    return model::patch_factor(patches_, s, offset_of(p, track.at(s)));
  }
  /// Height of the rails' plane at a point.
  double rails(const Eigen::Vector3d& p, double s_near) const {
    if (profile.flat()) return 0.0;
    const double s = track.foot({p.x(), p.y()}, s_near);
    const TrackProfile::Place along = profile.at(s);
    return along.height + along.tilt * (offset_of(p, track.at(s)) - track.alignment(s));
  }

 private:
  Under ground_at(const Eigen::Vector3d& p, double s, const Track::Node& node) const {
    const double offset = offset_of(p, node);
    const TrackProfile::Place along = profile.at(s);
    double rise = along.grade;
    if (!terrain_.sections.empty()) rise += change_along(s, offset);
    const GroundHeight<double> g =
        ground_height(terrain_.sections.empty() ? usual_ : cross_section(terrain_, s), offset);
    const Under roadbed{along.bed + g.z,
                        {g.slope * node.tangent.y() - rise * node.tangent.x(),
                         -g.slope * node.tangent.x() - rise * node.tangent.y(), 1.0}};
    return grid_.empty() ? roadbed : joined(roadbed, p, offset, along, node);
  }
  /// The roadbed, which beyond its crown becomes the grid; ballast that stands out of it.
  Under joined(const Under& roadbed, const Eigen::Vector3d& p, double offset, const TrackProfile::Place& along,
               const Track::Node& node) const {
    const double beyond = std::abs(offset) - terrain_.crown, share = std::min(beyond / terrain_.grid.seam, 1.0);
    if (share <= 0.0) return roadbed;
    const HeightGrid::Height map = grid_.at(p.x(), p.y());
    const double side = offset < 0.0 ? -1.0 : 1.0;
    const Vector2 left(-node.tangent.y(), node.tangent.x());
    // The ballast's side may stand out of both.
    const double outside = std::abs(offset) - terrain_.ballast_half_width;
    const double ballast = along.bed - terrain_.rail_height - terrain_.ballast_slope * std::max(outside, 0.0);
    // The crown, carried on without ballast.
    const double crown = along.bed - terrain_.rail_height - terrain_.ballast_height;
    const double z = crown + share * (map.z - crown);
    const bool on_ballast = terrain_.ballast_height > 0.0 && ballast > z;
    Vector2 slope = along.grade * node.tangent;
    if (on_ballast) {
      if (outside > 0.0) slope -= side * terrain_.ballast_slope * left;
    } else {
      slope = (1.0 - share) * slope + share * map.slope;
      if (share < 1.0) slope += (side * (map.z - crown) / terrain_.grid.seam) * left;
    }
    return {on_ballast ? ballast : z, {-slope.x(), -slope.y(), 1.0}};
  }
  /// Of the ground's height by sections, per length of track.
  double change_along(double s, double offset) const {
    constexpr double kReach = 0.01;  // m
    const auto height = [&](double at) { return ground_height(cross_section(terrain_, at), offset).z; };
    return (height(s + kReach) - height(s - kReach)) / (2.0 * kReach);
  }
  static double offset_of(const Eigen::Vector3d& p, const Track::Node& node) {
    return (p.y() - node.point.y()) * node.tangent.x() - (p.x() - node.point.x()) * node.tangent.y();
  }

  const std::vector<inputs::GroundPatch>& patches_;
  const inputs::Terrain& terrain_;
  const CrossSection usual_;
  const HeightGrid grid_;
  const GroundOutline outline_;
  const bool level_, prism_;
  const double highest_;  // where the track is level
};

}  // namespace train_derail::model
