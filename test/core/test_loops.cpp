// Loops of solvers and monitor: every version that this processor can run does what the plain one does, for lengths
// around those of its blocks.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "outcome/loops.hpp"
#include "solver/loops.hpp"

namespace train_derail {
namespace {

using Column = std::vector<double>;

Column random_column(std::ptrdiff_t n, test::Random& random) {
  Column c(static_cast<std::size_t>(n));
  for (double& x : c) x = random.uniform(-3.0, 3.0);
  return c;
}

void expect_near(const Column& a, const Column& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], tolerance) << "at " << i << " of " << a.size();
}

TEST(SolverLoops, EveryVersionComputesWhatItsNameSays) {
  test::Random random(7);
  for (const solver::VectorLoops* loops : solver::usable_loops()) {
    SCOPED_TRACE(loops->instruction_set);
    for (std::ptrdiff_t n = 0; n < 40; ++n) {
      const Column a = random_column(n, random), b = random_column(n, random), c = random_column(n, random);
      Column z(a.size()), expected(a.size());
      const solver::Term terms[] = {{2.0, a.data()}, {-0.5, b.data()}, {3.0, c.data()}};
      loops->add_up(3, terms, z.data(), n);
      double squares = 0.0, sum = 0.0;
      for (std::size_t i = 0; i < a.size(); ++i) {
        expected[i] = 2.0 * a[i] - 0.5 * b[i] + 3.0 * c[i];
        squares += a[i] * b[i] * a[i] * b[i];
        sum += a[i];
      }
      expect_near(z, expected, 1e-14);
      EXPECT_NEAR(loops->weighted_square_sum(a.data(), b.data(), n), squares, 1e-12);
      EXPECT_NEAR(loops->sum(a.data(), n), sum, 1e-12);

      loops->weights(1e-3, 1e-2, a.data(), z.data(), n);
      for (std::size_t i = 0; i < a.size(); ++i) expected[i] = 1.0 / (1e-3 * std::abs(a[i]) + 1e-2);
      expect_near(z, expected, 1e-4);  // of about 100: single precision

      Column v = b, q = c, v_expected = b, q_expected = c;
      loops->move(n, 0.1, a.data(), v.data(), q.data(), v.data(), q.data());
      for (std::size_t i = 0; i < a.size(); ++i) {
        v_expected[i] += 0.1 * a[i];
        q_expected[i] += 0.1 * v_expected[i];
      }
      expect_near(v, v_expected, 1e-14);
      expect_near(q, q_expected, 1e-14);
    }
  }
}

TEST(SolverLoops, SumShowsEveryNumberThatIsNotFinite) {
  for (const solver::VectorLoops* loops : solver::usable_loops()) {
    for (std::size_t i = 0; i < 37; ++i) {
      Column x(37, 1.0);
      x[i] = NAN;
      EXPECT_FALSE(std::isfinite(loops->sum(x.data(), 37))) << loops->instruction_set << ' ' << i;
    }
  }
}

/// Cubics through gaps and rates at both ends of a step of 1.5 s, looked at point by point, keep to what the loops say.
void expect_bounds_of_gaps(const outcome::MonitorLoops& loops, const Column& from, const Column& rate_from,
                           const Column& to, const Column& rate_to, Column highest, Column lowest) {
  const auto n = static_cast<std::ptrdiff_t>(from.size());
  const double h = 1.5;
  const outcome::GapStep step{h, from.data(), rate_from.data(), to.data(), rate_to.data()};
  double least = inputs::kInfinity, most = -inputs::kInfinity;
  bool turned_beyond = false, one_turns = false;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const bool turns = rate_from[i] * rate_to[i] < 0.0;
    one_turns = one_turns || turns;
    for (int k = 0; k <= 200; ++k) {
      const double s = k / 200.0, share = s * s * (3.0 - 2.0 * s);
      const double gap = (1.0 - share) * from[i] + share * to[i] + h * s * (1.0 - s) * (1.0 - s) * rate_from[i] +
                         h * s * s * (s - 1.0) * rate_to[i];
      least = std::min(least, gap);
      most = std::max(most, gap);
      turned_beyond = turned_beyond || (turns && (-gap > highest[i] || -gap < lowest[i]));
    }
  }
  const outcome::GapRange range = loops.reach(n, step);
  EXPECT_LE(range.least, least);
  EXPECT_GE(range.most, most);
  if (n > 0) {
    EXPECT_GT(range.least, -3.0 - 4.0 / 27.0 * h * 6.0 - 1e-12);
    EXPECT_LT(range.most, 3.0 + 4.0 / 27.0 * h * 6.0 + 1e-12);
  }
  const auto can_turn_beyond = [&] {
    return loops.can_turn_beyond(n, step, {highest.data(), nullptr, lowest.data(), nullptr});
  };
  EXPECT_TRUE(can_turn_beyond() || !turned_beyond);
  highest.assign(from.size(), 10.0);
  lowest.assign(from.size(), -10.0);
  EXPECT_FALSE(can_turn_beyond());
  highest.assign(from.size(), -10.0);
  EXPECT_EQ(can_turn_beyond(), one_turns);
}

