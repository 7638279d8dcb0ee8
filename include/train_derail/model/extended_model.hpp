/// \file
/// The paper's model with the parts that it lacks, each switched by its own input: rails that yield, air brakes, ground
/// friction by slip, draft gear, couplers that break, contact of car bodies, cars ahead of the point of derailment,
/// torn track, curves and grade (docs/accident_model.md). With all of them off: the paper's model. Latches and impacts
/// make it not smooth, so it is made for steps of fixed length. Knows no time stepping: a solver asks for accelerations
/// and says when a step is done.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "train_derail/files/archive.hpp"
#include "train_derail/model/planar_model.hpp"

namespace train_derail::model {

/// One object a run and a thread. The parts (src/model/part.hpp) hold the laws and what they remember; the model calls
/// them in the order of a step.
class ExtendedModel final : public PlanarModel {
 public:
  /// The scenario must be valid (inputs::validate). Throws std::invalid_argument unless `instruction_set` is one of
  /// instruction_sets(); by default the first of them.
  explicit ExtendedModel(const inputs::Scenario& scenario, const std::string& instruction_set = "");

  /// Versions of the loops over cars that this processor can run on a train of that length, fastest first: of "avx512",
  /// "avx2", "sse2", "plain". They agree to rounding.
  static std::vector<std::string> instruction_sets(Eigen::Index cars);

  ~ExtendedModel() override;

  StateVector initial_state() const override;
  /// What has happened before the first step: trucks that start past the point of derailment are off the rails.
  void start(const double* y);
  /// Saves or restores all that the future depends on, beside the state `y` at time t [s] itself. Restoring replaces
  /// start(); runs then go on bit for bit as they would have.
  void walk(double t, const double* y, files::Archive& archive);

  /// Coordinates of position of all cars: the first components of a state, their velocities the next.
  Eigen::Index position_count() const { return kCoordinates / 2 * car_count(); }
  /// Accelerations (cars x 3, column by column: x, y, theta) at time t of a step of length h; y as start() or settle()
  /// has left it.
  void accelerations(double t, double h, const double* y, double* result);
  /// The step from (t, before) to (t + h, y) is done: latches, work, and what gives way before the forces at its end
  /// can act: couplers break and trucks leave the rails within the step, where the limit is reached. May change
  /// velocities in y (kicks).
  void settle(double t, double h, const double* before, double* y);

  /// The car only rolls along the track now: what it does across it follows from the rails (rails.rolling_share).
  bool rolls(Eigen::Index car) const;

  bool derailed(Eigen::Index car) const override;
  bool past_pod(Eigen::Index car) const override;
  Cause cause(Eigen::Index car) const override;
  bool broken(Eigen::Index i) const override;
  Eigen::Index gone(const double* y) const override;
  EnergyLedger energy(const double* y) const override;
  bool straight_track() const override;
  TrackPlace track_place(Eigen::Index car, const Vector2& point) const override;
  const Incidents* incidents() const override;
  const ArrayX* axial_forces() const override;

 protected:
  CouplerState<double> coupler_between(const CarMotion& lead, const CarMotion& trail, Eigen::Index i) const override;

 private:
  struct Parts;

  const PlanarKernels& loops() const override;
  /// All forces but those that parts add by themselves, at (t, y).
  /// Moves cars along the track, from mid-slack to where couplers bear initial.buff_force and less; the first car to
  /// derail stays.
  void squeeze(Eigen::Ref<ArrayX> x) const;
  void find_forces(double t, const double* y);
  void note_blockage(double h);

  const std::unique_ptr<Parts> parts_;
  ArrayX fx_, fy_, moment_;    // one a car
  bool forces_found_ = false;  // those of find_forces() belong to the next step
};

}  // namespace train_derail::model
