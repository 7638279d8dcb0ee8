// A whole scene in three dimensions that is mirrored, moved or turned gives the same run, with every part of the model
// at work and cars that go over. The point of derailment is the origin and the track runs through it along x, so no
// input moves or turns the two. What can be moved and turned beside them is: a scene along a straight track with its
// grades, sections and patches (moved), a scene along a curve (turned about the middle of the curve, with rails,
// ballast, banks and superelevation), a scene off the track on level ground (turned about the vertical), and one that
// falls, where no direction differs from another but for the fall itself (turned about any axis).
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "spatial_fixtures.hpp"
#include "train_derail/model/spatial_bed.hpp"

namespace train_derail::test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using inputs::kInfinity;
using model::SpatialMotion;
using Train = SpatialTrain;
using Cars = std::vector<SpatialMotion>;

constexpr double kOver = 45.0 * inputs::kDegree;

/// One scene: inputs, and the cars where they start.
struct Scene {
  inputs::Scenario scenario;
  Cars cars;
};

/// Where a place of one scene is in the other; a mirror changes left and right of a car as well.
struct Elsewhere {
  Matrix3d turn = Matrix3d::Identity();
  Vector3d shift = Vector3d::Zero();

  Matrix3d axes(const Matrix3d& of) const {
    return turn * of * Vector3d(1.0, turn.determinant() > 0.0 ? 1.0 : -1.0, 1.0).asDiagonal();
  }
  Cars cars(const Cars& of) const {
    Cars moved;
    for (const SpatialMotion& q : of)
      moved.push_back(at(shift + turn * q.centre, turn * q.axes, turn * q.velocity, q.body_rates));
    return moved;
  }
};

/// What has happened until the end.
struct Seen {
  double tilt = 0.0;  // largest angle between the vertical and a car [rad]
  std::size_t derailments = 0, broken = 0, impacts = 0;
};

/// Largest difference of places [m], directions and velocities [m/s], in a frame that has `fallen` and is `faster`.
double apart(const Train& here, const Train& there, const Elsewhere& is, const Vector3d& fallen = Vector3d::Zero(),
             const Vector3d& faster = Vector3d::Zero()) {
  double most = 0.0;
  for (Eigen::Index k = 0; k < here.model().car_count(); ++k) {
    const SpatialMotion a = here.car(k), b = there.car(k);
    most =
        std::max({most, (is.shift + is.turn * (a.centre - fallen) - (b.centre - fallen)).norm(),
                  (is.axes(a.axes) - b.axes).norm(), (is.turn * (a.velocity - faster) - (b.velocity - faster)).norm()});
  }
  return most;
}
constexpr double kSame = 1e-6;

Seen expect_the_same(Train& here, Train& there, const Elsewhere& is, double until) {
  Seen seen;
  double most = 0.0;
  for (double t = 0.5; t <= until && most < kSame; t += 0.5) {
    here.to(t);
    there.to(t);
    most = apart(here, there, is);
    EXPECT_LT(most, kSame) << "at " << t;
    for (Eigen::Index k = 0; k < here.model().car_count(); ++k)
      seen.tilt = std::max(seen.tilt, std::acos(std::clamp(here.car(k).axes(2, 2), -1.0, 1.0)));
  }
  const model::Incidents &a = here.incidents(), &b = there.incidents();
  EXPECT_EQ(a.derailments.size(), b.derailments.size());
  EXPECT_EQ(a.impacts.size(), b.impacts.size());
  EXPECT_EQ(a.broken.size(), b.broken.size());
  for (std::size_t i = 0; i < std::min(a.broken.size(), b.broken.size()); ++i)
    EXPECT_EQ(a.broken[i].by, b.broken[i].by);
  EXPECT_NEAR(here.energy().kinetic() / there.energy().kinetic(), 1.0, 1e-6);
  seen.derailments = a.derailments.size();
  seen.broken = a.broken.size();
  seen.impacts = a.impacts.size();
  return seen;
}

/// A part of the scenario, and how it is left out.
struct Part {
  const char* name;
  std::function<void(inputs::Scenario&)> leave_out;
};

/// Without any of these the run is another one: they are at work.
void expect_at_work(const Scene& scene, const std::vector<Part>& parts, double until) {
  Train whole(scene.scenario, scene.cars);
  whole.to(until);
  for (const Part& part : parts) {
    inputs::Scenario s = scene.scenario;
    part.leave_out(s);
    Train without(s, scene.cars);
    without.to(until);
    EXPECT_GT(apart(whole, without, {}), 1e-3) << part.name;
  }
}

