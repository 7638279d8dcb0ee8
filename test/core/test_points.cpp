// Kinematics: pins and trucks (eqs. 1, 2, 4, 5), gaps and swings (eqs. 6 to 9, 13), expansion of the consist.
#include <gtest/gtest.h>

#include "fixtures.hpp"

namespace train_derail {
namespace {

using Vec = Eigen::Vector2d;

TEST(Consist, IsExpandedCarByCarFromTheFirstToDerail) {
  inputs::Scenario s = test::mixed_train();
  const std::vector<model::Car> cars = model::expand(s.consist);
  ASSERT_EQ(cars.size(), 7U);
  EXPECT_EQ(cars[1].length, 18.0);
  EXPECT_EQ(cars[2].length, 14.0);
  EXPECT_EQ(cars[6].length, 10.0);
  EXPECT_EQ(cars[0].truck_spacing, 12.5);
  EXPECT_DOUBLE_EQ(cars[4].truck_spacing, 0.7 * 14.0);
  EXPECT_DOUBLE_EQ(cars[0].mass, 1.1e6 / inputs::kStandardGravity);
  EXPECT_DOUBLE_EQ(cars[1].yaw_inertia, 0.085 * cars[1].mass * 18.0 * 18.0);
  EXPECT_EQ(cars[2].yaw_inertia, 1.3e6);
  EXPECT_EQ(cars[5].weight, 2.5e5);
}

TEST(Consist, DefaultsFillWhatThePaperLeavesOut) {
  const model::Car car = model::expand(test::baseline(1).consist).at(0);
  EXPECT_DOUBLE_EQ(car.truck_spacing, 0.71 * 59.2 * inputs::kFoot);
  EXPECT_DOUBLE_EQ(car.yaw_inertia, 0.093 * car.mass * car.length * car.length);
  EXPECT_DOUBLE_EQ(car.width, 10.0 * inputs::kFoot);
}

TEST(Points, MoveAsPointsOfARigidBody) {
  const inputs::Scenario s = test::mixed_train();
  const model::DerailmentModel m(s);
  test::Random random(21);
  const model::StateVector y = test::random_state(m, random);
  const double h = 1e-5;
  model::StateVector ahead = y, behind = y;
  const auto q = model::motion(y.data(), m.car_count());
  auto qa = model::motion(ahead.data(), m.car_count());
  auto qb = model::motion(behind.data(), m.car_count());
  for (Eigen::Index c = 0; c < 3; ++c) {  // pose moved on by velocity alone
    qa.col(c) += h * q.col(c + 3);
    qb.col(c) -= h * q.col(c + 3);
  }
  for (Eigen::Index k = 0; k < m.car_count(); ++k) {
    const model::Car& car = m.cars()[static_cast<std::size_t>(k)];
    const Vec centre(q(k, model::X), q(k, model::Y));
    const Vec heading(std::cos(q(k, model::THETA)), std::sin(q(k, model::THETA)));
    EXPECT_LT((m.front_pin(y.data(), k).position - (centre + 0.5 * car.length * heading)).norm(), 1e-13);
    EXPECT_LT((m.rear_pin(y.data(), k).position - (centre - 0.5 * car.length * heading)).norm(), 1e-13);
    EXPECT_LT((m.front_truck(y.data(), k).position - (centre + 0.5 * car.truck_spacing * heading)).norm(), 1e-13);
    EXPECT_LT((m.rear_truck(y.data(), k).position - (centre - 0.5 * car.truck_spacing * heading)).norm(), 1e-13);
    for (const double offset : {0.5 * car.length, 0.5 * car.truck_spacing, -0.5 * car.truck_spacing, 1.0}) {
      // Central difference: truncation offset omega^3 h^2 / 6, rounding 1e-14 / h; both below 1e-8.
      const Vec slope =
          (m.point(ahead.data(), k, offset).position - m.point(behind.data(), k, offset).position) / (2.0 * h);
      EXPECT_LT((m.point(y.data(), k, offset).velocity - slope).norm(), 1e-8);
    }
  }
  for (Eigen::Index i = 0; i < m.coupler_count(); ++i) {
    const Vec bar = m.rear_pin(y.data(), i).position - m.front_pin(y.data(), i + 1).position;
    EXPECT_NEAR(m.coupler(y.data(), i).gap, bar.norm(), 1e-12);
    EXPECT_NEAR(m.coupler(y.data(), i).ux, bar.x() / bar.norm(), 1e-12);
    EXPECT_NEAR(m.coupler(y.data(), i).uy, bar.y() / bar.norm(), 1e-12);
    const double beta = std::atan2(bar.y(), bar.x());
    const auto b = m.coupler(y.data(), i);
    EXPECT_NEAR(std::remainder(b.swing_lead - (beta - q(i, model::THETA)), 2.0 * test::kPi), 0.0, 1e-12);
    EXPECT_NEAR(std::remainder(b.swing_trail - (beta - q(i + 1, model::THETA)), 2.0 * test::kPi), 0.0, 1e-12);
    EXPECT_LE(std::max(std::abs(b.swing_lead), std::abs(b.swing_trail)), test::kPi);
  }
}

TEST(Ledger, AddsUpTheEnergiesOfTheBodies) {
  inputs::Scenario s = test::mixed_train();
  const model::DerailmentModel m(s);
  test::Random random(22);
  model::StateVector y = test::random_state(m, random);
  model::work(y.data(), m.car_count()) << 5.0, 7.0;
  const auto q = model::motion(y.data(), m.car_count());
  double translation = 0.0, rotation = 0.0, axial = 0.0, swing = 0.0, px = 0.0, py = 0.0, spin = 0.0;
  for (Eigen::Index k = 0; k < m.car_count(); ++k) {
    const model::Car& car = m.cars()[static_cast<std::size_t>(k)];
    translation += 0.5 * car.mass * (std::pow(q(k, model::VX), 2) + std::pow(q(k, model::VY), 2));
    rotation += 0.5 * car.yaw_inertia * std::pow(q(k, model::OMEGA), 2);
    px += car.mass * q(k, model::VX);
    py += car.mass * q(k, model::VY);
    spin += car.mass * (q(k, model::X) * q(k, model::VY) - q(k, model::Y) * q(k, model::VX)) +
            car.yaw_inertia * q(k, model::OMEGA);
  }
  for (Eigen::Index i = 0; i < m.coupler_count(); ++i) {
    const auto b = m.coupler(y.data(), i);
    axial += model::axial_energy(s.coupler, b.gap);
    swing += model::swing_energy(s.coupler, b.swing_lead) + model::swing_energy(s.coupler, b.swing_trail);
  }
  const model::EnergyLedger e = m.energy(y.data());
  EXPECT_NEAR(e.kinetic_translation / translation, 1.0, 1e-13);
  EXPECT_NEAR(e.kinetic_rotation / rotation, 1.0, 1e-13);
  EXPECT_NEAR(e.coupler_axial / axial, 1.0, 1e-12);
  EXPECT_NEAR(e.coupler_swing / swing, 1.0, 1e-12);
  EXPECT_EQ(e.work_on_track, 5.0);
  EXPECT_EQ(e.work_off_track, 7.0);
  const model::Momentum p = m.momentum(y.data());
  EXPECT_NEAR(p.x / px, 1.0, 1e-11);
  EXPECT_NEAR(p.y / py, 1.0, 1e-11);
  EXPECT_NEAR(p.angular / spin, 1.0, 1e-11);
}

}  // namespace
}  // namespace train_derail
