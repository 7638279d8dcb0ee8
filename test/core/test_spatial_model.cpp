// The train in three dimensions against closed forms and invariants: free bodies and whole runs.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "model/rotation.hpp"
#include "spatial_fixtures.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/step_limit.hpp"
#include "train_derail/simulation/checkpoint.hpp"

namespace train_derail {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using inputs::kInfinity;
using model::SpatialMotion;
using test::at;
using test::everything;
using test::height_of;
using test::spatial;
using test::turned;
using Train = test::SpatialTrain;
using test::kAloft;
using test::kGravity;

// Free bodies

/// A body that tumbles about its middle axis.
struct Tumble {
  Vector3d inertia{1.0, 2.0, 4.0}, rates;
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();

  void step(double h) {
    using Three = model::Three<double>;
    const Three i{inertia.x(), inertia.y(), inertia.z()};
    const Three spin = i.times({rates.x(), rates.y(), rates.z()});
    const model::Turn<double> by = model::turn_by(model::mean_rates(i, spin, h) * h);
    const Three after = model::turned_back(spin, by).over(i);
    rates = {after.x, after.y, after.z};
    turn = (turn * Eigen::Quaterniond(by.w, by.v.x, by.v.y, by.v.z)).normalized();
  }
  Vector3d momentum() const { return turn * inertia.cwiseProduct(rates); }
  double energy() const { return 0.5 * rates.dot(inertia.cwiseProduct(rates)); }
};

TEST(Tumbling, KeepsMomentumAndEnergy) {
  double drift[2];
  for (const int i : {0, 1}) {
    Tumble body;
    body.rates = {0.01, 2.0, 0.02};
    const Vector3d momentum = body.momentum();
    const double energy = body.energy();
    drift[i] = 0.0;
    const double h = i == 0 ? 2e-3 : 1e-3;
    for (double t = 0.0; t < 60.0; t += h) {
      body.step(h);
      drift[i] = std::max(drift[i], std::abs(body.energy() / energy - 1.0));
    }
    EXPECT_LT((body.momentum() - momentum).norm() / momentum.norm(), 1e-11);
  }
  // It swings with every flip, by the square of the step, and does not grow.
  EXPECT_LT(drift[0], 1e-5);
  EXPECT_GT(drift[0] / drift[1], 3.5);
}

TEST(Tumbling, FlipsAtThePeriodOfTheEllipticIntegral) {
  Tumble body;
  body.rates = {0.02, 2.0, 0.0};
  const double i1 = body.inertia[0], i2 = body.inertia[1], i3 = body.inertia[2];
  const double l2 = body.momentum().squaredNorm(), e2 = 2.0 * body.energy();
  // Landau and Lifshitz, Mechanics, section 37; the axes such that L^2 > 2 E I2.
  const bool high = l2 > e2 * i2;
  const double a = high ? i1 : i3, c = high ? i3 : i1;
  const double modulus = std::sqrt((i2 - a) * (e2 * c - l2) / ((c - i2) * (l2 - e2 * a)));
  const double rate = std::sqrt((c - i2) * (l2 - e2 * a) / (a * i2 * c));
  const double period = 4.0 * std::comp_ellint_1(modulus) / std::abs(rate);
  std::vector<double> flips;
  const double h = 1e-4;
  double before = body.rates.y();
  for (double t = h; flips.size() < 5; t += h) {
    ASSERT_LT(t, 100.0);
    body.step(h);
    if (before * body.rates.y() < 0.0) flips.push_back(t);
    before = body.rates.y();
  }
  EXPECT_NEAR((flips[4] - flips[0]) / (2.0 * period), 1.0, 2e-3);
}

TEST(Tumbling, OfACarThatFalls) {
  inputs::Scenario s = spatial(1, 1e-3);
  const Vector3d rates(0.3, 0.2, 1.0);
  Train train(s, {at(kAloft + Vector3d(0.0, 0.0, 200.0), turned(0.4, {1.0, 2.0, 3.0}), {3.0, 0.0, 10.0}, rates)});
  const auto spin = [&] {
    const model::SpatialMomentum p = train.momentum();
    const SpatialMotion q = train.car(0);
    return Vector3d(p.angular - q.centre.cross(p.linear));
  };
  const Vector3d before = spin();
  const double energy = train.energy().kinetic_rotation;
  train.to(5.0);
  EXPECT_LT((spin() - before).norm() / before.norm(), 1e-10);
  EXPECT_NEAR(train.energy().kinetic_rotation / energy, 1.0, 1e-3);
  EXPECT_NEAR(train.car(0).velocity.z(), 10.0 - 5.0 * kGravity, 1e-9);
  // A symmetric top: pitch and yaw rates turn about the roll axis at (I / I_roll - 1) times the roll rate.
  const model::Car& car = train.model().cars()[0];
  const double angle = -(1.0 - car.roll_inertia / car.yaw_inertia) * rates.x() * 5.0;
  const Vector3d after = train.car(0).body_rates;
  EXPECT_NEAR(after.x(), rates.x(), 1e-8);
  EXPECT_NEAR(after.y(), rates.y() * std::cos(angle) - rates.z() * std::sin(angle), 2e-3);
  EXPECT_NEAR(after.z(), rates.y() * std::sin(angle) + rates.z() * std::cos(angle), 2e-3);
}

// Whole runs

TEST(SpatialRun, EnergyIsAccountedFor) {
  struct Case {
    double step;
    bool hilly, round;
  };
  for (const auto& [step, hilly, round] :
       {Case{2e-3, false, false}, {5e-4, false, false}, {2e-3, true, false}, {2e-3, false, true}}) {
    inputs::Scenario s = everything(30, step, hilly);
    if (round) s.consist.back().shape = inputs::BodyShape::cylinder;
    simulation::Simulation sim(s);
    sim.run();
    const outcome::Outcome o = sim.outcome();
    EXPECT_EQ(o.ended, outcome::Ended::at_rest) << step << ' ' << o.energy.kinetic();
    EXPECT_LT(o.energy_residual, step == 2e-3 ? 1e-4 : 3e-5);
    const model::EnergyLedger& e = o.energy;
    for (const double taken : {e.work_on_track, e.work_off_track, e.work_rails, e.work_coupler_damping,
                               e.work_truck_damping, e.work_body_ground, e.work_impact_normal, e.work_impact_friction})
      EXPECT_GT(taken / o.energy_initial, 1e-5);
    EXPECT_LT(e.work_grade, 0.0);
    // All cars fall from the rails; on hills the train also stands at another height than before.
    if (hilly) EXPECT_GT(std::abs(e.height), 1e6);
    else EXPECT_LT(e.height, 0.0);
  }
}

TEST(SpatialRun, APileComesToRest) {
  inputs::Scenario s = test::accident(60);
  s.model = inputs::Model::spatial;
  s.terrain.bank_left = 2.0;
  s.terrain.rest_speed = 0.0;  // by its forces alone
  Train train(s);
  train.to(90.0);
  int over = 0;
  std::vector<Vector3d> places;
  for (Eigen::Index k = 0; k < 60; ++k) {
    places.push_back(train.car(k).centre);
    if (train.model().derailed(k) && train.car(k).axes(2, 2) < 0.5) ++over;
  }
  EXPECT_GT(over, 3);
  EXPECT_LT(train.energy().kinetic(), 1e-3);
  train.to(110.0);
  for (Eigen::Index k = 0; k < 60; ++k)
    EXPECT_LT((train.car(k).centre - places[static_cast<std::size_t>(k)]).norm(), 1e-4) << k;
  EXPECT_LT(train.energy().kinetic(), 1e-6);
}

/// Seventy cars and more in one jackknifed pile: each leans on up to six others with some hundred tons.
inputs::Scenario dense_pile(int seed) {
  inputs::Scenario s =
      inputs::read_scenario_file(std::string(TRAIN_DERAIL_SOURCE_DIR) + "/config/accidents/lac_megantic_2013.yaml");
  s.model = inputs::Model::spatial;
  s.initial.perturbation.seed = seed;
  return s;
}

TEST(SpatialRun, ADensePileComesToRestByItsForcesAlone) {
  // With damping that steps cannot carry, cars would be thrown back and forth for ever: 50 to 900 J.
  for (const int seed : {1, 2, 4}) {
    inputs::Scenario s = dense_pile(seed);
    s.terrain.rest_speed = 0.0;
    Train train(s);
    train.to(100.0);
    EXPECT_LT(train.energy().kinetic(), 20.0) << seed;
  }
}

TEST(SpatialRest, ADensePileIsHeldWholeAndThenCostsNothing) {
  for (const int seed : {1, 2, 4}) {
    Train train(dense_pile(seed));
    train.to(100.0);
    ASSERT_EQ(train.energy().kinetic(), 0.0) << seed;
    const std::int64_t rounds = train.model().force_rounds();
    const std::vector<double> places(train.data(), train.data() + 3 * train.model().car_count());
    const double total = train.energy().total();
    train.to(110.0);
    EXPECT_EQ(train.model().force_rounds(), rounds) << "nothing is found again";
    EXPECT_EQ(train.energy().kinetic(), 0.0) << seed;
    EXPECT_TRUE(std::equal(places.begin(), places.end(), train.data())) << seed;
    EXPECT_EQ(train.energy().total(), total);
  }
}

TEST(SpatialRest, APileThatIsRestoredGoesOnAsItWouldHave) {
  const inputs::Scenario s = dense_pile(4);
  Train whole(s);
  whole.to(45.0);  // some lie, some do not
  ASSERT_GT(whole.energy().kinetic(), 0.0);
  Train resumed(s, whole);
  for (Train* train : {&whole, &resumed}) train->to(50.0);
  const Eigen::Index n = whole.model().car_count();
  int still = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    EXPECT_EQ(whole.car(k).centre, resumed.car(k).centre) << k;
    EXPECT_EQ(whole.car(k).axes, resumed.car(k).axes) << k;
    still += whole.car(k).velocity.isZero(0.0) ? 1 : 0;
  }
  EXPECT_GT(still, 20);
}