TEST(MonitorLoops, EveryVersionComputesWhatItsNameSays) {
  test::Random random(8);
  for (const outcome::MonitorLoops* loops : outcome::usable_loops()) {
    SCOPED_TRACE(loops->instruction_set);
    for (std::ptrdiff_t n = 0; n < 40; ++n) {
      const Column x = random_column(n, random), y = random_column(n, random), vx = random_column(n, random),
                   vy = random_column(n, random), omega = random_column(n, random), theta = random_column(n, random);
      Column sine(x.size()), cosine(x.size()), length = random_column(n, random), width = random_column(n, random),
                                               spacing = random_column(n, random);
      for (std::size_t i = 0; i < x.size(); ++i) {
        sine[i] = std::sin(theta[i]);
        cosine[i] = std::cos(theta[i]);
        length[i] = std::abs(length[i]);
        width[i] = std::abs(width[i]);
        spacing[i] = std::abs(spacing[i]);
      }
      const outcome::MonitoredCars cars{x.data(),  y.data(),     sine.data(),   cosine.data(), vx.data(),
                                        vy.data(), omega.data(), length.data(), width.data(),  spacing.data()};
      double fastest = 0.0;
      Column astray = random_column(n, random), astray_expected = astray, rearmost(x), foremost(x), breadth(x),
             rearmost_expected(x), foremost_expected(x), breadth_expected(x);
      for (std::size_t i = 0; i < x.size(); ++i) {
        for (const double arm : {spacing[i], -spacing[i]}) {
          const double u = vx[i] - omega[i] * arm * sine[i], v = vy[i] + omega[i] * arm * cosine[i];
          fastest = std::max(fastest, u * u + v * v);
          astray_expected[i] = std::max(astray_expected[i], std::abs(y[i] + arm * sine[i]));
        }
        const double reach = length[i] * std::abs(cosine[i]) + width[i] * std::abs(sine[i]);
        rearmost_expected[i] = x[i] - reach;
        foremost_expected[i] = x[i] + reach;
        breadth_expected[i] = length[i] * std::abs(sine[i]) + width[i] * std::abs(cosine[i]);
      }
      EXPECT_NEAR(loops->truck_speed_squared_max(n, cars), fastest, 1e-12);
      loops->extend_astray(n, cars, astray.data());
      expect_near(astray, astray_expected, 1e-14);
      loops->boxes(n, cars, rearmost.data(), foremost.data(), breadth.data());
      expect_near(rearmost, rearmost_expected, 1e-14);
      expect_near(foremost, foremost_expected, 1e-14);
      expect_near(breadth, breadth_expected, 1e-14);

      const std::ptrdiff_t pairs = std::max<std::ptrdiff_t>(n - 1, 0);
      Column pins(static_cast<std::size_t>(pairs)), centres(pins), pins_expected(pins), centres_expected(pins);
      for (std::size_t i = 0; i < pins.size(); ++i) {
        const std::size_t j = i + 1;
        const double u = vx[i] - vx[j], v = vy[i] - vy[j];
        // The rear pin of car i against the front pin of car j.
        const double pin_u = u + omega[i] * length[i] * sine[i] + omega[j] * length[j] * sine[j];
        const double pin_v = v - omega[i] * length[i] * cosine[i] - omega[j] * length[j] * cosine[j];
        centres_expected[i] = u * u + v * v;
        pins_expected[i] = pin_u * pin_u + pin_v * pin_v;
      }
      loops->neighbour_speeds(pairs, cars, pins.data(), centres.data());
      expect_near(pins, pins_expected, 1e-11);
      expect_near(centres, centres_expected, 1e-12);
      double most = 0.0;
      for (const double p : pins) most = std::max(most, p);
      EXPECT_EQ(loops->largest_of(pairs, pins.data()), most);

      Column highest = random_column(n, random), lowest = random_column(n, random), highest_time(x.size(), 1.0),
             lowest_time(x.size(), 1.0);
      const Column high = highest, low = lowest;
      loops->widen(n, x.data(), 2.0, {highest.data(), highest_time.data(), lowest.data(), lowest_time.data()});
      for (std::size_t i = 0; i < x.size(); ++i) {
        EXPECT_EQ(highest[i], std::max(high[i], x[i]));
        EXPECT_EQ(highest_time[i], x[i] > high[i] ? 2.0 : 1.0);
        EXPECT_EQ(lowest[i], std::min(low[i], x[i]));
        EXPECT_EQ(lowest_time[i], x[i] < low[i] ? 2.0 : 1.0);
      }
      expect_bounds_of_gaps(*loops, x, vx, y, vy, high, low);
    }
  }
}

}  // namespace
}  // namespace train_derail
