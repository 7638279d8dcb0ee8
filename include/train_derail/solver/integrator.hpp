/// \file
/// Integrators of ordinary differential equations behind one small interface. They know nothing about trains. SUNDIALS
/// is used only in the source files.
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

/// A system dy/dt = f(t, y), with its Jacobian for implicit methods, and with event functions whose changes of sign the
/// integrator locates.
class OdeSystem {
 public:
  virtual ~OdeSystem() = default;

  /// Number of components of y.
  virtual Eigen::Index size() const = 0;
  /// Computes f(t, y). Returns false if the result is not finite; the integrator then tries a smaller step.
  virtual bool derivative(double t, const double* y, double* dydt) = 0;

  /// Number of positions at the beginning of y, whose rates are the as many velocities that follow them; by default
  /// nothing is known of that.
  virtual Eigen::Index position_count() const { return 0; }
  /// derivative() that may leave out the rates of the positions.
  virtual bool accelerations(double t, const double* y, double* dydt) { return derivative(t, y, dydt); }

  /// Number of components at the end of y that are quadratures: they are integrated, but do not influence f or the step
  /// size.
  virtual Eigen::Index quadrature_count() const { return 0; }

  /// Number of event functions.
  virtual Eigen::Index event_count() const { return 0; }
  /// Computes the values of all event functions. A constant value other than zero switches one off.
  virtual void events(double /*t*/, const double* /*y*/, double* /*values*/) {}

  /// Order of the components that makes the Jacobian banded: element i is the position of component i.
  virtual std::vector<Eigen::Index> band_positions() const = 0;
  /// Number of diagonals below the main diagonal, in band order.
  virtual Eigen::Index band_lower() const = 0;
  /// Number of diagonals above the main diagonal, in band order.
  virtual Eigen::Index band_upper() const = 0;
  /// Function that takes one entry of the Jacobian.
  using SetEntry = std::function<void(Eigen::Index row, Eigen::Index column, double value)>;
  /// Computes the Jacobian: calls set(row, column, df_row/dy_column) for every entry that can differ from zero. Row and
  /// column are positions in band order.
  virtual void jacobian(double t, const double* y, const SetEntry& set) = 0;
};

/// A motion q' = v, v' = a(t, q, v) that may change abruptly at the end of a step, for steps of fixed length. The state
/// holds the positions, then as many velocities, then other values of the system.
class SteppedSystem {
 public:
  virtual ~SteppedSystem() = default;

  /// Number of components of the state.
  virtual Eigen::Index size() const = 0;
  /// Number of positions.
  virtual Eigen::Index position_count() const = 0;
  /// Computes the accelerations for a step of length h that begins at (t, y).
  virtual void accelerations(double t, double h, const double* y, double* result) = 0;
  /// Called after the step from (t, before) to (t + h, y); may change y.
  virtual void settle(double t, double h, const double* before, double* y) = 0;
};

/// Counters of an integrator.
struct Statistics {
  std::int64_t steps = 0;                 ///< accepted steps
  std::int64_t rejected_steps = 0;        ///< steps that failed the error test or the nonlinear solver
  std::int64_t rhs_evaluations = 0;       ///< evaluations of f
  std::int64_t jacobian_evaluations = 0;  ///< evaluations of the Jacobian
};

/// How a step ended.
enum class StepStatus {
  stepped,  ///< as planned
  event,    ///< cut short, because an event function changed its sign
  failed    ///< the integrator cannot go on
};

/// Result of a step.
struct StepResult {
  StepStatus status = StepStatus::stepped;  ///< how it ended
  std::vector<Eigen::Index>
      events;           ///< event functions that changed their sign at time(); empty unless status is event
  std::string message;  ///< why the step failed; empty unless status is failed
};

/// Integrates a system step by step. After a failure, time() and state() are those of the last good step.
class Integrator {
 public:
  virtual ~Integrator() = default;

  /// Takes one step. It is cut short where an event function changes its sign.
  virtual StepResult step() = 0;
  /// Time at the end of the last step.
  virtual double time() const = 0;
  /// Time at the beginning of the last step.
  virtual double previous_time() const = 0;
  /// State at time().
  virtual const VectorX& state() const = 0;

  /// Interpolates the state within the last step; t must be in [previous_time(), time()].
  virtual void interpolate(double t, VectorX& y) const = 0;

  /// Forgets earlier steps, because f has changed abruptly at time(). The step size is kept.
  virtual void restart() = 0;

  /// Counters since the start.
  virtual Statistics statistics() const = 0;

  /// Whether walk() works: of steps of fixed length, which have no history.
  virtual bool can_be_saved() const { return false; }
  /// Saves or restores all that the next steps depend on. Throws std::logic_error unless can_be_saved().
  virtual void walk(files::Archive& archive);
};

/// Makes an integrator for the methods dormand_prince (our own, with cubic dense output), cash_karp (ARKODE) and bdf
/// (CVODE). It starts at (t0, y0). `system` must live longer than the integrator. Throws std::runtime_error if SUNDIALS
/// refuses the set-up.
std::unique_ptr<Integrator> make_integrator(const inputs::Solver& options, OdeSystem& system, double t0,
                                            const VectorX& y0);

/// Makes an integrator for the method semi_implicit: the semi-implicit (symplectic) Euler method of first order,
/// v += h a(q, v), then q += h v, with the step options.fixed_step. It reports no events. `system` must live longer
/// than the integrator.
std::unique_ptr<Integrator> make_integrator(const inputs::Solver& options, SteppedSystem& system, double t0,
                                            const VectorX& y0);

}  // namespace train_derail::solver
