// The pair of Dormand and Prince in passes over all numbers that do as much as they can at once: what ARKODE does with
// whole vectors was a third of a run of the paper's model (docs/performance_history.md).
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "solver/dormand_prince_impl.hpp"
#include "solver/loops.hpp"
#include "stepper.hpp"

namespace train_derail::solver {

namespace {

/// Lengths of steps: a controller that looks at two errors (PI; K. Gustafsson, ACM Trans. Math. Softw. 17 (1991),
/// 533-554). Its constants, and those after a failure, were chosen for the fewest evaluations at the energy residual of
/// ARKODE's controller (docs/performance_history.md).
class StepLength {
 public:
  /// How much longer the next step may be than one whose error was `error` of what is allowed.
  double after_success(double error) {
    const double now = std::max(error, kTiny);
    const double ratio = kSafety * std::pow(now, -0.7 / kOrder) * std::pow(before_, 0.2 / kOrder);
    before_ = now;
    return std::clamp(ratio, kLeast, std::exchange(most_, kMost));
  }
  /// How long the next attempt is against one with that error. What is too large is mostly the error of a kink, where a
  /// coupler gets taut or shut: it goes with the cube of the length.
  double after_failure(double error) {
    most_ = 1.0;
    if (!std::isfinite(error)) return kNonsense;
    return std::clamp(kSafety * std::pow(error, -1.0 / 3.0), kLeast, kSafety);
  }

 private:
  static constexpr double kOrder = 5.0, kSafety = 0.9, kTiny = 1e-10, kLeast = 0.1, kMost = 2.0, kNonsense = 0.25;
  double before_ = 1.0, most_ = kMost;
};

class DormandPrince final : public Integrator {
 public:
  DormandPrince(const inputs::Solver& options, OdeSystem& system, double t0, const VectorX& y0)
      : options_(options),
        system_(system),
        positions_(system.position_count()),
        others_(y0.size() - 2 * positions_),
        time_(t0),
        previous_time_(t0),
        reached_(t0),
        before_(y0),
        after_(y0),
        values_(static_cast<std::size_t>(system.event_count())),
        values_before_(values_) {
    for (VectorX& rate : rates_) rate.setZero(y0.size());
    for (std::size_t i = 0; i < rates_.size(); ++i) rate_[i] = rates_[i].data();
  }

  StepResult step() override {
    if (statistics_.steps >= options_.steps_max)
      return failed(fmt::format("solver.steps_max = {} steps taken at t = {} s", options_.steps_max, time_));
    if (cut_) after_.swap(cut_state_);
    cut_ = false;
    before_.swap(after_);
    if (const char* problem = begin()) return give_up(problem);
    if (const char* problem = take()) return give_up(problem);
    previous_time_ = time_;
    time_ = reached_;
    ++statistics_.steps;
    return events();
  }

  double time() const override { return time_; }
  double previous_time() const override { return previous_time_; }
  const VectorX& state() const override { return cut_ ? cut_state_ : after_; }

  void interpolate(double t, VectorX& y) const override {
    if (t == time_) {
      y = state();
      return;
    }
    // The cubic through states and rates at both ends (Hermite): its error is far below the tolerance at the steps that
    // couplers enforce.
    y.resize(after_.size());
    const double h = reached_ - previous_time_, s = (t - previous_time_) / h, share = s * s * (3.0 - 2.0 * s);
    const double by_first = h * s * (1.0 - s) * (1.0 - s), by_last = h * s * s * (s - 1.0);
    const double *from = before_.data(), *to = after_.data();
    const Eigen::Index p = positions_;
    const Term positions[] = {{1.0 - share, from}, {share, to}, {by_first, from + p}, {by_last, to + p}};
    const Term others[] = {
        {1.0 - share, from + p}, {share, to + p}, {by_first, rate_.front() + p}, {by_last, rate_.back() + p}};
    loops_.add_up(4, positions, y.data(), p);
    loops_.add_up(4, others, y.data() + p, y.size() - p);
  }

  void restart() override { rates_known_ = false; }
  Statistics statistics() const override { return statistics_; }

 private:
  bool rates(double t, const VectorX& y, double* rate) {
    ++statistics_.rhs_evaluations;
    return system_.accelerations(t, y.data(), rate);
  }

  /// Gets what a step from before_ needs. Says what is wrong.
  const char* begin() {
    if (rates_known_) {
      std::swap(rate_.front(), rate_.back());  // the last stage has been at the end of the step
    } else {
      if (!rates(time_, before_, rate_.front())) return "the derivative is not finite";
      system_.events(time_, before_.data(), values_.data());
    }
    if (length_ == 0.0) length_ = options_.fixed_step ? *options_.fixed_step : first_length();
    return nullptr;
  }

  /// A hundredth of the time in which the state would change by itself; the control of the length does the rest.
  double first_length() {
    const Eigen::Index n = before_.size() - system_.quadrature_count();
    VectorX weights(n);
    error_weights(options_.rtol, options_.atol, before_.data(), weights.data(), n);
    const double size = loops_.weighted_square_sum(before_.data(), weights.data(), n);
    const Eigen::Index p = positions_;  // their rates are the velocities
    const double rate = loops_.weighted_square_sum(before_.data() + p, weights.data(), p) +
                        loops_.weighted_square_sum(rate_.front() + p, weights.data() + p, n - p);
    constexpr double least = 1e-6;
    return rate > 0.0 ? std::max(0.01 * std::sqrt(size / rate), least) : least;
  }

