/// \file
/// What everybody may ask of a model of a train, whatever coordinates it moves.
#pragma once

#include <optional>
#include <vector>

#include "train_derail/eigen_types.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/attitude.hpp"
#include "train_derail/model/energy_ledger.hpp"
#include "train_derail/model/footprint.hpp"
#include "train_derail/model/incidents.hpp"
#include "train_derail/model/observation.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// The numbers that a solver integrates; what they mean is the model's own.
using StateVector = VectorX;

/// Position and velocity of a point of a car, seen from above.
struct PointMotion {
  Vector2 position;  ///< m
  Vector2 velocity;  ///< m/s
};

/// Place and motion of a car, seen from above, its heading worked out once.
struct CarMotion {
  Vector2 centre;    ///< centre of mass [m]
  Vector2 axis;      ///< unit vector, forward along the car
  Vector2 velocity;  ///< of the centre [m/s]
  double omega;      ///< yaw rate, counter-clockwise positive [rad/s]

  /// Unit vector to the left of the car.
  Vector2 side() const { return {-axis.y(), axis.x()}; }
  /// The point of the axis that lies `offset` ahead of the centre [m].
  PointMotion point(double offset) const { return {centre + offset * axis, velocity + offset * omega * side()}; }
};

/// Everybody but the models takes a state vector as it is, and learns what is in it by observe() and plan(). Cars and
/// couplers are counted from 0: coupler i joins car i (lead) and car i + 1 (trail).
class TrainModel {
 public:
  /// The scenario must be valid (inputs::validate).
  explicit TrainModel(const inputs::Scenario& scenario);
  TrainModel(const TrainModel&) = delete;
  TrainModel& operator=(const TrainModel&) = delete;
  virtual ~TrainModel() = default;

  /// Number of cars.
  Eigen::Index car_count() const { return static_cast<Eigen::Index>(cars_.size()); }
  /// Number of couplers.
  Eigen::Index coupler_count() const { return car_count() - 1; }
  /// The cars, from the foremost back.
  const std::vector<Car>& cars() const { return cars_; }
  /// The law of all couplers.
  const inputs::Coupler& coupler_law() const { return coupler_; }

  /// Length of a state vector.
  virtual Eigen::Index size() const = 0;
  /// The state at time 0 that the scenario describes, with its perturbation.
  virtual StateVector initial_state() const = 0;

  /// All that can be seen of the train in state `y`.
  virtual Observation observe(const double* y) const = 0;
  /// All cars of state `y` as seen from above; valid until the state changes or this is called again.
  virtual PlanColumns plan(const double* y) const = 0;
  /// What the cars do beside what is seen from above; valid as plan() is. Nothing in models of the plane: there the
  /// centre of mass is midway between the trucks, and plan() and headings() tell all.
  virtual std::optional<SpaceColumns> in_space(const double* /*y*/) const { return std::nullopt; }
  /// One car of state `y` as seen from above.
  virtual CarMotion car_motion(const double* y, Eigen::Index car) const = 0;
  /// What the body covers of the ground, seen from above.
  virtual Footprint footprint(const double* y, Eigen::Index car) const;
  /// How the car stands; nothing in models of the plane.
  virtual std::optional<Attitude> attitude(const double* /*y*/, Eigen::Index /*car*/) const { return std::nullopt; }

  /// The car has left the track: past the point of derailment, or, on rails that yield, a truck off them. Never undone.
  virtual bool derailed(Eigen::Index car) const = 0;
  /// The centre of mass has passed the point of derailment (cars that started ahead of it do not count). Never undone.
  virtual bool past_pod(Eigen::Index car) const = 0;
  /// What took the car's first truck off the rails; Cause::none where rails never yield.
  virtual Cause cause(Eigen::Index /*car*/) const { return Cause::none; }

  /// Gap of every coupler, pin to pin [m], and its rate of change [m/s]. Columns of Eigen of any kind; they are
  /// resized.
  template <class Column>
  void gaps(const double* y, Column& gap, Column& rate) const {
    gap.resize(coupler_count());
    rate.resize(coupler_count());
    find_gaps(y, gap.data(), rate.data());
  }
  /// Cosine and sine of every car's heading. Columns of Eigen of any kind; they are resized.
  template <class Column>
  void headings(const double* y, Column& cosine, Column& sine) const {
    cosine.resize(car_count());
    sine.resize(car_count());
    find_headings(y, cosine.data(), sine.data());
  }

  /// How many cars at the head of the train roll away for good: nothing else is coupled to them or near, the track
  /// before them is straight and whole, and it falls more than brakes hold. 0 in models that do not look for any.
  virtual Eigen::Index gone(const double* /*y*/) const { return 0; }

  /// Where the energy of the train is in state `y`, and what has been taken from it so far.
  virtual EnergyLedger energy(const double* y) const = 0;

  /// The centre line of the track is the x axis.
  virtual bool straight_track() const { return true; }
  /// `point` seen from the track; looked for near the car.
  virtual TrackPlace track_place(Eigen::Index /*car*/, const Vector2& point) const {
    return {point.x(), point.y(), Vector2::UnitX()};
  }

  /// What the model itself has noted; null if it notes nothing and everything follows from states.
  virtual const Incidents* incidents() const { return nullptr; }
  /// Axial force of every coupler at the end of the last step, buff positive [N]; null if incidents() is.
  virtual const ArrayX* axial_forces() const { return nullptr; }

 protected:
  virtual void find_gaps(const double* y, double* gap, double* rate) const = 0;
  virtual void find_headings(const double* y, double* cosine, double* sine) const = 0;
  const Car& at(Eigen::Index car) const { return cars_[static_cast<std::size_t>(car)]; }

  const std::vector<Car> cars_;
  const inputs::Coupler coupler_;
  const inputs::Ground ground_;
  const inputs::InitialMotion initial_;
};

}  // namespace train_derail::model
