/// \file
/// The train in three dimensions: rigid cars on trucks with a spring and a damper on each side, rails that yield,
/// ground with banks beside the track, couplers with pins at a height that let go when they slip or break, bodies that
/// touch the ground and each other (docs/spatial_model.md). Made for steps of fixed length, as the extended model.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "train_derail/files/archive.hpp"
#include "train_derail/model/train_model.hpp"

namespace train_derail::model {

/// Linear momentum [kg m/s] and angular momentum about the origin [kg m^2/s].
struct SpatialMomentum {
  Eigen::Vector3d linear = Eigen::Vector3d::Zero();
  Eigen::Vector3d angular = Eigen::Vector3d::Zero();
};

/// Place, orientation and motion of a car.
struct SpatialMotion {
  Eigen::Vector3d centre;      ///< of mass [m]
  Eigen::Matrix3d axes;        ///< columns: unit vectors forward, left and up of the car
  Eigen::Vector3d velocity;    ///< of the centre of mass [m/s]
  Eigen::Vector3d rotation;    ///< angular velocity, world frame [rad/s]
  Eigen::Vector3d body_rates;  ///< the same along the car's axes: roll, pitch, yaw [rad/s]

  /// A point that is given from the centre of mass along the car's axes [m].
  Eigen::Vector3d point(const Eigen::Vector3d& own) const { return centre + axes * own; }
};

/// One object a run and a thread. A state holds, column by column, one entry a car each: x, y, z of the centre of mass;
/// the angles by which the car has turned in the last step about its own axes; their rates of change: velocity (world
/// frame) and body rates; and the orientation as a unit quaternion (x, y, z, w).
class SpatialModel final : public TrainModel {
 public:
  /// The scenario must be valid (inputs::validate). `instruction_set`: one of instruction_sets(), by default the
  /// fastest; throws std::invalid_argument for any other.
  explicit SpatialModel(const inputs::Scenario& scenario, const std::string& instruction_set = "");
  ~SpatialModel() override;

  /// Those that the processor at hand can run and that suit the length of the train, fastest first.
  static std::vector<std::string> instruction_sets(Eigen::Index cars);

  Eigen::Index size() const override { return 16 * car_count(); }
  /// Positions that a solver moves: the first components of a state, their velocities the next.
  Eigen::Index position_count() const { return 6 * car_count(); }
  StateVector initial_state() const override;

  /// What has happened before the first step: trucks that start past the point of derailment are off the rails.
  void start(const double* y);
  /// Saves or restores all that the future depends on, beside the state `y` at time t [s] itself.
  void walk(double t, const double* y, files::Archive& archive);
  /// Accelerations (six columns) at time t of a step of length h; y as start() or settle() has left it.
  void accelerations(double t, double h, const double* y, double* result);
  /// The step from (t, before) to (t + h, y) is done: orientations, latches, work, and what gives way.
  void settle(double t, double h, const double* before, double* y);

  Observation observe(const double* y) const override;
  PlanColumns plan(const double* y) const override;
  std::optional<SpaceColumns> in_space(const double* y) const override;
  CarMotion car_motion(const double* y, Eigen::Index car) const override;
  Footprint footprint(const double* y, Eigen::Index car) const override;
  std::optional<Attitude> attitude(const double* y, Eigen::Index car) const override;
  /// One car of state `y` in space. Of a car that has lost its trucks too, "centre of mass" is where that of the whole
  /// car was: nobody outside is to see it jump. The state itself has that of what is left.
  SpatialMotion motion(const double* y, Eigen::Index car) const;
  /// Puts a car of state `y` somewhere else; SpatialMotion::rotation follows from the body rates.
  void place(double* y, Eigen::Index car, const SpatialMotion& whole) const;

  bool derailed(Eigen::Index car) const override;
  bool past_pod(Eigen::Index car) const override;
  Cause cause(Eigen::Index car) const override;
  EnergyLedger energy(const double* y) const override;
  bool straight_track() const override;
  TrackPlace track_place(Eigen::Index car, const Vector2& point) const override;
  const Incidents* incidents() const override;
  const ArrayX* axial_forces() const override;

  /// Of the whole train.
  SpatialMomentum momentum(const double* y) const;
  /// Vertical force on each side of a truck as found last: front right, front left, rear right, rear left [N].
  Eigen::Vector4d wheel_loads(Eigen::Index car) const;
  /// How often forces have been found so far: in a step in which all cars are held, not at all.
  std::int64_t force_rounds() const;
  /// The truck has parted from the body.
  bool truck_lost(Eigen::Index car, bool front) const;

 private:
  struct Parts;

  void find_gaps(const double* y, double* gap, double* rate) const override;
  void find_headings(const double* y, double* cosine, double* sine) const override;

  const std::unique_ptr<Parts> parts_;
  mutable Eigen::ArrayXXd plan_, in_space_;  // the columns of plan() and of in_space()
};

}  // namespace train_derail::model
