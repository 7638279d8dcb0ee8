/// \file
/// A car in space as Simbody moves it.
#pragma once

#include <Simbody.h>

#include "train_derail/model/train.hpp"

namespace train_derail::multibody {

/// A car with its trucks and, once it has lost them, without: two bodies of which one moves, while the other is held
/// somewhere and counts for nothing. Stations of both are from the centre of mass of the whole car.
class CarBody {
 public:
  CarBody(SimTK::SimbodyMatterSubsystem& matter, const model::Car& car);

  /// The one that moves.
  const SimTK::MobilizedBody::Free& now(const SimTK::State& state) const { return has_trucks(state) ? whole_ : bare_; }
  /// At the start it has them.
  void begin(SimTK::State& state) const { bare_.lock(state); }
  /// From now on it goes on without them, as it moves now.
  void lose_trucks(SimTK::State& state) const;
  /// Mass of what moves, over that of the whole car.
  double share(const SimTK::State& state) const { return has_trucks(state) ? 1.0 : share_; }

 private:
  bool has_trucks(const SimTK::State& state) const { return !whole_.isLocked(state); }

  double share_;  // of the mass, that is not of the trucks
  SimTK::MobilizedBody::Free whole_, bare_;
};

}  // namespace train_derail::multibody
