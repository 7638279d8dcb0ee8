#include "train_derail/scene/heap.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

#include "train_derail/outcome/outcome.hpp"

namespace train_derail::scene {

namespace {

/// Turned cars that make a heap.
constexpr std::size_t kHeapLeast = 3;
/// Cars that are shown before the first derails, and how far from the point they may be [m].
constexpr std::size_t kFirstCars = 3;
constexpr double kFirstCarsReach = 60.0;

/// A car by the track.
struct Place {
  std::size_t car;
  double s, reach;  // of its middle; of half its footprint along the track
  double cosine;    // of its angle against the track, without sign
  double tangent;   // heading of the track [rad]
};

Place place_of(const model::Car& car, const simulation::CarSnapshot& now, std::size_t number) {
  const double ds = now.front_truck.s - now.rear_truck.s, aside = now.front_truck.offset - now.rear_truck.offset;
  const double spacing = std::hypot(ds, aside);
  const double cosine = spacing > 0.0 ? std::abs(ds) / spacing : 1.0;
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return {number, 0.5 * (now.front_truck.s + now.rear_truck.s), 0.5 * (car.length * cosine + car.width * sine), cosine,
          now.theta - std::atan2(aside, ds)};
}

/// The largest group without a longer gap.
std::vector<Place> largest_group(std::vector<Place> places) {
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.s - a.reach < b.s - b.reach; });
  auto best = places.begin(), best_end = places.begin();
  for (auto first = places.begin(); first != places.end();) {
    double end = first->s + first->reach;
    auto next = first + 1;
    for (; next != places.end() && next->s - next->reach <= end + outcome::kMainPileGap; ++next) {
      end = std::max(end, next->s + next->reach);
    }
    // Of two that are as large, the one that is farther ahead.
    if (next - first >= best_end - best) std::tie(best, best_end) = std::pair(first, next);
    first = next;
  }
  return {best, best_end};
}

}  // namespace

Heap find_heap(const std::vector<model::Car>& cars, const std::vector<simulation::CarSnapshot>& now) {
  std::vector<Place> turned, derailed, first;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const Place place = place_of(cars[i], now[i], i);
    if (now[i].derailed || now[i].off_track) {
      derailed.push_back(place);
      if (place.cosine < outcome::kMainPileCosine) turned.push_back(place);
    }
    if (first.empty() || (first.size() < kFirstCars && std::abs(place.s) < kFirstCarsReach)) first.push_back(place);
  }
  std::vector<Place> group = largest_group(turned);
  if (group.size() < kHeapLeast) group = largest_group(derailed);
  if (group.empty()) group = first;

  // Headings may differ by whole turns.
  Eigen::Vector2d heading = Eigen::Vector2d::Zero();
  Heap heap;
  heap.first_car = static_cast<int>(cars.size());
  for (const Place& place : group) {
    heap.z += now[place.car].z / static_cast<double>(group.size());
    heading += Eigen::Vector2d(std::cos(place.tangent), std::sin(place.tangent));
    heap.first_car = std::min(heap.first_car, static_cast<int>(place.car) + 1);
    heap.last_car = std::max(heap.last_car, static_cast<int>(place.car) + 1);
  }
  heap.yaw = std::atan2(heading.y(), heading.x());
  const Eigen::Rotation2Dd to_heap(-heap.yaw);
  Eigen::AlignedBox2d box;
  for (const Place& place : group) {
    const simulation::CarSnapshot& car = now[place.car];
    const Eigen::Vector2d axis(std::cos(car.theta), std::sin(car.theta)), side(-axis.y(), axis.x());
    for (const double i : {-0.5, 0.5}) {
      for (const double j : {-0.5, 0.5}) {
        box.extend(to_heap * (Eigen::Vector2d(car.x, car.y) + i * cars[place.car].length * axis +
                              j * cars[place.car].width * side));
      }
    }
  }
  const Eigen::Vector2d middle = to_heap.inverse() * box.center();
  heap.x = middle.x();
  heap.y = middle.y();
  heap.length = box.sizes().x();
  heap.width = box.sizes().y();
  return heap;
}

}  // namespace train_derail::scene
