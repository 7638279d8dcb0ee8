// Integrators of ordinary differential equations behind one small interface. Knows no trains; SUNDIALS stays in the
// .cpp.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "train_derail/eigen_types.hpp"
#include "train_derail/files/archive.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::solver {

/// dy/dt = f(t, y), what the implicit method needs of it, and event functions whose sign changes are located.
class OdeSystem {
 public:
  virtual ~OdeSystem() = default;

  virtual Eigen::Index size() const = 0;
  /// False if the result is not finite: a smaller step may help.
  virtual bool derivative(double t, const double* y, double* dydt) = 0;

  /// That many last components are pure quadratures: integrated along, but without a say in the step size.
  virtual Eigen::Index quadrature_count() const { return 0; }

  /// Number of event functions and their values. A constant non-zero value switches one off.
  virtual Eigen::Index event_count() const { return 0; }
  virtual void events(double /*t*/, const double* /*y*/, double* /*values*/) {}

  /// Order of the unknowns that makes the Jacobian banded: position[i] is the place of component i.
  virtual std::vector<Eigen::Index> band_positions() const = 0;
  virtual Eigen::Index band_lower() const = 0;
  virtual Eigen::Index band_upper() const = 0;
  using SetEntry = std::function<void(Eigen::Index row, Eigen::Index column, double value)>;
  /// Calls set(row, column, df_row/dy_column) in band order for every entry that can be non-zero.
  virtual void jacobian(double t, const double* y, const SetEntry& set) = 0;
};

/// A motion q' = v, v' = a(t, q, v) that jumps at the end of steps: for steps of fixed length. The state is laid out as
/// positions, as many velocities, and whatever else the system keeps there.
class SteppedSystem {
 public:
  virtual ~SteppedSystem() = default;

  virtual Eigen::Index size() const = 0;
  virtual Eigen::Index position_count() const = 0;
  /// Accelerations at the beginning (t, y) of a step of length h.
  virtual void accelerations(double t, double h, const double* y, double* result) = 0;
  /// The step from (t, before) to (t + h, y) is done; may change y.
  virtual void settle(double t, double h, const double* before, double* y) = 0;
};

struct Statistics {
  std::int64_t steps = 0;           // accepted
  std::int64_t rejected_steps = 0;  // by the error test or a failed nonlinear solve
  std::int64_t rhs_evaluations = 0;
  std::int64_t jacobian_evaluations = 0;
};

enum class StepStatus { stepped, event, failed };

struct StepResult {
  StepStatus status = StepStatus::stepped;
  std::vector<Eigen::Index> events;  // which event functions changed sign at time(); empty unless status is event
  std::string message;               // why it failed; empty unless status is failed
};

/// Steps from one state to the next. After a failure time() and state() stay at the last good step.
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// One step, cut short where an event function changes sign.
  virtual StepResult step() = 0;
  virtual double time() const = 0;
  virtual double previous_time() const = 0;
  virtual const VectorX& state() const = 0;

  /// Dense output: state at t within [previous_time(), time()].
  virtual void interpolate(double t, VectorX& y) const = 0;

  /// Forgets the history: f has jumped at time(). Keeps the step size.
  virtual void restart() = 0;

  virtual Statistics statistics() const = 0;

  /// Whether walk() works: of steps of fixed length, which have no history.
  virtual bool can_be_saved() const { return false; }
  /// Saves or restores all that the next steps depend on. Throws std::logic_error unless can_be_saved().
  virtual void walk(files::Archive& archive);
};

/// `system` must outlive the integrator. Throws std::runtime_error if SUNDIALS refuses the set-up.
std::unique_ptr<Integrator> make_integrator(const inputs::Solver& options, OdeSystem& system, double t0,
                                            const VectorX& y0);

/// Semi-implicit (symplectic) Euler, first order: v += h a(q, v), q += h v, with options.fixed_step. step() reports no
/// events.
std::unique_ptr<Integrator> make_integrator(const inputs::Solver& options, SteppedSystem& system, double t0,
                                            const VectorX& y0);

}  // namespace train_derail::solver