const std::vector<Part> kCouplersAndContact{
    {"yaw stop", [](inputs::Scenario& s) { s.coupler.swing_stiffness = 0.0; }},
    {"pitch stop", [](inputs::Scenario& s) { s.coupler.pitch_stiffness = 0.0; }},
    {"roll stop", [](inputs::Scenario& s) { s.coupler.roll_stiffness = 0.0; }},
    {"draft gear", [](inputs::Scenario& s) { s.coupler.draft_gear_stiffness *= 1.1; }},
    {"coupler that breaks",
     [](inputs::Scenario& s) {
       s.coupler.break_draft = s.coupler.break_swing = s.coupler.break_twist = kInfinity;
       s.coupler.vertical_hold = kInfinity;
     }},
    {"contact", [](inputs::Scenario& s) { s.contact.law = inputs::ContactLaw::none; }},
    {"friction of contact", [](inputs::Scenario& s) { s.contact.friction = 0.0; }},
    {"sides that crush", [](inputs::Scenario& s) { s.contact.side_crush_force = kInfinity; }},
};
std::vector<Part> with(std::vector<Part> parts) {
  parts.insert(parts.begin(), kCouplersAndContact.begin(), kCouplersAndContact.end());
  return parts;
}

/// All parts, the first half of the cars boxes and the others tanks.
inputs::Scenario boxes_and_tanks(int cars) {
  inputs::Scenario s = everything(cars, 2e-3);
  s.initial.perturbation = {};
  s.track.curves.clear();
  s.consist.push_back(s.consist.back());
  s.consist.front().count = cars / 2;
  s.consist.back().count = cars - cars / 2;
  s.consist.back().shape = inputs::BodyShape::cylinder;
  s.coupler.roll_limit = 10.0 * inputs::kDegree;
  s.initial.cars_ahead = 0;
  return s;
}

// Mirrored

void expect_mirror_image(inputs::BodyShape shape, bool hilly) {
  inputs::Scenario s = everything(20, 2e-3, hilly);
  s.consist.back().shape = shape;
  s.initial.perturbation.kick = s.initial.perturbation.alignment = 0.0;  // drawn to either side
  s.ground.patches = {{-20.0, 80.0, 0.0, 10.0, 1.4}};
  inputs::Scenario m = s;
  m.initial.yaw_rate *= -1.0;
  std::swap(m.terrain.bank_left, m.terrain.bank_right);
  m.track.curves[0].curvature *= -1.0;
  std::swap(m.ground.patches[0].y_from, m.ground.patches[0].y_to);
  m.ground.patches[0].y_from *= -1.0;
  m.ground.patches[0].y_to *= -1.0;
  Train train(s), mirrored(m);
  const Seen seen = expect_the_same(train, mirrored, {Matrix3d(Vector3d(1.0, -1.0, 1.0).asDiagonal())}, 15.0);
  EXPECT_GT(seen.tilt, kOver);
  EXPECT_GT(seen.impacts, 0U);
  EXPECT_GT(seen.broken, 0U);
}

TEST(Mirrored, IsTheMirrorImage) { expect_mirror_image(inputs::BodyShape::box, false); }
TEST(Mirrored, IsTheMirrorImageWithTanks) { expect_mirror_image(inputs::BodyShape::cylinder, false); }
TEST(Mirrored, IsTheMirrorImageOnHills) { expect_mirror_image(inputs::BodyShape::box, true); }

// Along the track

/// Rails are torn up, and curves known, in pieces of this length: a scene is moved by whole ones.
constexpr double kPiece = 5.0 * inputs::kFoot;
constexpr double kMoved = -800.0 * kPiece;
constexpr double kFirst = -1000.0;  // where the first car of the scene is that stays
constexpr int kCars = 8;

/// A car on the rails at arc length s of the track.
SpatialMotion on_rails(const inputs::Scenario& scenario, const model::SpatialBed& bed, double s,
                       const Vector3d& velocity, const Vector3d& rates) {
  const double half = 0.5 * model::expand(scenario.consist)[0].truck_spacing;
  const model::Track::Node front = bed.track.at(s + half), rear = bed.track.at(s - half);
  const Eigen::Vector2d middle = 0.5 * (front.point + rear.point), along = (front.point - rear.point).normalized();
  const model::TrackProfile::Place rails = bed.profile.at(s);
  Matrix3d axes;
  axes << along.x(), -along.y(), 0.0, along.y(), along.x(), 0.0, 0.0, 0.0, 1.0;
  axes = axes * turned(std::atan(rails.tilt), Vector3d::UnitX());
  const Vector3d foot(middle.x(), middle.y(), rails.height);
  return at(foot + height_of(scenario) * axes.col(2), axes, axes * velocity, rates);
}

