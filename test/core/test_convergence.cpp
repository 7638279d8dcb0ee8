// Order of convergence of each method on three cars that move smoothly: couplers have no slack and no free swing, so
// that their laws have no corner; nobody passes the point of derailment, nobody comes to rest.
#include <memory>
#include <stdexcept>

#include <gtest/gtest.h>

#include "fixtures.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail {
namespace {

using inputs::Method;
using test::CarMotion;

constexpr double kEnd = 1.0;  // s

/// Sizes are spelt out: the error constants, and so the windows below, are those of this train.
inputs::Scenario smooth_train() {
  inputs::Scenario s = test::baseline(3);
  s.consist[0].truck_spacing_factor = 0.62;
  s.consist[0].yaw_inertia_factor = 0.089;
  s.coupler.slack = 0.0;
  s.coupler.swing_limit = 0.0;
  s.coupler.stiffness = 2e6;  // about 1.5 cycles of the stiffest mode in kEnd
  s.coupler.swing_stiffness = 1e7;
  s.ground.regularization_speed = 1.0 * inputs::kFoot;  // friction, too, is smooth over a step
  return s;
}

/// A train in a bend, stretched: it swings and rings.
model::StateVector bent_state(const inputs::Scenario& s) {
  const double gap = s.coupler.length + 0.3, length = s.consist[0].length;
  std::vector<CarMotion> cars;
  Eigen::Vector2d pin(-50.0, 0.0);
  double theta = 0.6;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector2d heading(std::cos(theta), std::sin(theta));
    const Eigen::Vector2d centre = pin - 0.5 * length * heading;
    cars.push_back({centre.x(), centre.y(), theta, 15.0 - 0.5 * k, 5.0 + 0.3 * k, 0.05 * (k - 1)});
    const double beta = theta - 0.3;
    pin = centre - 0.5 * length * heading - gap * Eigen::Vector2d(std::cos(beta), std::sin(beta));
    theta = beta - 0.3;
  }
  return test::state_of(cars);
}

/// State at kEnd. Throws if a step failed.
model::StateVector integrate(const inputs::Solver& options) {
  const inputs::Scenario s = smooth_train();
  model::DerailmentModel m(s);
  test::ModelSystem system(m);
  const auto integrator = solver::make_integrator(options, system, 0.0, bent_state(s));
  // Steps of a fixed size add up to kEnd but for rounding; half a step tells the last one.
  const double last = options.fixed_step ? kEnd - 0.5 * *options.fixed_step : kEnd;
  while (integrator->time() < last) {
    const solver::StepResult result = integrator->step();
    if (result.status != solver::StepStatus::stepped) throw std::runtime_error("step: " + result.message);
  }
  if (options.fixed_step) {
    EXPECT_NEAR(integrator->time(), kEnd, 1e-12);
    return integrator->state();
  }
  VectorX y(system.size());
  integrator->interpolate(kEnd, y);
  return y;
}

double distance(const model::StateVector& a, const model::StateVector& b) {
  return (a.head(18) - b.head(18)).norm();  // motion; the work terms are in joules
}

inputs::Solver fixed(Method method, int steps) {
  inputs::Solver options;
  options.method = method;
  options.fixed_step = kEnd / steps;
  return options;
}

TEST(Convergence, CasePutsTheCouplersToWork) {
  const inputs::Scenario s = smooth_train();
  EXPECT_NO_THROW(inputs::validate(s));
  const model::DerailmentModel m(s);
  const model::StateVector start = bent_state(s), end = integrate(fixed(Method::dormand_prince, 640));
  EXPECT_LT(m.coupler(start.data(), 0).axial, -1e5);
  EXPECT_GT(std::abs(m.coupler(end.data(), 0).gap - m.coupler(start.data(), 0).gap), 1e-3);
  EXPECT_GT(std::abs(m.coupler(end.data(), 1).swing_lead - m.coupler(start.data(), 1).swing_lead), 0.01);
  for (const model::StateVector& y : {start, end}) {
    for (Eigen::Index k = 0; k < 3; ++k) EXPECT_LT(m.front_pin(y.data(), k).position.x(), 0.0);
  }
}

class ExplicitOrder : public testing::TestWithParam<Method> {};

TEST_P(ExplicitOrder, IsFive) {
  const model::StateVector reference = integrate(fixed(Method::dormand_prince, 5120));
  std::vector<double> errors;
  for (const int steps : {160, 320, 640}) errors.push_back(distance(integrate(fixed(GetParam(), steps)), reference));
  for (std::size_t i = 0; i + 1 < errors.size(); ++i) {
    // Order 4 gives 16 times less error with half the step, order 6 gives 64 times; the window lies around 32.
    const double order = std::log2(errors[i] / errors[i + 1]);
    EXPECT_GT(order, 4.8) << errors[i] << " -> " << errors[i + 1];
    EXPECT_LT(order, 5.35) << errors[i] << " -> " << errors[i + 1];
  }
  EXPECT_GT(errors.back(), 1e-10);  // still well above rounding
  EXPECT_LT(errors.back(), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(Methods, ExplicitOrder, testing::Values(Method::cash_karp, Method::dormand_prince),
                         testing::PrintToStringParamName());

TEST(Convergence, ExplicitMethodsAreNotTheSame) {
  EXPECT_GT(distance(integrate(fixed(Method::cash_karp, 40)), integrate(fixed(Method::dormand_prince, 40))), 1e-9);
}

class ErrorControl : public testing::TestWithParam<Method> {};

TEST_P(ErrorControl, ErrorIsProportionalToTheTolerance) {
  const model::StateVector reference = integrate(fixed(Method::dormand_prince, 5120));
  std::vector<double> errors;
  for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10}) {
    inputs::Solver options;
    options.method = GetParam();
    options.rtol = options.atol = tolerance;
    errors.push_back(distance(integrate(options), reference));
  }
  // Six decades of tolerance must give six of error within a decade (local control does not bound the sum exactly), and
  // no two decades of tolerance may be without effect.
  EXPECT_NEAR(std::log10(errors.front() / errors.back()), 6.0, 1.2);
  for (std::size_t i = 0; i + 1 < errors.size(); ++i) EXPECT_GT(errors[i] / errors[i + 1], 10.0) << i;
  EXPECT_LT(errors.back(), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Methods, ErrorControl, testing::Values(Method::cash_karp, Method::dormand_prince, Method::bdf),
                         testing::PrintToStringParamName());

TEST(Convergence, ReferenceOfAnotherFamilyAgrees) {
  inputs::Solver bdf;
  bdf.method = Method::bdf;
  bdf.rtol = bdf.atol = 1e-12;  // over thousands of steps
  EXPECT_LT(distance(integrate(bdf), integrate(fixed(Method::dormand_prince, 5120))), 1e-7);
}

}  // namespace
}  // namespace train_derail
