// What is looked at, without RViz, node or master: where the camera stands, what overlay and table of outcomes say.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include <boost/make_shared.hpp>

#include <QApplication>
#include <QImage>
#include <QLabel>
#include <QRegularExpression>

#include "rviz/framing.hpp"
#include "rviz/outcome_table.hpp"
#include "rviz/overlay_content.hpp"
#include "rviz/overlay_painter.hpp"

namespace train_derail::rviz_panel {
namespace {

/// What a box takes of the part of the picture that is free: from 0 to 1, as shares of its width and height.
struct Taken {
  Eigen::Array2d low = Eigen::Array2d::Constant(INFINITY), high = Eigen::Array2d::Constant(-INFINITY);

  Taken(const Box& box, const Camera& camera, const Picture& picture) {
    const Margins& m = picture.margins;
    const Eigen::Array2d before(m.left, m.bottom), free(1.0 - m.left - m.right, 1.0 - m.bottom - m.top);
    for (const auto& corner : corners(box).colwise()) {
      const Eigen::Array2d share = (0.5 + 0.5 * project(camera, picture, corner).array() - before) / free;
      low = low.min(share);
      high = high.max(share);
    }
  }
};

class Framing : public testing::Test {
 protected:
  template <class Use>
  void for_many(const Use& use) {
    for (const double aspect : {0.5, 1.0, 1.35, 1.78, 3.0}) {
      for (const double yaw : {-3.0, -1.75, -M_PI_2, 0.0, 0.3, 1.2}) {
        for (const double pitch : {0.05, 0.22, 0.6, 1.2, M_PI_2}) {
          for (const double length : {18.0, 60.0, 400.0}) {
            for (const double width : {3.0, 40.0, 150.0}) {
              const Box box = heap_box({-120.0, 30.0, 0.0}, 0.7, length, width);
              const Picture picture{0.61, aspect};
              use(box, Direction{yaw, pitch}, picture);
            }
          }
        }
      }
    }
  }
};

TEST_F(Framing, EveryCornerIsInsideTheMarginsAndTheBoxIsAsLargeAsThatAllows) {
  int wide = 0, high = 0;
  for_many([&](const Box& box, const Direction& direction, const Picture& picture) {
    const Camera camera = frame(box, direction, picture);
    ASSERT_GT(camera.distance, 0.0);
    for (const auto& corner : corners(box).colwise()) {
      ASSERT_GT(-(camera.axes.col(2).dot(corner - camera.position())), 0.0) << "behind the camera";
    }
    const Taken taken(box, camera, picture);
    const Eigen::Array2d size = taken.high - taken.low;
    constexpr double kRound = 1e-9;
    EXPECT_TRUE((taken.low > -kRound).all() && (taken.high < 1.0 + kRound).all());
    EXPECT_LT(size.x(), picture.width_share + kRound);
    EXPECT_LT(size.y(), picture.height_share + kRound);
    const bool fills_width = size.x() > picture.width_share - kRound;
    const bool fills_height = size.y() > picture.height_share - kRound;
    EXPECT_TRUE(fills_width || fills_height);
    if (fills_width) {
      EXPECT_NEAR(0.5 * (taken.low.x() + taken.high.x()), 0.5, kRound);
    } else {
      EXPECT_NEAR(0.5 * (taken.low.y() + taken.high.y()), 0.5, kRound);
    }
    wide += fills_width ? 1 : 0;
    high += fills_height ? 1 : 0;
  });
  EXPECT_GT(wide, 100);
  EXPECT_GT(high, 100);
}

TEST_F(Framing, AnOblongHeapSeenFromItsSideFillsTheWidth) {
  for_many([&](const Box& box, const Direction& direction, const Picture& picture) {
    const bool from_the_side = std::abs(std::sin(direction.yaw)) > 0.9 && direction.pitch < 0.7;
    if (!from_the_side || box.length < 3.0 * box.width || picture.aspect < 1.3 || picture.aspect > 2.0) return;
    const Taken taken(box, frame(box, direction, picture), picture);
    EXPECT_NEAR(taken.high.x() - taken.low.x(), picture.width_share, 1e-9);
  });
}

TEST_F(Framing, AShortHeapIsShownAsALongerOne) {
  const Box box = heap_box({0.0, 0.0, 0.0}, 0.0, 10.0, 3.0);
  EXPECT_EQ(box.length, kHeapLengthLeast);
  EXPECT_EQ(heap_box({0.0, 0.0, 0.0}, 0.0, 90.0, 3.0).length, 90.0);
  // A car of 18 m still takes a third of the picture.
  const Picture picture{0.61, 1.5};
  const Camera camera = frame(box, {-M_PI_2, 0.6}, picture);
  const double car = project(camera, picture, {9.0, 0.0, 0.0}).x() - project(camera, picture, {-9.0, 0.0, 0.0}).x();
  EXPECT_GT(0.5 * car, 0.25);
}

TEST_F(Framing, TheCameraIsWhereTheDirectionSays) {
  const Box box = heap_box({5.0, 6.0, 0.0}, M_PI_2, 60.0, 10.0);
  const Picture picture{0.61, 1.5};
  // The track heads along +y; -pi/2 is to its right, hence +x.
  const Camera side = frame(box, {-M_PI_2, 0.0}, picture);
  EXPECT_GT(side.position().x(), 5.0 + 30.0);
  EXPECT_NEAR(side.position().y(), 6.0, 1e-9);
  // Forward is to the right.
  EXPECT_GT(project(side, picture, {5.0, 20.0, 0.0}).x(), 0.0);
  EXPECT_GT(project(side, picture, {5.0, 6.0, 4.0}).y(), project(side, picture, {5.0, 6.0, 0.0}).y());
  const Camera above = frame(box, {-M_PI_2, M_PI_2}, picture);
  EXPECT_NEAR(above.axes(2, 2), 1.0, 1e-12);
  EXPECT_GT(project(above, picture, {5.0, 20.0, 0.0}).x(), 0.0);
  EXPECT_TRUE((side.axes.transpose() * side.axes).isIdentity(1e-12));
}

TEST_F(Framing, BetweenTwoBoxesTheHeadingGoesTheShortWay) {
  const Box a{{0.0, 0.0, 0.0}, 3.0, 10.0, 2.0, 4.0}, b{{10.0, 0.0, 0.0}, -3.0, 20.0, 4.0, 4.0};
  const Box half = between(a, b, 0.5);
  EXPECT_NEAR(std::cos(half.heading), -1.0, 1e-9);
  EXPECT_EQ(half.middle.x(), 5.0);
  EXPECT_EQ(half.length, 15.0);
  const Box all = between(a, b, 1.0);
  EXPECT_NEAR(std::remainder(all.heading - b.heading, 2.0 * M_PI), 0.0, 1e-9);
  EXPECT_EQ(all.width, 4.0);
}

/// A run of four cars at some moment, as a panel's link knows it.
class Overlay : public testing::Test {
 protected:
  Overlay() {
    cars.run_id = outcome.run_id = inputs.run_id = info.run_id = couplers.run_id = pile_up.run_id = 3;
    cars.time = outcome.stop_time = couplers.time = 4.86;
    cars.cars.resize(4);
    for (std::size_t i = 0; i < 4; ++i) {
      cars.cars[i].number = static_cast<std::uint32_t>(i + 1);
      cars.cars[i].pose.position.x = 20.0 - 20.0 * static_cast<double>(i);
    }
    cars.cars[3].twist.linear.x = 10.0;
    couplers.couplers.resize(3);
    inputs.title = "A test";
    inputs.track_heading = std::numeric_limits<double>::quiet_NaN();
    inputs.on_track_law = "rails";
    info.state = RunInfo::RUNNING;
    pile_up.pose.position.x = 20.0;
    pile_up.pose.orientation.w = 1.0;
    pile_up.length = 100.0;
    pile_up.width = 12.0;
  }
  NodeView view() const {
    NodeView v;
    v.present = true;
    v.cars = boost::make_shared<CarStates>(cars);
    v.couplers = boost::make_shared<CouplerForces>(couplers);
    v.outcome = boost::make_shared<Outcome>(outcome);
    v.inputs = boost::make_shared<Inputs>(inputs);
    v.run_info = boost::make_shared<RunInfo>(info);
    v.pile_up = boost::make_shared<PileUp>(pile_up);
    return v;
  }
  std::vector<std::string> statements() const {
    std::vector<std::string> all;
    for (const Statement& s : make_strip(view()).statements) all.push_back(s.text);
    return all;
  }

