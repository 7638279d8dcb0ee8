// The semi-implicit method, and the extended model without its parts against the paper's model, which is as it was.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "extended_fixtures.hpp"

namespace train_derail {
namespace {

using model::StateVector;
using test::Train;

/// q'' = -w^2 q, and a note of every step that was settled.
class Spring final : public solver::SteppedSystem {
 public:
  Eigen::Index size() const override { return 3; }
  Eigen::Index position_count() const override { return 1; }
  void accelerations(double t, double h, const double* y, double* a) override {
    EXPECT_DOUBLE_EQ(t, h * static_cast<double>(settled));
    a[0] = -w2 * y[0];
  }
  void settle(double t, double h, const double* before, double* y) override {
    EXPECT_DOUBLE_EQ(t, h * static_cast<double>(settled));
    EXPECT_EQ(before[2], y[2]);  // what is neither place nor velocity is the system's own
    y[2] += h;
    ++settled;
  }
  double w2 = 9.0;
  int settled = 0;
};

inputs::Solver fixed(double h) {
  inputs::Solver options;
  options.method = inputs::Method::semi_implicit;
  options.fixed_step = h;
  return options;
}

TEST(SemiImplicit, IsEulersWithTheNewVelocities) {
  Spring spring;
  VectorX y(3);
  y << 1.0, 0.5, 0.0;
  const auto integrator = solver::make_integrator(fixed(0.1), spring, 0.0, y);
  EXPECT_EQ(integrator->step().status, solver::StepStatus::stepped);
  EXPECT_DOUBLE_EQ(integrator->state()[1], 0.5 - 0.9);
  EXPECT_DOUBLE_EQ(integrator->state()[0], 1.0 + 0.1 * (0.5 - 0.9));
  EXPECT_DOUBLE_EQ(integrator->state()[2], 0.1);
  EXPECT_DOUBLE_EQ(integrator->time(), 0.1);
  EXPECT_DOUBLE_EQ(integrator->previous_time(), 0.0);
  VectorX between;
  integrator->interpolate(0.025, between);
  EXPECT_DOUBLE_EQ(between[0], 1.0 - 0.25 * 0.04);
  EXPECT_DOUBLE_EQ(between[2], 0.025);
  EXPECT_EQ(integrator->statistics().steps, 1);
}

TEST(SemiImplicit, KeepsItsOwnEnergyForever) {
  // w^2 q^2 + v^2 - h w^2 q v is kept exactly; the energy only swings about it.
  Spring spring;
  VectorX y(3);
  y << 1.0, 0.0, 0.0;
  const double h = 0.05;
  const auto integrator = solver::make_integrator(fixed(h), spring, 0.0, y);
  for (int i = 0; i < 100000; ++i) {
    integrator->step();
    if (i % 100 != 0) continue;
    const double q = integrator->state()[0], v = integrator->state()[1];
    EXPECT_NEAR(9.0 * q * q + v * v - h * 9.0 * q * v, 9.0, 1e-9);
  }
  EXPECT_EQ(spring.settled, 100000);
}

TEST(SemiImplicit, IsOfFirstOrder) {
  double error[3];
  for (int i = 0; i < 3; ++i) {
    Spring spring;
    VectorX y(3);
    y << 1.0, 0.0, 0.0;
    const double h = 0.01 / (1 << i);
    const auto integrator = solver::make_integrator(fixed(h), spring, 0.0, y);
    while (integrator->time() < 1.0 - 1e-9) integrator->step();
    error[i] = std::abs(integrator->state()[0] - std::cos(3.0));
  }
  EXPECT_NEAR(error[1] / error[0], 0.5, 0.03);
  EXPECT_NEAR(error[2] / error[1], 0.5, 0.03);
}

TEST(SemiImplicit, SaysWhyItFails) {
  Spring spring;
  VectorX y(3);
  y << 1.0, 0.0, 0.0;
  inputs::Solver options = fixed(0.5);
  options.steps_max = 3;
  auto integrator = solver::make_integrator(options, spring, 0.0, y);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(integrator->step().status, solver::StepStatus::stepped);
  const VectorX last = integrator->state();
  const solver::StepResult refused = integrator->step();
  EXPECT_EQ(refused.status, solver::StepStatus::failed);
  EXPECT_NE(refused.message.find("steps_max = 3"), std::string::npos) << refused.message;
  EXPECT_EQ(integrator->state(), last);

  Spring stiff;
  stiff.w2 = 1e300;
  integrator = solver::make_integrator(fixed(0.5), stiff, 0.0, y);
  solver::StepResult result;
  for (int i = 0; i < 10 && result.status == solver::StepStatus::stepped; ++i) result = integrator->step();
  EXPECT_EQ(result.status, solver::StepStatus::failed);
  EXPECT_NE(result.message.find("not finite"), std::string::npos) << result.message;
  EXPECT_TRUE(integrator->state().allFinite());
}

// In steps of fixed length the paper's model, and the extended one with every part off, converge to the solution of the
// paper's model, in first order.
class WithoutParts : public testing::TestWithParam<std::tuple<inputs::OnTrackLaw, inputs::Model>> {};

TEST_P(WithoutParts, ConvergesToThePapersModel) {
  inputs::Scenario s = test::mixed_train();
  s.ground.on_track_law = std::get<0>(GetParam());
  s.initial.yaw_rate = 0.4;
  s.stop.time_max = 0.5;  // later a car passes the point of derailment, which steps see up to one step late
  test::set_tolerance(s, 1e-11);
  simulation::Simulation exact(s);
  exact.run();
  ASSERT_GT(exact.outcome().coupler_force_peak(), 1e4);
  s.model = std::get<1>(GetParam());
  s.solver.method = inputs::Method::semi_implicit;
  double error[3];
  for (int i = 0; i < 3; ++i) {
    s.solver.fixed_step = 4e-5 / (1 << i);
    simulation::Simulation stepped(s);
    stepped.run();
    const Eigen::Index motion = 6 * static_cast<Eigen::Index>(exact.cars().size());
    error[i] = (stepped.state() - exact.state()).head(motion).cwiseAbs().maxCoeff();
    EXPECT_EQ(stepped.outcome().cars_past_pod, exact.outcome().cars_past_pod);
    EXPECT_EQ(stepped.outcome().cars_derailed, exact.outcome().cars_derailed);
    EXPECT_NEAR(stepped.outcome().coupler_force_peak() / exact.outcome().coupler_force_peak(), 1.0, 0.02);
    EXPECT_NEAR(stepped.outcome().energy.work_on_track / exact.outcome().energy.work_on_track, 1.0, 1e-3);
    EXPECT_NEAR(stepped.outcome().energy.work_off_track / exact.outcome().energy.work_off_track, 1.0, 1e-3);
  }
  EXPECT_LT(error[2], 2e-3);
  EXPECT_GT(error[0] / error[1], 1.6);
  EXPECT_LT(error[0] / error[1], 2.5);
  EXPECT_GT(error[1] / error[2], 1.6);
  EXPECT_LT(error[1] / error[2], 2.5);
}

INSTANTIATE_TEST_SUITE_P(Readings, WithoutParts,
                         testing::Combine(testing::Values(inputs::OnTrackLaw::isotropic,
                                                          inputs::OnTrackLaw::along_track),
                                          testing::Values(inputs::Model::paper, inputs::Model::extended)));
INSTANTIATE_TEST_SUITE_P(Guided, WithoutParts,
                         testing::Values(std::tuple{inputs::OnTrackLaw::guided, inputs::Model::paper}));

/// Passing of the point of derailment as the paper's model has it, on its own: no part of simulation/.
class PaperSystem final : public test::ModelSystem {
 public:
  explicit PaperSystem(model::DerailmentModel& m) : test::ModelSystem(m), model_(m) {}
  Eigen::Index event_count() const override { return 1; }
  void events(double /*t*/, const double* y, double* values) override { values[0] = foremost(y).second; }
  /// The foremost car before the point of derailment, and its place.
  std::pair<Eigen::Index, double> foremost(const double* y) const {
    const auto q = model::motion(y, model_.car_count());
    std::pair<Eigen::Index, double> first{-1, -1.0};
    for (Eigen::Index k = 0; k < model_.car_count(); ++k) {
      if (!model_.derailed(k) && (first.first < 0 || q(k, model::X) > first.second)) first = {k, q(k, model::X)};
    }
    return first;
  }