TEST(SpatialRest, ACarThatStandsOnTheRailsIsHeldUntilItIsHit) {
  inputs::Scenario s = spatial(2, 2e-3);
  s.contact.law = inputs::ContactLaw::elastic;
  s.coupler.break_draft = 1e-4;
  s.brakes.rolling_resistance = 0.005;
  const double length = model::expand(s.consist)[0].length;
  const auto run = [&](double rest_speed) {
    s.terrain.rest_speed = rest_speed;
    const Vector3d first(-300.0, 0.0, height_of(s));
    Train train(s, {at(first, Matrix3d::Identity(), {4e-3, 0.0, 0.0}),
                    at(first - Vector3d(length + 4.0, 0.0, 0.0), Matrix3d::Identity(), {3.0, 0.0, 0.0})});
    train.to(1.0);
    EXPECT_EQ(train.car(0).velocity.isZero(0.0), rest_speed > 0.0);
    train.to(10.0);
    EXPECT_EQ(train.incidents().impacts.size(), 1U);
    return std::array<Vector3d, 2>{train.car(0).centre, train.car(1).centre};
  };
  const auto held = run(0.01), free = run(0.0);
  EXPECT_GT(held[0].x(), -295.0);
  for (std::size_t k = 0; k < 2; ++k) EXPECT_LT((held[k] - free[k]).norm(), 0.02) << k;
}

