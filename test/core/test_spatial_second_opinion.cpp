// The second opinion on trains in three dimensions: Simbody's free bodies move as the spatial model's cars do, step by
// step, and mistakes that are put in are seen.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <regex>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "folder.hpp"
#include "multibody/spatial_engine.hpp"
#include "same_ensembles.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/multibody/verify.hpp"

namespace train_derail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using inputs::kInfinity;
using multibody::FreeMotion;
using multibody::SpatialFault;
using test::at;
using test::turned;

constexpr double kInterval = 0.02;  // at which the two are compared [s]

struct Case {
  const char* name;
  inputs::Scenario scenario;
  std::vector<model::SpatialMotion> start;
  double until;
};

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
  s.coupler.butt_height = 0.0;         // cars that go over roll from edge to edge of them: small differences would grow
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
  return {"one car",
          s,
          {at(standing(s, 50.0, 0.5), turned(0.2, Vector3d::UnitZ()), {6.0, 4.0, 0.0}, {-0.3, 0.0, 0.4})},
          1.8};
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
  c.scenario.coupler.butt_height = inputs::Coupler{}.butt_height;
  const double height = test::height_of(c.scenario);
  c.start.clear();
  for (int k = 0; k < 3; ++k)
    c.start.push_back(at({-60.0 - k * (test::kPitch - 0.03), 0.0, height + (k == 1 ? 0.03 : -0.02)},
                         Matrix3d::Identity(), {10.0 + 0.6 * k, 0.0, 0.0}));
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

using Film = std::vector<std::vector<FreeMotion>>;  // cars at every kInterval

int frames(const Case& c) { return static_cast<int>(std::lround(c.until / kInterval)); }

Film by_model(const Case& c, double step) {
  inputs::Scenario s = c.scenario;
  s.solver.fixed_step = step;
  test::SpatialTrain train(s, c.start);
  Film film;
  for (int i = 0; i <= frames(c); ++i) {
    train.to(i * kInterval);
    std::vector<FreeMotion>& cars = film.emplace_back();
    for (std::size_t k = 0; k < c.start.size(); ++k) {
      const model::SpatialMotion q = train.car(static_cast<Eigen::Index>(k));
      cars.push_back({q.centre, q.axes, q.velocity, q.rotation});
    }
  }
  return film;
}

Film by_simbody(const Case& c, const multibody::SpatialEngineOptions& options) {
  std::vector<FreeMotion> start;
  for (const model::SpatialMotion& q : c.start) start.push_back({q.centre, q.axes, q.velocity, q.rotation});
  const auto run = multibody::start_spatial_engine(c.scenario, start, options);
  Film film;
  for (int i = 0; i <= frames(c); ++i) {
    run->advance(i * kInterval);
    film.push_back(run->cars());
  }
  return film;
}

/// The farthest that any car is from its twin at any time.
struct Apart {
  double position = 0.0, angle = 0.0;  // m, rad
};
Apart apart(const Film& a, const Film& b) {
  Apart most;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < a[i].size(); ++k) {
      most.position = std::max(most.position, (a[i][k].centre - b[i][k].centre).norm());
      most.angle = std::max(most.angle, Eigen::AngleAxisd(a[i][k].axes.transpose() * b[i][k].axes).angle());
    }
  }
  return most;
}

constexpr double kWorth = 1e-3;  // a limit above that says nothing [m, rad]

/// Both are followed twice, with steps and tolerances a whole and a half. What halving changes is what an answer lacks
/// still, if it comes closer in proportion to the step; the two agree if they differ by at most twice the sum of both.
struct Comparison {
  Film model, simbody;
  Apart whole, half;  // between the two, with the model's longer and its shorter step
  Apart limit;
  bool within(const Apart& a) const { return a.position <= limit.position && a.angle <= limit.angle; }
  bool agrees() const { return within(half) && limit.position < kWorth && limit.angle < kWorth; }
};

Comparison compare(const Case& c, SpatialFault fault = SpatialFault::none) {
  const Film coarse = by_model(c, 4e-5), rough = by_simbody(c, {1e-6, 1e-4, fault});
  Comparison r;
  r.model = by_model(c, 2e-5);
  r.simbody = by_simbody(c, {1e-7, 5e-5, fault});
  r.whole = apart(coarse, r.simbody);
  r.half = apart(r.model, r.simbody);
  const Apart model = apart(coarse, r.model), simbody = apart(rough, r.simbody);
  r.limit = {2.0 * (model.position + simbody.position), 2.0 * (model.angle + simbody.angle)};
  std::printf("%s: %.1e m and %.1e rad apart (allowed: %.1e, %.1e; with twice the step %.1e, %.1e)\n", c.name,
              r.half.position, r.half.angle, r.limit.position, r.limit.angle, r.whole.position, r.whole.angle);
  return r;
}

/// How upright a car is at the end: 1 on its wheels, 0 on its side, -1 upside down.
double upright(const Film& film, std::size_t car) { return film.back()[car].axes(2, 2); }

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
    {"rails", off_the_rails, [](inputs::Scenario& s) { s.rails.stiffness *= kMore; }},
    {"rail damping", off_the_rails, [](inputs::Scenario& s) { s.rails.damping_ratio *= kMore; }},
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
  const Comparison r = compare(GetParam()());
  EXPECT_TRUE(r.agrees());
  // They come closer as the model's step becomes shorter.
  EXPECT_LT(r.half.position, 0.8 * r.whole.position);
  const Case c = GetParam()();
  expect_row_on_the_page(std::string(c.name) + ':',
                         {c.until, r.half.position / kMilli, r.limit.position / kMilli, r.half.angle / kMilli,
                          r.limit.angle / kMilli, r.whole.position / kMilli});
}

