/// \file
/// Cars off the rails that lie still in the extended model: friction holds them where they are. Nothing is computed for
/// them, nor for the couplers and touches between them, until what others do to one is more than friction can hold.
#pragma once

#include <vector>

#include "model/car_ranges.hpp"
#include "model/couplers.hpp"
#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "model/rest.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// The law: a car both of whose trucks are off the rails, every point of which has come less far than at
/// ground.rest_speed in Rest::kTime, and which the friction under its trucks can stop within that time, is held.
/// Friction takes what motion it has left. While others push it, it keeps the momentum that they give it less what
/// friction takes, but it stays where it is: bodies that are pressed together push in spikes. Once any point would be
/// faster than ground.rest_speed the car is let go, in the same step, with that momentum.
class PlanarRest {
 public:
  /// `couplers` and all arrays of `trucks` must outlive it.
  PlanarRest(const inputs::Ground& law, const std::vector<Car>& cars, const Couplers& couplers,
             const TruckArrays& trucks);

  bool any() const { return rest_.any(); }
  bool lies(int car) const { return rest_.lies(static_cast<std::size_t>(car)); }
  /// The cars that loops have to look at: all that move and do not only roll, and whose couplers join them to one that
  /// moves.
  const CarRanges& busy() const { return busy_; }
  /// Blocks (of kBusyBlock) of cars that only roll from now on. None of them may lie.
  void leave_out(const std::vector<bool>& rolling);
  /// Grows whenever another car lies, or one no longer does.
  std::size_t changes() const { return changes_; }

  /// A step begins: the sums hold what the loops have found.
  void begin(const Wrenches& sum);
  /// Something pushes car `car`, which lies, in this step; to be called before that is added to the sums.
  void touch(int car, const Wrenches& sum);
  /// touch() has been called in this step, or a coupler joins the car, which lies, to one that moves.
  bool touched(int car) const { return touched_[static_cast<std::size_t>(car)]; }
  /// All forces of a step of length h [s] are in the sums: lets go what they move.
  void hold(double h, const CarColumns& cars, const Wrenches& sum);
  /// The same moment: who has been slow for long enough will lie at the end of this step.
  void look(double h, const CarColumns& cars);
  /// Sets the accelerations (columns x, y, yaw) in this step of those that lie and of those that have been let go.
  void still(double h, double* accelerations);
  /// The end of the step: stops in state `y` those that look() has found; returns the energy that friction has taken
  /// from them, less what hold() has kept for those that it has let go [J].
  double lay(double* y);
  /// The forces at the end of the step are in the sums.
  void keep(const Wrenches& sum);

  void walk(files::Archive& archive);

 private:
  using Index = std::ptrdiff_t;

  /// What the trucks would have to take of a force and a moment on the car, over what friction gives: of the truck that
  /// needs more.
  double need(std::size_t car, const CarColumns& cars, double fx, double fy, double moment) const;
  bool off_rails(std::size_t car) const;
  bool moves(std::size_t car) const { return vx_[car] != 0.0 || vy_[car] != 0.0 || omega_[car] != 0.0; }
  /// The sums push the car for a step, then friction acts. Whether it is to be let go.
  bool push(std::size_t car, double h, const CarColumns& cars, const Wrenches& sum);
  void find_busy();

  const inputs::Ground law_;
  const Couplers& couplers_;
  const TruckArrays trucks_;
  Rest rest_;
  std::vector<double> radius_, half_spacing_, mass_, inertia_;
  std::vector<double> fx_, fy_, moment_;  // on cars that lie, of all but touches [N, N m]
  std::vector<double> vx_, vy_, omega_;   // what they would move at if they did not lie [m/s, rad/s]
  std::vector<double> seen_x_, seen_y_, seen_cosine_, seen_sine_;  // where a car was when it began to be slow
  std::vector<bool> touched_, fresh_;                              // fresh: has come to lie at the end of the last step
  std::vector<int> touched_cars_, touched_before_;
  std::vector<std::size_t> let_go_;  // in this step
  double kept_ = 0.0;                // J, of them, that no force of this step has accounted for
  std::vector<int> joined_;          // cars that lie, with a coupler to one that moves
  std::vector<int> looked_at_;       // cars that lie, but that the loops look at
  std::vector<int> lying_cars_;
  std::vector<std::size_t> to_lie_;
  std::vector<bool> rolling_;  // one a block
  CarRanges busy_;
  std::size_t changes_ = 0;
  int unlooked_ = 0;  // steps since look() has looked
};

}  // namespace train_derail::model
