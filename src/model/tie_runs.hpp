/// \file
/// Trucks that run on the ties: how far they have drifted, what obstacles they meet, and what throws them off the
/// track bed. The loops find the forces on them.
#pragma once

#include <vector>

#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

/// Trucks are numbered as in Trucks.
class TieRuns {
 public:
  /// `record` must outlive the object. The seed decides where obstacles are and what each truck stands.
  TieRuns(const inputs::Scenario& scenario, const std::vector<Car>& cars, Record& record);

  /// Trucks may run on the ties.
  bool on() const { return law_.law == inputs::TieLaw::guided; }
  const inputs::Ties& law() const { return law_; }
  /// Trucks that do so now, in the order in which they began.
  const std::vector<Eigen::Index>& running() const { return running_; }
  /// What the loops need; valid as long as the object lives.
  template <class Arrays>
  void show(Arrays& arrays) const {
    arrays.guided = guided_.data();
    arrays.drift = drift_.data();
    arrays.tie_damping = damping_.data();
  }

  /// The truck begins to run at time t [s], where it is off the centre line by `offset` [m].
  void begin(double t, Eigen::Index truck, double offset);
  /// What a truck has met on its way.
  struct Met {
    bool thrown = false;  ///< an obstacle throws it off
    bool parted = false;  ///< it has parted the brake pipe
    double share = 1.0;   ///< where on the way that was
  };
  /// A truck has run from arc length `from` to `to` [m].
  Met run(Eigen::Index truck, double from, double to);
  /// A truck is off the centre line by `offset` [m]; whether it has drifted off the track bed.
  bool drift(Eigen::Index truck, double offset, double load);
  /// The truck has left the track bed at time t [s].
  void end(double t, Eigen::Index truck, TieRun::End by);
  /// Sideways speed of a truck that an obstacle throws off, left positive [m/s].
  double throw_speed(Eigen::Index truck) const { return throw_speed_[truck]; }
  /// Arc lengths of all obstacles, in order [m].
  std::vector<double> obstacles() const;

  /// The trucks that run are those of the record, which must have been walked before.
  void walk(files::Archive& archive);

 private:
  struct Obstacle {
    double at, hazard;
  };
  void place_obstacles(const inputs::Scenario& scenario);
  TieRun& run_of(Eigen::Index truck) {
    return record_.incidents.tie_runs[static_cast<std::size_t>(run_[static_cast<std::size_t>(truck)])];
  }

  const inputs::Ties law_;
  const Eigen::Index cars_;
  Record& record_;
  std::vector<Obstacle> obstacles_;  // in order
  std::vector<Eigen::Index> running_;
  // One a truck.
  std::vector<int> run_;                       // index in the record; -1: none
  ArrayX endurance_, parts_at_, throw_speed_;  // hazard that it stands; distance at which it parts the pipe [m]
  ArrayX guided_, drift_, damping_, met_;      // see TruckArrays; met: hazard so far
};

}  // namespace train_derail::model
