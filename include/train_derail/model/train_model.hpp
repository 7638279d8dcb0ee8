// What all models of a train have in common: its cars, where they start, and what can be read off a state.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/model/incidents.hpp"
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

/// State vectors have the layout of model/state.hpp.
class TrainModel {
 public:
  /// The scenario must be valid (inputs::validate).
  explicit TrainModel(const inputs::Scenario& scenario);
  virtual ~TrainModel() = default;

  Eigen::Index car_count() const { return static_cast<Eigen::Index>(cars_.size()); }
  Eigen::Index coupler_count() const { return car_count() - 1; }
  Eigen::Index size() const { return state_size(car_count()); }
  const std::vector<Car>& cars() const { return cars_; }
  const inputs::Coupler& coupler_law() const { return coupler_; }

  /// Mid-slack start, eqs. (15)-(17), with the scenario's perturbation.
  virtual StateVector initial_state() const;

  /// Has left the track: past the point of derailment, or, on rails that yield, a truck off them. Never undone.
  virtual bool derailed(Eigen::Index car) const = 0;
  /// The centre of mass has passed the point of derailment (cars that started ahead of it do not count). Never undone.
  virtual bool past_pod(Eigen::Index car) const = 0;

  /// Coupler `i` joins car i (lead) and car i + 1 (trail), counted from 0; no force if it is broken.
  virtual CouplerState<double> coupler(const double* y, Eigen::Index i) const;
  /// All of them.
  virtual std::vector<CouplerState<double>> couplers(const double* y) const;
  virtual bool broken(Eigen::Index /*coupler*/) const { return false; }
  /// Gap of every coupler [m] and its rate of change [m/s].
  virtual void gaps(const double* y, Eigen::ArrayXd& gap, Eigen::ArrayXd& rate) const = 0;

  /// Cosine and sine of every car's heading.
  virtual void headings(const double* y, Eigen::ArrayXd& cosine, Eigen::ArrayXd& sine) const = 0;
  CarMotion car_motion(const double* y, Eigen::Index car) const;
  /// `offset` along the car's axis from its centre, forward positive [m].
  PointMotion point(const double* y, Eigen::Index car, double offset) const { return car_motion(y, car).point(offset); }
  PointMotion front_pin(const double* y, Eigen::Index car) const { return point(y, car, 0.5 * at(car).length); }
  PointMotion rear_pin(const double* y, Eigen::Index car) const { return point(y, car, -0.5 * at(car).length); }
  PointMotion front_truck(const double* y, Eigen::Index car) const { return point(y, car, 0.5 * at(car).truck_spacing); }
  PointMotion rear_truck(const double* y, Eigen::Index car) const { return point(y, car, -0.5 * at(car).truck_spacing); }

  virtual EnergyLedger energy(const double* y) const = 0;
  Momentum momentum(const double* y) const;

  virtual bool straight_track() const { return true; }
  virtual TrackPlace track_place(Eigen::Index /*car*/, const Eigen::Vector2d& point) const {
    return {point.x(), point.y(), Eigen::Vector2d::UnitX()};
  }

  /// What the model itself has noted; null if it notes nothing and everything follows from states.
  virtual const Incidents* incidents() const { return nullptr; }

 protected:
  const Car& at(Eigen::Index car) const { return cars_[static_cast<std::size_t>(car)]; }
  /// Kinetic and coupler strain energy.
  EnergyLedger mechanical_energy(const double* y) const;

  std::vector<Car> cars_;
  inputs::Coupler coupler_;
  inputs::Ground ground_;
  inputs::InitialMotion initial_;
  Eigen::ArrayXd mass_, inertia_, half_length_, half_spacing_;
};

}  // namespace train_derail::model
