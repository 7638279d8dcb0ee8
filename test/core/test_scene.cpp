// What a run looks like: heaps, shapes, track, the document of a page.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "train_derail/model/track.hpp"
#include "train_derail/model/track_profile.hpp"
#include "train_derail/scene/car_shape.hpp"
#include "train_derail/scene/heap.hpp"
#include "train_derail/scene/marks.hpp"
#include "train_derail/scene/replay.hpp"
#include "train_derail/scene/track_picture.hpp"

#include "fixtures.hpp"

namespace train_derail::scene {
namespace {

/// Cars of 20 m that lie along the track with their middles at these places, turned by these angles.
std::vector<simulation::CarSnapshot> cars_at(const std::vector<std::pair<double, double>>& places) {
  std::vector<simulation::CarSnapshot> cars;
  for (const auto& [s, yaw] : places) {
    simulation::CarSnapshot& c = cars.emplace_back();
    c.x = s;
    c.theta = yaw;
    c.front_truck = {s + 7.0 * std::cos(yaw), 7.0 * std::sin(yaw), 0.0, 0.0};
    c.rear_truck = {s - 7.0 * std::cos(yaw), -7.0 * std::sin(yaw), 0.0, 0.0};
  }
  return cars;
}
const model::Car kCar{"car", 6e4, 6e5, 1e6, 20.0, 14.0, 3.0};

TEST(Heap, IsTheLargestGroupOfTurnedCars) {
  // Three far ahead in line, four turned ones, two turned ones far behind, one on the rails.
  std::vector<simulation::CarSnapshot> now = cars_at(
      {{300, 0}, {279, 0}, {258, 0}, {40, 1.2}, {30, -1.2}, {22, 1.3}, {10, -1.0}, {-60, 1.0}, {-70, -1.0}, {-100, 0}});
  for (std::size_t i = 0; i < 9; ++i) now[i].derailed = true;
  const std::vector<model::Car> cars(now.size(), kCar);
  const Heap heap = find_heap(cars, now);
  EXPECT_EQ(heap.first_car, 4);
  EXPECT_EQ(heap.last_car, 7);
  EXPECT_GT(heap.x, 10.0);
  EXPECT_LT(heap.x, 40.0);
  EXPECT_NEAR(heap.yaw, 0.0, 1e-9);
  for (std::size_t i = 3; i < 7; ++i) {  // every corner is in it
    for (const double u : {-10.0, 10.0}) {
      for (const double v : {-1.5, 1.5}) {
        const double x = now[i].x + u * std::cos(now[i].theta) - v * std::sin(now[i].theta);
        const double y = now[i].y + u * std::sin(now[i].theta) + v * std::cos(now[i].theta);
        EXPECT_LE(std::abs(x - heap.x), 0.5 * heap.length + 1e-9);
        EXPECT_LE(std::abs(y - heap.y), 0.5 * heap.width + 1e-9);
      }
    }
  }
}

TEST(Heap, IsTheDerailedCarsBeforeThereIsOneAndTheFirstCarsBeforeThat) {
  std::vector<simulation::CarSnapshot> now = cars_at({{20, 0}, {-1, 0}, {-22, 0}, {-43, 0}, {-64, 0}});
  const std::vector<model::Car> cars(now.size(), kCar);
  Heap heap = find_heap(cars, now);
  EXPECT_EQ(heap.first_car, 1);
  EXPECT_EQ(heap.last_car, 3) << "the first cars, near the point";
  EXPECT_NEAR(heap.x, -1.0, 1e-9);
  EXPECT_NEAR(heap.length, 62.0, 1e-9);
  EXPECT_NEAR(heap.width, 3.0, 1e-9);
  now[0].derailed = now[1].derailed = true;
  heap = find_heap(cars, now);
  EXPECT_EQ(heap.last_car, 2);
  EXPECT_NEAR(heap.length, 41.0, 1e-9);
}

TEST(Heap, IsAtTheMeanHeightOfItsCars) {
  std::vector<simulation::CarSnapshot> now = cars_at({{20, 0}, {-1, 0}, {-22, 0}});
  for (std::size_t i = 0; i < 3; ++i) now[i].z = 1.0 * static_cast<double>(i);
  EXPECT_NEAR(find_heap(std::vector<model::Car>(3, kCar), now).z, 1.0, 1e-12);
}

TEST(Lie, HasTheBoundsOfTheOutcome) {
  const auto lie = [](double degrees) { return lie_of(degrees * inputs::kDegree); };
  EXPECT_EQ(lie(0.0), Lie::upright);
  EXPECT_EQ(lie(9.9), Lie::upright);
  EXPECT_EQ(lie(10.1), Lie::leaning);
  EXPECT_EQ(lie(44.9), Lie::leaning);
  EXPECT_EQ(lie(45.1), Lie::on_side);
  EXPECT_EQ(lie(134.9), Lie::on_side);
  EXPECT_EQ(lie(135.1), Lie::inverted);
  EXPECT_EQ(lie(180.0), Lie::inverted);
}

TEST(CarShape, ReachesFromItsOwnFloorToItsOwnRoof) {
  for (const char* body : {"tank_car", "hopper", "boxcar", "locomotive", "flat", "car"}) {
    for (const auto& [floor, roof] : {std::pair(1.1, 4.2), std::pair(0.3, 6.1), std::pair(1.0, 2.6)}) {
      model::Car car = kCar;
      car.body = body;
      car.floor_height = floor;
      car.roof_height = roof;
      const CarShape shape = car_shape(car);
      double low = 10.0, high = 0.0;
      for (const Point& p : shape.body) {
        low = std::min(low, p.z);
        high = std::max(high, p.z);
      }
      EXPECT_NEAR(high, roof, 1e-9) << body;
      EXPECT_GE(low, floor - 1e-9) << body;
      EXPECT_LT(low, floor + 0.3) << body;
      EXPECT_LE(shape.top, roof + 0.031) << body;
      for (const Point& p : shape.dark) EXPECT_LE(p.z, roof + 0.05) << body;
    }
  }
}

TEST(CarShape, OfACylinderIsAsRoundAsTheBodyThatTouches) {
  for (const char* body : {"tank_car", "hopper"}) {
    model::Car car = kCar;
    car.body = body;
    car.cylinder = true;
    car.floor_height = 1.0;
    car.roof_height = 1.2 + car.width;  // higher than wide
    const CarShape shape = car_shape(car);
    const double radius = 0.5 * car.width, middle = 1.1 + radius, half = 0.5 * car.length - radius;
    double reach = 0.0;
    int on_heads = 0;
    for (const Point& p : shape.body) {
      const double beyond = std::max(std::abs(p.x) - half, 0.0);
      EXPECT_NEAR(std::hypot(beyond, std::hypot(p.y, p.z - middle)), radius, 1e-9) << body;
      reach = std::max(reach, std::abs(p.x));
      if (beyond > 0.1 * radius && beyond < 0.9 * radius) ++on_heads;
    }
    EXPECT_NEAR(reach, 0.5 * car.length, 1e-9);
    EXPECT_GT(on_heads, 20) << "heads are domes";
    EXPECT_NEAR(shape.top, middle + radius, 0.05);
  }
}

// ---- Track ------------------------------------------------------------------------------------------------------

inputs::Scenario hill() {
  inputs::Scenario s = test::baseline(20);
  s.model = inputs::Model::spatial;
  s.ground.on_track_law = inputs::OnTrackLaw::rails;
  s.track.grades = {{-400.0, 300.0, 0.02}};
  inputs::Curve curve;
  curve.start = -200.0;
  curve.length = 250.0;
  curve.curvature = -1.0 / 400.0;
  curve.superelevation = 0.15;
  s.track.curves = {curve};
  return s;
}

/// Height of a part nearest to a place.
double height_near(const Points& points, const Point& place) {
  const auto distance = [&](const Point& p) { return std::hypot(p.x - place.x, p.y - place.y); };
  return std::min_element(points.begin(), points.end(),
                          [&](const Point& a, const Point& b) { return distance(a) < distance(b); })
      ->z;
}

TEST(TrackPicture, LiesOnTheHillWithItsSuperelevation) {
  const inputs::Scenario s = hill();
  const std::vector<model::Car> cars = model::expand(s.consist);
  const TrackPicture picture = track_picture(s, cars);
  const TrackPicture level = track_picture(test::baseline(20), cars);
  const model::TrackProfile profile(s);
  const model::Track track(s, -500.0, 100.0);
  const double rail = level.rails.front().z;
  ASSERT_LT(profile.at(-350.0).bed, -3.0);
  for (const double at : {-350.0, -250.0, -100.0, 0.0}) {
    const model::Track::Node node = track.at(at);
    const model::TrackProfile::Place place = profile.at(at);
    for (const double left : {-0.7175, 0.7175}) {
      const Point p =
          make_point(node.point.x() - left * node.tangent.y(), node.point.y() + left * node.tangent.x(), 0.0);
      // A corner is at most half a piece away: 5 m of a grade of two in a hundred.
      EXPECT_NEAR(height_near(picture.rails, p) - rail, place.height + place.tilt * left, 0.12) << at << ' ' << left;
      EXPECT_NEAR(height_near(picture.ballast, p), place.bed, 0.35) << at;
    }
    EXPECT_NEAR(height_near(picture.ground, make_point(node.point.x(), node.point.y(), 0.0)), place.bed, 0.12) << at;
  }
  // In a curve to the right the left rail is the higher one.
  const model::Track::Node node = track.at(-100.0);
  const auto beside = [&](double left) {
    return height_near(picture.rails, make_point(node.point.x() - left * node.tangent.y(),
                                                 node.point.y() + left * node.tangent.x(), 0.0));
  };
  EXPECT_NEAR(beside(0.7175) - beside(-0.7175), 0.15, 0.03);
}

TEST(TrackPicture, KnowsNorthIfTheScenarioDoes) {
  inputs::Scenario s = test::baseline(5);
  const std::vector<model::Car> cars = model::expand(s.consist);
  EXPECT_FALSE(track_picture(s, cars).north.has_value());
  s.track.heading = 90.0 * inputs::kDegree;  // to the east: north is on the left
  const Point north = *track_picture(s, cars).north;
  EXPECT_NEAR(north.x, 0.0, 1e-12);
  EXPECT_NEAR(north.y, 1.0, 1e-12);
}

/// The arrow on the ground: its two halves meet at the tip, ahead of the two corners at its foot by its length.
TEST(TrackPicture, PaintsAnArrowToTheNorth) {
  inputs::Scenario s = test::baseline(5);
  const std::vector<model::Car> cars = model::expand(s.consist);
  const std::size_t before = track_picture(s, cars).ruler.size();
  for (const double degrees : {0.0, 75.0, 200.0}) {
    s.track.heading = degrees * inputs::kDegree;
    const TrackPicture picture = track_picture(s, cars);
    ASSERT_GT(picture.ruler.size(), before + 6);
    const auto corner = [&](std::size_t i) { return picture.ruler[before + i]; };
    const Point tip = corner(0), left = corner(1), right = corner(4);
    const double x = tip.x - 0.5 * (left.x + right.x), y = tip.y - 0.5 * (left.y + right.y);
    EXPECT_NEAR(x / std::hypot(x, y), std::cos(*s.track.heading), 1e-9);
    EXPECT_NEAR(y / std::hypot(x, y), std::sin(*s.track.heading), 1e-9);
    EXPECT_GT(std::hypot(x, y), 10.0);
    for (std::size_t i = before; i < picture.ruler.size(); ++i) {
      EXPECT_GT(picture.ruler[i].y, 50.0);  // clear of the numbers of the ruler
      EXPECT_NEAR(picture.ruler[i].z, 0.03, 1e-9);
    }
  }
}

// ---- The document of a page -------------------------------------------------------------------------------------

struct Recorded {
  nlohmann::json document;
  std::size_t cars, moments;

