// The second opinion on trains in three dimensions: Simbody's free bodies move as the spatial model's cars do, step by
// step, and mistakes that are put in are seen.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "folder.hpp"
#include "multibody/halving.hpp"
#include "same_ensembles.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/multibody/verify.hpp"

namespace train_derail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using inputs::kInfinity;
using multibody::Apart;
using multibody::BodyMotion;
using multibody::Fault;
using multibody::Film;
using test::at;
using test::turned;

constexpr double kInterval = 0.02;  // at which the two are compared [s]

struct Case {
  const char* name;
  inputs::Scenario scenario;
  std::vector<model::SpatialMotion> start;
  double until;
  multibody::Steps whole = {};
};
const multibody::Steps kForBlows{multibody::Steps().step, 1e-7, 5e-5};

/// Loaded tank cars on a bank of 3 m, with every part that the second opinion has.
inputs::Scenario on_the_bank(int cars) {
  inputs::Scenario s = test::accident(cars);
  s.model = inputs::Model::spatial;
  s.contact.law = inputs::ContactLaw::none;
  s.brakes.force = s.brakes.rolling_resistance = 0.0;
  s.initial.perturbation = {};
  s.rails.derail_ratio = 1e3;
  s.rails.torn_length = 0.0;
  s.rails.flange_height = kInfinity;
  s.coupler.break_draft = s.coupler.break_swing = s.coupler.break_twist = kInfinity;
  s.coupler.vertical_hold = kInfinity;
  s.coupler.draft_gear_travel = 0.02;  // soon used up
  s.terrain.bank_left = 3.0;
  return s;
}
/// Centre of mass of a car that stands on the crown.
Vector3d standing(const inputs::Scenario& s, double x, double y) {
  return {x, y, test::height_of(s) - s.terrain.rail_height};
}

/// Thrown off the crown sideways, turning; it goes over on the bank.
Case one_car() {
  inputs::Scenario s = on_the_bank(1);
  s.terrain.ballast_height = 0.3;
  s.consist[0].underframe_height = 0.25;  // low enough to come to the ground as it goes over
  return {"one car",
          s,
          {at(standing(s, 50.0, 0.5), turned(0.2, Vector3d::UnitZ()), {6.0, 4.0, 0.0}, {-0.3, 0.0, 0.4})},
          1.8,
          {2e-5}};
}
/// The lead car leaves the crown and pulls the next one round.
Case two_cars() {
  const inputs::Scenario s = on_the_bank(2);
  return {"two cars",
          s,
          {at(standing(s, 60.0, 1.0), turned(0.15, Vector3d::UnitZ()), {9.0, 2.5, 0.0}, {-0.2, 0.0, 0.3}),
           at(standing(s, 60.0 - test::kPitch, 0.0), Matrix3d::Identity(), {10.0, 0.0, 0.0})},
          2.0};
}
/// How far a car's centre is behind the next one's if it stands that much aside of it and the coupler is at rest.
double behind(double aside) {
  const double length = inputs::Coupler{}.length;
  return test::kPitch - length + std::sqrt(length * length - aside * aside);
}
/// The first car goes over on the bank and takes the others, which have only come to its edge, along. The farther from
/// the track, the faster they go sideways.
Case three_cars() {
  const inputs::Scenario s = on_the_bank(3);
  const auto car = [&](double x, double aside, double roll_rate) {
    return at(standing(s, x, aside), Matrix3d::Identity(), {8.0, aside, 0.0}, {roll_rate, 0.0, 0.0});
  };
  const double second = 80.0 - behind(0.3), third = second - behind(0.2);
  return {"three cars", s, {car(80.0, 1.9, -3.0), car(second, 1.6, 0.0), car(third, 1.4, 0.0)}, 2.0};
}
/// Rocking on the rails, the train comes to their end: truck after truck drops to the ground.
Case off_the_rails() {
  const inputs::Scenario s = on_the_bank(3);
  const double height = test::height_of(s);
  const auto car = [&](int k) {
    const double way = k % 2 == 0 ? 1.0 : -1.0;
    return at({-8.0 - k * (test::kPitch - 0.05), 0.005 * way, height + 0.01 * way}, Matrix3d::Identity(),
              {12.0 + k, 0.0, 0.0}, {0.1 * way, 0.02, 0.05});
  };
  return {"off the rails", s, {car(0), car(1), car(2)}, 2.0};
}

/// On the rails, one higher than the next, cars run into each other: butts hold them level, or do not.
Case in_buff() {
  Case c = off_the_rails();
  c.name = "in buff";
  c.until = 0.5;
  const double height = test::height_of(c.scenario);
  c.start.clear();
  for (int k = 0; k < 3; ++k)
    c.start.push_back(at({-60.0 - k * (test::kPitch - 0.03), 0.0, height + (k == 1 ? 0.03 : -0.02)},
                         Matrix3d::Identity(), {10.0 + 0.6 * k, 0.0, 0.0}));
  return c;
}