TEST(SpatialRest, ACarOnTheRailsIsHeldOnAGradeOnlyIfItsResistanceHoldsIt) {
  inputs::Scenario s = spatial(1, 2e-3);
  s.brakes.rolling_resistance = 0.002;
  const auto moved = [&s](double grade) {
    s.track.grade = grade;
    const Vector3d from(-500.0, 0.0, height_of(s));
    Train train(s, {at(from)});
    train.to(20.0);
    EXPECT_EQ(train.energy().kinetic() == 0.0, -grade < s.brakes.rolling_resistance);
    return train.car(0).centre.x() - from.x();
  };
  EXPECT_LT(moved(-0.0015), 1e-2);
  EXPECT_NEAR(moved(-0.0025), 0.5 * 0.0005 * kGravity * 400.0, 0.02);
}

TEST(SpatialRest, APileIsHeldWithoutALossInTheLedger) {
  inputs::Scenario s = everything(30, 2e-3);
  Train train(s);
  train.to(60.0);
  std::vector<Vector3d> places;
  const model::EnergyLedger before = train.energy();
  int held = 0;
  for (Eigen::Index k = 0; k < 30; ++k) {
    places.push_back(train.car(k).centre);
    if (!train.model().derailed(k)) continue;
    held += train.car(k).velocity.isZero(0.0) && train.car(k).rotation.isZero(0.0) ? 1 : 0;
  }
  EXPECT_GT(held, 5);
  train.to(70.0);
  for (Eigen::Index k = 0; k < 30; ++k) {
    if (!train.model().derailed(k)) continue;
    EXPECT_EQ(train.car(k).centre, places[static_cast<std::size_t>(k)]) << k;
  }
  EXPECT_NEAR(train.energy().suspension / before.suspension, 1.0, 1e-5);
  s.terrain.rest_speed = 0.0;
  Train free(s);
  free.to(60.0);
  EXPECT_NEAR(train.energy().total() / free.energy().total(), 1.0, 1e-4);
}

