// Cash-Karp and Dormand-Prince pairs of order 5(4) by ARKODE's ERKStep; the latter to hold our own against
// (dormand_prince.cpp).
#include "stepper.hpp"

namespace train_derail::solver {

namespace {

inline void free_erk(void* memory) { ARKodeFree(&memory); }

class ExplicitRungeKutta final : public Stepper {
 public:
  ExplicitRungeKutta(const inputs::Solver& options, OdeSystem& system, double t0, const VectorX& y0)
      : Stepper(options, system, t0, y0),
        y_(wrap(state_.data(), state_.size(), context_)),
        memory_(check_made(ERKStepCreate(on_derivative, t0, y_.get(), context_.get()), "ERKStepCreate")) {
    void* m = memory_.get();
    check(ARKodeSetUserData(m, this), "ARKodeSetUserData");
    check(tell_arkode_errors<on_error>(context_.get(), m, this), "setting ARKODE's error handler");
    const bool cash_karp = options.method == inputs::Method::cash_karp;
    check(ERKStepSetTableNum(m, cash_karp ? ARKODE_CASH_KARP_6_4_5 : ARKODE_DORMAND_PRINCE_7_4_5),
          "ERKStepSetTableNum");
    check(ARKodeWFtolerances(m, on_error_weights), "ARKodeWFtolerances");
    // Cubic Hermite needs no further evaluations; its error is far below the tolerance at the steps that couplers
    // enforce.
    check(ARKodeSetInterpolantDegree(m, 3), "ARKodeSetInterpolantDegree");
    if (options.fixed_step) check(ARKodeSetFixedStep(m, *options.fixed_step), "ARKodeSetFixedStep");
    if (system.event_count() > 0) {
      check(ARKodeRootInit(m, static_cast<int>(system.event_count()), on_events), "ARKodeRootInit");
      check(ARKodeSetNoInactiveRootWarn(m), "ARKodeSetNoInactiveRootWarn");
    }
  }

  void interpolate(double t, VectorX& y) const override {
    y.resize(state_.size());
    if (t == time_) {
      y = state_;
      return;
    }
    const Vector out = wrap(y.data(), y.size(), context_);
    check(ARKodeGetDky(memory_.get(), t, 0, out.get()), "ARKodeGetDky");
  }

  void restart() override {
    check(ARKodeReset(memory_.get(), time_, y_.get()), "ARKodeReset");
    previous_time_ = time_;
  }

  Statistics statistics() const override {
    Statistics s;
    long count = 0;
    ARKodeGetNumSteps(memory_.get(), &count);
    s.steps = count;
    ARKodeGetNumErrTestFails(memory_.get(), &count);
    s.rejected_steps = count;
    ERKStepGetNumRhsEvals(memory_.get(), &count);
    s.rhs_evaluations = count;
    return s;
  }

 private:
  Flag evolve(double& t, VectorX& y) override {
    (void)y;  // y_ is a view of it
    const int flag = ARKodeEvolve(memory_.get(), time_ + 1.0, y_.get(), &t, ARK_ONE_STEP);
    if (flag < 0) return failed(ARKodeGetReturnFlagName(flag));
    return flag == ARK_ROOT_RETURN ? Flag::root : Flag::stepped;
  }

  void root_info(int* directions) override { check(ARKodeGetRootInfo(memory_.get(), directions), "ARKodeGetRootInfo"); }

  std::int64_t step_count() const override {
    long count = 0;
    ARKodeGetNumSteps(memory_.get(), &count);
    return count;
  }

  static ExplicitRungeKutta& self(void* user) { return *static_cast<ExplicitRungeKutta*>(user); }
  static int on_derivative(sunrealtype t, N_Vector y, N_Vector dydt, void* user) {
    return self(user).derivative(t, NV_DATA_S(y), NV_DATA_S(dydt));
  }
  static int on_error_weights(N_Vector y, N_Vector weights, void* user) {
    self(user).error_weights(NV_DATA_S(y), NV_DATA_S(weights), NV_LENGTH_S(y));
    return 0;
  }
  static int on_events(sunrealtype t, N_Vector y, sunrealtype* values, void* user) {
    self(user).system_.events(t, NV_DATA_S(y), values);
    return 0;
  }
  static void on_error(const char* message, void* user) { self(user).set_error(message); }

  Vector y_;
  std::unique_ptr<void, Deleter<free_erk>> memory_;
};

}  // namespace

std::unique_ptr<Integrator> make_explicit(const inputs::Solver& options, OdeSystem& system, double t0,
                                          const VectorX& y0) {
  return std::make_unique<ExplicitRungeKutta>(options, system, t0, y0);
}

}  // namespace train_derail::solver
