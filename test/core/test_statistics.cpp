// Statistics of studies against closed forms.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <boost/random/exponential_distribution.hpp>
#include <boost/random/mersenne_twister.hpp>

#include "fixtures.hpp"
#include "study_fixtures.hpp"
#include "train_derail/study/statistics.hpp"
#include "train_derail/study/study.hpp"

namespace train_derail {
namespace {

TEST(Statistics, QuantilesOfAKnownSample) {
  std::vector<double> sample;
  for (int i = 100; i >= 0; --i) sample.push_back(i);
  const study::Spread s = study::spread(sample);
  EXPECT_DOUBLE_EQ(s.q05, 5.0);
  EXPECT_DOUBLE_EQ(s.median, 50.0);
  EXPECT_DOUBLE_EQ(s.q95, 95.0);
  EXPECT_DOUBLE_EQ(s.mean, 50.0);
  EXPECT_NEAR(s.sd, std::sqrt(101.0 * 102.0 / 12.0), 1e-12);
  EXPECT_DOUBLE_EQ(study::quantile({1.0, 2.0}, 0.25), 1.25);
  EXPECT_TRUE(std::isnan(study::spread({}).median));
  EXPECT_TRUE(std::isnan(study::spread({1.0}).sd));
}

TEST(Statistics, OfFewRunsTheRangeIsFromTheLowestToTheHighest) {
  std::vector<double> sample;
  for (int i = 0; i < 19; ++i) sample.push_back(i);
  EXPECT_EQ(study::spread(sample).low, 0.0);
  EXPECT_EQ(study::spread(sample).high, 18.0);
  EXPECT_EQ(study::range_words(19), "lowest to highest of 19 runs");
  sample.push_back(19);
  const study::Spread s = study::spread(sample);
  EXPECT_EQ(s.low, s.q05);
  EXPECT_EQ(s.high, s.q95);
  EXPECT_EQ(study::range_words(20), "5 to 95 % of 20 runs");
  EXPECT_TRUE(std::isnan(study::spread({}).low));
}

// A real value drawn as the members are lies between their ranks as often as the header says, whatever the
// distribution.
TEST(Statistics, PredictiveIntervalHoldsTheShareThatItsRanksSay) {
  boost::random::mt19937_64 generator(5);
  boost::random::exponential_distribution<double> draw(0.1);
  for (const std::size_t n : {1, 5, 16, 19, 20, 39, 100}) {
    const study::PredictiveRanks ranks = study::predictive_ranks(n, 0.9);
    constexpr int kTrials = 40000;
    int held = 0, between_quantiles = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      std::vector<double> members(n);
      for (double& m : members) m = draw(generator);
      const double real = draw(generator);
      const study::Interval i = study::predictive_interval(members, 0.9);
      const study::Spread s = study::spread(members);
      held += i.low <= real && real <= i.high;
      between_quantiles += s.q05 <= real && real <= s.q95;
    }
    EXPECT_NEAR(held / double{kTrials}, ranks.held, 4.0 * std::sqrt(0.25 / kTrials)) << n;
    EXPECT_LE(between_quantiles, held) << n;
    if (n == 19) {
      EXPECT_LT(between_quantiles / double{kTrials}, 0.85);
    }
  }
}

TEST(Statistics, PredictiveRanks) {
  const auto expect = [](std::size_t n, std::size_t low, std::size_t high, double held) {
    const study::PredictiveRanks r = study::predictive_ranks(n, 0.9);
    EXPECT_EQ(r.low, low) << n;
    EXPECT_EQ(r.high, high) << n;
    EXPECT_DOUBLE_EQ(r.held, held) << n;
  };
  expect(1, 1, 1, 0.0);
  expect(16, 1, 16, 15.0 / 17.0);
  expect(19, 1, 19, 0.9);
  expect(20, 1, 20, 19.0 / 21.0);  // outwards
  expect(39, 2, 38, 0.9);
  expect(99, 5, 95, 0.9);
  EXPECT_TRUE(std::isnan(study::predictive_interval({}, 0.9).low));
  EXPECT_EQ(study::predictive_interval({7.0, 3.0, 5.0}, 0.9).low, 3.0);
}

class SobolIndices : public test::StudyFolder {};

// Ishigami's function, whose indices are known: S = (0.3139, 0.4424, 0), ST = (0.5576, 0.4424, 0.2437).
TEST_F(SobolIndices, OfIshigami) {
  write("ishigami.yaml",
        "scenario: scenario.yaml\nplan: saltelli\nsamples: 4096\nfactors:\n"
        "  - {key: initial.yaw_rate, low: -3.141592653589793, high: 3.141592653589793}\n"
        "  - {key: ground.off_track_friction, low: 0, high: 6.283185307179586}\n"
        "  - {key: ground.on_track_friction, low: 0, high: 6.283185307179586}\n");
  const auto points = study::points(read("ishigami.yaml"));
  const auto f = [](const study::Point& p) {
    const double x1 = std::stod(p.values[0]), x2 = std::stod(p.values[1]) - test::kPi,
                 x3 = std::stod(p.values[2]) - test::kPi;
    return std::sin(x1) + 7.0 * std::pow(std::sin(x2), 2) + 0.1 * std::pow(x3, 4) * std::sin(x1);
  };
  std::vector<double> a, b;
  std::vector<std::vector<double>> ab(3);
  for (std::size_t s = 0; s < 4096; ++s) {
    a.push_back(f(points[5 * s]));
    b.push_back(f(points[5 * s + 1]));
    for (std::size_t i = 0; i < 3; ++i) ab[i].push_back(f(points[5 * s + 2 + i]));
  }
  const auto indices = study::sobol_indices(a, b, ab);
  const double first[] = {0.3139, 0.4424, 0.0}, total[] = {0.5576, 0.4424, 0.2437};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(indices[i].first, first[i], 0.02);
    EXPECT_NEAR(indices[i].total, total[i], 0.02);
    EXPECT_LE(indices[i].first_low, indices[i].first);
    EXPECT_GE(indices[i].total_high, indices[i].total);
  }
}

}  // namespace
}  // namespace train_derail
