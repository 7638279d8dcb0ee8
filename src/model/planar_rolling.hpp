/// \file
/// Cars of the extended model that only roll: on sound rails, far from whatever is off them. What happens across the
/// track is known there without computing it, and the loops find their motion along the track alone
/// (model/rolling_kernels_impl.hpp).
#pragma once

#include <vector>

#include "model/car_ranges.hpp"
#include "model/contacts.hpp"
#include "model/couplers.hpp"
#include "model/planar_rest.hpp"
#include "model/trucks.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// The law. A block of kBusyBlock cars rolls while
/// - all its trucks are on the rails, and so are those of the next kReach cars that are coupled to it at either end,
/// - the lateral force of each of these trucks is at most rails.rolling_share of what makes it leave the rails,
/// - no truck of the block is near track that is torn, a place where it leaves the rails, or one where the curvature
///   changes by more than kBend of that force at its speed, and no other body is near.
/// Every kInterval, and whenever a car that rolls is hit, all this is looked at again. The lateral force of a truck is
/// what the couplers, with their angles, and the bend of its path at its speed make it. A block that no longer rolls
/// goes on from the rails as they are there, with the motion that they force upon it.
class PlanarRolling {
 public:
  static constexpr double kInterval = 0.04;  ///< s
  static constexpr double kQuiet = 0.2;      ///< for so long a block must be fit to roll [s],
  static constexpr double kEnter = 0.75;     ///< with at most that much of rails.rolling_share
  static constexpr int kSeatEvery = 5;       ///< looks, on straight track
  static constexpr double kBend = 0.25;      ///< of rails.rolling_share
  static constexpr int kReach = 3;           ///< cars beyond a block's ends
  static constexpr double kWay = 20.0;       ///< "near" on the track [m], and kTime times the speed
  static constexpr double kTime = 0.5;       ///< s

  /// `arrays`: of the cars `train`. All but `scenario` must outlive it.
  PlanarRolling(const inputs::Scenario& scenario, const std::vector<Car>& train, const PlanarArrays& arrays,
                const Couplers& couplers, Trucks& trucks, PlanarRest& rest);

  /// The cars that only roll. On curved track they turn with it.
  const BusyCars& cars() const { return ranges_.cars(); }
  /// Whether `car` is one of them.
  bool rolls(Eigen::Index car) const { return rolls_[busy_block(car)]; }
  /// The end of a step of length h [s], with the forces of its beginning: who rolls from now on. Changes the places of
  /// those who do, and the motion of those who begin or cease to. Returns the energy that this takes [J]. `contacts`
  /// may be null.
  double look(double h, double* y, Contacts* contacts);
  void walk(files::Archive& archive);

 private:
  using Index = Eigen::Index;

  /// Calls use(car) for all that roll.
  template <class Use>
  void for_all(const Use& use);
  /// Puts it onto the rails as they are where it has come to, and gives it, if it `goes` on as a body in the plane, the
  /// motion across the track and in yaw that they force upon it. Returns the energy that this takes [J].
  double seat(double* y, Index car, bool goes);
  /// The bar of coupler i, from the pin of the car behind to that of the car in front; without force at the train's
  /// ends.
  struct Bar {
    Vector2 along;
    double length, axial;  ///< m; buff positive [N]
  };
  Bar bar(const double* y, Index i) const;
  /// What the rails bear sideways under all that roll, so that it can be compared with what they hold.
  void find_lateral(const double* y);
  void find_lateral(const double* y, Index car, const Bar& ahead, const Bar& behind);
  /// Nothing but rolling may happen to the block while L/V is at most `share` of derail_ratio.
  bool may_roll(std::size_t block, double share) const;
  void show();
  bool is_calm(Index car, double share) const { return trucks_.sound(car) && lateral_share_[at(car)] <= share; }
  void begin_look(const double* y, Contacts* contacts);
  double kinetic(const double* y, Index car) const;
  Index first(std::size_t block) const { return static_cast<Index>(block) * kBusyBlock; }
  Index end(std::size_t block) const { return std::min(first(block) + kBusyBlock, static_cast<Index>(train_.size())); }
  static std::size_t at(Index car) { return static_cast<std::size_t>(car); }

  const double share_;
  const bool possible_;       // with these inputs
  const double bend_at_one_;  // at which that share is reached, times the speed squared [m/s^2]
  const std::vector<Car>& train_;
  const PlanarArrays arrays_;
  const Couplers& couplers_;
  Trucks& trucks_;
  PlanarRest& rest_;
  double unlooked_ = 0.0;          // s
  int unseated_ = 0;               // looks
  std::vector<bool> rolls_;        // one a block
  std::vector<double> quiet_for_;  // one a block [s]
  // One a car.
  std::vector<double> bend_front_, bend_rear_;      // of the trucks' paths, as seat() has found them last [1/m]
  std::vector<double> lateral_share_, way_, bend_;  // of this look; bend: largest change that is allowed [1/m]
  std::vector<bool> sound_, near_;
  CarRanges ranges_;
};

}  // namespace train_derail::model
