// What all models of a train have in common: its cars, where they start, and what can be read off a state.
#pragma once

#include <optional>
#include <vector>

#include "train_derail/eigen_types.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/model/incidents.hpp"
#include "train_derail/model/observation.hpp"
#include "train_derail/model/state.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// Linear momentum [kg m/s] and angular momentum about the origin [kg m^2/s].
struct Momentum {
  double x = 0.0, y = 0.0, angular = 0.0;
};

/// Position and velocity of a point of a car.
struct PointMotion {
  Vector2 position;  // m
  Vector2 velocity;  // m/s
};

/// A car's place and motion, its heading worked out once.
struct CarMotion {
  Vector2 centre;    // m
  Vector2 axis;      // unit vector, forward
  Vector2 velocity;  // of the centre [m/s]
  double omega;      // rad/s

  Vector2 side() const { return {-axis.y(), axis.x()}; }
  /// `offset` along the axis from the centre, forward positive [m].
  PointMotion point(double offset) const { return {centre + offset * axis, velocity + offset * omega * side()}; }
};

/// Everybody but the models takes a state vector as it is, and learns what is in it by observe() and plan().
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

  /// What can be seen of the train in a state.
  Observation observe(const double* y) const;
  virtual PlanColumns plan(const double* y) const;

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
  /// Gap of every coupler [m] and its rate of change [m/s]. Columns of Eigen of any kind; they are resized.
  template <class Column>
  void gaps(const double* y, Column& gap, Column& rate) const {
    gap.resize(coupler_count());
    rate.resize(coupler_count());
    find_gaps(y, gap.data(), rate.data());
  }

  /// Cosine and sine of every car's heading.
  template <class Column>
  void headings(const double* y, Column& cosine, Column& sine) const {
    cosine.resize(car_count());
    sine.resize(car_count());
    find_headings(y, cosine.data(), sine.data());
  }
  CarMotion car_motion(const double* y, Eigen::Index car) const;
  /// `offset` along the car's axis from its centre, forward positive [m].
  PointMotion point(const double* y, Eigen::Index car, double offset) const { return car_motion(y, car).point(offset); }
  PointMotion front_pin(const double* y, Eigen::Index car) const { return point(y, car, 0.5 * at(car).length); }
  PointMotion rear_pin(const double* y, Eigen::Index car) const { return point(y, car, -0.5 * at(car).length); }
  PointMotion front_truck(const double* y, Eigen::Index car) const {
    return point(y, car, 0.5 * at(car).truck_spacing);
  }
  PointMotion rear_truck(const double* y, Eigen::Index car) const {
    return point(y, car, -0.5 * at(car).truck_spacing);
  }

  virtual EnergyLedger energy(const double* y) const = 0;
  Momentum momentum(const double* y) const;

  virtual bool straight_track() const { return true; }
  virtual TrackPlace track_place(Eigen::Index /*car*/, const Vector2& point) const {
    return {point.x(), point.y(), Vector2::UnitX()};
  }
  /// What took the car's first truck off the rails; Cause::none where rails never yield.
  virtual Cause cause(Eigen::Index /*car*/) const { return Cause::none; }

  /// What the model itself has noted; null if it notes nothing and everything follows from states.
  virtual const Incidents* incidents() const { return nullptr; }
  /// Axial force of every coupler at the end of the last step, buff positive [N]; null if incidents() is.
  virtual const ArrayX* axial_forces() const { return nullptr; }

 protected:
  virtual void find_gaps(const double* y, double* gap, double* rate) const = 0;
  virtual void find_headings(const double* y, double* cosine, double* sine) const = 0;
  const Car& at(Eigen::Index car) const { return cars_[static_cast<std::size_t>(car)]; }
  /// Kinetic and coupler strain energy.
  EnergyLedger mechanical_energy(const double* y) const;

  std::vector<Car> cars_;
  inputs::Coupler coupler_;
  inputs::Ground ground_;
  inputs::InitialMotion initial_;
  ArrayX mass_, inertia_, half_length_, half_spacing_;
};

}  // namespace train_derail::model
