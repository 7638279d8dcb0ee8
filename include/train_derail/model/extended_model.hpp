// The paper's model with the parts that it lacks, each switched by its own input: rails that yield, air brakes, ground
// friction by slip, draft gear, couplers that break, contact of car bodies, cars ahead of the point of derailment, torn
// track, curves and grade (docs/accident_model.md). With all of them off: the paper's model. Latches and impacts make
// it not smooth, so it is made for steps of fixed length. Knows no time stepping: a solver asks for accelerations and
// says when a step is done.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "train_derail/model/track.hpp"
#include "train_derail/model/train_model.hpp"

namespace train_derail::model {

class Contacts;
struct ExtendedArrays;
struct ExtendedKernels;

class ExtendedModel final : public TrainModel {
 public:
  /// The scenario must be valid (inputs::validate). Throws std::invalid_argument unless `instruction_set` is one of
  /// instruction_sets(); by default the first of them.
  explicit ExtendedModel(const inputs::Scenario& scenario, const std::string& instruction_set = "");

  /// Versions of the loops over cars that this processor can run on a train of that length, fastest first: of "avx512",
  /// "avx2", "plain". They agree to rounding.
  static std::vector<std::string> instruction_sets(Eigen::Index cars);

  ~ExtendedModel() override;

  StateVector initial_state() const override;
  /// What has happened before the first step: trucks that start past the point of derailment are off the rails.
  void start(const double* y);

  /// Coordinates of position of all cars: the first components of a state, their velocities the next.
  Eigen::Index position_count() const { return kCoordinates / 2 * car_count(); }
  /// Accelerations (cars x 3, column by column: x, y, theta) at time t of a step of length h; y as start() or settle()
  /// has left it.
  void accelerations(double t, double h, const double* y, double* result);
  /// The step from (t, before) to (t + h, y) is done: latches, work, and what gives way before the forces at its end
  /// can act: couplers break and trucks leave the rails within the step, where the limit is reached. May change
  /// velocities in y (kicks).
  void settle(double t, double h, const double* before, double* y);

  bool derailed(Eigen::Index car) const override;
  bool past_pod(Eigen::Index car) const override { return past_pod_[static_cast<std::size_t>(car)]; }
  CouplerState<double> coupler(const double* y, Eigen::Index i) const override;
  bool broken(Eigen::Index i) const override { return alive_[i] == 0.0; }
  EnergyLedger energy(const double* y) const override;
  bool straight_track() const override { return track_.straight(); }
  TrackPlace track_place(Eigen::Index car, const Vector2& point) const override;
  Cause cause(Eigen::Index car) const override { return first_cause_[static_cast<std::size_t>(car)]; }
  const Incidents* incidents() const override { return &incidents_; }
  const ArrayX* axial_forces() const override { return &axial_; }

 private:
  void find_gaps(const double* y, double* gap, double* rate) const override;
  void find_headings(const double* y, double* cosine, double* sine) const override;

  enum End { FRONT, REAR };
  /// Trucks are numbered: the front ones of all cars, then the rear ones.
  Eigen::Index truck(Eigen::Index car, End end) const { return end == FRONT ? car : car_count() + car; }
  double arm(Eigen::Index truck) const {
    return truck < car_count() ? half_spacing_[truck] : -half_spacing_[truck - car_count()];
  }
  Eigen::Index car_of(Eigen::Index truck) const { return truck < car_count() ? truck : truck - car_count(); }
  bool on_rails(Eigen::Index truck) const { return cause_[static_cast<std::size_t>(truck)] == Cause::none; }

  ExtendedArrays arrays();
  /// Where trucks are on the track, from their places in px_, py_.
  void locate();
  /// All forces but those of contact, at (t, y).
  void find_forces(double t, const double* y);
  /// In the step that ends at (t, y); whether any has. The forces are then to be found anew.
  bool break_couplers(double t, double h, const double* before, const double* y);
  void note_peaks(double t);
  void note_blockage(double h);
  /// At the point of derailment or on torn track, in the step of length h that ends at t.
  void leave_bad_track(double t, double h, double* y);
  /// By lateral force, in the step of length h that ends at t; whether any has.
  bool leave_overloaded(double t, double h, double* y);
  void find_standing();
  void leave(double t, Eigen::Index truck, Cause cause, double* y);
  /// Puts the derailments noted from number `first` on in the order of time.
  void order_derailments(std::ptrdiff_t first);
  void pass_pod(const double* y);
  /// The brake pipe is opened at time t at `place` along the train.
  void vent(double t, double place);
  double spring_energy(double gap) const;

  const inputs::Rails rails_;
  const inputs::Brakes brakes_;
  const double grade_;  // sine of the slope
  const bool rails_on_;
  const double cos_limit_, cos_break_;  // of swing
  const ExtendedKernels* kernels_;
  Track track_;
  // One a car.
  std::vector<bool> past_pod_, brake_source_;
  std::vector<Cause> first_cause_;
  ArrayX brake_ratio_, pipe_, signal_;  // B; place along the brake pipe [m]; when the emergency signal comes [s]
  ArrayX inverse_mass_, inverse_inertia_, cos_, sin_, along_, fx_, fy_, moment_, turned_;
  // One a truck.
  std::vector<Cause> cause_;
  ArrayX kick_, arc_, overloaded_, on_track_, offset_, tangent_x_, tangent_y_, load_, rail_damping_, patch_, px_, py_;
  ArrayX truck_x_, truck_y_, brake_, lateral_, lateral_before_;
  // One a coupler.
  double buff_ = 0.0, draft_ = 0.0, cos_swing_least_ = 1.0, end_moment_largest_ = 0.0;  // of all of them in the step
  ArrayX alive_, damping_, axial_, damper_, ux_, uy_, cos_swing_, end_moment_;
  ArrayX pin_x_, pin_y_, moment_lead_, moment_trail_;  // cars + 1 entries
  std::vector<inputs::GroundPatch> patches_;
  Eigen::Index standing_ = -1;  // foremost car that stands on the rails behind what has derailed
  bool forces_found_ = false;   // those of find_forces() belong to the next step
  std::unique_ptr<Contacts> contacts_;
  Incidents incidents_;
  EnergyLedger spent_;  // its work_... terms
};

}  // namespace train_derail::model
