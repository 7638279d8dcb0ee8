// What RViz is shown: shapes of cars, markers and their legend.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "marker_check.hpp"
#include "train_derail/model/track.hpp"
#include "train_derail/ros/car_shape.hpp"
#include "train_derail/ros/marker_scene.hpp"

namespace train_derail::ros_face {
namespace {

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

using visualization_msgs::Marker;

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

/// The marker with this key if it is shown.
const Marker* shown(const MarkerScene& scene, const std::string& ns, int id) {
  for (const Marker& m : scene.markers().markers) {
    if (m.ns == ns && m.id == id && m.action == Marker::ADD) return &m;
  }
  return nullptr;
}

double grey(const std_msgs::ColorRGBA& c) { return 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b; }

model::Car car_of(const std::string& body, double length) { return {body, 6e4, 6e5, 1e6, length, 0.6 * length, 3.0}; }

TEST(CarShape, FitsTheFootprintAndFacesUp) {
  for (const std::string& body : kBodies) {
    for (const double length : {1.0, 12.0, 24.0}) {
      const CarShape shape = car_shape(car_of(body, length));
      ASSERT_GT(shape.body.size(), 0U);
      EXPECT_EQ(shape.body.size() % 3, 0U);
      EXPECT_EQ(shape.dark.size() % 3, 0U);
      EXPECT_EQ(shape.edges.size() % 2, 0U);
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
      EXPECT_NEAR(top, kRoofHeight, 1e-9) << body;
      for (std::size_t i = 0; i < 8; ++i) {
        EXPECT_NEAR(std::abs(shape.edges[i].x), 0.5 * length, 1e-9) << body;
        EXPECT_NEAR(std::abs(shape.edges[i].y), 1.5, 1e-9) << body;
      }
      // RViz lights a face from the side that its corners run round counter-clockwise.
      for (std::size_t i = 0; i < shape.body.size(); i += 3) {
        const auto &a = shape.body[i], &b = shape.body[i + 1], &c = shape.body[i + 2];
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

TEST(CarShape, TellsTheNamesApart) {
  std::set<std::vector<double>> bodies;
  for (const std::string& body : kBodies) {
    std::vector<double> all;
    for (const auto& p : car_shape(car_of(body, 18.0)).body) all.insert(all.end(), {p.x, p.y, p.z});
    EXPECT_TRUE(bodies.insert(all).second) << body << " looks like another one";
    EXPECT_LT(all.size() / 3, 200U) << body << ": a thousand cars are sent fifty times a second";
  }
  const CarShape other = car_shape(car_of("caboose", 18.0)), plain = car_shape(car_of("car", 18.0));
  EXPECT_EQ(other.body, plain.body);
}

TEST(MarkerScene, IsValidFromStartToEnd) {
  for (const inputs::Scenario& scenario :
       {short_train(1), short_train(12), train_of_all_bodies(), short_accident(12)}) {
    simulation::Simulation simulation(scenario);
    MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
    for (double t = 0.0; t <= 4.0; t += 0.5) {
      simulation.advance(t);
      scene.update(simulation.snapshot(), simulation.outcome(), simulation.touches(), 0.0, 0.0, ros::Time(1.0 + t));
      test::expect_valid(scene.markers(), "map");
      test::expect_valid(scene.markers_on_empty(), "map");
      EXPECT_EQ(scene.markers_on_empty().markers.front().action, Marker::DELETEALL);
    }
  }
}

TEST(MarkerScene, EveryCarIsWhereItIsInTheColourOfItsState) {
  simulation::Simulation simulation(train_of_all_bodies());
  simulation.advance(1.5);
  simulation::Snapshot now = simulation.snapshot();
  now.cars[0].past_pod = now.cars[1].past_pod = true;
  now.cars[2].past_pod = now.cars[3].past_pod = now.cars[4].past_pod = now.cars[4].off_track = false;
  now.cars[2].off_track = now.cars[3].off_track = true;
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  scene.update(now, simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
  const Marker *edges = shown(scene, "cars_outline", 0), *past_pod = shown(scene, "cars_past_pod", 0),
               *off_track = shown(scene, "cars_off_track", 0), *on_track = shown(scene, "cars_on_track", 0);
  ASSERT_TRUE(edges && past_pod && off_track && on_track);
  std::vector<std::size_t> size;
  std::size_t edge = 0;
  for (std::size_t i = 0; i < now.cars.size(); ++i) {
    const CarShape shape = car_shape(simulation.cars()[i]);
    double x = 0.0, y = 0.0;
    for (std::size_t k = 0; k < 8; ++k) {
      x += edges->points.at(edge + k).x / 8.0;
      y += edges->points.at(edge + k).y / 8.0;
    }
    EXPECT_NEAR(x, now.cars[i].x, 1e-9);
    EXPECT_NEAR(y, now.cars[i].y, 1e-9);
    edge += shape.edges.size();
    size.push_back(shape.body.size());
  }
  EXPECT_EQ(past_pod->points.size(), size[0] + size[1]);
  EXPECT_EQ(off_track->points.size(), size[2] + size[3]);
  EXPECT_EQ(on_track->points.size(), size[4]);
  for (const Marker* m : {past_pod, off_track, on_track}) EXPECT_TRUE(m->colors.empty()) << "unlit in RViz";
  // Printed in grey the states are still three.
  EXPECT_GT(grey(past_pod->color), grey(on_track->color) + 0.15);
  EXPECT_GT(grey(off_track->color), grey(past_pod->color) + 0.15);
}

TEST(MarkerScene, CouplersShowTheirForceByColourAndByArrows) {
  simulation::Simulation simulation(short_train(4));
  simulation::Snapshot now = simulation.snapshot();
  now.couplers[0].axial_force = 1.0e6;
  now.couplers[1].axial_force = -1.0e6;
  now.couplers[2].axial_force = 0.0;
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  scene.update(now, simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
  const Marker *couplers = shown(scene, "couplers", 0), *arrows = shown(scene, "coupler_arrows", 0),
               *bars = shown(scene, "coupler_force_bars", 1);
  ASSERT_TRUE(couplers && arrows && bars);
  ASSERT_EQ(couplers->points.size(), 6U);
  ASSERT_EQ(arrows->points.size(), 12U) << "none without force";
  for (const Marker* m : {couplers, arrows, bars}) {
    const std::size_t each = m == arrows ? 6 : 2;
    EXPECT_GT(m->colors[0].r, m->colors[0].b) << m->ns << ": buff is red";
    EXPECT_GT(m->colors[each].b, m->colors[each].r) << m->ns << ": draft is blue";
    if (m != arrows) {
      EXPECT_NEAR(m->colors[4].r, m->colors[4].b, 1e-6) << m->ns << ": neutral is grey";
    }
  }
  EXPECT_GT(bars->points[1].y, bars->points[0].y);
  EXPECT_LT(bars->points[3].y, bars->points[2].y);
  for (std::size_t i = 0; i < 2; ++i) {
    const double middle = 0.5 * (couplers->points[2 * i].x + couplers->points[2 * i + 1].x);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto* corner = &arrows->points[6 * i + 3 * k];
      const double tip = std::abs(corner[0].x - middle), base = std::abs(corner[1].x - middle);
      EXPECT_EQ(tip < base, i == 0) << "arrows press on the coupler in buff and leave it in draft";
      EXPECT_EQ(corner[1].x, corner[2].x);
    }
  }
}

TEST(MarkerScene, LegendsSayWhatTheColoursMean) {
  simulation::Simulation simulation(short_train(12));
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  const auto places_at = [&](double x, double y) {
    scene.update(simulation.snapshot(), simulation.outcome(), {}, x, y, ros::Time(1.0));
    std::vector<geometry_msgs::Point> places;
    for (const Marker& m : scene.markers().markers) {
      if (m.ns == "legend_near") places.push_back(m.pose.position);
    }
    return places;
  };
  const auto before = places_at(0.0, 0.0), after = places_at(100.0, 7.0);
  ASSERT_EQ(before.size(), after.size());
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_NEAR(after[i].x - before[i].x, 100.0, 1e-9);
    EXPECT_NEAR(after[i].y - before[i].y, 7.0, 1e-9);
  }
  for (const std::string ns : {"legend", "legend_near"}) {
    std::map<std::string, geometry_msgs::Point> words;
    const Marker* swatches = nullptr;
    for (const Marker& m : scene.markers().markers) {
      if (m.ns != ns) continue;
      EXPECT_EQ(m.action, Marker::ADD);
      if (m.type == Marker::TEXT_VIEW_FACING) words[m.text.substr(0, m.text.find(' '))] = m.pose.position;
      if (m.type == Marker::TRIANGLE_LIST) swatches = &m;
      if (m.text.find("kip") != std::string::npos) {
        double kip = 0.0, kn = 0.0;
        ASSERT_EQ(std::sscanf(m.text.c_str(), "%lf kip\n%lf kN", &kip, &kn), 2) << m.text;
        EXPECT_NEAR(kip * inputs::kKip, kn * 1000.0, 1000.0);
      }
    }
    ASSERT_TRUE(swatches != nullptr);
    for (const char* word : {"draft", "buff", "0", "on", "off", "past"}) EXPECT_EQ(words.count(word), 1U) << word;
    EXPECT_LT(words["draft"].x, words["0"].x);
    EXPECT_GT(words["buff"].x, words["0"].x);
    // The colour beside a word is that of the thing.
    const auto colour_near = [&](const geometry_msgs::Point& place) {
      double best = 1e9;
      std_msgs::ColorRGBA found;
      for (std::size_t i = 6; i < swatches->points.size(); ++i) {  // after the background
        const double dx = swatches->points[i].x + swatches->pose.position.x - place.x;
        const double dy = swatches->points[i].y + swatches->pose.position.y - place.y;
        if (std::hypot(dx, dy) < best) {
          best = std::hypot(dx, dy);
          found = swatches->colors[i];
        }
      }
      return found;
    };
    const auto draft = colour_near(words["draft"]), buff = colour_near(words["buff"]);
    EXPECT_GT(draft.b, draft.r);
    EXPECT_GT(buff.r, buff.b);
    EXPECT_EQ(colour_near(words["past"]), shown(scene, "cars_past_pod", 0)->color);
    EXPECT_EQ(colour_near(words["on"]), shown(scene, "cars_on_track", 0)->color);
  }
}

TEST(MarkerScene, BodiesShowWhatDerailedThem) {
  simulation::Simulation simulation(short_accident(4));
  simulation::Snapshot now = simulation.snapshot();
  const model::Cause causes[] = {model::Cause::pod, model::Cause::lateral, model::Cause::torn_track,
                                 model::Cause::none};
  const char* const kinds[] = {"cars_derailed_pod", "cars_derailed_lateral", "cars_derailed_torn_track",
                               "cars_on_track"};
  // The words beside the same colours in the legend.
  const char* const words[] = {"at the\npoint", "by lateral\nforce", "on torn\ntrack", "on the\ntrack"};
  for (std::size_t i = 0; i < 4; ++i) {
    now.cars[i].cause = causes[i];
    now.cars[i].derailed = causes[i] != model::Cause::none;
  }
  now.cars[3].past_pod = true;  // stands on the rails all the same
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  outcome::Outcome outcome;
  outcome.cars_derailed = 60;
  outcome.derailed_by = {10, 20, 30};
  scene.update(now, outcome, {}, 0.0, 0.0, ros::Time(1.0));
  test::expect_valid(scene.markers(), "map");
  std::vector<double> greys;
  for (std::size_t i = 0; i < 4; ++i) {
    const Marker* body = shown(scene, kinds[i], 0);
    ASSERT_TRUE(body) << kinds[i];
    EXPECT_EQ(body->points.size(), car_shape(simulation.cars()[i]).body.size()) << kinds[i];
    double x = 0.0;
    for (const auto& p : body->points) x += p.x / static_cast<double>(body->points.size());
    EXPECT_NEAR(x, now.cars[i].x, 0.5) << kinds[i];
    greys.push_back(grey(body->color));

    const Marker *swatches = shown(scene, "legend", 0), *word = nullptr;
    for (const Marker& m : scene.markers().markers) {
      if (m.ns == "legend" && m.text == words[i]) word = &m;
    }
    ASSERT_TRUE(swatches && word) << words[i];
    bool painted = false;
    for (std::size_t k = 6; k < swatches->points.size(); ++k) {
      const double dx = swatches->points[k].x + swatches->pose.position.x - word->pose.position.x;
      const double dy = swatches->points[k].y + swatches->pose.position.y - word->pose.position.y;
      painted = painted || (std::abs(dx) < 3.0 * word->scale.z && dy > 0.0 && dy < 3.0 * word->scale.z &&
                            swatches->colors[k] == body->color);
    }
    EXPECT_TRUE(painted) << words[i];
  }
  EXPECT_FALSE(shown(scene, "cars_past_pod", 0));
  std::sort(greys.begin(), greys.end());
  for (std::size_t i = 1; i < 4; ++i) EXPECT_GT(greys[i], greys[i - 1] + 0.12) << "apart in grey";
  const Marker* status = shown(scene, "status", 0);
  ASSERT_TRUE(status);
  EXPECT_NE(status->text.find("derailed: 60 (point 10, lateral 20, torn 30) of 4"), std::string::npos) << status->text;
  EXPECT_EQ(status->text.find("broken"), std::string::npos) << status->text;
  outcome.couplers_broken = 7;
  outcome.impacts.count = 8;
  scene.update(now, outcome, {}, 0.0, 0.0, ros::Time(1.0));
  EXPECT_NE(shown(scene, "status", 0)->text.find("couplers broken 7, impacts 8"), std::string::npos);
}

TEST(MarkerScene, ABrokenCouplerIsAGapWithoutForce) {
  simulation::Simulation simulation(short_accident(4));
  simulation::Snapshot now = simulation.snapshot();
  for (simulation::CouplerSnapshot& c : now.couplers) c.axial_force = 1.0e6;
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  const auto points = [&](const char* ns, int id) {
    const Marker* m = shown(scene, ns, id);
    return m == nullptr ? std::vector<geometry_msgs::Point>() : m->points;
  };
  scene.update(now, {}, {}, 0.0, 0.0, ros::Time(1.0));
  EXPECT_TRUE(points("couplers_broken", 0).empty());
  now.couplers[1].broken = true;
  scene.update(now, {}, {}, 0.0, 0.0, ros::Time(1.0));
  test::expect_valid(scene.markers(), "map");
  EXPECT_EQ(points("couplers", 0).size(), 4U);
  EXPECT_EQ(points("coupler_force_bars", 1).size(), 4U);
  EXPECT_EQ(points("coupler_arrows", 0).size(), 12U);
  const double lead = now.cars[1].x - 0.5 * simulation.cars()[1].length;
  const double trail = now.cars[2].x + 0.5 * simulation.cars()[2].length;
  const auto broken = points("couplers_broken", 0);
  ASSERT_EQ(broken.size(), 8U);
  for (const auto& p : broken) {
    EXPECT_LE(std::min(std::abs(p.x - lead), std::abs(p.x - trail)), 1.0);
    EXPECT_LE(std::abs(p.y - now.cars[1].y), 1.6);
  }
  for (const auto& p : points("couplers", 0)) EXPECT_FALSE(p.x > trail + 1e-6 && p.x < lead - 1e-6);
}

TEST(MarkerScene, TheTrackIsDrawnAlongItsCurves) {
  inputs::Scenario scenario = short_accident(12);
  scenario.track.curves = {{-150.0, 100.0, -1.0 / 300.0}, {20.0, 60.0, 1.0 / 200.0}};
  simulation::Simulation simulation(scenario);
  MarkerScene scene(scenario, simulation.cars(), "map", 0.02);
  scene.update(simulation.snapshot(), simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
  test::expect_valid(scene.markers(), "map");
  const model::Track track(scenario, -400.0, 400.0);
  const Marker* rails = shown(scene, "track", 1);
  ASSERT_TRUE(rails);
  double last = -1e9, lowest = 0.0;
  for (std::size_t i = 0; i < rails->points.size(); i += 4) {
    for (const std::size_t end : {i, i + 1}) {
      const auto &right = rails->points.at(end), &left = rails->points.at(end + 2);
      EXPECT_NEAR(std::hypot(left.x - right.x, left.y - right.y), 1.435, 1e-9);
      const Eigen::Vector2d middle(0.5 * (left.x + right.x), 0.5 * (left.y + right.y));
      const double s = track.foot(middle, middle.x());
      EXPECT_NEAR((track.at(s).point - middle).norm(), 0.0, 0.02) << "at " << s << " m";
      EXPECT_GE(s, last - 1e-3) << "no gap";
      last = s;
      lowest = std::min(lowest, middle.y());
    }
  }
  EXPECT_GT(last, 100.0);
  EXPECT_LT(lowest, -10.0);
  EXPECT_GT(rails->points.size(), 4U * 16U);
  EXPECT_LT(rails->points.size(), 4U * 40U) << "sent fifty times a second";
  // What is read beside the train keeps clear of it.
  EXPECT_LT(shown(scene, "status", 0)->pose.position.y, lowest - 50.0);
  const auto cars = simulation.snapshot().cars;
  for (const auto& c : cars) EXPECT_GT(shown(scene, "coupler_force_bars", 0)->points.at(0).y, c.y + 50.0);
}

TEST(MarkerScene, WhatIsReadBesideALongTrainIsInTheShippedView) {
  for (const inputs::Scenario& scenario : {short_train(100), short_accident(100)}) {
    simulation::Simulation simulation(scenario);
    MarkerScene scene(scenario, simulation.cars(), "map", 0.02);
    scene.update(simulation.snapshot(), simulation.outcome(), {}, 0.0, 0.0, ros::Time(1.0));
    const Marker *legend = shown(scene, "legend", 0), *status = shown(scene, "status", 0);
    ASSERT_TRUE(legend && status);
    // 1026 by 745 pixels of 1 / 0.85 m, the middle at x = -550 m.
    for (const auto& p : legend->points) {
      EXPECT_LT(std::abs(p.x + legend->pose.position.x + 550.0), 600.0);
      EXPECT_LT(p.y + legend->pose.position.y, 430.0);
    }
    EXPECT_NEAR(status->pose.position.x, -550.0, 100.0);
    EXPECT_LT(status->pose.position.y + 0.5 * 6.0 * 1.2 * status->scale.z, 0.0) << "six lines beside the track";
  }
}

outcome::FirstTouch touch_at(double time, double speed) { return {speed, speed, 1, 2, time, 10.0 * speed, 3.0}; }

TEST(MarkerScene, TouchesFlashForASecondOfSimulatedTime) {
  simulation::Simulation simulation(short_train(2));
  simulation::Snapshot now = simulation.snapshot();
  const std::vector<outcome::FirstTouch> touches{touch_at(0.5, 4.0), touch_at(2.0, 5.0), touch_at(2.1, 0.2)};
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  const auto show_at = [&](MarkerScene& in, double time) {
    now.time = time;
    in.update(now, simulation.outcome(), touches, 0.0, 0.0, ros::Time(10.0 + time));
    test::expect_valid(in.markers(), "map");
  };
  show_at(scene, 2.1);
  ASSERT_TRUE(shown(scene, "touches", 0));
  const Marker star = *shown(scene, "touches", 0);
  ASSERT_TRUE(shown(scene, "touches", 1));
  const Marker text = *shown(scene, "touches", 1);
  EXPECT_EQ(text.text, "11.2 mph (5.0 m/s)");
  EXPECT_EQ(text.pose.position.x, 50.0);
  EXPECT_NEAR(text.pose.position.y, 3.0, 20.0);
  EXPECT_FALSE(shown(scene, "touches", 2)) << "the slow one has no text";
  const auto star_size = [](const Marker& m, double x) {
    double size = 0.0;
    for (const auto& p : m.points) {
      if (std::abs(p.x - x) < 10.0) size = std::max(size, std::abs(p.x - x));
    }
    return size;
  };
  EXPECT_GT(star_size(star, 50.0), star_size(star, 2.0)) << "the faster the larger";

  show_at(scene, 2.9);
  ASSERT_TRUE(shown(scene, "touches", 1));
  EXPECT_LT(shown(scene, "touches", 1)->color.a, text.color.a) << "fades";
  EXPECT_LT(star_size(*shown(scene, "touches", 0), 50.0), star_size(star, 50.0));
  show_at(scene, 2.9);
  EXPECT_TRUE(shown(scene, "touches", 1)) << "stays as long as time stands";
  show_at(scene, 3.05);
  EXPECT_FALSE(shown(scene, "touches", 1));
  EXPECT_TRUE(shown(scene, "touches", 0)) << "the later one is still there";
  show_at(scene, 3.1);
  EXPECT_FALSE(shown(scene, "touches", 0));

  // Arrays that are farther apart than a second still show each touch once.
  MarkerScene coarse(simulation.scenario(), simulation.cars(), "map", 4.0);
  show_at(coarse, 4.0);
  ASSERT_TRUE(shown(coarse, "touches", 2));
  show_at(coarse, 8.0);
  EXPECT_FALSE(shown(coarse, "touches", 0));
}

TEST(MarkerScene, TellsTheFastestOfManyTouches) {
  simulation::Simulation simulation(short_train(2));
  simulation::Snapshot now = simulation.snapshot();
  now.time = 1.0;
  std::vector<outcome::FirstTouch> touches;
  for (int i = 0; i < 40; ++i) touches.push_back(touch_at(0.5 + 0.01 * i, 2.0 + (i * 7) % 40));
  MarkerScene scene(simulation.scenario(), simulation.cars(), "map", 0.02);
  scene.update(now, simulation.outcome(), touches, 0.0, 0.0, ros::Time(1.0));
  std::size_t told = 0;
  for (const Marker& m : scene.markers().markers) {
    if (m.ns != "touches" || m.type != Marker::TEXT_VIEW_FACING || m.action != Marker::ADD) continue;
    ++told;
    EXPECT_GE(m.pose.position.x, 10.0 * 30.0);
  }
  EXPECT_EQ(told, 12U);
}

}  // namespace
}  // namespace train_derail::ros_face

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