/// Uphill on the rails, two cars roll slower and slower until their rolling resistance holds them.
Case uphill() {
  Case c = off_the_rails();
  c.name = "uphill";
  c.until = 1.2;
  c.scenario = on_the_bank(2);
  c.scenario.track.grade = 0.02;
  c.scenario.brakes.rolling_resistance = 0.03;
  c.scenario.terrain.rest_speed = 0.0;  // Simbody does not lay still what hardly moves
  c.scenario.stop.speed = 1e-6;
  c.start.clear();
  for (int k = 0; k < 2; ++k)
    c.start.push_back(
        at({-60.0 - k * test::kPitch, 0.0, test::height_of(c.scenario)}, Matrix3d::Identity(), {0.35, 0.0, 0.0}));
  return c;
}

/// The same three cars with couplers of usual strength: one is twisted off.
Case a_coupler_breaks() {
  Case c = three_cars();
  c.name = "a coupler breaks";
  c.until = 1.0;
  const inputs::Coupler usual;
  c.scenario.coupler.break_twist = usual.break_twist;
  c.scenario.coupler.vertical_hold = usual.vertical_hold;
  c.scenario.coupler.break_draft = 650.0 * inputs::kKip;
  c.scenario.coupler.break_swing = 45.0 * inputs::kDegree;
  c.scenario.coupler.slip_height = 0.25;
  return c;
}

/// Bodies that press on each other. The coupler breaks at once and does nothing until then.
inputs::Scenario with_contact() {
  inputs::Scenario s = on_the_bank(2);
  s.contact.law = inputs::ContactLaw::elastic;
  s.contact.restitution = 0.4;
  s.contact.crush_force = 300.0 * inputs::kKip;
  s.contact.side_crush_force = 250.0 * inputs::kKip;
  s.coupler.draft_gear_travel = s.coupler.damping_ratio = 0.0;
  s.coupler.swing_stiffness = s.coupler.pitch_stiffness = s.coupler.roll_stiffness = 0.0;
  s.coupler.stiffness = 1e3;
  s.coupler.break_draft = 100.0;
  return s;
}
/// A car runs into the side of one that lies across its way.
Case into_a_side() {
  const inputs::Scenario s = with_contact();
  return {"into a side",
          s,
          {at(standing(s, 60.0, 0.5), turned(1.2, Vector3d::UnitZ()), {0.0, 0.0, 0.0}),
           at(standing(s, 48.8, 0.2), turned(0.1, Vector3d::UnitZ()), {3.5, 0.0, 0.0}, {0.0, 0.0, 0.1})},
          0.38,
          kForBlows};
}
/// The same car meets the end of one that stands nearly in line with it.
Case into_an_end() {
  Case c = into_a_side();
  c.name = "into an end";
  c.until = 0.46;
  const inputs::Scenario& s = c.scenario;
  c.start = {at(standing(s, 60.0, 0.5), turned(0.15, Vector3d::UnitZ()), {1.0, 0.0, 0.0}, {0.3, 0.0, 0.0}),
             at(standing(s, 60.0 - 17.2, 0.1), turned(0.02, Vector3d::UnitZ()), {2.5, 0.0, 0.0})};
  return c;
}
/// One that has gone over lies across an edge of the other: edges that cross, and floors.
Case on_top() {
  Case c = into_a_side();
  c.name = "on top";
  c.until = 0.6;
  const inputs::Scenario& s = c.scenario;
  c.start = {at(standing(s, 60.0, 0.0), turned(0.0, Vector3d::UnitZ()), {0.0, 0.0, 0.0}),
             at(standing(s, 62.0, 1.0) + Vector3d(0.0, 0.0, 3.2), turned(1.3, Vector3d(0.1, 0.05, 1.0).normalized()),
                {0.0, 0.0, -1.0}, {0.2, 0.1, 0.0})};
  return c;
}

/// A coupler of a train on the rails is pulled off: the signal runs along the pipe, and cars brake one after the other.
Case brakes() {
  inputs::Scenario s = on_the_bank(3);
  s.brakes.force = 0.1;
  s.brakes.dead_time = 0.2;
  s.brakes.build_up_time = 0.5;
  s.brakes.propagation_speed = 100.0;
  s.brakes.radio_delay = 0.05;
  s.coupler.break_draft = 1e4;
  s.consist[0].brake_share = 0.9;
  inputs::CarBlock last = s.consist[0];
  s.consist[0].count = 2;
  last.count = 1;
  last.loaded_weight = 1.1 * last.weight;
  last.brake_source = inputs::BrakeSource::remote;
  s.consist.push_back(last);
  Case c{"brakes", s, {}, 1.2};
  for (int k = 0; k < 3; ++k)
    c.start.push_back(
        at({-100.0 - k * test::kPitch - (k > 0 ? 0.5 * s.coupler.slack + 1e-3 : 0.0), 0.0, test::height_of(s)},
           Matrix3d::Identity(), {10.0, 0.0, 0.0}));
  return c;
}