TEST_P(EarlyMotion, ASmallChangeIsSeen) {
  const Comparison r = compare(GetParam()());
  for (const Change& change : kChanges) {
    if (change.of != GetParam()) continue;
    Case c = GetParam()();
    change.change(c.scenario);
    EXPECT_FALSE(r.within(apart(by_model(c, 2e-5), r.simbody))) << change.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, EarlyMotion,
                         testing::Values(one_car, two_cars, three_cars, off_the_rails, in_buff, a_coupler_breaks),
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
  Case c = off_the_rails();
  test::SpatialTrain train(c.scenario, c.start);
  EXPECT_TRUE(train.incidents().derailments.empty());
  train.to(c.until);
  EXPECT_EQ(train.incidents().derailments.size(), 3U);
}

TEST(SpatialSecondOpinion, SeesTheWrongSignOfTheGyroscopicMoment) {
  const Comparison r = compare(one_car(), SpatialFault::gyroscopic_sign);
  EXPECT_FALSE(r.within(r.half));
  EXPECT_GT(r.half.position, 0.1);
  expect_row_on_the_page("gyroscopic moment", {r.half.position, r.half.angle});
}

TEST(SpatialSecondOpinion, SeesACentreOfMassOnTheWrongSideOfTheRail) {
  const Comparison r = compare(one_car(), SpatialFault::centre_below_rail);
  EXPECT_FALSE(r.within(r.half));
  EXPECT_GT(r.half.angle, 1.0);
  expect_row_on_the_page("centre of mass on the wrong side", {r.half.position, r.half.angle});
}

TEST(SpatialSecondOpinion, SeesThatTheRollStopIsMissing) {
  const Comparison r = compare(three_cars(), SpatialFault::no_roll_stop);
  EXPECT_FALSE(r.within(r.half));
  // It is the roll stop that takes the second car along.
  EXPECT_LT(upright(r.model, 1), 0.0);
  EXPECT_GT(upright(r.simbody, 1), 0.5);
  expect_row_on_the_page("roll stop left out", {r.half.position, r.half.angle});
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
    const std::vector<FreeMotion>& end = film.back();
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
  for (unsigned i = 0; i < kRuns; ++i) {
    model.add(by_model(thrown(i), 1e-3));
    simbody.add(by_simbody(thrown(1000 + i), {1e-4, 5e-4}));
    loose.add(by_simbody(thrown(2000 + i), {1e-4, 5e-4, SpatialFault::no_roll_stop}));
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

TEST(SpatialSecondOpinion, RefusesWhatItHasNot) {
  Case c = one_car();
  const auto start = [&c] { by_simbody({c.name, c.scenario, c.start, 0.0}, {}); };
  EXPECT_NO_THROW(start());
  c.scenario.contact.law = inputs::ContactLaw::elastic;
  EXPECT_THROW(start(), std::invalid_argument);
  c = one_car();
  c.scenario.brakes.force = 0.05;
  EXPECT_THROW(start(), std::invalid_argument);
  c = one_car();
  c.scenario.track.grades = {{-100.0, 200.0, 0.01}};
  EXPECT_THROW(start(), std::invalid_argument);
  c = one_car();
  c.scenario.terrain.sections.resize(1);
  c.scenario.terrain.sections[0].length = 50.0;
  EXPECT_THROW(start(), std::invalid_argument);
  c = one_car();
  c.scenario.terrain.bank_left = c.scenario.terrain.bank_right = 0.0;
  c.scenario.terrain.grid.rows = {{"-1 -1"}, {"-1 -1"}};
  EXPECT_THROW(start(), std::invalid_argument);
  c = one_car();
  c.scenario.track.curves = {{-100.0, 200.0, 1e-3, 0.1}};
  EXPECT_THROW(start(), std::invalid_argument);
  const auto expect_refused = [](const std::string& key, const auto& change) {
    Case changed = one_car();
    change(changed.scenario);
    try {
      by_simbody({changed.name, changed.scenario, changed.start, 0.0}, {});
      FAIL() << key;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(key), std::string::npos) << e.what();
    }
  };
  expect_refused("shape", [](auto& s) { s.consist[0].shape = inputs::BodyShape::cylinder; });
  expect_refused("ground.load_exponent", [](auto& s) { s.ground.load_exponent = 0.7; });
  expect_refused("rails.load_exponent", [](auto& s) { s.rails.load_exponent = 0.7; });
  expect_refused("initial.mechanism", [](auto& s) { s.initial.mechanism = inputs::Mechanism::bad_track; });
  expect_refused("ties.law", [](auto& s) { s.ties.law = inputs::TieLaw::guided; });
  expect_refused("traction", [](auto& s) { s.traction.law = inputs::TractionLaw::steady; });
  c = one_car();
  c.start.clear();
  EXPECT_THROW(start(), std::invalid_argument);
}

TEST(SpatialSecondOpinion, VerifySaysThatItHasNoSuchModel) {
  try {
    multibody::verify(one_car().scenario, {}, [](double, const std::string&) {});
    FAIL() << "not refused";
  } catch (const inputs::InputError& e) {
    EXPECT_EQ(e.key(), "model");
    EXPECT_NE(std::string(e.what()).find("model = 'spatial'"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace train_derail