/// The first car is thrown off the rails to the left, far behind the point of derailment; the others run up to it.
Scene thrown_off(const inputs::Scenario& scenario, double first, double to_the_left) {
  const model::SpatialBed bed(scenario);
  Scene scene{scenario, {}};
  for (int k = 0; k < kCars; ++k) {
    const bool thrown = k == 0;
    const Vector3d velocity(thrown ? 12.0 : 16.0, thrown ? to_the_left : 0.0, 0.0);
    const Vector3d rates = (thrown ? to_the_left : 0.0) * Vector3d(-1.0, 0.0, 0.1) / 6.0;
    scene.cars.push_back(on_rails(scenario, bed, first - k * (kPitch - 0.02), velocity, rates));
  }
  return scene;
}

/// A stretch with a high bank, and a patch of another friction, beside the scene whose first car is at `first`.
void add_surroundings(inputs::Scenario& s, double first) {
  s.terrain.sections.resize(1);
  s.terrain.sections[0].start = first + 30.0;
  s.terrain.sections[0].length = 100.0;
  s.terrain.sections[0].bank_left = s.terrain.sections[0].bank_right = 4.0;
  s.ground.patches = {{first - 10.0, first + 60.0, -8.0, 8.0, 1.4}};
}
const std::vector<Part> kTrackAndGround{
    {"rails", [](inputs::Scenario& s) { s.rails.stiffness *= 1.1; }},
    {"torn track", [](inputs::Scenario& s) { s.rails.torn_length = 0.0; }},
    {"springs", [](inputs::Scenario& s) { s.suspension.stiffness *= 1.1; }},
    {"brakes", [](inputs::Scenario& s) { s.brakes.force = 0.0; }},
    {"ballast", [](inputs::Scenario& s) { s.terrain.ballast_height = 0.0; }},
    {"bank", [](inputs::Scenario& s) { s.terrain.bank_left = s.terrain.bank_right = 0.0; }},
    {"section", [](inputs::Scenario& s) { s.terrain.sections.clear(); }},
    {"patch", [](inputs::Scenario& s) { s.ground.patches.clear(); }},
    {"bodies on the ground", [](inputs::Scenario& s) { s.terrain.body_friction *= 1.1; }},
};

void expect_cars_gone_over(const Seen& seen) {
  EXPECT_GT(seen.tilt, kOver);
  EXPECT_GT(seen.derailments, 6U);
  EXPECT_GT(seen.broken, 1U);
  EXPECT_GT(seen.impacts, 1U);
}

TEST(MovedAlongAStraightTrack, WithItsGradesIsTheSame) {
  const auto scene = [](double first) {
    inputs::Scenario s = boxes_and_tanks(kCars);
    // Far from both scenes; the track, and where it is torn up, is known as far as this.
    s.track.curves = {{-3000.0, 10.0, 1.0 / 600.0, 0.0}};
    s.track.grades = {{first + 40.0, 100.0, 0.01}, {first + 140.0, 100.0, -0.01}};
    add_surroundings(s, first);
    return thrown_off(s, first, 3.0);
  };
  const Scene a = scene(kFirst), b = scene(kFirst + kMoved);
  Train here(a.scenario, a.cars), there(b.scenario, b.cars);
  const Seen seen = expect_the_same(here, there, {Matrix3d::Identity(), Vector3d(kMoved, 0.0, 0.0)}, 8.0);
  expect_cars_gone_over(seen);
  for (const model::Derailment& d : here.incidents().derailments) EXPECT_NE(d.cause, model::Cause::pod);
  std::vector<Part> parts = with(kTrackAndGround);
  parts.push_back({"grades", [](inputs::Scenario& s) { s.track.grades.clear(); }});
  expect_at_work(a, parts, 8.0);
}