/// Cars thrown sideways on the rails: a truck is overloaded, leaves them and tears them; others come to that place.
Case pushed_off() {
  inputs::Scenario s = on_the_bank(2);
  s.rails.derail_ratio = 1.2;
  s.rails.derail_time = 0.025;
  s.rails.torn_length = 2.0;
  Case c{"pushed off", s, {}, 1.0, kForBlows};
  for (int k = 0; k < 2; ++k)
    c.start.push_back(at({-70.0 - k * test::kPitch, k == 0 ? 0.07 : 0.0, test::height_of(s)}, Matrix3d::Identity(),
                         {12.0, 0.0, 0.0}, {k == 0 ? 0.1 : 0.0, 0.0, k == 0 ? 0.02 : 0.0}));
  return c;
}
/// A car on the rails rocks so hard that the wheels of one side come out.
Case rocked_off() {
  inputs::Scenario s = on_the_bank(1);
  s.rails.derail_ratio = 50.0;  // not by force
  s.rails.flange_height = 0.03;
  s.rails.derail_time = 0.2;  // longer than the rails push to one side
  return {"rocked off",
          s,
          {at({-70.0, 0.0, test::height_of(s)}, Matrix3d::Identity(), {12.0, 0.0, 0.0}, {4.0, 0.0, 0.0})},
          0.8};
}

int frames(const Case& c) { return static_cast<int>(std::lround(c.until / kInterval)); }

BodyMotion body(const model::SpatialMotion& q) { return {q.centre, q.axes, q.velocity, q.rotation}; }

Film by_model(const Case& c, double step) {
  inputs::Scenario s = c.scenario;
  s.solver.fixed_step = step;
  test::SpatialTrain train(s, c.start);
  Film film;
  for (int i = 0; i <= frames(c); ++i) {
    train.to(i * kInterval);
    multibody::Frame& now = film.emplace_back();
    for (std::size_t k = 0; k < c.start.size(); ++k) now.cars.push_back(body(train.car(static_cast<Eigen::Index>(k))));
  }
  return film;
}

Film by_simbody(const Case& c, const multibody::Steps& steps, Fault fault = Fault::none) {
  std::vector<BodyMotion> start;
  for (const model::SpatialMotion& q : c.start) start.push_back(body(q));
  multibody::Engine run(c.scenario, {steps.accuracy, false, fault, steps.settle_time}, start);
  Film film;
  for (int i = 0; i <= frames(c); ++i) {
    run.advance(i * kInterval);
    film.push_back({run.cars(), {}});
  }
  return film;
}

/// By both, with steps and tolerances a whole and a half.
struct Both {
  multibody::Halves<Film> films;
  multibody::HalvedComparison compared;
  bool agrees() const { return compared.agrees() && compared.worth(multibody::Criteria().worth); }
};
Both both(const Case& c, Fault fault = Fault::none) {
  Both r;
  const multibody::Steps &whole = c.whole, half = c.whole.halved();
  r.films = {by_model(c, whole.step), by_model(c, half.step), by_simbody(c, whole, fault), by_simbody(c, half, fault)};
  r.compared = multibody::compare(r.films);
  const multibody::HalvedComparison& m = r.compared;
  std::printf("%s: %.1e m and %.1e rad apart (allowed: %.1e, %.1e; with twice the step %.1e, %.1e)\n", c.name,
              m.half.position, m.half.angle, m.limit.position, m.limit.angle, m.whole.position, m.whole.angle);
  return r;
}

/// The same without a mistake, computed once for all tests.
const Both& both_of(Case (*of)()) {
  static std::map<Case (*)(), Both> known;
  const auto found = known.find(of);
  return found != known.end() ? found->second : known.emplace(of, both(of())).first->second;
}

/// How upright a car is at the end: 1 on its wheels, 0 on its side, -1 upside down.
double upright(const Film& film, std::size_t car) { return film.back().cars[car].axes(2, 2); }

