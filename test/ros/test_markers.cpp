// What RViz is shown: shapes of cars, markers that are sent when they change, colours that everybody can tell apart.
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "marker_check.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/ros/marker_scene.hpp"
#include "train_derail/ros/track_markers.hpp"
#include "train_derail/scene/car_shape.hpp"

namespace train_derail::ros_face {

using namespace scene;

namespace {

using test::Shown;
using visualization_msgs::Marker;

inputs::Scenario short_train(int cars) {
  inputs::Scenario s;
  inputs::CarBlock block;
  block.count = cars;
  block.length = 18.0;
  block.weight = 6.0e5;
  s.consist = {block};
  s.initial.speed = 16.0;
  s.initial.yaw_rate = 0.2;
  return s;
}

/// On rails that yield.
inputs::Scenario short_accident(int cars) {
  inputs::Scenario s = short_train(cars);
  s.ground.on_track_law = inputs::OnTrackLaw::rails;
  s.brakes.law = inputs::BrakeLaw::air;
  s.solver.method = inputs::Method::semi_implicit;
  s.solver.fixed_step = 0.002;
  return s;
}

const std::vector<std::string> kBodies{"tank_car", "hopper", "boxcar", "locomotive", "car"};

inputs::Scenario train_of_all_bodies() {
  inputs::Scenario s = short_train(1);
  const inputs::CarBlock block = s.consist[0];
  s.consist.clear();
  for (const std::string& body : kBodies) {
    s.consist.push_back(block);
    s.consist.back().name = body;
  }
  return s;
}

/// A scene, and somebody who has heard of it from the beginning.
struct Watched {
  explicit Watched(const inputs::Scenario& scenario, double interval = 0.02)
      : simulation(scenario), scene(simulation.scenario(), simulation.cars(), Frames(), interval) {
    shown.receive(scene.whole_on_empty());
  }
  void show(const simulation::Snapshot& now, const std::vector<outcome::FirstTouch>& touches = {}) {
    scene.update(now, touches);
    const visualization_msgs::MarkerArray changes = scene.take_changes(true);
    test::expect_valid(changes, "map");
    sent = changes.markers.size();
    shown.receive(changes);
    Shown whole;
    whole.receive(scene.whole());
    EXPECT_TRUE(shown == whole) << "who has heard every change sees what a newcomer sees";
  }
  simulation::Simulation simulation;
  MarkerScene scene;
  Shown shown;
  std::size_t sent = 0;
};

constexpr double kRoof = 4.2;
model::Car car_of(const std::string& body, double length) {
  return {body, 6e4, 6e5, 1e6, length, 0.6 * length, 3.0, 2.0, 1.1, kRoof};
}

TEST(CarShape, FitsTheFootprintAndFacesUp) {
  for (const std::string& body : kBodies) {
    for (const double length : {1.0, 12.0, 24.0}) {
      const CarShape shape = car_shape(car_of(body, length));
      ASSERT_GT(shape.body.size(), 0U);
      EXPECT_EQ(shape.body.size() % 3, 0U);
      EXPECT_EQ(shape.dark.size() % 3, 0U);
      double reach = 0.0, side = 0.0, top = 0.0;
      for (const auto& p : shape.body) {
        reach = std::max(reach, std::abs(p.x));
        side = std::max(side, std::abs(p.y));
        top = std::max(top, p.z);
      }
      EXPECT_LE(reach, 0.5 * length + 1e-9) << body;
      EXPECT_GE(reach, 0.9 * 0.5 * length) << body;
      EXPECT_LE(side, 1.5 + 1e-9) << body;
      EXPECT_GE(side, 0.9 * 1.5) << body;
      EXPECT_NEAR(top, kRoof, 1e-9) << body;
      // RViz lights a face from the side that its corners run round counter-clockwise.
      for (const Points* points : {&shape.body, &shape.dark}) {
        for (std::size_t i = 0; i < points->size(); i += 3) {
          const auto &a = (*points)[i], &b = (*points)[i + 1], &c = (*points)[i + 2];
          const Eigen::Vector3d n = Eigen::Vector3d(b.x - a.x, b.y - a.y, b.z - a.z)
                                        .cross(Eigen::Vector3d(c.x - a.x, c.y - a.y, c.z - a.z))
                                        .normalized();
          if (a.z + b.z + c.z > 3.0 * 2.8 && std::abs(n.z()) > 0.6) {
            EXPECT_GT(n.z(), 0.0) << body << ", corner " << i;
          }
        }
      }
    }
  }
}

TEST(CarShape, TellsTheNamesApart) {
  const auto corners = [](const std::string& body) {
    std::vector<double> all;
    for (const Point& p : car_shape(car_of(body, 18.0)).body) all.insert(all.end(), {p.x, p.y, p.z});
    return all;
  };
  std::set<std::vector<double>> bodies;
  for (const std::string& body : kBodies) {
    EXPECT_TRUE(bodies.insert(corners(body)).second) << body << " looks like another one";
  }
  EXPECT_EQ(corners("caboose"), corners("car"));
}

TEST(MarkerScene, DrawsCarsWhereTheirFramesAre) {
  inputs::Scenario in_space = short_accident(40);
  in_space.model = inputs::Model::spatial;
  const auto layers_of = [](const inputs::Scenario& scenario) {
    const Watched watched(scenario);
    std::vector<double> layers(static_cast<std::size_t>(scenario.consist[0].count), kRoof);
    for (const Marker& m : watched.scene.whole().markers) {
      if (m.ns == "cars") layers[static_cast<std::size_t>(m.id) - 1] = m.pose.position.z;
    }
    return layers;
  };
  for (const double height : layers_of(in_space)) EXPECT_EQ(height, 0.0);
  // Where bodies may lie across each other, those near by in the train are millimetres apart.
  const std::vector<double> layers = layers_of(short_train(40));
  for (std::size_t i = 0; i < layers.size(); ++i) {
    EXPECT_LT(layers[i], 0.05);
    for (std::size_t k = i + 1; k < std::min(i + 8, layers.size()); ++k)
      EXPECT_GE(std::abs(layers[i] - layers[k]), 0.003 - 1e-12);
  }
}

TEST(MarkerScene, IsValidFromStartToEndAndNewcomersSeeTheSame) {
  for (const inputs::Scenario& scenario :
       {short_train(1), short_train(12), train_of_all_bodies(), short_accident(12)}) {
    Watched watched(scenario);
    for (double t = 0.0; t <= 4.0; t += 0.25) {
      watched.simulation.advance(t);
      watched.show(watched.simulation.snapshot(), watched.simulation.touches());
      EXPECT_EQ(watched.shown.count("cars"), watched.simulation.cars().size());
    }
    test::expect_valid(watched.scene.whole_on_empty(), "map");
    EXPECT_EQ(watched.scene.whole_on_empty().markers.front().action, Marker::DELETEALL);
  }
}

TEST(MarkerScene, SendsNothingWhereNothingChanges) {
  Watched watched(short_accident(6));
  simulation::Snapshot now = watched.simulation.snapshot();
  watched.show(now);
  for (simulation::CarSnapshot& car : now.cars) car.x += 100.0;
  watched.show(now);
  EXPECT_EQ(watched.sent, 0U) << "a car that only moves is moved by tf";
  now.cars[2].cause = model::Cause::lateral;
  watched.show(now);
  EXPECT_EQ(watched.sent, 2U) << "body and parts of one car";
  now.couplers[3].axial_force = 3.0e6;
  watched.show(now);
  EXPECT_EQ(watched.sent, 2U) << "an arrow on either side";
  now.couplers[3].axial_force = 3.1e6;
  watched.show(now);
  EXPECT_EQ(watched.sent, 0U) << "the same class of force";
  // A moment that is earlier takes everything back.
  now.cars[2].cause = model::Cause::none;
  now.couplers[3].axial_force = 0.0;
  now.time = -1.0;
  watched.show(now);
  EXPECT_EQ(watched.sent, 4U);
  EXPECT_EQ(watched.shown.count("couplers_front") + watched.shown.count("couplers_rear"), 0U);
}

TEST(MarkerScene, ForcesWaitATenthOfASecondUnlessAllIsAskedFor) {
  Watched watched(short_accident(3));
  simulation::Snapshot now = watched.simulation.snapshot();
  watched.show(now);
  const auto changes_at = [&](double time, double force, bool all) {
    now.time = time;
    now.couplers[0].axial_force = force;
    watched.scene.update(now, {});
    return watched.scene.take_changes(all).markers.size();
  };
  EXPECT_EQ(changes_at(1.00, 1.0e6, false), 2U);
  EXPECT_EQ(changes_at(1.02, 3.0e6, false), 0U);
  EXPECT_EQ(changes_at(1.10, 3.0e6, false), 2U);
  EXPECT_EQ(changes_at(1.12, 1.0e6, true), 2U);
  // At the limit of a class, force that goes up and down a little does not change the arrow.
  EXPECT_EQ(changes_at(1.8, 1.05 * kForceSteps[2], true), 0U);
  EXPECT_EQ(changes_at(2.0, 1.15 * kForceSteps[2], true), 2U);
  EXPECT_EQ(changes_at(2.2, 0.95 * kForceSteps[2], true), 0U);
  EXPECT_EQ(changes_at(2.4, 0.85 * kForceSteps[2], true), 2U);
}

TEST(MarkerScene, ABodyLiesInItsCarsFrameWithItsColourBarsAndNumber) {
  Watched watched(train_of_all_bodies());
  simulation::Snapshot now = watched.simulation.snapshot();
  now.cars[0].past_pod = now.cars[1].past_pod = true;
  now.cars[2].past_pod = now.cars[3].past_pod = now.cars[4].past_pod = now.cars[4].off_track = false;
  now.cars[2].off_track = now.cars[3].off_track = true;
  watched.show(now);
  const std::array<Look, 5> looks{Look::past_point, Look::past_point, Look::off_track, Look::off_track, Look::on_track};
  std::array<std::size_t, 5> parts{};
  for (std::size_t i = 0; i < 5; ++i) {
    const Marker* body = watched.shown.find("cars", static_cast<int>(i) + 1);
    const Marker* dark = watched.shown.find("car_parts", static_cast<int>(i) + 1);
    ASSERT_TRUE(body && dark);
    EXPECT_EQ(body->header.frame_id, Frames().car(static_cast<int>(i) + 1));
    const Rgb wanted = facts_of(looks[i]).colour;
    EXPECT_NEAR(body->color.r, wanted.r / 255.0, 1e-6);
    EXPECT_NEAR(body->color.g, wanted.g / 255.0, 1e-6);
    EXPECT_NEAR(body->color.b, wanted.b / 255.0, 1e-6);
    parts[i] = dark->points.size();
  }
  // Each bar is a rectangle on either end of the roof.
  for (simulation::CarSnapshot& car : now.cars) car.past_pod = car.off_track = false;
  watched.show(now);
  for (std::size_t i = 0; i < 5; ++i) {
    const std::size_t plain = watched.shown.find("car_parts", static_cast<int>(i) + 1)->points.size();
    EXPECT_EQ(parts[i] - plain, static_cast<std::size_t>(12 * facts_of(looks[i]).bars)) << i;
  }
}

TEST(MarkerScene, BodiesShowWhatDerailedThem) {
  Watched watched(short_accident(4));
  simulation::Snapshot now = watched.simulation.snapshot();
  const std::array<model::Cause, 4> causes{model::Cause::pod, model::Cause::lateral, model::Cause::torn_track,
                                           model::Cause::none};
  const std::array<Look, 4> looks{Look::at_point, Look::by_lateral, Look::by_torn_track, Look::on_track};
  for (std::size_t i = 0; i < 4; ++i) {
    now.cars[i].cause = causes[i];
    now.cars[i].derailed = causes[i] != model::Cause::none;
  }
  now.cars[3].past_pod = true;  // stands on the rails all the same
  watched.show(now);
  for (std::size_t i = 0; i < 4; ++i) {
    const Rgb wanted = facts_of(looks[i]).colour;
    EXPECT_NEAR(watched.shown.find("cars", static_cast<int>(i) + 1)->color.r, wanted.r / 255.0, 1e-6) << i;
    EXPECT_NEAR(watched.shown.find("cars", static_cast<int>(i) + 1)->color.b, wanted.b / 255.0, 1e-6) << i;
  }
}

TEST(MarkerScene, BodiesShowHowTheyLieIfThatIsAsked) {
  Watched watched(short_accident(4));
  simulation::Snapshot now = watched.simulation.snapshot();
  const std::array<double, 4> tilts{0.0, 0.5, 1.6, 3.0};  // rad
  const std::array<Lie, 4> lies{Lie::upright, Lie::leaning, Lie::on_side, Lie::inverted};
  for (std::size_t i = 0; i < 4; ++i) {
    now.cars[i].qx = std::sin(0.5 * tilts[i]);
    now.cars[i].qw = std::cos(0.5 * tilts[i]);
    now.cars[i].cause = model::Cause::pod;
  }
  const auto expect_colours = [&](const auto& wanted) {
    for (std::size_t i = 0; i < 4; ++i) {
      const Marker* body = watched.shown.find("cars", static_cast<int>(i) + 1);
      ASSERT_TRUE(body);
      EXPECT_NEAR(body->color.r, wanted[i].colour.r / 255.0, 1e-6) << i;
      EXPECT_NEAR(body->color.b, wanted[i].colour.b / 255.0, 1e-6) << i;
    }
  };
  const std::vector<LookFacts> by_cause(4, facts_of(Look::at_point));
  std::vector<LookFacts> by_posture;
  for (const Lie lie : lies) by_posture.push_back(facts_of(lie));
  watched.show(now);
  expect_colours(by_cause);
  watched.scene.colour_by(Colours::posture);
  watched.show(now);
  expect_colours(by_posture);
  EXPECT_EQ(watched.sent, 8U);  // bodies, and the bars on them
  watched.scene.colour_by(Colours::cause);
  watched.show(now);
  expect_colours(by_cause);
}

TEST(MarkerScene, ArrowsPressOnACouplerInBuffAndLeaveItInDraft) {
  Watched watched(short_train(3));
  simulation::Snapshot now = watched.simulation.snapshot();
  now.couplers[0].axial_force = 1.0e6;
  now.couplers[1].axial_force = -4.0e6;
  watched.show(now);
  EXPECT_EQ(watched.shown.count("couplers_rear"), 2U);
  EXPECT_EQ(watched.shown.count("couplers_front"), 2U);
  const auto tip = [](const Marker& m) {  // an arrow of RViz begins at its pose and points along x
    const double heading = m.pose.orientation.w * m.pose.orientation.w > 0.5 ? 1.0 : -1.0;
    return std::pair(m.pose.position.x, m.pose.position.x + heading * m.scale.x);
  };
  const double half = 0.5 * watched.simulation.cars()[0].length;
  const Marker* rear = watched.shown.find("couplers_rear", 1);
  const Marker* front = watched.shown.find("couplers_front", 2);
  ASSERT_TRUE(rear && front);
  EXPECT_NEAR(tip(*rear).second, -half, 1e-9) << "buff: the tip is at the rear end of the car ahead";
  EXPECT_GT(tip(*rear).first, -half);
  EXPECT_NEAR(tip(*front).second, half, 1e-9);
  EXPECT_GT(rear->color.r, rear->color.b) << "buff is red";
  rear = watched.shown.find("couplers_rear", 2);
  front = watched.shown.find("couplers_front", 3);
  ASSERT_TRUE(rear && front);
  EXPECT_NEAR(tip(*rear).first, -half, 1e-9) << "draft: the tail is there";
  EXPECT_GT(tip(*rear).second, -half);
  EXPECT_NEAR(tip(*front).first, half, 1e-9);
  EXPECT_LT(tip(*front).second, half);
  EXPECT_GT(rear->color.b, rear->color.r) << "draft is blue";
  EXPECT_GT(rear->scale.x, watched.shown.find("couplers_rear", 1)->scale.x) << "the stronger, the longer";
}

TEST(MarkerScene, ABrokenCouplerHasNoArrowsAndMarksBothEnds) {
  Watched watched(short_accident(4));
  simulation::Snapshot now = watched.simulation.snapshot();
  for (simulation::CouplerSnapshot& c : now.couplers) c.axial_force = 1.0e6;
  watched.show(now);
  const std::size_t before = watched.shown.find("car_parts", 2)->points.size();
  now.couplers[1].broken = true;
  watched.show(now);
  EXPECT_EQ(watched.shown.count("couplers_front"), 2U);
  EXPECT_EQ(watched.shown.count("couplers_rear"), 2U);
  EXPECT_FALSE(watched.shown.find("couplers_rear", 2));
  EXPECT_FALSE(watched.shown.find("couplers_front", 3));
  EXPECT_EQ(watched.shown.find("car_parts", 2)->points.size(), before + 6U);
  EXPECT_EQ(watched.shown.find("car_parts", 3)->points.size(), before + 6U);
  EXPECT_LT(watched.shown.find("car_parts", 2)->points.back().x, 0.0) << "at the rear of the car ahead";
  EXPECT_GT(watched.shown.find("car_parts", 3)->points.back().x, 0.0) << "at the front of the car behind";
}

const Marker* find(const visualization_msgs::MarkerArray& array, const std::string& ns, int id) {
  for (const Marker& m : array.markers) {
    if (m.ns == ns && m.id == id && m.action == Marker::ADD) return &m;
  }
  return nullptr;
}

TEST(TrackMarkers, FollowTheCurvesToScale) {
  inputs::Scenario scenario = short_accident(12);
  scenario.track.curves = {{-150.0, 100.0, -1.0 / 300.0}, {20.0, 60.0, 1.0 / 200.0}};
  const std::vector<model::Car> cars = model::expand(scenario.consist);
  const visualization_msgs::MarkerArray array = track_markers(scenario, cars, "map");
  test::expect_valid(array, "map");
  EXPECT_EQ(array.markers.front().action, Marker::DELETEALL);
  const model::Track track(scenario, -400.0, 400.0);
  const Marker *rails = find(array, "track", 2), *ties = find(array, "track", 1);
  ASSERT_TRUE(rails && ties);
  double first = 1e9, last = -1e9;
  std::set<int> sides;
  for (const auto& p : rails->points) {
    const Eigen::Vector2d place(p.x, p.y);
    const double s = track.foot(place, p.x);
    const double off = (place - track.at(s).point).norm();
    EXPECT_NEAR(off, 0.5 * 1.435, 0.1) << "at " << s << " m";
    const Eigen::Vector2d t = track.at(s).tangent;
    sides.insert(t.x() * (place - track.at(s).point).y() - t.y() * (place - track.at(s).point).x() > 0.0 ? 1 : -1);
    first = std::min(first, s);
    last = std::max(last, s);
  }
  EXPECT_EQ(sides.size(), 2U);
  EXPECT_LT(first, -12 * 18.0);
  EXPECT_GT(last, 100.0);
  // A tie is a rectangle of two triangles, half a metre from the next.
  ASSERT_GT(ties->points.size(), 12U);
  const double step = track.foot({ties->points[6].x, ties->points[6].y}, ties->points[6].x) -
                      track.foot({ties->points[0].x, ties->points[0].y}, ties->points[0].x);
  EXPECT_NEAR(step, 0.5, 0.01);
}

TEST(TrackMarkers, ARulerCountsMetresOnTheLeftAndFeetOnTheRight) {
  const inputs::Scenario scenario = short_train(30);
  const std::vector<model::Car> cars = model::expand(scenario.consist);
  const visualization_msgs::MarkerArray array = track_markers(scenario, cars, "map");
  const Marker* ruler = find(array, "ruler", 0);
  ASSERT_TRUE(ruler);
  // Lines are the rectangles that reach from the ballast to 45 m.
  std::vector<double> left, right;
  for (std::size_t i = 0; i + 5 < ruler->points.size(); i += 6) {
    double low = 1e9, high = -1e9, x = 0.0;
    for (std::size_t k = i; k < i + 6; ++k) {
      low = std::min(low, ruler->points[k].y);
      high = std::max(high, ruler->points[k].y);
      x += ruler->points[k].x / 6.0;
    }
    if (high - low < 30.0) continue;
    (low > 0.0 ? left : right).push_back(x);
  }
  ASSERT_GT(left.size(), 5U);
  ASSERT_GT(right.size(), 5U);
  for (std::size_t i = 1; i < left.size(); ++i) EXPECT_NEAR(left[i] - left[i - 1], 50.0, 1e-6);
  for (std::size_t i = 1; i < right.size(); ++i) EXPECT_NEAR(right[i] - right[i - 1], 30.48, 1e-6);
  EXPECT_NEAR(std::remainder(left[0], 50.0), 0.0, 1e-6) << "from the point of derailment";
  EXPECT_NEAR(std::remainder(right[0], 30.48), 0.0, 1e-6);
}

outcome::FirstTouch touch_at(double time, double speed, int car = 1) {
  return {speed, speed, car, car + 1, time, 10.0 * speed, 3.0};
}

TEST(MarkerScene, TouchesFlashForASecondOfSimulatedTimeAndFade) {
  Watched watched(short_train(4));
  simulation::Snapshot now = watched.simulation.snapshot();
  const std::vector<outcome::FirstTouch> touches{touch_at(0.5, 4.0, 1), touch_at(2.0, 5.0, 2), touch_at(2.1, 0.2, 3)};
  const auto show_at = [&](double time) {
    now.time = time;
    watched.show(now, touches);
  };
  const auto texts = [&] {
    std::vector<Marker> all;
    for (const auto& [key, m] : watched.shown.all()) {
      if (key.first == "touches" && m.type == Marker::TEXT_VIEW_FACING) all.push_back(m);
    }
    return all;
  };
  const auto star_at = [&](double x) -> double {
    for (const auto& [key, m] : watched.shown.all()) {
      if (key.first != "touches" || m.type != Marker::TRIANGLE_LIST || std::abs(m.pose.position.x - x) > 1e-9) continue;
      double size = 0.0;
      for (const auto& p : m.points) size = std::max(size, std::hypot(p.x, p.y));
      return size;
    }
    return 0.0;
  };
  show_at(2.1);
  ASSERT_EQ(texts().size(), 1U) << "the slow one has no text";
  EXPECT_EQ(texts()[0].text, "11.2 mph (5.0 m/s)");
  EXPECT_EQ(texts()[0].pose.position.x, 50.0);
  const float fresh = texts()[0].color.a;
  const double size = star_at(50.0);
  EXPECT_GT(size, star_at(2.0)) << "the faster the larger";
  EXPECT_GT(star_at(2.0), 0.0);
  show_at(2.9);
  ASSERT_EQ(texts().size(), 1U);
  EXPECT_LT(texts()[0].color.a, fresh) << "fades";
  EXPECT_LT(star_at(50.0), size);
  show_at(2.9);
  EXPECT_EQ(watched.sent, 0U) << "stays as long as time stands";
  show_at(3.05);
  EXPECT_TRUE(texts().empty());
  EXPECT_GT(star_at(2.0), 0.0) << "the later one is still there";
  show_at(3.1);
  EXPECT_EQ(watched.shown.count("touches"), 0U);
  show_at(2.5);
  EXPECT_EQ(texts().size(), 1U) << "and again when the moment is shown again";

  // Arrays that are farther apart than a second still show each touch once.
  Watched coarse(short_train(4), 4.0);
  now.time = 4.0;
  coarse.show(now, touches);
  EXPECT_GT(coarse.shown.count("touches"), 2U);
  now.time = 8.0;
  coarse.show(now, touches);
  EXPECT_EQ(coarse.shown.count("touches"), 0U);
}

TEST(MarkerScene, TellsTheFastestOfManyTouchesWhereTheyDoNotCoverEachOther) {
  Watched watched(short_train(60));
  simulation::Snapshot now = watched.simulation.snapshot();
  now.time = 1.0;
  std::vector<outcome::FirstTouch> touches;
  for (int i = 0; i < 40; ++i) touches.push_back(touch_at(0.5 + 0.01 * i, 2.0 + (i * 7) % 40, i + 1));
  watched.show(now, touches);
  std::vector<Marker> texts;
  for (const auto& [key, m] : watched.shown.all()) {
    if (key.first == "touches" && m.type == Marker::TEXT_VIEW_FACING) texts.push_back(m);
  }
  ASSERT_FALSE(texts.empty());
  EXPECT_LE(texts.size(), 6U);
  double fastest = 0.0;
  for (std::size_t i = 0; i < texts.size(); ++i) {
    fastest = std::max(fastest, texts[i].pose.position.x / 10.0);
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_GT(std::abs(texts[i].pose.position.x - texts[k].pose.position.x), 20.0);
    }
  }
  EXPECT_NEAR(fastest, 41.0, 1e-9);
  EXPECT_EQ(watched.shown.count("touches"), 40U + texts.size());
}

// Colours as those see them who lack one of the three kinds of cones: Machado, Oliveira and Fernandes (2009), severity
// 1, on linear RGB. Distances in CIE L*a*b* (D65): 10 and more is told apart at a glance.
using Matrix = std::array<std::array<double, 3>, 3>;
constexpr Matrix kNormal{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
constexpr Matrix kProtan{
    {{0.152286, 1.052583, -0.204868}, {0.114503, 0.786281, 0.099216}, {-0.003882, -0.048116, 1.051998}}};
constexpr Matrix kDeutan{
    {{0.367322, 0.860646, -0.227968}, {0.280085, 0.672501, 0.047413}, {-0.011820, 0.042940, 0.968881}}};
constexpr Matrix kTritan{
    {{1.255528, -0.076749, -0.178779}, {-0.078411, 0.930809, 0.147602}, {0.004733, 0.691367, 0.303900}}};

Eigen::Vector3d lab(Rgb rgb, const Matrix& sight) {
  const auto linear = [](double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); };
  const std::array<double, 3> in{linear(rgb.r / 255.0), linear(rgb.g / 255.0), linear(rgb.b / 255.0)};
  std::array<double, 3> c{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) c[i] += sight[i][k] * in[k];
    c[i] = std::clamp(c[i], 0.0, 1.0);
  }
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116.0; };
  const double x = f((0.4124 * c[0] + 0.3576 * c[1] + 0.1805 * c[2]) / 0.95047);
  const double y = f(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
  const double z = f((0.0193 * c[0] + 0.1192 * c[1] + 0.9505 * c[2]) / 1.08883);
  return {116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)};
}

