/// \file
/// Bodies of cars in space that press on each other.
#pragma once

#include <ostream>
#include <vector>

#include <Simbody.h>

#include "multibody/body_patch.hpp"
#include "multibody/car_body.hpp"
#include "multibody/strained.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::multibody {

/// Contact of all pairs of cars. How far bodies have been crushed and how far friction has strained them follow
/// differential equations: both come to their limits within `settle_time`.
class BodyContacts final : public Strained {
 public:
  /// `at_centre`: a mistake is put in, the force acts at the centres of mass.
  BodyContacts(const inputs::Scenario& s, const std::vector<model::Car>& train, const std::vector<CarBody>& bodies,
               const SimTK::GeneralForceSubsystem& forces, double settle_time, bool at_centre);

  /// Two cars that push each other, a < b: a place, and the velocity of the first against the second where they close
  /// fastest.
  struct Push {
    std::size_t a, b;
    SimTK::Vec3 point, velocity;
    double closing;
  };
  /// All of them; the state must be realized to its forces.
  const std::vector<Push>& pushes(const SimTK::State& state) const;

  void realizeTopology(SimTK::State& state) const override;
  void calcForce(const SimTK::State& state, SimTK::Vector_<SimTK::SpatialVec>& forces, SimTK::Vector_<SimTK::Vec3>&,
                 SimTK::Vector&) const override;

 private:
  /// Of a pair: how far crushed [m], how far friction has strained it [m].
  struct Strain {
    double crushed;
    SimTK::Vec3 sheared;
  };
  static constexpr int kNumbers = 4;
  friend std::ostream& operator<<(std::ostream& out, const std::vector<Push>& pushes) { return out << pushes.size(); }

  Block block(const SimTK::State& state, std::size_t car) const;
  /// Adds the forces of a pair, and what there is to say of it; returns how fast its strain changes.
  Strain press(const SimTK::State& state, std::size_t a, std::size_t b, const Patch& patch, const Strain& now,
               SimTK::Vector_<SimTK::SpatialVec>& forces, std::vector<Push>& pushes) const;
  /// Where a force from that direction presses, the end of the car is pushed.
  bool at_end(const SimTK::State& state, std::size_t car, const SimTK::Vec3& normal) const;
  int pairs() const { return static_cast<int>(radius_.size() * (radius_.size() - 1) / 2); }

  const inputs::Contact law_;
  const double quiet_;
  const double settle_time_;
  const bool at_centre_;
  const std::vector<CarBody> bodies_;
  std::vector<SimTK::Vec3> centre_, half_;  // of the bodies of cars
  std::vector<double> radius_;
  mutable SimTK::DiscreteVariableIndex axes_;  // Patch::axis of every pair, of the step before
  mutable SimTK::CacheEntryIndex pushes_;      // found with the forces
};

}  // namespace train_derail::multibody