/// One part of the scenario changed by a fiftieth.
struct Change {
  const char* name;
  Case (*of)();  // where it plays a role
  void (*change)(inputs::Scenario&);
};
constexpr double kMore = 1.02;
model::Car car_of(const inputs::Scenario& s) { return model::expand(s.consist)[0]; }
const Change kChanges[] = {
    {"mass", one_car, [](inputs::Scenario& s) { s.consist[0].weight *= kMore; }},
    {"roll inertia", one_car, [](inputs::Scenario& s) { s.consist[0].roll_inertia = kMore * car_of(s).roll_inertia; }},
    {"yaw inertia", one_car, [](inputs::Scenario& s) { s.consist[0].yaw_inertia = kMore * car_of(s).yaw_inertia; }},
    {"height", one_car, [](inputs::Scenario& s) { s.consist[0].centre_height = kMore * car_of(s).centre_height; }},
    {"width", one_car, [](inputs::Scenario& s) { s.consist[0].width *= kMore; }},
    {"trucks", one_car,
     [](inputs::Scenario& s) { s.consist[0].truck_weight = kMore * test::kGravity * car_of(s).truck_mass; }},
    {"underframe", one_car,
     [](inputs::Scenario& s) { s.consist[0].underframe_height = kMore * car_of(s).underframe_height; }},
    {"underframe width", one_car,
     [](inputs::Scenario& s) { s.consist[0].underframe_width = kMore * car_of(s).underframe_width; }},
    {"spring", one_car, [](inputs::Scenario& s) { s.suspension.stiffness *= kMore; }},
    {"damper", one_car, [](inputs::Scenario& s) { s.suspension.damping_ratio *= kMore; }},
    {"half base", one_car, [](inputs::Scenario& s) { s.suspension.half_base *= kMore; }},
    {"bank", one_car, [](inputs::Scenario& s) { s.terrain.bank_slope *= kMore; }},
    {"crown", one_car, [](inputs::Scenario& s) { s.terrain.crown *= kMore; }},
    {"ballast", one_car, [](inputs::Scenario& s) { s.terrain.ballast_height *= kMore; }},
    {"ballast width", one_car, [](inputs::Scenario& s) { s.terrain.ballast_half_width *= kMore; }},
    {"ballast slope", one_car, [](inputs::Scenario& s) { s.terrain.ballast_slope *= kMore; }},
    {"bank height", one_car, [](inputs::Scenario& s) { s.terrain.bank_left *= kMore; }},
    {"body friction", one_car, [](inputs::Scenario& s) { s.terrain.body_friction *= kMore; }},
    {"ground stiffness", one_car, [](inputs::Scenario& s) { s.terrain.body_stiffness *= kMore; }},
    {"ground damping", one_car, [](inputs::Scenario& s) { s.terrain.body_damping_ratio *= kMore; }},
    {"broadside", one_car, [](inputs::Scenario& s) { s.ground.broadside_friction *= kMore; }},
    {"in line", two_cars, [](inputs::Scenario& s) { s.ground.in_line_friction *= kMore; }},
    {"slip ratio", two_cars, [](inputs::Scenario& s) { s.ground.slip_ratio *= kMore; }},
    {"far", two_cars, [](inputs::Scenario& s) { s.ground.far_distance *= kMore; }},
    {"slack", two_cars, [](inputs::Scenario& s) { s.coupler.slack *= kMore; }},
    {"draft gear", two_cars, [](inputs::Scenario& s) { s.coupler.draft_gear_stiffness *= kMore; }},
    {"travel", two_cars, [](inputs::Scenario& s) { s.coupler.draft_gear_travel *= kMore; }},
    {"stiffness", two_cars, [](inputs::Scenario& s) { s.coupler.stiffness *= kMore; }},
    {"coupler damper", two_cars, [](inputs::Scenario& s) { s.coupler.damping_ratio *= kMore; }},
    {"coupler height", two_cars, [](inputs::Scenario& s) { s.coupler.height *= kMore; }},
    {"swing limit", two_cars, [](inputs::Scenario& s) { s.coupler.swing_limit *= kMore; }},
    {"swing stop", two_cars, [](inputs::Scenario& s) { s.coupler.swing_stiffness *= kMore; }},
    {"pitch limit", three_cars, [](inputs::Scenario& s) { s.coupler.pitch_limit = kMore * 7.0 * inputs::kDegree; }},
    {"pitch stop", three_cars, [](inputs::Scenario& s) { s.coupler.pitch_stiffness *= kMore; }},
    {"roll limit", three_cars, [](inputs::Scenario& s) { s.coupler.roll_limit = kMore * 10.0 * inputs::kDegree; }},
    {"roll stop", three_cars, [](inputs::Scenario& s) { s.coupler.roll_stiffness *= kMore; }},
    {"butt height", in_buff, [](inputs::Scenario& s) { s.coupler.butt_height *= kMore; }},
    {"rolling resistance", uphill, [](inputs::Scenario& s) { s.brakes.rolling_resistance *= kMore; }},
    {"grade", uphill, [](inputs::Scenario& s) { s.track.grade *= kMore; }},
    {"rails", off_the_rails, [](inputs::Scenario& s) { s.rails.stiffness *= kMore; }},
    {"rail damping", off_the_rails, [](inputs::Scenario& s) { s.rails.damping_ratio *= kMore; }},
    {"contact stiffness", into_a_side, [](inputs::Scenario& s) { s.contact.stiffness *= kMore; }},
    {"restitution", on_top, [](inputs::Scenario& s) { s.contact.restitution *= kMore; }},
    {"friction of bodies", into_a_side, [](inputs::Scenario& s) { s.contact.friction *= kMore; }},
    {"crush force of sides", into_a_side, [](inputs::Scenario& s) { s.contact.side_crush_force *= kMore; }},
    {"crush force", into_an_end, [](inputs::Scenario& s) { s.contact.crush_force *= kMore; }},
    {"length", into_an_end, [](inputs::Scenario& s) { s.consist[0].length *= kMore; }},
    {"roof", on_top, [](inputs::Scenario& s) { s.consist[0].roof_height = kMore * car_of(s).roof_height; }},
    {"floor", on_top, [](inputs::Scenario& s) { s.consist[0].floor_height = kMore * car_of(s).floor_height; }},
    {"brake force", brakes, [](inputs::Scenario& s) { s.brakes.force *= kMore; }},
    {"brake share", brakes, [](inputs::Scenario& s) { s.consist[0].brake_share *= kMore; }},
    {"loaded weight", brakes, [](inputs::Scenario& s) { *s.consist[1].loaded_weight *= kMore; }},
    {"dead time", brakes, [](inputs::Scenario& s) { s.brakes.dead_time *= kMore; }},
    {"build-up", brakes, [](inputs::Scenario& s) { s.brakes.build_up_time *= kMore; }},
    {"signal", brakes, [](inputs::Scenario& s) { s.brakes.propagation_speed *= kMore; }},
    {"radio", brakes, [](inputs::Scenario& s) { s.brakes.radio_delay *= kMore; }},
    {"L/V", pushed_off, [](inputs::Scenario& s) { s.rails.derail_ratio *= kMore; }},
    {"time of overload", pushed_off, [](inputs::Scenario& s) { s.rails.derail_time *= kMore; }},
    {"torn length", pushed_off, [](inputs::Scenario& s) { s.rails.torn_length *= kMore; }},
    {"flange", rocked_off, [](inputs::Scenario& s) { s.rails.flange_height *= kMore; }},
    {"rail height", off_the_rails, [](inputs::Scenario& s) { s.terrain.rail_height *= kMore; }},
};