TEST(SpatialRest, AHitWakesACarAndWhatLeansOnIt) {
  // Two cars stand off the rails, end to end; a third one runs into them.
  inputs::Scenario s = spatial(3);
  s.contact.law = inputs::ContactLaw::elastic;
  s.ground.off_track_friction = 0.5;
  const auto run = [&s](double rest_speed) {
    s.terrain.rest_speed = rest_speed;
    const double length = model::expand(s.consist)[0].length, up = height_of(s) - s.terrain.rail_height;
    std::vector<SpatialMotion> cars(3);
    cars[0] = at({200.0, 0.0, up});
    cars[1] = at({200.0 - length, 0.0, up});
    cars[2] = at({200.0 - 2.0 * length - 9.0, 0.3, up}, Matrix3d::Identity(), {14.0, 0.0, 0.0});
    Train train(s, cars);
    train.to(0.6);
    const bool held = train.car(0).velocity.isZero(0.0) && train.car(1).velocity.isZero(0.0);
    EXPECT_TRUE(held || rest_speed == 0.0);
    train.to(20.0);
    return std::array<Vector3d, 3>{train.car(0).centre, train.car(1).centre, train.car(2).centre};
  };
  const auto woken = run(0.01), free = run(0.0);
  EXPECT_GT(woken[0].x(), 200.05);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_LT((woken[k] - free[k]).norm(), 0.05) << k;
}

/// A car that stands off the rails, and one that comes from behind without a coupler.
inputs::Scenario standing_and_coming() {
  inputs::Scenario s = spatial(2, 2e-3);
  s.contact.law = inputs::ContactLaw::elastic;
  s.contact.friction = 0.0;
  s.coupler.break_draft = 1e-4;
  s.ground.off_track_law = inputs::OffTrackLaw::by_slip;
  s.track.curves = {{10.0, 1000.0, 1.0 / 600.0}};
  s.track.grade = -0.01;
  s.ground.patches = {{-1e3, 1e3, -1.0, 1.0, 0.0}};  // nothing would hold the car in the middle of the track
  return s;
}
std::vector<SpatialMotion> standing_and_coming(const inputs::Scenario& s, double gap, double speed) {
  const double length = model::expand(s.consist)[0].length, up = height_of(s) - s.terrain.rail_height;
  const Matrix3d along = turned(std::atan(190.0 / 600.0), Vector3d::UnitZ());
  const Vector3d first(200.0, 34.0, up);
  return {at(first, along),
          at(first - along * Vector3d(length + gap, 0.3, 0.0), along, along * Vector3d(speed, 0.0, 0.0))};
}

