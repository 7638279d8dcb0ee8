// Scores of predicted counts, and fits of the rows alone, against numbers worked out by hand.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "train_derail/validation/scores.hpp"

namespace train_derail {
namespace {

TEST(Scores, AgainstNumbersByHand) {
  // Errors +1, -2, 0, +3; the last row has no prediction.
  const std::vector<double> real{4.0, 10.0, 7.0, 3.0, 50.0}, predicted{5.0, 8.0, 7.0, 6.0, NAN};
  const validation::Score s = validation::score(real, predicted);
  EXPECT_EQ(s.count, 4u);
  EXPECT_DOUBLE_EQ(s.mean_absolute_error, 1.5);
  EXPECT_DOUBLE_EQ(s.bias, 0.5);
  EXPECT_DOUBLE_EQ(s.root_mean_square_error, std::sqrt(14.0 / 4.0));
  EXPECT_DOUBLE_EQ(s.r2, 1.0 - 14.0 / 30.0);  // mean 6: 4 + 16 + 1 + 9
  EXPECT_TRUE(std::isnan(validation::score({2.0, 2.0}, {1.0, 3.0}).r2));
  EXPECT_TRUE(std::isnan(validation::score({}, {}).bias));
}

TEST(Scores, EndsOfAnIntervalBelongToIt) {
  const validation::Coverage c = validation::coverage({1.0, 5.0, 9.0, 3.0}, {1.0, 2.0, 4.0, NAN}, {2.0, 5.0, 8.0, NAN});
  EXPECT_DOUBLE_EQ(c.share, 2.0 / 3.0);
  EXPECT_DOUBLE_EQ(c.mean_width, (1.0 + 3.0 + 4.0) / 3.0);
}

TEST(Scores, CrpsOfMembersByHandAndOfAKnownDistribution) {
  // |1 - 4|, |3 - 4|, |8 - 4|; pairs 2, 7, 5 apart, mean 14 / 3.
  EXPECT_DOUBLE_EQ(validation::crps(4.0, {3.0, NAN, 8.0, 1.0}), 8.0 / 3.0 - 7.0 / 3.0);
  EXPECT_DOUBLE_EQ(validation::crps(4.0, {7.0}), 3.0);
  EXPECT_TRUE(std::isnan(validation::crps(4.0, {NAN})));
  // Two strata of one member each: half of all pairs of draws are of the same one.
  EXPECT_DOUBLE_EQ(validation::crps(2.0, {1.0, 3.0}, {"a", "b"}), 1.0 - 0.5);
  // Shares 2/3 and 1/3: pairs within the first are 2 apart, across 8 and 6.
  EXPECT_DOUBLE_EQ(validation::crps(2.0, {1.0, 9.0, 3.0, NAN}, {"a", "b", "a", "b"}),
                   3.0 - (4.0 / 9.0 * 2.0 + 2.0 * 2.0 / 9.0 * 7.0) / 2.0);
  // Uniform on [0, 1] at r: r^2 - r + 1/3.
  std::vector<double> uniform;
  for (int i = 0; i < 4000; ++i) uniform.push_back((i + 0.5) / 4000.0);
  for (const double r : {0.0, 0.3, 1.0}) EXPECT_NEAR(validation::crps(r, uniform), r * r - r + 1.0 / 3.0, 1e-4);
  // Few members are no better or worse than many: all pairs of three values.
  double mean = 0.0;
  for (const double a : {0.0, 1.0, 5.0}) {
    for (const double b : {0.0, 1.0, 5.0}) mean += validation::crps(2.0, {a, b}) / 9.0;
  }
  std::vector<double> many;
  for (int i = 0; i < 3000; ++i) many.push_back(i < 1000 ? 0.0 : i < 2000 ? 1.0 : 5.0);
  EXPECT_NEAR(mean, validation::crps(2.0, many), 2e-3);
}

TEST(Scores, BandsOfSpeedAsInPublishedTables) {
  const auto bands = validation::by_speed({4.0, 5.0, 10.0, 15.0, 16.0, 20.0}, {1.0, 2.0, 6.0, 8.0, 4.0, 6.0},
                                          {1.0, 2.0, 7.0, 14.0, 4.0, 5.0});
  ASSERT_EQ(bands.size(), 4u);
  EXPECT_DOUBLE_EQ(bands[0].to, 5.0);
  EXPECT_DOUBLE_EQ(bands[1].from, 5.0);
  EXPECT_DOUBLE_EQ(bands[2].from, 10.0);
  EXPECT_EQ(bands[2].count, 2u);
  EXPECT_DOUBLE_EQ(bands[2].speed, 12.5);
  EXPECT_DOUBLE_EQ(bands[2].real, 7.0);
  EXPECT_DOUBLE_EQ(bands[2].real_sd, std::sqrt(2.0));
  EXPECT_DOUBLE_EQ(bands[2].predicted, 10.5);
  EXPECT_DOUBLE_EQ(bands[2].error, 0.5);
  EXPECT_EQ(bands[3].count, 2u);
  EXPECT_DOUBLE_EQ(bands[3].to, 20.0);
}

TEST(Scores, ExponentOfAPowerLaw) {
  std::vector<double> mph{5.0, 11.0, 23.0, 37.0, 48.0}, count;
  for (const double v : mph) count.push_back(0.6 * std::pow(v, 1.06));
  EXPECT_NEAR(validation::speed_exponent(mph, count), 1.06, 1e-12);
  mph.push_back(60.0);
  count.push_back(0.0);  // has no logarithm
  EXPECT_NEAR(validation::speed_exponent(mph, count), 1.06, 1e-12);
  EXPECT_TRUE(std::isnan(validation::speed_exponent({20.0, 20.0}, {3.0, 4.0})));
}

validation::FitInputs fit_inputs() {
  return {{10.0, 20.0, 25.0, 30.0, 41.0, 48.0, 15.0},
          {60.0, 20.0, 90.0, 75.0, 100.0, 40.0, 33.0},
          {120.0, 140.0, 131.0, 143.0, 128.0, 136.0, 139.0}};
}

TEST(Fits, FindTheCoefficientsTheyWereMadeWith) {
  const validation::FitInputs in = fit_inputs();
  std::vector<double> line, plane, power;
  for (std::size_t i = 0; i < in.speed.size(); ++i) {
    line.push_back(-1.58 + 0.822 * in.speed[i]);
    plane.push_back(2.0 + 0.5 * in.speed[i] + 0.1 * in.tail[i] - 0.05 * in.tons[i]);
    power.push_back(0.4 * std::pow(in.speed[i], 0.6) * std::pow(in.tail[i], 0.38) * std::pow(in.tons[i], 0.63));
  }
  const auto expect = [](const validation::Fit& f, const std::vector<double>& wanted, const std::vector<double>& real) {
    ASSERT_EQ(f.coefficients.size(), wanted.size());
    for (std::size_t i = 0; i < wanted.size(); ++i) EXPECT_NEAR(f.coefficients[i], wanted[i], 1e-9);
    for (std::size_t i = 0; i < real.size(); ++i) {
      EXPECT_NEAR(f.fitted[i], real[i], 1e-9);
      EXPECT_NEAR(f.left_out[i], real[i], 1e-8);
    }
  };
  expect(validation::fit(validation::FitKind::straight_line, in, line), {-1.58, 0.822}, line);
  expect(validation::fit(validation::FitKind::linear, in, plane), {2.0, 0.5, 0.1, -0.05}, plane);
  expect(validation::fit(validation::FitKind::log_log, in, power), {std::log(0.4), 0.6, 0.38, 0.63}, power);
}

TEST(Fits, LeavingARowOutIsFittingTheOthers) {
  const validation::FitInputs in = fit_inputs();
  const std::vector<double> real{9.0, 6.0, 25.0, 21.0, 37.0, 20.0, 8.0};
  for (const validation::FitKind kind : validation::kFitKinds) {
    const validation::Fit all = validation::fit(kind, in, real);
    for (std::size_t out = 0; out < real.size(); ++out) {
      validation::FitInputs others = in;
      std::vector<double> their = real;
      for (std::vector<double>* v : {&others.speed, &others.tail, &others.tons, &their}) {
        v->erase(v->begin() + static_cast<std::ptrdiff_t>(out));
      }
      const std::vector<double> c = validation::fit(kind, others, their).coefficients;
      const double v = in.speed[out], tail = in.tail[out], tons = in.tons[out];
      double expected = c[0] + c[1] * v;
      if (kind == validation::FitKind::linear) expected += c[2] * tail + c[3] * tons;
      if (kind == validation::FitKind::log_log) {
        expected = std::exp(c[0]) * std::pow(v, c[1]) * std::pow(tail, c[2]) * std::pow(tons, c[3]);
      }
      EXPECT_NEAR(all.left_out[out], expected, 1e-8 * expected)
          << validation::to_string(kind) << " without row " << out;
      EXPECT_GT(std::abs(all.left_out[out] - all.fitted[out]), 1e-6);
    }
  }
}

TEST(Fits, RowsThatDoNotDetermineThemGiveNone) {
  validation::FitInputs in = fit_inputs();
  const std::vector<double> real{9.0, 6.0, 25.0, 21.0, 37.0, 20.0, 8.0};
  in.tons.assign(7, 130.0);  // cannot be told from the constant
  EXPECT_TRUE(validation::fit(validation::FitKind::linear, in, real).coefficients.empty());
  EXPECT_TRUE(std::isnan(validation::fit(validation::FitKind::log_log, in, real).fitted[0]));
  EXPECT_EQ(validation::fit(validation::FitKind::straight_line, in, real).coefficients.size(), 2u);
  EXPECT_TRUE(
      validation::fit(validation::FitKind::straight_line, {{20.0}, {60.0}, {130.0}}, {9.0}).coefficients.empty());
  EXPECT_TRUE(validation::fit(validation::FitKind::log_log,
                              {{1.0, 1.0, 1.0, 1.0}, {2.0, 3.0, 4.0, 6.0}, {5.0, 6.0, 8.0, 9.0}}, {1.0, 2.0, 3.0, 4.0})
                  .coefficients.empty());
}

}  // namespace
}  // namespace train_derail
