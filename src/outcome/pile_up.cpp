#include "train_derail/outcome/pile_up.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <boost/geometry.hpp>
#include <boost/geometry/geometries/multi_point.hpp>
#include <boost/geometry/geometries/point_xy.hpp>
#include <boost/geometry/geometries/polygon.hpp>

namespace train_derail::outcome {

PileUp pile_up(const std::vector<model::Footprint>& cars, const std::vector<bool>& counted, const PlaceByTrack& place) {
  namespace bg = boost::geometry;
  using Point = bg::model::d2::point_xy<double>;
  bg::model::multi_point<Point> corners;
  PileUp p;
  bool beside = false;
  Eigen::AlignedBox2d extent;                      // in arc length and offset from the track
  std::vector<std::pair<double, double>> extents;  // first and last arc length of each turned car
  for (std::size_t k = 0; k < cars.size(); ++k) {
    if (counted[k] && !beside) ++p.groups;
    beside = counted[k];
    if (!counted[k]) continue;
    const model::Footprint& f = cars[k];
    const model::TrackPlace middle = place(k, f.centre);
    const double cosine = std::abs(f.axis.dot(middle.tangent));
    if (cosine < 0.5) ++p.cars_across;
    double reach_aside = 0.0;
    for (const Vector2& c : f.corners()) {
      bg::append(corners, Point(c.x(), c.y()));
      const model::TrackPlace corner = place(k, c);
      extent.extend(Vector2(corner.s, corner.offset));
      reach_aside = std::max(reach_aside, std::abs(corner.offset));
    }
    p.lateral_reach.add(reach_aside);
    if (cosine >= kMainPileCosine) continue;
    const double reach = f.reach(middle.tangent);
    extents.emplace_back(middle.s - reach, middle.s + reach);
  }
  if (bg::is_empty(corners)) return p;
  p.length = extent.sizes().x();
  p.width = extent.sizes().y();
  std::sort(extents.begin(), extents.end());
  for (std::size_t i = 0; i < extents.size();) {
    const std::size_t first = i;
    double end = extents[i].second;
    for (++i; i < extents.size() && extents[i].first <= end + kMainPileGap; ++i) end = std::max(end, extents[i].second);
    if (const auto cars_here = static_cast<int>(i - first); cars_here > p.main_cars) {
      p.main_cars = cars_here;
      p.main_length = end - extents[first].first;
    }
  }
  bg::model::polygon<Point> hull;
  bg::convex_hull(corners, hull);
  p.area = bg::area(hull);
  return p;
}

}  // namespace train_derail::outcome
