// Our own stepper of the pair of Dormand and Prince: its table is that of SUNDIALS, its order that of the closed form,
// its motion that of ARKODE with the same steps.
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <arkode/arkode_butcher_erk.h>
#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "solver/loops.hpp"
#include "solver/stepper.hpp"
#ifdef __x86_64__
#include "simd/batch.hpp"
#endif

namespace train_derail {
namespace {

using solver::kPairStages;

struct FreeTable {
  void operator()(ARKodeButcherTable table) const { ARKodeButcherTable_Free(table); }
};
using Table = std::unique_ptr<std::remove_pointer_t<ARKodeButcherTable>, FreeTable>;

/// A state of `positions` numbers, as many velocities and `others`, and rates at all stages.
struct Stages {
  Stages(std::ptrdiff_t positions, std::ptrdiff_t others, test::Random& random)
      : positions(positions), others(others), y(2 * positions + others) {
    for (double& x : y) x = random.uniform(-3.0, 3.0);
    for (auto& rate : rates) {
      rate.resize(y.size());
      for (double& x : rate) x = random.uniform(-3.0, 3.0);
    }
  }
  /// Puts the velocities of the stages before `stage` where rates of the positions belong: what the pair says of a
  /// system of first order.
  void complete(const ARKodeButcherTableMem& table, double h) {
    for (int stage = 0; stage < kPairStages; ++stage) {
      for (std::ptrdiff_t i = 0; i < positions; ++i) {
        double v = y[positions + i];
        for (int j = 0; j < stage; ++j) v += h * table.A[stage][j] * rates[j][positions + i];
        rates[stage][i] = v;
      }
    }
  }
  std::ptrdiff_t positions, others;
  std::vector<double> y;
  std::array<std::vector<double>, kPairStages> rates;
};

TEST(DormandPrince, EveryVersionOfTheLoopsIsTheTableOfSundials) {
  const Table table(ARKodeButcherTable_LoadERK(ARKODE_DORMAND_PRINCE_7_4_5));
  ASSERT_EQ(table->stages, kPairStages);
  const double h = 0.7, rtol = 1e-3, atol = 1e-2;
  test::Random random(51);
  for (const solver::VectorLoops* loops : solver::usable_loops()) {
    SCOPED_TRACE(loops->instruction_set);
    for (std::ptrdiff_t positions = 0; positions < 20; ++positions) {
      for (const std::ptrdiff_t others : {0, 2, 11}) {
        Stages s(positions, others, random);
        std::array<const double*, kPairStages> rates;
        std::array<std::vector<double>, kPairStages> seen = s.rates;
        for (int j = 0; j < kPairStages; ++j) {
          for (std::ptrdiff_t i = 0; i < positions; ++i) seen[j][i] = std::nan("");  // must not be read
          rates[j] = seen[j].data();
        }
        s.complete(*table, h);
        const solver::PairStep step{positions, others, h, s.y.data(), rates.data()};
        std::vector<double> state(s.y.size());
        for (int stage = 2; stage <= kPairStages; ++stage) {
          loops->pair_stage(stage, step, state.data());
          for (std::size_t i = 0; i < state.size(); ++i) {
            double expected = s.y[i];
            for (int j = 0; j < stage - 1; ++j) expected += h * table->A[stage - 1][j] * s.rates[j][i];
            EXPECT_NEAR(state[i], expected, 1e-13 * 300.0) << "stage " << stage << ", number " << i;
          }
        }
        const std::ptrdiff_t controlled = others - (others > 0 ? 1 : 0);
        double sum = 0.0;
        for (std::ptrdiff_t i = 0; i < 2 * positions + controlled; ++i) {
          double error = 0.0;
          for (int j = 0; j < kPairStages; ++j) error += h * (table->b[j] - table->d[j]) * s.rates[j][i];
          sum += std::pow(error / (rtol * std::abs(s.y[i]) + atol), 2);
        }
        EXPECT_NEAR(loops->pair_error(step, controlled, rtol, atol), sum, 1e-6 * sum);  // weights to single precision
      }
    }
  }
}

/// Springs of 1, 2, 3 rad/s from (1, 0), a number that decays, and as a quadrature the integral of the first position.
class Springs : public solver::OdeSystem {
 public:
  static constexpr Eigen::Index kSprings = 3;
  Eigen::Index size() const override { return 2 * kSprings + 2; }
  Eigen::Index position_count() const override { return kSprings; }
  Eigen::Index quadrature_count() const override { return 1; }
  bool derivative(double /*t*/, const double* y, double* d) override {
    for (Eigen::Index k = 0; k < kSprings; ++k) {
      d[k] = y[kSprings + k];
      d[kSprings + k] = -static_cast<double>((k + 1) * (k + 1)) * y[k];
    }
    d[2 * kSprings] = -y[2 * kSprings];
    d[2 * kSprings + 1] = y[0];
    return true;
  }
  static VectorX at(double t) {
    VectorX y(2 * kSprings + 2);
    for (Eigen::Index k = 0; k < kSprings; ++k) {
      const double rate = static_cast<double>(k + 1);
      y[k] = std::cos(rate * t);
      y[kSprings + k] = -rate * std::sin(rate * t);
    }
    y[2 * kSprings] = std::exp(-t);
    y[2 * kSprings + 1] = std::sin(t);
    return y;
  }
  std::vector<Eigen::Index> band_positions() const override { return {}; }
  Eigen::Index band_lower() const override { return 0; }
  Eigen::Index band_upper() const override { return 0; }
  void jacobian(double /*t*/, const double* /*y*/, const SetEntry& /*set*/) override {}
};

/// The same, known as a system of first order only.
class PlainSprings final : public Springs {
  Eigen::Index position_count() const override { return 0; }
};

/// The same; rates of positions are not even numbers.
class BareSprings final : public Springs {
  bool accelerations(double t, const double* y, double* d) override {
    static_cast<void>(derivative(t, y, d));
    for (Eigen::Index k = 0; k < kSprings; ++k) d[k] = std::nan("");
    return true;
  }
};

inputs::Solver fixed(double h) {
  inputs::Solver o;
  o.method = inputs::Method::dormand_prince;
  o.fixed_step = h;
  return o;
}

/// Largest errors up to t = 2: of the states, and of what is interpolated a third into each step.
std::pair<double, double> errors(Springs& system, double h) {
  const auto integrator = solver::make_integrator(fixed(h), system, 0.0, Springs::at(0.0));
  std::pair<double, double> worst{0.0, 0.0};
  VectorX y;
  while (integrator->time() < 2.0 - 0.5 * h) {
    EXPECT_EQ(integrator->step().status, solver::StepStatus::stepped);
    const double t = integrator->previous_time() + h / 3.0;
    integrator->interpolate(t, y);
    worst.first = std::max(worst.first, (integrator->state() - Springs::at(integrator->time())).cwiseAbs().maxCoeff());
    worst.second = std::max(worst.second, (y - Springs::at(t)).cwiseAbs().maxCoeff());
  }
  return worst;
}

TEST(DormandPrince, StepsAreOfOrderFiveAndDenseOutputOfOrderFour) {
  Springs motion;
  PlainSprings plain;
  for (Springs* system : std::array<Springs*, 2>{&motion, &plain}) {
    const auto [coarse, coarse_between] = errors(*system, 0.05);
    const auto [fine, fine_between] = errors(*system, 0.025);
    EXPECT_LT(coarse, 1e-5);
    EXPECT_NEAR(std::log2(coarse / fine), 5.0, 0.25);
    EXPECT_NEAR(std::log2(coarse_between / fine_between), 4.0, 0.25);
  }
}

TEST(DormandPrince, RatesOfPositionsAreNotRead) {
  for (const bool control : {false, true}) {
    inputs::Solver o = fixed(0.05);
    if (control) o.fixed_step.reset();
    Springs whole;
    BareSprings bare;
    const auto a = solver::make_integrator(o, whole, 0.0, Springs::at(0.0));
    const auto b = solver::make_integrator(o, bare, 0.0, Springs::at(0.0));
    VectorX y_a, y_b;
    for (int i = 0; i < 100; ++i) {
      ASSERT_EQ(a->step().status, solver::StepStatus::stepped);
      ASSERT_EQ(b->step().status, solver::StepStatus::stepped);
      const double between = 0.5 * (a->previous_time() + a->time());
      a->interpolate(between, y_a);
      b->interpolate(between, y_b);
      ASSERT_EQ(a->state(), b->state());
      ASSERT_EQ(y_a, y_b);
    }
  }
}

TEST(DormandPrince, KeepsTheToleranceAndFindsItsFirstStep) {
  for (const double tolerance : {1e-4, 1e-7, 1e-10}) {
    inputs::Solver o;
    o.method = inputs::Method::dormand_prince;
    o.rtol = o.atol = tolerance;
    Springs system;
    const auto integrator = solver::make_integrator(o, system, 0.0, Springs::at(0.0));
    while (integrator->time() < 5.0) ASSERT_EQ(integrator->step().status, solver::StepStatus::stepped);
    const double error = (integrator->state() - Springs::at(integrator->time())).cwiseAbs().maxCoeff();
    EXPECT_LT(error, 30.0 * tolerance);
    EXPECT_GT(error, 0.01 * tolerance);  // no more work than was asked for
    const solver::Statistics s = integrator->statistics();
    EXPECT_LT(s.rejected_steps, s.steps / 4 + 5);
    EXPECT_EQ(s.rhs_evaluations, 6 * (s.steps + s.rejected_steps) + 1);  // the last stage is the next step's first
  }
}

/// Two heights of the first spring that are crossed within one long step.
class Watched final : public Springs {
 public:
  Eigen::Index event_count() const override { return 3; }
  void events(double /*t*/, const double* y, double* values) override {
    values[0] = y[0] - 0.90;
    values[1] = y[0] - 0.95;  // crossed first
    values[2] = -1.0;         // switched off
  }
};

TEST(DormandPrince, EventsWithinOneStepComeOneByOneAndOnTheFarSide) {
  Watched system;
  const auto integrator = solver::make_integrator(fixed(0.6), system, 0.0, Springs::at(0.0));
  for (const auto& [event, height] : {std::pair<Eigen::Index, double>{1, 0.95}, {0, 0.90}}) {
    const solver::StepResult r = integrator->step();
    ASSERT_EQ(r.status, solver::StepStatus::event);
    EXPECT_EQ(r.events, std::vector<Eigen::Index>{event});
    EXPECT_LE(integrator->state()[0], height);
    EXPECT_NEAR(integrator->state()[0], height, 1e-12);
    EXPECT_NEAR(integrator->time(), std::acos(height), 5e-3);  // of the cubic through a step of 0.6 s
    VectorX y;
    integrator->interpolate(integrator->time(), y);
    EXPECT_EQ(y, integrator->state());
  }
  EXPECT_EQ(integrator->step().status, solver::StepStatus::stepped);
}

TEST(DormandPrince, MovesThePapersTrainAsArkodeDoes) {
  // The same steps of the same pair: until couplers have closed and opened for a while only roundings differ.
  const inputs::Scenario s = test::baseline(20);
  model::DerailmentModel m(s);
  m.derail(0);
  test::ModelSystem system(m);
  const VectorX start = m.initial_state();
  const inputs::Solver o = fixed(5e-4);
  const auto own = solver::make_integrator(o, system, 0.0, start);
  const auto arkode = solver::make_explicit(o, system, 0.0, start);
  double moved = 0.0;
  while (own->time() < 0.8) {
    ASSERT_EQ(own->step().status, solver::StepStatus::stepped);
    ASSERT_EQ(arkode->step().status, solver::StepStatus::stepped);
    ASSERT_NEAR(own->time(), arkode->time(), 1e-12);
    const Eigen::Index coordinates = model::kCoordinates * m.car_count();
    ASSERT_LT((own->state() - arkode->state()).head(coordinates).cwiseAbs().maxCoeff(), 1e-8) << own->time();
    moved = std::max(moved, (own->state() - start).segment(3 * m.car_count(), m.car_count()).cwiseAbs().maxCoeff());
  }
  EXPECT_GT(moved, 1.0);  // a speed has changed by that much: couplers have pushed
}

#ifdef __x86_64__
TEST(DormandPrince, AngleOfADirectionIsThatOfTheStandardLibrary) {
  using B = xsimd::batch<double, xsimd::sse2>;
  test::Random random(52);
  for (int i = 0; i < 20000; ++i) {
    const double range = i % 2 == 0 ? 3.14159265358979 : 0.5;
    const double angle[] = {random.uniform(-range, range), random.uniform(-range, range)};
    const double sine[] = {std::sin(angle[0]), std::sin(angle[1])}, cosine[] = {std::cos(angle[0]), std::cos(angle[1])};
    double found[2];
    Lanes<B>::store(UnitVectors<B>::atan2(Lanes<B>::load(sine), Lanes<B>::load(cosine)), found);
    for (std::size_t k = 0; k < 2; ++k) {
      const double expected = std::atan2(sine[k], cosine[k]);
      EXPECT_NEAR(found[k], expected, 4.0 * std::numeric_limits<double>::epsilon() * std::abs(expected));
    }
  }
}
#endif

}  // namespace
}  // namespace train_derail