  /// A step from before_ to after_, in as many attempts as it needs. Says what is wrong.
  const char* take() {
    constexpr int attempts_max = 20;
    for (int attempts = 0; attempts < attempts_max; ++attempts) {
      reached_ = time_ + length_;
      if (!(reached_ > time_)) return "the steps have become too short";
      const double error = attempt();
      if (error <= 1.0) {
        if (!options_.fixed_step) length_ *= control_.after_success(error);
        rates_known_ = true;
        return nullptr;
      }
      if (options_.fixed_step) break;
      ++statistics_.rejected_steps;
      length_ *= control_.after_failure(error);
    }
    return "no step was found that keeps the tolerance";
  }

  /// The error of the step of length_, as a share of what is allowed; infinite where something is not finite.
  double attempt() {
    const PairStep step{positions_, others_, length_, before_.data(), rate_.data()};
    for (int stage = 2; stage <= kPairStages; ++stage) {
      const auto i = static_cast<std::size_t>(stage - 1);
      loops_.pair_stage(stage, step, after_.data());
      if (!rates(time_ + pair::row_sum(pair::kRates, stage - 1) * length_, after_, rate_[i])) return inputs::kInfinity;
    }
    if (!all_finite(after_.data(), after_.size())) return inputs::kInfinity;
    if (options_.fixed_step) return 0.0;
    const double sum = loops_.pair_error(step, others_ - system_.quadrature_count(), options_.rtol, options_.atol);
    const double error = std::sqrt(sum / static_cast<double>(after_.size()));
    return std::isfinite(error) ? error : inputs::kInfinity;
  }

  static bool changed(double before, double after) {
    return (before > 0.0 && after <= 0.0) || (before < 0.0 && after >= 0.0);
  }

  /// Cuts the step short where an event function first changes its sign.
  StepResult events() {
    StepResult result;
    if (values_.empty()) return result;
    values_.swap(values_before_);
    system_.events(time_, after_.data(), values_.data());
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (changed(values_before_[i], values_[i])) cut(i);
    }
    if (!cut_) return result;
    rates_known_ = false;
    result.status = StepStatus::event;
    for (std::size_t i = 0; i < values_.size(); ++i) {
      if (changed(values_before_[i], values_[i])) result.events.push_back(static_cast<Eigen::Index>(i));
    }
    return result;
  }

  /// Puts the end of the step to where event function i has just changed its sign, by false position (Illinois).
  void cut(std::size_t i) {
    const double near =
        100.0 * std::numeric_limits<double>::epsilon() * (std::abs(reached_) + reached_ - previous_time_);
    double from = previous_time_, to = time_, value_from = values_before_[i], value_to = values_[i];
    int side = 0;
    while (to - from > near) {
      double t = to - value_to * (to - from) / (value_to - value_from);
      if (!(t - from >= 0.5 * near && to - t >= 0.5 * near))
        t = t - from < to - t ? from + 0.5 * near : to - 0.5 * near;
      const double value = values_at(t, i);
      if (changed(values_before_[i], value)) {
        to = t;
        value_to = value;
        if (side == 1) value_from *= 0.5;
        side = 1;
      } else {
        from = t;
        value_from = value;
        if (side == -1) value_to *= 0.5;
        side = -1;
      }
    }
    values_at(to, i);
    time_ = to;
    cut_ = true;
  }

  double values_at(double t, std::size_t i) {
    interpolate(t, cut_state_);
    system_.events(t, cut_state_.data(), values_.data());
    return values_[i];
  }

  StepResult failed(const std::string& problem) const {
    StepResult result;
    result.status = StepStatus::failed;
    result.message = problem;
    return result;
  }
  StepResult give_up(const char* problem) {
    after_.swap(before_);
    previous_time_ = reached_ = time_;
    rates_known_ = false;
    return failed(fmt::format("{} (last good time {} s)", problem, time_));
  }

  const inputs::Solver options_;
  OdeSystem& system_;
  const VectorLoops& loops_ = loops();
  const Eigen::Index positions_, others_;
  double time_, previous_time_;
  double reached_;  // end of the step before it was cut short
  VectorX before_, after_, cut_state_;
  bool cut_ = false;  // by an event, to cut_state_ at time_
  std::array<VectorX, kPairStages> rates_;
  std::array<double*, kPairStages> rate_;  // of the stages, the last of a step being the first of the next
  bool rates_known_ = false;
  std::vector<double> values_, values_before_;  // of the event functions
  StepLength control_;
  double length_ = 0.0;
  Statistics statistics_;
};

}  // namespace

std::unique_ptr<Integrator> make_dormand_prince(const inputs::Solver& options, OdeSystem& system, double t0,
                                                const VectorX& y0) {
  return std::make_unique<DormandPrince>(options, system, t0, y0);
}

}  // namespace train_derail::solver
