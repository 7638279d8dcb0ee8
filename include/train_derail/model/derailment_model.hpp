// Equations of motion of a train that derails: Jeong, Lyons, Orringer and Perlman (2007), RTDF2007-46009, eqs. 1-17,
// with the errata of docs/model.md. Knows no time stepping.
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/state.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// Mechanical energy and work of the whole train [J]. Without error of integration, total() stays constant.
struct EnergyLedger {
  double kinetic_translation = 0.0;
  double kinetic_rotation = 0.0;
  double coupler_axial = 0.0;    // strain energy
  double coupler_swing = 0.0;    // strain energy
  double work_on_track = 0.0;    // dissipated by the ground under cars before the point of derailment
  double work_off_track = 0.0;   // ... past it

  double kinetic() const { return kinetic_translation + kinetic_rotation; }
  double total() const { return kinetic() + coupler_axial + coupler_swing + work_on_track + work_off_track; }
};

/// Linear momentum [kg m/s] and angular momentum about the origin [kg m^2/s].
struct Momentum {
  double x = 0.0, y = 0.0, angular = 0.0;
};

/// Position and velocity of a point of a car.
struct PointMotion {
  Eigen::Vector2d position;  // m
  Eigen::Vector2d velocity;  // m/s
};

/// Right-hand side with its one discrete state: which cars have passed the point of derailment at x = 0.
/// One object a run and a thread (it owns scratch arrays).
class DerailmentModel {
 public:
  /// The scenario must be valid (inputs::validate).
  explicit DerailmentModel(const inputs::Scenario& scenario);

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

  /// dydt = f(y); both of length size().
  void derivative(const double* y, double* dydt);

  /// Jacobian of derivative() in the band ordering: index of (car, coordinate) is 6 car + coordinate, work terms last.
  /// Rows of the work terms are left zero (they feed back on nothing). `set(row, column, value)` is called for each entry
  /// inside the band once; entries not set are zero.
  using SetEntry = std::function<void(Eigen::Index row, Eigen::Index column, double value)>;
  void jacobian(const double* y, const SetEntry& set) const;
  static Eigen::Index band_index(Eigen::Index car, Coordinate c) { return kCoordinates * car + c; }
  static constexpr Eigen::Index kBandLower = 11, kBandUpper = 5;

  /// Coupler `i` joins car i (lead) and car i + 1 (trail), counted from 0.
  CouplerState<double> coupler(const double* y, Eigen::Index i) const;
  /// `offset` along the car's axis from its centre, forward positive [m].
  PointMotion point(const double* y, Eigen::Index car, double offset) const;
  PointMotion front_pin(const double* y, Eigen::Index car) const { return point(y, car, 0.5 * at(car).length); }
  PointMotion rear_pin(const double* y, Eigen::Index car) const { return point(y, car, -0.5 * at(car).length); }
  PointMotion front_truck(const double* y, Eigen::Index car) const { return point(y, car, 0.5 * at(car).truck_spacing); }
  PointMotion rear_truck(const double* y, Eigen::Index car) const { return point(y, car, -0.5 * at(car).truck_spacing); }

  EnergyLedger energy(const double* y) const;
  Momentum momentum(const double* y) const;

 private:
  const Car& at(Eigen::Index car) const { return cars_[static_cast<std::size_t>(car)]; }
  bool held(Eigen::Index car) const { return ground_.on_track_law == inputs::OnTrackLaw::guided && !derailed(car); }

  std::vector<Car> cars_;
  inputs::Coupler coupler_;
  double cos_limit_;  // of the coupler's swing
  inputs::Ground ground_;
  inputs::InitialMotion initial_;
  std::vector<bool> derailed_;
  Eigen::ArrayXd mass_, inertia_, half_length_, half_spacing_, load_;  // load_: mu W / 2 as latched [N]
  Eigen::ArrayXd cos_, sin_;                                           // scratch
};

}  // namespace train_derail::model