/// docs/verification.md shows what is measured here. A number there is right if it is within a half of what the test
/// finds: distances are near to rounding, so that compilers and processors make a difference.
std::string page() { return test::text_of(TRAIN_DERAIL_SOURCE_DIR "/docs/verification.md"); }
void expect_numbers_on_the_page(const std::string& text, const std::vector<double>& measured) {
  static const std::regex kNumber(R"(\d+(\.\d+)?)");
  std::vector<double> told;
  for (std::sregex_iterator i(text.begin(), text.end(), kNumber), end; i != end; ++i)
    told.push_back(std::stod(i->str()));
  ASSERT_EQ(told.size(), measured.size()) << text;
  for (std::size_t i = 0; i < told.size(); ++i) EXPECT_NEAR(told[i], measured[i], 0.5 * measured[i]) << text;
}
/// The cells after the first one, in the row of a table that begins with `first`.
void expect_row_on_the_page(const std::string& first, const std::vector<double>& measured) {
  const std::string text = page();
  const std::size_t row = text.find("\n| " + first);
  ASSERT_NE(row, std::string::npos) << first;
  const std::size_t cells = text.find('|', row + 3);
  expect_numbers_on_the_page(text.substr(cells, text.find('\n', cells) - cells), measured);
}
constexpr double kMilli = 1e-3;

class EarlyMotion : public testing::TestWithParam<Case (*)()> {};

TEST_P(EarlyMotion, IsTheSame) {
  const Both& r = both_of(GetParam());
  EXPECT_TRUE(r.agrees());
  // They come closer as the model's step becomes shorter.
  const Apart &half = r.compared.half, &whole = r.compared.whole, &limit = r.compared.limit;
  EXPECT_LT(half.position, 0.8 * whole.position);
  const Case c = GetParam()();
  expect_row_on_the_page(std::string(c.name) + ':',
                         {c.until, half.position / kMilli, limit.position / kMilli, half.angle / kMilli,
                          limit.angle / kMilli, whole.position / kMilli});
}