TEST(SpatialRest, TheFirstBlowWakesACar) {
  inputs::Scenario s = standing_and_coming();
  // All of the force at once: it does not change from the first step of the blow to the next.
  s.contact.crush_force = 1e5;
  // It comes long after the car has come to rest, or in the very next steps.
  int held = 0;
  for (double gap = 8.0; gap < 11.0; gap += 0.013) {
    Train train(s, standing_and_coming(s, gap, 20.0));
    bool still = false;
    while (train.incidents().impacts.empty() && train.time() < 3.0) {
      still = train.car(0).velocity.isZero(0.0);
      train.step();
    }
    train.step();  // the blow may have begun with less than what wakes
    if (!still || train.time() > 2.9) continue;
    ++held;
    ASSERT_GT(train.car(0).velocity.x(), 0.0) << gap;
    // From the first step on it stands on its wheels.
    ASSERT_GT(train.car(0).velocity.z(), -0.2 * kGravity * s.solver.fixed_step.value()) << gap;
  }
  EXPECT_GT(held, 50);
}

TEST(SpatialRest, AHeldCarThatIsRestoredWakesAsItWouldHave) {
  inputs::Scenario s = standing_and_coming();
  Train whole(s, standing_and_coming(s, 20.0, 20.0));
  whole.to(0.8);
  ASSERT_TRUE(whole.car(0).velocity.isZero(0.0));
  Train resumed(s, whole);
  s.terrain.rest_speed = 0.0;
  Train free(s, whole);
  free.step();
  EXPECT_FALSE(free.car(0).velocity.isZero(0.0)) << "no car is held any more";
  for (Train* train : {&whole, &resumed}) train->to(4.0);
  EXPECT_GT(whole.car(0).centre.x(), 200.5);
  for (Eigen::Index k = 0; k < 2; ++k) EXPECT_EQ(whole.car(k).centre, resumed.car(k).centre) << k;
}

TEST(SpatialRun, FlatAndStiffMovesAsInThePlane) {
  inputs::Scenario plane = test::accident(15);
  plane.model = inputs::Model::extended;
  plane.initial.perturbation.kick = 0.0;
  inputs::Scenario space = plane;
  space.model = inputs::Model::spatial;
  space.terrain.rail_height = 0.0;
  space.suspension.half_base = 1.5;
  space.suspension.damping_ratio = 0.5;
  for (inputs::CarBlock& b : space.consist) b.centre_height = 0.2;
  space.coupler.height = 0.2;
  test::Train flat(plane);
  Train train(space);
  for (const double t : {0.5, 1.0, 2.0}) {
    flat.to(t);
    train.to(t);
    for (Eigen::Index k = 0; k < 15; ++k) {
      const SpatialMotion q = train.car(k);
      const test::CarMotion p = flat.car(k);
      EXPECT_NEAR(q.centre.x(), p.x, 0.03 * t * t) << k << " at " << t;
      EXPECT_NEAR(q.centre.y(), p.y, 0.03 * t * t) << k << " at " << t;
      EXPECT_NEAR(std::atan2(q.axes(1, 0), q.axes(0, 0)), p.theta, 0.01 * t * t) << k << " at " << t;
    }
    EXPECT_EQ(train.incidents().derailments.size(), flat.incidents().derailments.size());
  }
  EXPECT_GT(train.incidents().derailments.size(), 2U);
}

TEST(SpatialRun, IsTheSameForEveryInstructionSet) {
  enum class Line { curved, hilly, straight, level };
  for (const Line line : {Line::curved, Line::hilly, Line::straight, Line::level}) {
    // As many cars as leave a part of the widest block.
    inputs::Scenario s = everything(18, 2e-3, line == Line::hilly);
    if (line == Line::straight || line == Line::level) s.track.curves.clear();
    if (line == Line::level) s.terrain.bank_left = s.terrain.bank_right = s.terrain.ballast_height = 0.0;
    s.ground.patches = {{-1e3, 1e3, 0.0, 1e3, 1.2}};
    Train plain(s, {}, "plain");
    plain.to(3.0);
    EXPECT_GT(plain.incidents().derailments.size(), 2U);
    for (const std::string& set : model::SpatialModel::instruction_sets(18)) {
      Train train(s, {}, set);
      train.to(3.0);
      for (Eigen::Index k = 0; k < 18; ++k) {
        EXPECT_LT((train.car(k).centre - plain.car(k).centre).norm(), 1e-6) << set << " car " << k;
        EXPECT_LT((train.car(k).axes - plain.car(k).axes).norm(), 1e-6) << set << " car " << k;
      }
      EXPECT_NEAR(train.energy().total(), plain.energy().total(), 1e-6 * plain.energy().total()) << set;
      EXPECT_NEAR(train.energy().work_off_track, plain.energy().work_off_track,
                  1e-4 * std::abs(plain.energy().work_off_track))
          << set;
      EXPECT_NEAR(train.energy().work_coupler_damping, plain.energy().work_coupler_damping,
                  1e-4 * plain.energy().work_coupler_damping)
          << set;
    }
  }
}