  CarStates cars;
  CouplerForces couplers;
  Outcome outcome;
  Inputs inputs;
  RunInfo info;
  PileUp pile_up;
};

TEST_F(Overlay, BeforeAnythingHasHappenedItNamesNothingThatHasNot) {
  const Strip strip = make_strip(view());
  EXPECT_EQ(strip.title, "A test");
  EXPECT_EQ(strip.run, "run 3 \u00b7 4.86 s");
  EXPECT_EQ(strip.state, "");
  EXPECT_EQ(statements(), (std::vector<std::string>{"derailed 0 of 4", "last car at 22.4 mph (10.00 m/s)"}));
  EXPECT_TRUE(make_strip(NodeView()).run.empty());
  EXPECT_TRUE(entries_now(NodeView()).empty());
  EXPECT_TRUE(make_map(NodeView()).cars.empty());
}

TEST_F(Overlay, SaysWhatTheRunHasComeTo) {
  cars.cars[0].derailed = cars.cars[1].derailed = true;
  couplers.couplers[1].broken = true;
  outcome.impacts = 31;
  outcome.touches = 5;
  outcome.coupler_draft_peak = 1.0e6;
  outcome.coupler_draft_peak_coupler = 2;
  outcome.coupler_buff_peak = 2.0e6;
  outcome.coupler_buff_peak_coupler = 3;
  outcome.closing_speed_max = 8.0;
  outcome.closing_car_a = 1;
  outcome.closing_car_b = 2;
  EXPECT_EQ(statements(),
            (std::vector<std::string>{"derailed 2 of 4", "last car at 22.4 mph (10.00 m/s)", "1 coupler broken",
                                      "31 impacts", "peak force 450 kip (2000 kN), buff, coupler 3",
                                      "fastest closing 17.9 mph (8.00 m/s), cars 1 and 2"}));
  EXPECT_TRUE(make_strip(view()).statements.front().strong);
  // The stream has shown a larger one since the last outcome.
  NodeView later = view();
  later.forces.run_id = 3;
  later.forces.time = 4.86;
  later.forces.buff_peak = {0.0, 0.0, 0.0};
  later.forces.draft_peak = {3.0e6, 0.0, 0.0};
  EXPECT_EQ(make_strip(later).statements[4].text, "peak force 674 kip (3000 kN), draft, coupler 1");
  later.forces.history = {{8.0, 0.0, 3.0e6}};  // the run has gone on to there: an earlier moment is shown again
  EXPECT_EQ(make_strip(later).statements[4].text, "peak force 450 kip (2000 kN), buff, coupler 3");
}

TEST_F(Overlay, WhatComesLaterThanTheMomentShownIsNotNamed) {
  info.state = RunInfo::ENDED;
  outcome.ended = Outcome::AT_REST;
  outcome.stop_time = 18.0;
  outcome.impacts = 31;
  outcome.touches = 5;
  outcome.coupler_buff_peak = 2.0e6;
  outcome.coupler_buff_peak_coupler = 1;
  outcome.coupler_buff_peak_time = 7.0;
  outcome.closing_speed_max = 8.0;
  outcome.closing_time = 9.0;
  EXPECT_EQ(make_strip(view()).state, "looking back");
  EXPECT_EQ(statements().size(), 2U);
  cars.time = 18.0;
  EXPECT_EQ(make_strip(view()).state, "ended: all cars at rest");
  EXPECT_EQ(statements().size(), 5U);
  outcome.ended = Outcome::TIME_MAX;
  EXPECT_EQ(make_strip(view()).state, "ended: time limit reached");
  info.state = RunInfo::PAUSED;
  EXPECT_EQ(make_strip(view()).state, "paused");
  info.state = RunInfo::FAILED;
  info.message = "a step of 1e-12 s";
  EXPECT_EQ(make_strip(view()).state, "computing failed: a step of 1e-12 s");
  // Of another run
  outcome.run_id = 2;
  EXPECT_EQ(statements().size(), 2U);
}

TEST_F(Overlay, TheLegendHasWhatIsInUse) {
  using scene::Look;
  cars.cars[0].cause = CarState::POD;
  cars.cars[1].cause = CarState::TORN_TRACK;
  couplers.couplers[0].broken = true;
  couplers.couplers[0].axial_force = 9.0e6;  // carries nothing
  couplers.couplers[1].axial_force = -300.0e3;
  couplers.couplers[2].axial_force = 1.0e3;
  const Entries entries = entries_now(view());
  EXPECT_TRUE(entries.has(Look::on_track) && entries.has(Look::at_point) && entries.has(Look::by_torn_track));
  EXPECT_FALSE(entries.has(Look::by_lateral) || entries.has(Look::past_point) || entries.has(Look::off_track));
  EXPECT_TRUE(entries.has_broken());
  EXPECT_FALSE(entries.has_impact());
  for (int k = -scene::kForceClasses; k <= scene::kForceClasses; ++k) EXPECT_EQ(entries.has_force(k), k == -1);
  EXPECT_EQ(force_limit(0), (std::pair<std::string, std::string>("50", "222")));
  EXPECT_EQ(force_limit(4), (std::pair<std::string, std::string>("2000", "8896")));
  inputs.on_track_law = "isotropic";
  cars.cars[0].past_pod = true;
  EXPECT_TRUE(entries_now(view()).has(Look::past_point));
  EXPECT_FALSE(entries_now(view()).has(Look::at_point));

  // By how they lie, if the node colours them so.
  info.colours = "posture";
  cars.cars[0].tilt = 1.5;
  EXPECT_TRUE(entries_now(view()).has(scene::Lie::on_side) && entries_now(view()).has(scene::Lie::upright));
  EXPECT_FALSE(entries_now(view()).has(Look::past_point) || entries_now(view()).has(scene::Lie::inverted));
  EXPECT_EQ(make_map(view()).cars[0].facts, &scene::facts_of(scene::Lie::on_side));
}

TEST_F(Overlay, AnEntryStaysForAWhileAndGoesWithItsRun) {
  Entries push, pull;
  push.add_force(2);
  pull.add_force(-3);
  Legend legend;
  legend.use(push, 1, 10.0);
  legend.use(pull, 1, 11.0);
  EXPECT_TRUE(legend.entries().has_force(2) && legend.entries().has_force(-3));
  legend.use(pull, 1, 13.0);
  EXPECT_TRUE(!legend.entries().has_force(2) && legend.entries().has_force(-3));
  legend.use(push, 2, 13.1);
  EXPECT_TRUE(legend.entries().has_force(2) && !legend.entries().has_force(-3));
}

TEST_F(Overlay, TheMapIsAlongTheTrain) {
  // A train that heads along +y
  for (CarState& car : cars.cars) {
    car.pose.position.y = car.pose.position.x + 5.0;
    car.pose.position.x = 0.0;
    car.theta = M_PI_2;
  }
  const TrainMap map = make_map(view());
  ASSERT_EQ(map.cars.size(), 4U);
  EXPECT_NEAR(map.cars[0].x - map.cars[3].x, 60.0, 1e-9);
  EXPECT_NEAR(map.cars[0].y, 0.0, 1e-9);
  EXPECT_NEAR(map.cars[0].heading, 0.0, 1e-9);
  EXPECT_NEAR(map.cars[0].x - map.point_x, 25.0, 1e-9);
  EXPECT_NEAR(map.heap_turn, -M_PI_2, 1e-9);
  EXPECT_EQ(map.heap_length, 100.0);
  EXPECT_NEAR(map.right - map.left, 60.0 + 2.0 * kMapHalfCar, 1e-9);
  EXPECT_TRUE(map == make_map(view()));
  EXPECT_FALSE(map.north.has_value());
  inputs.track_heading =
      M_PI / 3.0;  // +x of the world is 60 degrees east of north; the map has +y of the world to the right
  EXPECT_NEAR(*make_map(view()).north, M_PI / 3.0 - M_PI_2, 1e-9);
  EXPECT_FALSE(map == make_map(view()));
  cars.cars[2].pose.position.x = 1.0;
  EXPECT_FALSE(map == make_map(view()));
  EXPECT_EQ(scale_bar(700.0).text, "2000 ft (610 m)");
  EXPECT_EQ(scale_bar(160.0).text, "500 ft (152 m)");
  EXPECT_NEAR(scale_bar(160.0).length, 152.4, 1e-9);
  EXPECT_EQ(scale_bar(1.0).text, "100 ft (30 m)");
}

TEST_F(Overlay, PlatesStayWithinTheirSpace) {
  Strip strip = make_strip(view());
  strip.title = std::string(400, 'x');
  strip.statements.resize(30, {"something of some length", false});
  Entries all;
  for (std::size_t i = 0; i < scene::kLooks; ++i) all.add(static_cast<scene::Look>(i));
  for (int k = -scene::kForceClasses; k <= scene::kForceClasses; ++k) all.add_force(k);
  all.add_broken();
  all.add_impact();
  for (const auto& [width, height] : {std::pair(640, 480), std::pair(838, 676), std::pair(3400, 2000)}) {
    const double text = text_height(height, 1.0);
    EXPECT_GE(text, 13.0);
    const Space top{width, static_cast<int>(0.9 * kMargins.top * height), text};
    const Space left{static_cast<int>(0.6 * width), static_cast<int>(0.9 * kMargins.bottom * height), text};
    const Space right{static_cast<int>(0.38 * width), left.height, text};
    const std::pair<QImage, Space> plates[] = {
        {paint_strip(strip, top), top}, {paint_legend(all, left), left}, {paint_map(make_map(view()), right), right}};
    for (const auto& [image, space] : plates) {
      ASSERT_FALSE(image.isNull());
      EXPECT_LE(image.width(), space.width + 1);
      EXPECT_LE(image.height(), space.height + 1);
    }
  }
  EXPECT_GT(text_height(2000, 1.0), 35.0);
  EXPECT_EQ(text_height(600, 2.0), 26.0);
  EXPECT_TRUE(paint_strip(Strip(), {800, 80, 13.0}).isNull());
  EXPECT_TRUE(paint_legend(Entries(), {800, 80, 13.0}).isNull());
  EXPECT_TRUE(paint_map(TrainMap(), {800, 80, 13.0}).isNull());
}

// A number from nowhere may be three hundred digits long, and the window as wide.
TEST(OutcomeTable, WithoutAnOutcomeNothingHasAValue) {
  OutcomeTable table(nullptr);
  table.show_outcome({});
  int values = 0;
  for (const QLabel* label : table.findChildren<QLabel*>()) {
    EXPECT_FALSE(label->text().contains(QRegularExpression("^[-0-9]"))) << label->text().toStdString();
    values += label->text() == "\u2013" ? 1 : 0;
  }
  EXPECT_GT(values, 5);
}

}  // namespace
}  // namespace train_derail::rviz_panel

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  // Fonts want an application; it needs no screen.
  qputenv("QT_QPA_PLATFORM", "offscreen");
  const QApplication application(argc, argv);
  return RUN_ALL_TESTS();
}
