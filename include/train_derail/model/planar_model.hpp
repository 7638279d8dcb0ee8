/// \file
/// What the models of the plane have in common: cars that move in x, y and yaw, joined by massless bars.
#pragma once

#include <vector>

#include "train_derail/model/coupler_law.hpp"
#include "train_derail/model/state.hpp"
#include "train_derail/model/train_model.hpp"

namespace train_derail::model {

struct PlanarArrays;
struct PlanarKernels;

/// Linear momentum [kg m/s] and angular momentum about the origin [kg m^2/s].
struct Momentum {
  double x = 0.0;        ///< forward
  double y = 0.0;        ///< left
  double angular = 0.0;  ///< counter-clockwise
};

/// States are laid out as in state_layout.hpp. Heights, roll, pitch and vertical forces are zero.
class PlanarModel : public TrainModel {
 public:
  /// The scenario must be valid (inputs::validate).
  explicit PlanarModel(const inputs::Scenario& scenario);

  Eigen::Index size() const override { return state_size(car_count()); }
  /// Mid-slack start, eqs. (15)-(17), with the scenario's perturbation.
  StateVector initial_state() const override;

  Observation observe(const double* y) const override;
  PlanColumns plan(const double* y) const override;
  CarMotion car_motion(const double* y, Eigen::Index car) const override;

  /// Coupler `i` with its forces, which are zero if it is broken.
  CouplerState<double> coupler(const double* y, Eigen::Index i) const;
  /// All of them; the motion of each car is found once.
  virtual std::vector<CouplerState<double>> couplers(const double* y) const;
  /// The coupler has broken, for good.
  virtual bool broken(Eigen::Index /*coupler*/) const { return false; }

  /// The point of the car's axis that lies `offset` ahead of its centre [m].
  PointMotion point(const double* y, Eigen::Index car, double offset) const { return car_motion(y, car).point(offset); }
  /// Coupler pins and truck centres of a car.
  PointMotion front_pin(const double* y, Eigen::Index car) const { return point(y, car, half_length_[car]); }
  PointMotion rear_pin(const double* y, Eigen::Index car) const { return point(y, car, -half_length_[car]); }
  PointMotion front_truck(const double* y, Eigen::Index car) const { return point(y, car, half_spacing_[car]); }
  PointMotion rear_truck(const double* y, Eigen::Index car) const { return point(y, car, -half_spacing_[car]); }

  /// Of the whole train.
  Momentum momentum(const double* y) const;

 protected:
  /// Coupler `i` with its forces, between the cars that move as `lead` and `trail` say.
  virtual CouplerState<double> coupler_between(const CarMotion& lead, const CarMotion& trail, Eigen::Index i) const;
  /// Of the pins of coupler `i`: that of the leading car, and that of the trailing one.
  PointMotion lead_pin(const CarMotion& lead, Eigen::Index i) const { return lead.point(-half_length_[i]); }
  PointMotion trail_pin(const CarMotion& trail, Eigen::Index i) const { return trail.point(half_length_[i + 1]); }

  /// The loops over cars that every model of the plane has.
  virtual const PlanarKernels& loops() const = 0;
  void find_gaps(const double* y, double* gap, double* rate) const override;
  void find_headings(const double* y, double* cosine, double* sine) const override;
  /// The arrays below, for loops. Valid as long as the model lives.
  PlanarArrays planar_arrays() const;
  /// Kinetic energy; nothing else is filled in.
  EnergyLedger kinetic_energy(const double* y) const;

  // One a car; a zero inverse is an infinite inertia.
  ArrayX mass_, inertia_, inverse_mass_, inverse_inertia_, half_length_, half_spacing_;
  const double cos_limit_;  // of the coupler's swing
  // Scratch of the loops: headings, one a car; forces and moments of couplers, cars + 1 entries, [i + 1] is coupler i.
  mutable ArrayX cos_, sin_, pin_x_, pin_y_, moment_lead_, moment_trail_;
};

}  // namespace train_derail::model