 private:
  model::DerailmentModel& model_;
};

class PaperMethod : public testing::TestWithParam<inputs::Method> {};

TEST_P(PaperMethod, StillDrivesThePapersModelBitForBit) {
  inputs::Scenario s = test::baseline(8);
  s.solver.method = GetParam();
  s.stop.time_max = 6.0;
  simulation::Simulation sim(s);
  sim.run();

  model::DerailmentModel m(s);
  PaperSystem system(m);
  const StateVector start = m.initial_state();
  m.derail(0);
  const auto integrator = solver::make_integrator(s.solver, system, 0.0, start);
  int crossings = 0;
  while (integrator->time() < 6.0) {
    if (integrator->step().status != solver::StepStatus::event || integrator->time() >= 6.0) continue;
    m.derail(system.foremost(integrator->state().data()).first);
    integrator->restart();
    ++crossings;
  }
  StateVector end;
  integrator->interpolate(6.0, end);
  EXPECT_GT(crossings, 2);
  EXPECT_EQ(sim.outcome().cars_past_pod, crossings + 1);
  EXPECT_TRUE((sim.state().array() == end.array()).all());
  EXPECT_EQ(sim.outcome().solver.steps, integrator->statistics().steps);
  // Nothing of the new parts is in the answer.
  const outcome::Outcome o = sim.outcome();
  EXPECT_EQ(o.energy.work_rails, 0.0);
  EXPECT_EQ(o.energy.work_impact_normal, 0.0);
  EXPECT_EQ(o.couplers_broken, 0);
  EXPECT_EQ(o.impacts.count, 0);
  EXPECT_EQ(o.cars_derailed, o.cars_past_pod);
}

INSTANTIATE_TEST_SUITE_P(Methods, PaperMethod,
                         testing::Values(inputs::Method::dormand_prince, inputs::Method::cash_karp,
                                         inputs::Method::bdf));

TEST(PaperMethod, IsTheDefault) {
  EXPECT_EQ(inputs::Solver{}.method, inputs::Method::dormand_prince);
  EXPECT_TRUE(inputs::parts_beyond_the_paper(test::baseline()).empty());
  EXPECT_TRUE(inputs::parts_beyond_the_paper(inputs::Scenario{}).empty());
}

}  // namespace
}  // namespace train_derail
