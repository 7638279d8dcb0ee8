// Equations of motion of a train that derails: Jeong, Lyons, Orringer and Perlman (2007), RTDF2007-46009, eqs. 1-17,
// with the errata of docs/model.md. Knows no time stepping.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/state.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// Linear momentum [kg m/s] and angular momentum about the origin [kg m^2/s].
struct Momentum {
  double x = 0.0, y = 0.0, angular = 0.0;
};

/// Position and velocity of a point of a car.
struct PointMotion {
  Eigen::Vector2d position;  // m
  Eigen::Vector2d velocity;  // m/s
};

/// A car's place and motion, its heading worked out once.
struct CarMotion {
  Eigen::Vector2d centre;    // m
  Eigen::Vector2d axis;      // unit vector, forward
  Eigen::Vector2d velocity;  // of the centre [m/s]
  double omega;              // rad/s

  Eigen::Vector2d side() const { return {-axis.y(), axis.x()}; }
  /// `offset` along the axis from the centre, forward positive [m].
  PointMotion point(double offset) const { return {centre + offset * axis, velocity + offset * omega * side()}; }
};

struct CarArrays;
struct KernelSet;

/// Right-hand side with its one discrete state: which cars have passed the point of derailment at x = 0.
/// One object a run and a thread (it owns scratch arrays).
class DerailmentModel {
 public:
  /// The scenario must be valid (inputs::validate). Throws std::invalid_argument unless `instruction_set` is one of
  /// instruction_sets(); by default the first of them that suits the length of the train.
  explicit DerailmentModel(const inputs::Scenario& scenario, const std::string& instruction_set = "");

  /// Versions of derivative() and gaps() that this processor can run, fastest first: of "avx512", "avx2", "plain". They agree to
  /// rounding. Short trains have only the last.
  static std::vector<std::string> instruction_sets(Eigen::Index cars);

  Eigen::Index car_count() const { return static_cast<Eigen::Index>(cars_.size()); }
  Eigen::Index coupler_count() const { return car_count() - 1; }
  Eigen::Index size() const { return state_size(car_count()); }
  const std::vector<Car>& cars() const { return cars_; }
  const inputs::Coupler& coupler_law() const { return coupler_; }

  /// Mid-slack start, eqs. (15)-(17), with the scenario's perturbation.
  StateVector initial_state() const;

  /// Past the point of derailment: latched by derail(), never undone; the first car from the start.
  bool derailed(Eigen::Index car) const { return derailed_[static_cast<std::size_t>(car)]; }
  void derail(Eigen::Index car);

  /// x of the foremost car that has not derailed [m]; minus infinity if all have.
  double foremost_on_track(const double* y) const;

  /// dydt = f(y); both of length size().
  void derivative(const double* y, double* dydt) const;

  /// Jacobian of derivative() in the band ordering: index of (car, coordinate) is 6 car + coordinate, work terms last.
  /// Rows of the work terms are left zero (they feed back on nothing). `set(row, column, value)` is called for each entry
  /// inside the band once; entries not set are zero.
  using SetEntry = std::function<void(Eigen::Index row, Eigen::Index column, double value)>;
  void jacobian(const double* y, const SetEntry& set) const;
  static Eigen::Index band_index(Eigen::Index car, Coordinate c) { return kCoordinates * car + c; }
  static constexpr Eigen::Index kBandLower = 11, kBandUpper = 5;

  /// Coupler `i` joins car i (lead) and car i + 1 (trail), counted from 0.
  CouplerState<double> coupler(const double* y, Eigen::Index i) const;
  /// All of them.
  std::vector<CouplerState<double>> couplers(const double* y) const;
  /// Gap of every coupler [m] and its rate of change [m/s].
  void gaps(const double* y, Eigen::ArrayXd& gap, Eigen::ArrayXd& rate) const;
  /// Cosine and sine of every car's heading.
  void headings(const double* y, Eigen::ArrayXd& cosine, Eigen::ArrayXd& sine) const;
  CarMotion car_motion(const double* y, Eigen::Index car) const;
  /// `offset` along the car's axis from its centre, forward positive [m].
  PointMotion point(const double* y, Eigen::Index car, double offset) const { return car_motion(y, car).point(offset); }
  PointMotion front_pin(const double* y, Eigen::Index car) const { return point(y, car, 0.5 * at(car).length); }
  PointMotion rear_pin(const double* y, Eigen::Index car) const { return point(y, car, -0.5 * at(car).length); }
  PointMotion front_truck(const double* y, Eigen::Index car) const { return point(y, car, 0.5 * at(car).truck_spacing); }
  PointMotion rear_truck(const double* y, Eigen::Index car) const { return point(y, car, -0.5 * at(car).truck_spacing); }

  EnergyLedger energy(const double* y) const;
  Momentum momentum(const double* y) const;

 private:
  const Car& at(Eigen::Index car) const { return cars_[static_cast<std::size_t>(car)]; }
  /// Ground and rails of the car as its place has it: before the point of derailment or past it.
  void lay(Eigen::Index car);
  CarArrays arrays() const;

  std::vector<Car> cars_;
  inputs::Coupler coupler_;
  double cos_limit_;  // of the coupler's swing
  inputs::Ground ground_;
  inputs::InitialMotion initial_;
  std::vector<bool> derailed_;
  Eigen::ArrayXd mass_, inertia_, half_length_, half_spacing_;
  Eigen::ArrayXd load_, lateral_, past_pod_, inverse_mass_, inverse_mass_y_, inverse_inertia_;  // see CarArrays
  mutable Eigen::ArrayXd cos_, sin_, force_x_, force_y_, moment_lead_, moment_trail_;           // scratch
  const KernelSet* kernels_;
};

}  // namespace train_derail::model
