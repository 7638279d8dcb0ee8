#include <algorithm>

#include <fmt/format.h>

#include "solver/loops.hpp"
#include "train_derail/solver/integrator.hpp"
#include "wide_vector.hpp"

namespace train_derail::solver {

namespace {

class SemiImplicit final : public Integrator {
 public:
  SemiImplicit(const inputs::Solver& options, SteppedSystem& system, double t0, const VectorX& y0)
      : steps_max_(options.steps_max),
        h_(options.fixed_step.value()),
        t0_(t0),
        system_(system),
        before_(y0),
        state_(y0),
        acceleration_(system.position_count()) {}

  StepResult step() override {
    StepResult result;
    if (steps_ >= steps_max_) {
      result.status = StepStatus::failed;
      result.message = fmt::format("solver.steps_max = {} steps taken at t = {} s", steps_max_, time());
      return result;
    }
    const Eigen::Index n = system_.position_count();
    const double t = time();
    system_.accelerations(t, h_, state_.data(), acceleration_.data());
    if (!all_finite(acceleration_.data(), n)) {
      result.status = StepStatus::failed;
      result.message = fmt::format("the accelerations are not finite (last good time {} s)", t);
      return result;
    }
    before_.swap(state_);
    loops().move(n, h_, acceleration_.data(), before_.data() + n, before_.data(), state_.data() + n, state_.data());
    state_.tail(state_.size() - 2 * n) = before_.tail(state_.size() - 2 * n);
    ++steps_;
    system_.settle(t, h_, before_.data(), state_.data());
    return result;
  }

  double time() const override { return t0_ + static_cast<double>(steps_) * h_; }
  double previous_time() const override { return steps_ > 0 ? t0_ + static_cast<double>(steps_ - 1) * h_ : t0_; }
  const VectorX& state() const override { return state_; }
  void interpolate(double t, VectorX& y) const override {
    const double share = std::min(std::max((time() - t) / h_, 0.0), 1.0);
    y = state_ + share * (before_ - state_);
  }
  void restart() override {}
  Statistics statistics() const override { return {steps_, 0, steps_, 0}; }
  bool can_be_saved() const override { return true; }
  void walk(files::Archive& archive) override {
    double length = h_;
    archive.value("steps", steps_);
    archive.value("step_length", length);
    archive.value("begin", t0_);
    // Steps of another length go on from where those that were saved had come to.
    if (length != h_) t0_ += static_cast<double>(steps_) * (length - h_);
    archive.column("before", before_);
    archive.column("state", state_);
  }

 private:
  const std::int64_t steps_max_;
  const double h_;
  double t0_;
  SteppedSystem& system_;
  VectorX before_, state_, acceleration_;
  std::int64_t steps_ = 0;
};

}  // namespace

std::unique_ptr<Integrator> make_integrator(const inputs::Solver& options, SteppedSystem& system, double t0,
                                            const VectorX& y0) {
  return std::make_unique<SemiImplicit>(options, system, t0, y0);
}

}  // namespace train_derail::solver