TEST_P(EarlyMotion, ASmallChangeIsSeen) {
  const Both& r = both_of(GetParam());
  for (const Change& change : kChanges) {
    if (change.of != GetParam()) continue;
    Case c = GetParam()();
    change.change(c.scenario);
    EXPECT_FALSE(multibody::farthest(by_model(c, c.whole.halved().step), r.films.engine_half).within(r.compared.limit))
        << change.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, EarlyMotion,
                         testing::Values(one_car, two_cars, three_cars, off_the_rails, in_buff, uphill,
                                         a_coupler_breaks, into_a_side, into_an_end, on_top, brakes, pushed_off,
                                         rocked_off),
                         [](const auto& c) {
                           std::string name = c.param().name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(SpatialSecondOpinion, ThePageTellsHowManyNumbersAreChanged) {
  const std::string told = "Each of " + std::to_string(std::size(kChanges)) + " numbers (mass";
  EXPECT_NE(page().find(told), std::string::npos) << told;
}

TEST(SpatialSecondOpinion, TheCasesAreWhatTheyAreSaidToBe) {
  EXPECT_LT(upright(by_model(one_car(), 1e-4), 0), 0.0);
  const Film three = by_model(three_cars(), 1e-4);
  EXPECT_LT(upright(three, 0), 0.0);
  EXPECT_LT(upright(three, 1), 0.0);
  EXPECT_LT(upright(three, 2), 0.9);
  const Case torn = a_coupler_breaks();
  test::SpatialTrain tears(torn.scenario, torn.start);
  tears.to(torn.until);
  ASSERT_EQ(tears.incidents().broken.size(), 1U);
  EXPECT_EQ(tears.incidents().broken[0].by, model::BrokenCoupler::By::twist);
  EXPECT_LT(by_simbody(uphill(), uphill().whole).back().cars[0].velocity.norm(), 0.02) << "it stands";
  Case c = off_the_rails();
  test::SpatialTrain train(c.scenario, c.start);
  EXPECT_TRUE(train.incidents().derailments.empty());
  train.to(c.until);
  EXPECT_EQ(train.incidents().derailments.size(), 3U);
  // Blows, each of one kind.
  using model::Face;
  struct Blow {
    Case (*of)();
    std::set<Face> faces;
  };
  const Blow blows[] = {{into_a_side, {Face::left, Face::front}},
                        {into_an_end, {Face::rear, Face::front}},
                        {on_top, {Face::top, Face::bottom}}};
  for (const Blow& blow : blows) {
    const Case hit = blow.of();
    test::SpatialTrain hits(hit.scenario, hit.start);
    hits.to(hit.until);
    ASSERT_EQ(hits.incidents().impacts.size(), 1U) << hit.name;
    const model::Impact& impact = hits.incidents().impacts[0];
    EXPECT_EQ((std::set<Face>{impact.face_a, impact.face_b}), blow.faces) << hit.name;
    EXPECT_LT(impact.time, hit.until - 0.1) << hit.name;
  }
  const Film braking = by_model(brakes(), 1e-4);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT(braking.back().cars[k].velocity.x(), 9.7) << k;
  // One car leaves the rails by force, and those that come to the place where it did.
  const Case off = pushed_off();
  test::SpatialTrain leaves(off.scenario, off.start);
  leaves.to(off.until);
  std::set<model::Cause> causes;
  for (const model::Derailment& d : leaves.incidents().derailments) causes.insert(d.cause);
  EXPECT_EQ(causes, (std::set<model::Cause>{model::Cause::lateral, model::Cause::torn_track}));
  // The flange decides.
  Case rocks = rocked_off();
  for (const double flange : {rocks.scenario.rails.flange_height, kInfinity}) {
    rocks.scenario.rails.flange_height = flange;
    test::SpatialTrain rocking(rocks.scenario, rocks.start);
    rocking.to(rocks.until);
    EXPECT_EQ(rocking.incidents().derailments.empty(), flange == kInfinity);
  }
}

TEST(SpatialSecondOpinion, SeesTheWrongSignOfTheGyroscopicMoment) {
  const Both r = both(one_car(), Fault::gyroscopic_sign);
  EXPECT_FALSE(r.compared.agrees());
  EXPECT_GT(r.compared.half.position, 0.1);
  expect_row_on_the_page("gyroscopic moment", {r.compared.half.position, r.compared.half.angle});
}

TEST(SpatialSecondOpinion, SeesACentreOfMassOnTheWrongSideOfTheRail) {
  const Both r = both(one_car(), Fault::centre_below_rail);
  EXPECT_FALSE(r.compared.agrees());
  EXPECT_GT(r.compared.half.angle, 1.0);
  expect_row_on_the_page("centre of mass on the wrong side", {r.compared.half.position, r.compared.half.angle});
}

TEST(SpatialSecondOpinion, SeesThatTheRollStopIsMissing) {
  const Both r = both(three_cars(), Fault::no_roll_stop);
  EXPECT_FALSE(r.compared.agrees());
  // It is the roll stop that takes the second car along.
  EXPECT_LT(upright(r.films.model_half, 1), 0.0);
  EXPECT_GT(upright(r.films.engine_half, 1), 0.5);
  expect_row_on_the_page("roll stop left out", {r.compared.half.position, r.compared.half.angle});
}

TEST(SpatialSecondOpinion, SeesThatBodiesPushAtTheWrongPlace) {
  const Both r = both(into_a_side(), Fault::contact_at_centre);
  EXPECT_FALSE(r.compared.agrees());
  EXPECT_GT(r.compared.half.position, 10.0 * r.compared.limit.position);
  expect_row_on_the_page("bodies push each other at their centres", {r.compared.half.position, r.compared.half.angle});
}

TEST(SpatialSecondOpinion, BothTellOfTheSameBlow) {
  const Case c = into_a_side();
  test::SpatialTrain train(c.scenario, c.start);
  train.to(c.until);
  ASSERT_EQ(train.incidents().impacts.size(), 1U);
  const model::Impact& impact = train.incidents().impacts[0];
  multibody::Engine run(c.scenario, {1e-7, false, Fault::none, 1e-4}, {body(c.start[0]), body(c.start[1])});
  run.advance(c.until);
  const outcome::Outcome o = run.outcome();
  EXPECT_EQ(o.touches, 1);
  EXPECT_EQ(o.couplers_broken, 1);
  const outcome::FirstTouch& touch = o.closing_speed_max;
  EXPECT_EQ(touch.car_a, 1);
  EXPECT_EQ(touch.car_b, 2);
  EXPECT_NEAR(touch.time, impact.time, 1e-3);
  EXPECT_NEAR(touch.speed, impact.closing_speed, 0.01 * impact.closing_speed);
  EXPECT_NEAR(touch.speed_normal, impact.closing_speed_normal, 0.01 * impact.closing_speed_normal);
  EXPECT_NEAR(touch.x, impact.x, 0.01);
  EXPECT_NEAR(touch.y, impact.y, 0.01);
}

// Later, as ensembles

/// One of many starts of two cars: the first one goes over the edge of the bank, rolling.
Case thrown(unsigned seed) {
  const inputs::Scenario s = on_the_bank(2);
  Case c{"thrown", s, {}, 3.0};
  test::Random random(seed);
  const auto car = [&](double x, double aside, double outwards, double roll_rate) {
    c.start.push_back(at(standing(s, x, aside), Matrix3d::Identity(), {8.0, outwards, 0.0},
                         {roll_rate, 0.0, random.uniform(-0.1, 0.1)}));
  };
  const double aside = random.uniform(1.0, 2.0), apart = random.uniform(0.0, 0.4);
  const double first_outwards = random.uniform(1.0, 2.0), second_outwards = random.uniform(0.0, 0.5);
  const double roll_rate = random.uniform(-3.5, -2.0);
  car(80.0, aside, first_outwards, roll_rate);
  car(80.0 - behind(apart), aside - apart, second_outwards, 0.0);
  return c;
}

/// What has become of each of many pairs of cars.
struct Fates {
  std::vector<double> first_up, second_up;  // upright()
  std::vector<double> together;             // how alike their sides point: 1 if neither has rolled against the other
  std::vector<double> aside;                // of the first car [m]
  void add(const Film& film) {
    const std::vector<BodyMotion>& end = film.back().cars;
    first_up.push_back(upright(film, 0));
    second_up.push_back(upright(film, 1));
    together.push_back(end[0].axes.col(1).dot(end[1].axes.col(1)));
    aside.push_back(end[0].centre.y());
  }
};

/// See test::least_p().
double chance(const Fates& model, const Fates& simbody) {
  const auto all = [](const Fates& f) { return std::array{f.first_up, f.second_up, f.together, f.aside}; };
  return test::least_p(all(model), all(simbody));
}

TEST(SpatialSecondOpinion, ManyEndAlikeButNotWithoutARollStop) {
  constexpr unsigned kRuns = 10;
  Fates model, simbody, loose;
  const multibody::EngineOptions usual;
  const multibody::Steps rough{1e-3, 1e-4, usual.settle_time};
  for (unsigned i = 0; i < kRuns; ++i) {
    model.add(by_model(thrown(i), rough.step));
    simbody.add(by_simbody(thrown(1000 + i), rough));
    loose.add(by_simbody(thrown(2000 + i), rough, Fault::no_roll_stop));
  }
  const double same = chance(model, simbody), other = chance(model, loose);
  std::printf("two cars, %u runs: by chance with probability %.2g, without a roll stop %.2g\n", kRuns, same, other);
  EXPECT_GT(same, 0.01);
  EXPECT_LT(other, 0.01);
  const std::string text = page();
  const std::size_t begin = text.find("the smallest of the eight");
  ASSERT_NE(begin, std::string::npos);
  expect_numbers_on_the_page(text.substr(begin, text.find("\n\n", begin) - begin), {same, other});
}

// Draws are each program's own, so that only many runs can be compared: a car ahead of the broken rail follows rails
// that are not straight, the one behind it is pushed aside as its rear truck comes to the end.
TEST(SpatialSecondOpinion, RandomTracksAndKicksAreAlike) {
  inputs::Scenario s = on_the_bank(2);
  s.initial.cars_ahead = 1;
  s.initial.speed = 12.0;
  s.initial.yaw_rate = 0.05;
  s.initial.perturbation.alignment = 0.006;
  s.initial.perturbation.kick = 0.3;
  s.stop.time_max = 1.3;
  const auto found = [](const BodyMotion& ahead, const BodyMotion& behind) {
    return std::array{ahead.centre.y(), ahead.velocity.y(), behind.rotation.z(), behind.centre.y()};
  };
  constexpr int kRuns = 25;
  std::array<std::vector<double>, 4> model, simbody, quiet;
  const auto add = [](auto& to, const auto& values) {
    for (std::size_t i = 0; i < values.size(); ++i) to[i].push_back(values[i]);
  };
  for (int i = 0; i < kRuns; ++i) {
    s.initial.perturbation.seed = i;
    test::SpatialTrain train(s);
    train.to(s.stop.time_max);
    add(model, found(body(train.car(0)), body(train.car(1))));
    multibody::Engine run(s, {1e-4, false, Fault::none, 5e-4});
    run.advance(s.stop.time_max);
    add(simbody, found(run.cars()[0], run.cars()[1]));
    inputs::Scenario calm = s;
    calm.initial.perturbation.alignment *= 0.1;
    calm.initial.perturbation.kick *= 0.1;
    multibody::Engine other(calm, {1e-4, false, Fault::none, 5e-4});
    other.advance(s.stop.time_max);
    add(quiet, found(other.cars()[0], other.cars()[1]));
  }
  EXPECT_GT(test::least_p(model, simbody), 0.01);
  EXPECT_LT(test::least_p(model, quiet), 0.01);
}

/// A key that asks for a part which the engine has not.
struct Refused {
  const char* key;
  const char* value;
  void (*ask)(inputs::Scenario&);
};
const Refused kRefused[] = {
    {"consist[0].shape", "cylinder", [](auto& s) { s.consist[0].shape = inputs::BodyShape::cylinder; }},
    {"traction.law", "steady", [](auto& s) { s.traction.law = inputs::TractionLaw::steady; }},
    {"ties.law", "guided", [](auto& s) { s.ties.law = inputs::TieLaw::guided; }},
    {"rails.load_exponent", "0.7", [](auto& s) { s.rails.load_exponent = 0.7; }},
    {"ground.load_exponent", "0.7", [](auto& s) { s.ground.load_exponent = 0.7; }},
    {"track.curves", "1 item",
     [](auto& s) {
       s.track.curves = {{-100.0, 200.0, 1e-3, 0.1}};
     }},
    {"track.grades", "1 item",
     [](auto& s) {
       s.track.grades = {{-100.0, 200.0, 0.01}};
     }},
    {"terrain.sections", "1 item", [](auto& s) { s.terrain.sections.resize(1); }},
    {"terrain.grid.rows", "2 items",
     [](auto& s) {
       s.terrain.grid.rows = {{"-1 -1"}, {"-1 -1"}};
     }},
    {"ground.patches", "1 item", [](auto& s) { s.ground.patches.resize(1); }},
    {"initial.mechanism", "bad_track", [](auto& s) { s.initial.mechanism = inputs::Mechanism::bad_track; }},
};

/// What is said of the scenario, which is refused.
std::string refusal(const inputs::Scenario& s) {
  try {
    multibody::require_parts(s, "train.yaml");
  } catch (const inputs::InputError& e) {
    return e.what();
  }
  return "not refused";
}

TEST(SpatialSecondOpinion, RefusesWhatItHasNotAndNamesAllOfIt) {
  EXPECT_NO_THROW(multibody::require_parts(one_car().scenario));
  inputs::Scenario all = one_car().scenario;
  for (const Refused& r : kRefused) {
    inputs::Scenario s = one_car().scenario;
    r.ask(s);
    r.ask(all);
    EXPECT_EQ(refusal(s).rfind(std::string("train.yaml: ") + r.key + " = '" + r.value + "': ", 0), 0U)
        << r.key << ": " << refusal(s);
    EXPECT_NE(refusal(s).find("; allowed: "), std::string::npos) << refusal(s);
  }
  const std::string said = refusal(all);
  for (const Refused& r : kRefused)
    EXPECT_NE(said.find(std::string("\n  train.yaml: ") + r.key + " = '" + r.value + "'"), std::string::npos) << said;
  inputs::Scenario friction = one_car().scenario;
  friction.brakes.law = inputs::BrakeLaw::friction;
  EXPECT_NE(refusal(friction).find("brakes.law = 'friction'"), std::string::npos) << refusal(friction);
  Case c = one_car();
  c.start.clear();
  EXPECT_THROW(by_simbody(c, {}), std::invalid_argument);
}

}  // namespace
}  // namespace train_derail
