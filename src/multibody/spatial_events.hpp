/// \file
/// What a train in space has in common that changes at events only: the emergency signal in its brake pipe, and the
/// track that it has torn.
#pragma once

#include <cstddef>
#include <vector>

#include <Simbody.h>

#include "train_derail/inputs/scenario.hpp"

namespace train_derail::multibody {

/// A force element that only remembers: no force of its own.
class Memory : public SimTK::Force::Custom::Implementation {
 public:
  void calcForce(const SimTK::State&, SimTK::Vector_<SimTK::SpatialVec>&, SimTK::Vector_<SimTK::Vec3>&,
                 SimTK::Vector&) const final {}
  SimTK::Real calcPotentialEnergy(const SimTK::State&) const final { return 0.0; }
};

/// Air brakes: when the emergency signal comes to each car, and how hard it brakes.
class BrakePipe final : public Memory {
 public:
  /// `crew_delay`: factor of brakes.emergency_time.
  BrakePipe(const inputs::Scenario& s, const SimTK::GeneralForceSubsystem& forces, double crew_delay);

  /// The pipe is opened, now, between car `coupler` and the next.
  void open(SimTK::State& state, std::size_t coupler) const;
  /// Brakes and rolling resistance over the load of a car.
  double share(const SimTK::State& state, std::size_t car) const;

  void realizeTopology(SimTK::State& state) const override;

 private:
  void open_at(SimTK::Vector& signals, double time, double place) const;

  const inputs::Brakes law_;
  const SimTK::GeneralForceSubsystem& forces_;
  const double emergency_;  // when the crew applies the brakes, from the head of the train; infinite: never [s]
  std::vector<double> full_, place_;  // full force over weight; along the pipe [m]
  std::vector<bool> by_radio_;        // opens the pipe when it is told
  mutable SimTK::DiscreteVariableIndex signals_;
};

/// Stretches of track that trucks have torn up as they left it.
class TornTrack final : public Memory {
 public:
  TornTrack(double length, const SimTK::GeneralForceSubsystem& forces) : length_(length), forces_(forces) {}

  /// The stretch around that place is torn from now on.
  void tear(SimTK::State& state, double place) const;
  bool torn(const SimTK::State& state, double place) const;

  void realizeTopology(SimTK::State& state) const override;

 private:
  using Stretches = SimTK::Array_<int>;
  int stretch(double place) const;

  const double length_;  // of a stretch, 0: none is torn [m]
  const SimTK::GeneralForceSubsystem& forces_;
  mutable SimTK::DiscreteVariableIndex torn_;
};

}  // namespace train_derail::multibody