TEST(MovedAlongACurve, IsTurnedAndTheSame) {
  // The curve is a polygon of such pieces, its corners on a circle of this radius. It must not close.
  constexpr double kBend = 1.0 / 600.0;
  const double radius = 0.5 * kPiece / std::sin(0.5 * kPiece * kBend);
  const auto scene = [](double first) {
    inputs::Scenario s = boxes_and_tanks(kCars);
    s.track.curves = {{-2000.0 * kPiece, 2100.0 * kPiece, kBend, 0.1}};
    add_surroundings(s, first);
    return thrown_off(s, first, -3.0);
  };
  Scene a = scene(kFirst), b = scene(kFirst + kMoved);
  const Matrix3d turn = turned(kMoved * kBend, Vector3d::UnitZ());
  const Vector3d middle(0.0, radius, 0.0);
  Train here(a.scenario, a.cars), there(b.scenario, b.cars);
  const Seen seen = expect_the_same(here, there, {turn, middle - turn * middle}, 8.0);
  expect_cars_gone_over(seen);
  for (const model::Derailment& d : here.incidents().derailments) EXPECT_NE(d.cause, model::Cause::pod);
  std::vector<Part> parts = with(kTrackAndGround);
  parts.push_back({"superelevation", [](inputs::Scenario& s) { s.track.curves[0].superelevation = 0.0; }});
  parts.push_back({"grade", [](inputs::Scenario& s) { s.track.grade = 0.0; }});
  expect_at_work(a, parts, 8.0);
}

// Off the track

/// Cars that are coupled, the first of which is turned and rolls over, `up` above the ground, beyond the point of
/// derailment, where all trucks are off the rails.
Cars coupled_cars(const inputs::Scenario& s, double up) {
  const Vector3d first(900.0, 300.0, height_of(s) - s.terrain.rail_height + up);
  Cars cars;
  for (int k = 0; k < kCars; ++k) {
    const bool lead = k == 0;
    cars.push_back(at(first - Vector3d(k * (kPitch - 0.02), 0.0, 0.0), Matrix3d::Identity(),
                      {lead ? 6.0 : 24.0, lead ? 4.0 : 0.0, 0.0}, {lead ? -2.5 : 0.0, 0.0, lead ? 1.2 : 0.0}));
  }
  return cars;
}

TEST(TurnedOffTheTrack, OnLevelGroundIsTheSame) {
  inputs::Scenario s = boxes_and_tanks(kCars);
  s.track.grade = s.terrain.bank_left = s.terrain.bank_right = s.terrain.ballast_height = 0.0;
  const Scene scene{s, coupled_cars(s, 0.0)};
  const Elsewhere is{turned(2.0, Vector3d::UnitZ()), Vector3d(2000.0, -900.0, 0.0)};
  Train here(s, scene.cars), there(s, is.cars(scene.cars));
  expect_cars_gone_over(expect_the_same(here, there, is, 6.0));
  expect_at_work(scene,
                 with({{"springs", [](inputs::Scenario& q) { q.suspension.stiffness *= 1.1; }},
                       {"ground under trucks", [](inputs::Scenario& q) { q.ground.broadside_friction *= 1.1; }},
                       {"bodies on the ground", [](inputs::Scenario& q) { q.terrain.body_friction *= 1.1; }}}),
                 6.0);
}

TEST(TurnedInTheAir, AboutAnyAxisIsTheSame) {
  // Weight is what has a direction: seen by one who falls with them, nothing has. A coupler that lets go by height or
  // by vertical force would have as well.
  inputs::Scenario s = boxes_and_tanks(kCars);
  s.track.grade = 0.0;
  s.coupler.vertical_hold = s.coupler.slip_height = kInfinity;
  s.suspension.part_angle = 4.0;  // from the vertical: they stay
  constexpr double kUntil = 3.0, kUp = 600.0;
  const Scene scene{s, coupled_cars(s, kUp)};
  Elsewhere is{turned(2.0, {1.0, 2.0, 3.0}), Vector3d::Zero()};
  const Vector3d first = scene.cars[0].centre;
  is.shift = first + Vector3d(0.0, 0.0, 300.0) - is.turn * first;
  Train here(s, scene.cars), there(s, is.cars(scene.cars));
  const double h = s.solver.fixed_step.value();
  for (double t = 0.5; t <= kUntil; t += 0.5) {
    here.to(t);
    there.to(t);
    const Vector3d fallen(0.0, 0.0, -0.5 * kGravity * t * (t + h)), faster(0.0, 0.0, -kGravity * t);
    EXPECT_LT(apart(here, there, is, fallen, faster), kSame) << "at " << t;
  }
  EXPECT_GT(here.incidents().impacts.size(), 1U);
  EXPECT_EQ(here.incidents().impacts.size(), there.incidents().impacts.size());
  EXPECT_GT(here.incidents().broken.size(), 0U);
  EXPECT_EQ(here.incidents().broken.size(), there.incidents().broken.size());
  EXPECT_EQ(here.energy().work_body_ground, 0.0);
  expect_at_work(scene, kCouplersAndContact, kUntil);
}

}  // namespace
}  // namespace train_derail::test