TEST(Palette, CanBeToldApartByTheColourBlind) {
  const std::array<std::pair<const char*, const Matrix*>, 4> sights{
      {{"normal", &kNormal}, {"protan", &kProtan}, {"deutan", &kDeutan}, {"tritan", &kTritan}}};
  // Looks that are never together (rails that yield or not) may share a colour.
  const std::vector<std::vector<Look>> together{
      {Look::on_track, Look::past_point, Look::off_track},
      {Look::on_track, Look::at_point, Look::by_lateral, Look::by_torn_track}};
  for (const auto& [name, sight] : sights) {
    for (const auto& looks : together) {
      for (std::size_t i = 0; i < looks.size(); ++i) {
        for (std::size_t k = 0; k < i; ++k) {
          const double distance =
              (lab(facts_of(looks[i]).colour, *sight) - lab(facts_of(looks[k]).colour, *sight)).norm();
          EXPECT_GT(distance, 20.0) << name << ": " << facts_of(looks[i]).words << ", " << facts_of(looks[k]).words;
          EXPECT_NE(facts_of(looks[i]).bars, facts_of(looks[k]).bars);
        }
      }
    }
    for (int k = -kForceClasses; k < kForceClasses; ++k) {
      EXPECT_GT((lab(force_colour(k), *sight) - lab(force_colour(k + 1), *sight)).norm(), 6.0) << name << ", " << k;
    }
    for (int k = 2; k <= kForceClasses; ++k) {
      EXPECT_GT((lab(force_colour(k), *sight) - lab(force_colour(-k), *sight)).norm(), 20.0)
          << name << ": buff and draft of class " << k;
    }
  }
}

TEST(Palette, ForceClassesBeginAtTheirSteps) {
  EXPECT_EQ(force_class(0.0), 0);
  for (std::size_t i = 0; i < kForceSteps.size(); ++i) {
    EXPECT_EQ(force_class(kForceSteps[i]), static_cast<int>(i) + 1);
    EXPECT_EQ(force_class(0.999 * kForceSteps[i]), static_cast<int>(i));
    EXPECT_EQ(force_class(-kForceSteps[i]), -static_cast<int>(i) - 1);
  }
}

}  // namespace
}  // namespace train_derail::ros_face

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
