/// \file
/// A coupler in space.
#pragma once

#include <Simbody.h>

#include "multibody/car_body.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::multibody {

/// Draft gear, damper and stops of a coupler. Its forces are slopes of its length and of the energy of its stops, found
/// by differences. It breaks by pull, swing, moments of its ends, vertical force or twist, and slips by rise.
class SpatialBar final : public SimTK::Force::Custom::Implementation {
 public:
  SpatialBar(const inputs::Coupler& law, const inputs::CouplerHold& hold, const SimTK::GeneralForceSubsystem& forces,
             double damping, bool roll_stop, const CarBody& ahead, const SimTK::Vec3& rear_pin, const CarBody& behind,
             const SimTK::Vec3& front_pin);

  bool broken(const SimTK::State& state) const;
  void part(SimTK::State& state) const;
  /// Positive while nothing breaks the coupler: how far it is from its nearest limit, as a share of the limit.
  double holds(const SimTK::State& state) const;
  /// Axial force, buff positive, of one that is not broken [N].
  double buff(const SimTK::State& state) const;

  void realizeTopology(SimTK::State& state) const override;
  void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<SimTK::Vec3>&,
                 SimTK::Vector&) const override;
  SimTK::Real calcPotentialEnergy(const SimTK::State&) const override { return 0.0; }

 private:
  /// Slope of a quantity downhill: force on the car ahead; moments.
  struct Downhill {
    SimTK::Vec3 force{0.0}, on_ahead{0.0}, on_behind{0.0};
  };
  /// Length of the bar, and its slope.
  struct Stretch {
    double length;
    Downhill shortening;
  };
  Stretch stretch(const SimTK::State& state) const;
  /// Length of a bar in buff: one that is tilted stands on edges of its ends, as long as slack makes room for that.
  double on_edges(const SimTK::Transform& ahead, const SimTK::Transform& behind) const;
  double buff(const SimTK::State& state, const Stretch& stretch) const;
  /// Buff positive.
  double buff(double length, double rate) const;
  double stop_energy(const SimTK::Transform& ahead, const SimTK::Transform& behind) const;
  /// Roll of one car in the other: the angle between what is left of their left sides when seen along the bar.
  double roll(const SimTK::Transform& ahead, const SimTK::Transform& behind) const;
  Downhill stops(const SimTK::Transform& ahead, const SimTK::Transform& behind) const;
  /// By central differences.
  template <class Function>
  static Downhill slope(const SimTK::Transform& ahead, const SimTK::Transform& behind, const Function& of);

  const inputs::Coupler law_;
  const inputs::CouplerHold hold_;
  const SimTK::GeneralForceSubsystem& forces_;
  const double damping_;
  const bool roll_stop_;
  const CarBody ahead_, behind_;
  const SimTK::Vec3 rear_pin_, front_pin_;
  mutable SimTK::DiscreteVariableIndex broken_;
};

}  // namespace train_derail::multibody
