/// \file
/// Forces that strain something, as differential equations.
#pragma once

#include <Simbody.h>

namespace train_derail::multibody {

/// A force with numbers of its own in the state, strains first. It finds their rates together with its forces.
class Strained : public SimTK::Force::Custom::Implementation {
 public:
  /// An error of a strain counts a hundredth of one of a place: it is soon forgotten.
  void set_weights(SimTK::State& state) const;

  SimTK::Real calcPotentialEnergy(const SimTK::State&) const final { return 0.0; }
  void realizeAcceleration(const SimTK::State& state) const final;

 protected:
  explicit Strained(const SimTK::GeneralForceSubsystem& forces) : forces_(forces) {}

  /// So many strains and other numbers, all 0 at the start.
  void allocate(SimTK::State& state, int strains, int others = 0) const;
  const SimTK::Real* numbers(const SimTK::State& state) const { return &forces_.getZ(state)[first_]; }
  SimTK::Real* rates(const SimTK::State& state) const;

  const SimTK::GeneralForceSubsystem& forces_;

 private:
  mutable int strains_ = 0;
  mutable SimTK::ZIndex first_;
  mutable SimTK::CacheEntryIndex rates_;
};

}  // namespace train_derail::multibody