  const std::vector<std::int32_t> channel(std::size_t k) const { return document["channels"][k]; }
  std::size_t coupler_channel(const std::string& name) const {
    const auto& couplers = document["fields"]["couplers"];
    const auto found = std::find_if(couplers.begin(), couplers.end(), [&](const auto& f) { return f["name"] == name; });
    return document["fields"]["cars"].size() + static_cast<std::size_t>(found - couplers.begin());
  }
};

/// A run whose couplers push once each with as many MN as their number, at moment `peak`.
Recorded record(int cars, int moments, int peak) {
  inputs::Scenario s = test::baseline(cars);
  const std::vector<model::Car> train = model::expand(s.consist);
  Replay replay(s, train);
  for (int k = 0; k < moments; ++k) {
    simulation::Snapshot now{0.02 * k, {}, {}};
    now.cars.resize(train.size());
    now.couplers.resize(train.size() - 1);
    for (std::size_t i = 0; i < train.size(); ++i) {
      now.cars[i].x = 0.02 * k - 20.0 * static_cast<double>(i);
      now.cars[i].qw = 1.0;
      now.cars[i].front_truck.s = now.cars[i].x + 6.0;
      now.cars[i].rear_truck.s = now.cars[i].x - 6.0;
    }
    for (std::size_t i = 0; i + 1 < train.size(); ++i)
      now.couplers[i].buff_peak = k == peak ? 1e6 * static_cast<double>(i + 1) : 1e3;
    replay.add(now, {});
  }
  Recorded r{nlohmann::json::parse(replay.document({"title", ""}, {}, {})), train.size(), 0};
  r.moments = r.document["times"].size();
  return r;
}

TEST(Replay, AShortRunIsKeptWhole) {
  const Recorded r = record(10, 500, 100);
  EXPECT_EQ(r.moments, 500U);
  const std::vector<double> times = r.document["times"];
  for (std::size_t k = 0; k < times.size(); ++k) ASSERT_DOUBLE_EQ(times[k], 0.02 * static_cast<double>(k));
  EXPECT_EQ(r.channel(0)[10 * 250 + 3], 500 - 6000) << "cm";
}

TEST(Replay, ALongRunIsThinnedButKeepsItsEndsAndItsLargestForces) {
  for (const int moments : {2600, 9003, 20000}) {
    for (const int peak : {777, moments - 2}) {
      const Recorded r = record(100, moments, peak);
      EXPECT_LE(r.moments * 100, kReplayValuesMax + 100) << moments;
      EXPECT_GT(r.moments * 100, kReplayValuesMax / 3) << moments;
      const std::vector<double> times = r.document["times"];
      EXPECT_EQ(times.front(), 0.0);
      EXPECT_DOUBLE_EQ(times.back(), 0.02 * (moments - 1));
      for (std::size_t k = 2; k + 1 < times.size(); ++k)
        ASSERT_NEAR(times[k] - times[k - 1], times[1] - times[0], 1e-9)
            << moments << ": moments are equally far apart but for the last";
      // Every channel belongs to the same moments.
      const std::vector<std::int32_t> x = r.channel(0), peaks = r.channel(r.coupler_channel("buff_peak"));
      ASSERT_EQ(x.size(), 100 * r.moments);
      ASSERT_EQ(peaks.size(), 99 * r.moments);
      ASSERT_EQ(r.document["channels"].back().size(), r.moments);
      for (std::size_t k = 0; k < r.moments; ++k) ASSERT_NEAR(0.01 * x[100 * k + 2], times[k] - 40.0, 0.0051);
      // The peak stands once, at the first moment that is not before it.
      const auto at =
          static_cast<std::size_t>(std::lower_bound(times.begin(), times.end(), 0.02 * peak - 1e-9) - times.begin());
      for (std::size_t i = 0; i < 99; ++i) {
        for (std::size_t k = 0; k < r.moments; ++k)
          ASSERT_EQ(peaks[99 * k + i], k == at ? 1000 * static_cast<std::int32_t>(i + 1) : 1)
              << moments << ' ' << peak << ' ' << k;
      }
    }
  }
}

TEST(Replay, TellsWhereTheHeapIs) {
  const Recorded r = record(10, 3, 0);
  const auto& heap = r.document["fields"]["heap"];
  ASSERT_EQ(heap[0]["name"], "x");
  const std::size_t first = r.document["channels"].size() - heap.size();
  EXPECT_EQ(r.channel(first), (std::vector<std::int32_t>{-2000, -1998, -1996})) << "the first three cars, in cm";
}

}  // namespace
}  // namespace train_derail::scene
