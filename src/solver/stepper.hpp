// What the two SUNDIALS packages have in common: stepping, keeping the last good state, events, limits.
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include "train_derail/solver/integrator.hpp"
#include "wide_vector.hpp"

namespace train_derail::solver {

class Stepper : public Integrator {
 public:
  Stepper(const inputs::Solver& options, OdeSystem& system, double t0, const VectorX& y0)
      : options_(options), system_(system), context_(make_context()), time_(t0), previous_time_(t0), state_(y0) {}

  StepResult step() final;
  double time() const final { return time_; }
  double previous_time() const final { return previous_time_; }
  const VectorX& state() const final { return state_; }

 protected:
  enum class Flag { stepped, root, failed };
  /// One internal step: writes the new time and state, or says in error() why not.
  virtual Flag evolve(double& t, VectorX& y) = 0;
  virtual void root_info(int* directions) = 0;
  virtual std::int64_t step_count() const = 0;

  /// 1 / (rtol |y| + atol) for what is controlled, next to nothing for quadratures.
  void error_weights(const double* y, double* weights, Eigen::Index size) const;
  /// Derivative of the system; one that is not finite is a recoverable failure (SUNDIALS then tries a smaller step).
  int derivative(double t, const double* y, double* dydt);

  void set_error(const std::string& error) { error_ = error; }
  /// After a failure: `name` (to be freed) of the code that came back is its reason unless there is a better one.
  Flag failed(char* name) {
    if (error_.empty()) set_error(std::string("the integrator gave up: ") + name);
    std::free(name);
    return Flag::failed;
  }

  const inputs::Solver options_;
  OdeSystem& system_;
  const Context context_;
  double time_, previous_time_;
  VectorX state_;

 private:
  VectorX last_good_;
  std::vector<int> directions_;
  std::string error_;
};

std::unique_ptr<Integrator> make_explicit(const inputs::Solver&, OdeSystem&, double t0, const VectorX& y0);
std::unique_ptr<Integrator> make_dormand_prince(const inputs::Solver&, OdeSystem&, double t0, const VectorX& y0);
std::unique_ptr<Integrator> make_bdf(const inputs::Solver&, OdeSystem&, double t0, const VectorX& y0);

}  // namespace train_derail::solver
