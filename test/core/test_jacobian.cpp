// The analytic Jacobian against differences of the right-hand side.
#include <set>
#include <utility>

#include <gtest/gtest.h>

#include "fixtures.hpp"

namespace train_derail {
namespace {

using inputs::OnTrackLaw;
using model::DerailmentModel;

/// The matrix that the model sets, in band order; fails on an entry outside the band or set twice.
Eigen::MatrixXd analytic(const DerailmentModel& m, const model::StateVector& y) {
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(m.size(), m.size());
  std::set<std::pair<Eigen::Index, Eigen::Index>> seen;
  m.jacobian(y.data(), [&](Eigen::Index row, Eigen::Index column, double value) {
    ASSERT_TRUE(row >= 0 && row < m.size() && column >= 0 && column < m.size()) << row << ", " << column;
    EXPECT_LE(row - column, DerailmentModel::kBandLower) << row << ", " << column;
    EXPECT_LE(column - row, DerailmentModel::kBandUpper) << row << ", " << column;
    EXPECT_TRUE(seen.emplace(row, column).second) << "set twice: " << row << ", " << column;
    jacobian(row, column) = value;
  });
  return jacobian;
}

/// Five-point central differences, in band order, motion alone.
Eigen::MatrixXd numerical(DerailmentModel& m, const model::StateVector& y) {
  const Eigen::Index n = m.car_count(), size = model::kCoordinates * n;
  std::vector<Eigen::Index> position = test::ModelSystem(m).band_positions();
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(size, size);
  const double h = 1e-4;
  const auto rate_at = [&](Eigen::Index column, double step) {
    model::StateVector moved = y, rate(m.size());
    moved(column) += step;
    m.derivative(moved.data(), rate.data());
    return rate;
  };
  for (Eigen::Index column = 0; column < size; ++column) {
    const model::StateVector slope =
        (8.0 * (rate_at(column, h) - rate_at(column, -h)) - (rate_at(column, 2.0 * h) - rate_at(column, -2.0 * h))) /
        (12.0 * h);
    for (Eigen::Index row = 0; row < size; ++row)
      jacobian(position[static_cast<std::size_t>(row)], position[static_cast<std::size_t>(column)]) = slope(row);
  }
  return jacobian;
}

/// Whether differences could reach over a corner of the coupler's laws: within 1e-2 m or rad of one.
bool near_corner(const DerailmentModel& m, const model::StateVector& y) {
  const inputs::Coupler& c = m.coupler_law();
  for (Eigen::Index i = 0; i < m.coupler_count(); ++i) {
    const auto b = m.coupler(y.data(), i);
    if (b.gap < 0.2 || std::abs(std::abs(b.gap - c.length) - 0.5 * c.slack) < 1e-2) return true;
    for (const double gamma : {b.swing_lead, b.swing_trail}) {
      const double yield = c.swing_limit + c.swing_moment_max / c.swing_stiffness;
      if (std::abs(std::abs(gamma) - c.swing_limit) < 2e-2 || std::abs(std::abs(gamma) - yield) < 2e-2) return true;
      if (std::abs(gamma) > test::kPi - 2e-2) return true;
    }
  }
  return false;
}

inputs::Scenario soft_train(OnTrackLaw law) {
  inputs::Scenario s = test::mixed_train();
  s.ground.on_track_law = law;
  s.coupler.slack = 0.3;
  s.coupler.stiffness = 3e6;  // with this every force has a share in the entries that rounding cannot hide
  s.coupler.swing_stiffness = 1e6;
  s.coupler.swing_moment_max = 0.5e6;
  s.ground.regularization_speed = 0.3;  // smooth over the steps of the differences
  return s;
}

class Jacobian : public testing::TestWithParam<OnTrackLaw> {};

TEST_P(Jacobian, AgreesWithDifferences) {
  test::Random random(31);
  for (const double stiffness : {3e6, 7e8}) {
    inputs::Scenario s = soft_train(GetParam());
    s.coupler.stiffness = stiffness;
    int checked = 0;
    for (int round = 0; round < 400 && checked < 40; ++round) {
      DerailmentModel m(s);
      test::derail_at_random(m, random);
      model::StateVector y = test::random_state(m, random);
      if (GetParam() == OnTrackLaw::guided) test::put_on_rails(m, y);
      if (near_corner(m, y)) continue;
      ++checked;
      const Eigen::Index size = model::kCoordinates * m.car_count();
      const Eigen::MatrixXd whole = analytic(m, y), expected = numerical(m, y), j = whole.topLeftCorner(size, size);
      EXPECT_EQ(whole.bottomRows(model::kWorkTerms).norm(), 0.0);
      EXPECT_EQ(whole.rightCols(model::kWorkTerms).norm(), 0.0);
      for (Eigen::Index row = 0; row < size; ++row) {
        // Truncation h^4 times fifth derivatives at gaps of 0.4 m, (h / G)^4 = 4e-15 times some hundred; rounding of
        // the forces, K * 1e-14 m / (m h), is 1e-10 of the row's largest entry.
        const double tolerance = 1e-8 * expected.row(row).cwiseAbs().maxCoeff() + 1e-9;
        for (Eigen::Index column = 0; column < size; ++column)
          ASSERT_NEAR(j(row, column), expected(row, column), tolerance)
              << "round " << round << ", row " << row / 6 << "/" << row % 6 << ", column " << column / 6 << "/"
              << column % 6;
      }
    }
    EXPECT_EQ(checked, 40);
  }
}

INSTANTIATE_TEST_SUITE_P(OnTrack, Jacobian,
                         testing::Values(OnTrackLaw::isotropic, OnTrackLaw::along_track, OnTrackLaw::guided),
                         testing::PrintToStringParamName());

TEST(JacobianOfCouplers, IsTheHessianOfAPotential) {
  inputs::Scenario s = soft_train(OnTrackLaw::isotropic);
  test::set_friction(s, 0.0, 0.0);
  const DerailmentModel m(s);
  test::Random random(32);
  const Eigen::Index n = m.car_count();
  for (int round = 0; round < 100; ++round) {
    const model::StateVector y = test::random_state(m, random);
    const Eigen::MatrixXd j = analytic(m, y);
    Eigen::MatrixXd hessian(3 * n, 3 * n);
    for (Eigen::Index a = 0; a < 3 * n; ++a) {
      const model::Car& car = m.cars()[static_cast<std::size_t>(a / 3)];
      const double inertia = a % 3 == 2 ? car.yaw_inertia : car.mass;
      for (Eigen::Index b = 0; b < 3 * n; ++b)
        hessian(a, b) = inertia * j(6 * (a / 3) + 3 + a % 3, 6 * (b / 3) + b % 3);
    }
    EXPECT_LT((hessian - hessian.transpose()).cwiseAbs().maxCoeff(), 1e-12 * hessian.cwiseAbs().maxCoeff());
    EXPECT_GT(hessian.cwiseAbs().maxCoeff(), 0.0);
    // No force depends on velocity without friction, and pose changes by velocity alone.
    for (Eigen::Index row = 0; row < 6 * n; ++row) {
      for (Eigen::Index column = 0; column < 6 * n; ++column) {
        if (column % 6 < 3) continue;
        ASSERT_EQ(j(row, column), row % 6 < 3 && column == row + 3 ? 1.0 : 0.0);
      }
    }
  }
}

}  // namespace
}  // namespace train_derail
