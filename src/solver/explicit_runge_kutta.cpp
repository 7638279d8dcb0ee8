// Cash-Karp and Dormand-Prince pairs of order 5(4) by ARKODE's ERKStep.
#include <arkode/arkode_erkstep.h>

#include "stepper.hpp"

namespace train_derail::solver {

namespace {

inline void free_erk(void* memory) { ERKStepFree(&memory); }

class ExplicitRungeKutta final : public Stepper {
 public:
  ExplicitRungeKutta(const inputs::Solver& options, OdeSystem& system, double t0, const VectorX& y0)
      : Stepper(options, system, t0, y0),
        y_(wrap(state_.data(), state_.size(), context_)),
        memory_(check_made(ERKStepCreate(on_derivative, t0, y_.get(), context_.get()), "ERKStepCreate")) {
    void* m = memory_.get();
    check(ERKStepSetUserData(m, this), "ERKStepSetUserData");
    check(ERKStepSetErrHandlerFn(m, on_error, this), "ERKStepSetErrHandlerFn");
    const bool cash_karp = options.method == inputs::Method::cash_karp;
    check(ERKStepSetTableNum(m, cash_karp ? ARKODE_CASH_KARP_6_4_5 : ARKODE_DORMAND_PRINCE_7_4_5),
          "ERKStepSetTableNum");
    check(ERKStepWFtolerances(m, on_error_weights), "ERKStepWFtolerances");
    // Cubic Hermite needs no further evaluations; its error is far below the tolerance at the steps that couplers
    // enforce.
    check(ERKStepSetInterpolantDegree(m, 3), "ERKStepSetInterpolantDegree");
    if (options.fixed_step) check(ERKStepSetFixedStep(m, *options.fixed_step), "ERKStepSetFixedStep");
    if (system.event_count() > 0) {
      check(ERKStepRootInit(m, static_cast<int>(system.event_count()), on_events), "ERKStepRootInit");
      check(ERKStepSetNoInactiveRootWarn(m), "ERKStepSetNoInactiveRootWarn");
    }
  }

  void interpolate(double t, VectorX& y) const override {
    y.resize(state_.size());
    if (t == time_) {
      y = state_;
      return;
    }
    const Vector out = wrap(y.data(), y.size(), context_);
    check(ERKStepGetDky(memory_.get(), t, 0, out.get()), "ERKStepGetDky");
  }

  void restart() override {
    check(ERKStepReset(memory_.get(), time_, y_.get()), "ERKStepReset");
    previous_time_ = time_;
  }

  Statistics statistics() const override {
    Statistics s;
    long count = 0;
    ERKStepGetNumSteps(memory_.get(), &count);
    s.steps = count;
    ERKStepGetNumErrTestFails(memory_.get(), &count);
    s.rejected_steps = count;
    ERKStepGetNumRhsEvals(memory_.get(), &count);
    s.rhs_evaluations = count;
    return s;
  }

 private:
  Flag evolve(double& t, VectorX& y) override {
    (void)y;  // y_ is a view of it
    const int flag = ERKStepEvolve(memory_.get(), time_ + 1.0, y_.get(), &t, ARK_ONE_STEP);
    if (flag < 0) return failed(ERKStepGetReturnFlagName(flag));
    return flag == ARK_ROOT_RETURN ? Flag::root : Flag::stepped;
  }

  void root_info(int* directions) override {
    check(ERKStepGetRootInfo(memory_.get(), directions), "ERKStepGetRootInfo");
  }

  std::int64_t step_count() const override {
    long count = 0;
    ERKStepGetNumSteps(memory_.get(), &count);
    return count;
  }

  static ExplicitRungeKutta& self(void* user) { return *static_cast<ExplicitRungeKutta*>(user); }
  static int on_derivative(realtype t, N_Vector y, N_Vector dydt, void* user) {
    return self(user).derivative(t, NV_DATA_S(y), NV_DATA_S(dydt));
  }
  static int on_error_weights(N_Vector y, N_Vector weights, void* user) {
    self(user).error_weights(NV_DATA_S(y), NV_DATA_S(weights), NV_LENGTH_S(y));
    return 0;
  }
  static int on_events(realtype t, N_Vector y, realtype* values, void* user) {
    self(user).system_.events(t, NV_DATA_S(y), values);
    return 0;
  }
  static void on_error(int code, const char*, const char*, char* message, void* user) {
    if (code < 0) self(user).set_error(message);
  }

  Vector y_;
  std::unique_ptr<void, Deleter<free_erk>> memory_;
};

}  // namespace

std::unique_ptr<Integrator> make_explicit(const inputs::Solver& options, OdeSystem& system, double t0,
                                          const VectorX& y0) {
  return std::make_unique<ExplicitRungeKutta>(options, system, t0, y0);
}

}  // namespace train_derail::solver