TEST(SpatialRun, GoesOnFromACheckpointBitForBit) {
  inputs::Scenario s = everything(20, 2e-3);
  s.consist.back().count -= 8;
  s.consist.push_back(s.consist.back());
  s.consist.back().count = 8;
  s.consist[s.consist.size() - 2].shape = inputs::BodyShape::cylinder;
  simulation::Simulation whole(s);
  // While cars derail, and when brakes and ground hold them.
  for (const double t : {7.0, 22.0}) {
    whole.advance(t);
    const simulation::Checkpoint saved = whole.checkpoint();
    whole.advance(t + 8.0);
    simulation::Simulation resumed(s, saved);
    resumed.advance(t + 8.0);
    EXPECT_GT(whole.outcome().cars_derailed, 3);
    EXPECT_EQ((whole.state() - resumed.state()).cwiseAbs().maxCoeff(), 0.0) << t;
  }
}

/// Butts in hard buff are a spring that turns cars level: at the longest step it is stable, and not far below what
/// blows up.
TEST(SpatialRun, AStepTooLongForButtsShakesCars) {
  inputs::Scenario s = test::spatial(2);
  s.coupler.stiffness = 1e8;
  s.coupler.slack = 0.15;
  s.coupler.butt_height = 1.0;
  s.coupler.height = test::height_of(s);
  const model::StepLimit limit = model::step_limits(s).front();
  ASSERT_EQ(limit.key, "coupler.butt_height");
  // Two cars in free fall run into each other, one higher by a hair.
  const auto pitch = [&](double step) {
    s.solver.fixed_step = step;
    const Vector3d half(0.5 * test::kPitch, 0.0, 0.0), speed(2.6, 0.0, 0.0);
    Train train(s, {at(kAloft + half + Vector3d(0.0, 0.0, 1e-6), Matrix3d::Identity(), -speed),
                    at(kAloft - half, Matrix3d::Identity(), speed)});
    double pitch_max = 0.0, buff_max = 0.0;
    train.to(0.15, [&] {
      pitch_max = std::max(pitch_max, std::abs(train.car(0).axes(2, 0)));
      buff_max = std::max(buff_max, (*train.model().axial_forces())[0]);
    });
    EXPECT_NEAR(buff_max / inputs::kKip, 3000.0, 300.0);
    return pitch_max;
  };
  EXPECT_LT(pitch(0.99 * limit.step_max), 1e-5);
  EXPECT_GT(pitch(3.0 * limit.step_max), 1e-3);
}

TEST(SpatialRun, ATooLongStepIsRefused) {
  inputs::Scenario s = test::accident(5);
  s.model = inputs::Model::spatial;
  const double longest = model::step_limits(s).front().step_max;
  EXPECT_GT(longest, 2e-3);
  s.solver.fixed_step = 1.01 * longest;
  EXPECT_THROW(simulation::Simulation{s}, inputs::InputError);
  s.solver.fixed_step = 0.99 * longest;
  EXPECT_NO_THROW(simulation::Simulation{s});
  // Each new mechanism may be what limits the step.
  for (const auto& stiffen : std::vector<std::function<void()>>{
           [&] { s.suspension.stiffness = 1e12; }, [&] { s.terrain.body_stiffness = 1e12; },
           [&] { s.coupler.butt_height = 1.0; }, [&] { s.coupler.pitch_stiffness = 1e12; },
           [&] { s.coupler.roll_stiffness = 1e12; },
           [&] {
             s.ties.law = inputs::TieLaw::guided;
             s.ties.stiffness = 1e12;
           }}) {
    const inputs::Scenario kept = s;
    stiffen();
    EXPECT_THROW(simulation::Simulation{s}, inputs::InputError);
    s = kept;
  }
}

}  // namespace
}  // namespace train_derail
