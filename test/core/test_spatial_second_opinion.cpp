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

#include "early_motion.hpp"
#include "folder.hpp"
#include "multibody/halving.hpp"
#include "same_ensembles.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/multibody/verify.hpp"

namespace train_derail {
namespace {

using namespace early;

using multibody::Apart;
using multibody::BodyMotion;
using multibody::Fault;
using multibody::Film;

constexpr double kInterval = 0.02;  // at which the two are compared [s]

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
