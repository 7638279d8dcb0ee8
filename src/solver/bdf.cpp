// Backward differentiation formulas by CVODE, Newton iteration with the banded analytic Jacobian.
#include <sunlinsol/sunlinsol_band.h>
#include <sunmatrix/sunmatrix_band.h>

#include "stepper.hpp"

namespace train_derail::solver {

namespace {

inline void free_cvode(void* memory) { CVodeFree(&memory); }

/// CVODE sees the unknowns in band order; state() and the system keep their own.
class Bdf final : public Stepper {
 public:
  Bdf(const inputs::Solver& options, OdeSystem& system, double t0, const VectorX& y0)
      : Stepper(options, system, t0, y0),
        positions_(system.band_positions()),
        banded_(y0.size()),
        natural_(y0.size()),
        natural_rate_(y0.size()),
        dense_(y0.size()),
        y_(wrap(banded_.data(), banded_.size(), context_)),
        dense_view_(wrap(dense_.data(), dense_.size(), context_)),
        jacobian_(check_made(SUNBandMatrix(y0.size(), system.band_upper(), system.band_lower(), context_.get()),
                             "SUNBandMatrix")),
        linear_solver_(check_made(SUNLinSol_Band(y_.get(), jacobian_.get(), context_.get()), "SUNLinSol_Band")),
        memory_(check_made(CVodeCreate(CV_BDF, context_.get()), "CVodeCreate")) {
    to_band(state_, banded_);
    void* m = memory_.get();
    check(CVodeSetUserData(m, this), "CVodeSetUserData");
    check(tell_cvode_errors<on_error>(context_.get(), m, this), "setting CVODE's error handler");
    check(CVodeInit(m, on_derivative, t0, y_.get()), "CVodeInit");
    check(CVodeWFtolerances(m, on_error_weights), "CVodeWFtolerances");
    check(CVodeSetLinearSolver(m, linear_solver_.get(), jacobian_.get()), "CVodeSetLinearSolver");
    check(CVodeSetJacFn(m, on_jacobian), "CVodeSetJacFn");
    if (system.event_count() > 0) {
      check(CVodeRootInit(m, static_cast<int>(system.event_count()), on_events), "CVodeRootInit");
      check(CVodeSetNoInactiveRootWarn(m), "CVodeSetNoInactiveRootWarn");
    }
  }

  void interpolate(double t, VectorX& y) const override {
    y.resize(state_.size());
    if (t == time_) {
      y = state_;
      return;
    }
    check(CVodeGetDky(memory_.get(), t, 0, dense_view_.get()), "CVodeGetDky");
    from_band(dense_.data(), y);
  }

  void restart() override {
    finished_ = statistics();
    to_band(state_, banded_);
    check(CVodeReInit(memory_.get(), time_, y_.get()), "CVodeReInit");  // zeroes the counters
    previous_time_ = time_;
  }

  Statistics statistics() const override {
    Statistics s = finished_;
    long count = 0;
    CVodeGetNumSteps(memory_.get(), &count);
    s.steps += count;
    CVodeGetNumErrTestFails(memory_.get(), &count);
    s.rejected_steps += count;
    CVodeGetNumNonlinSolvConvFails(memory_.get(), &count);
    s.rejected_steps += count;
    CVodeGetNumRhsEvals(memory_.get(), &count);
    s.rhs_evaluations += count;
    CVodeGetNumJacEvals(memory_.get(), &count);
    s.jacobian_evaluations += count;
    return s;
  }

 private:
  Flag evolve(double& t, VectorX& y) override {
    const int flag = CVode(memory_.get(), time_ + 1.0, y_.get(), &t, CV_ONE_STEP);
    if (flag < 0) return failed(CVodeGetReturnFlagName(flag));
    from_band(banded_.data(), y);
    return flag == CV_ROOT_RETURN ? Flag::root : Flag::stepped;
  }

  void root_info(int* directions) override { check(CVodeGetRootInfo(memory_.get(), directions), "CVodeGetRootInfo"); }

  std::int64_t step_count() const override {
    long count = 0;
    CVodeGetNumSteps(memory_.get(), &count);
    return finished_.steps + count;
  }

  void to_band(const VectorX& natural, VectorX& banded) const {
    for (std::size_t i = 0; i < positions_.size(); ++i) banded[positions_[i]] = natural[static_cast<Eigen::Index>(i)];
  }
  void from_band(const double* banded, VectorX& natural) const {
    for (std::size_t i = 0; i < positions_.size(); ++i) natural[static_cast<Eigen::Index>(i)] = banded[positions_[i]];
  }

  static Bdf& self(void* user) { return *static_cast<Bdf*>(user); }
  static int on_derivative(sunrealtype t, N_Vector y, N_Vector dydt, void* user) {
    Bdf& s = self(user);
    s.from_band(NV_DATA_S(y), s.natural_);
    const int flag = s.derivative(t, s.natural_.data(), s.natural_rate_.data());
    for (std::size_t i = 0; i < s.positions_.size(); ++i) {
      NV_DATA_S(dydt)[s.positions_[i]] = s.natural_rate_[static_cast<Eigen::Index>(i)];
    }
    return flag;
  }
  static int on_jacobian(sunrealtype t, N_Vector y, N_Vector, SUNMatrix jacobian, void* user, N_Vector, N_Vector,
                         N_Vector) {
    Bdf& s = self(user);
    s.from_band(NV_DATA_S(y), s.natural_);
    s.system_.jacobian(t, s.natural_.data(), [jacobian](Eigen::Index row, Eigen::Index column, double value) {
      SM_ELEMENT_B(jacobian, row, column) = value;
    });
    return 0;
  }
  static int on_error_weights(N_Vector y, N_Vector weights, void* user) {
    // Quadratures come last in both orders, so the weights need no translation.
    self(user).error_weights(NV_DATA_S(y), NV_DATA_S(weights), NV_LENGTH_S(y));
    return 0;
  }
  static int on_events(sunrealtype t, N_Vector y, sunrealtype* values, void* user) {
    Bdf& s = self(user);
    s.from_band(NV_DATA_S(y), s.natural_);
    s.system_.events(t, s.natural_.data(), values);
    return 0;
  }
  static void on_error(const char* message, void* user) { self(user).set_error(message); }

  const std::vector<Eigen::Index> positions_;
  VectorX banded_, natural_, natural_rate_, dense_;
  Vector y_, dense_view_;
  Matrix jacobian_;
  LinearSolver linear_solver_;
  std::unique_ptr<void, Deleter<free_cvode>> memory_;
  Statistics finished_;  // of before the last restart
};

}  // namespace

std::unique_ptr<Integrator> make_bdf(const inputs::Solver& options, OdeSystem& system, double t0, const VectorX& y0) {
  return std::make_unique<Bdf>(options, system, t0, y0);
}

}  // namespace train_derail::solver
