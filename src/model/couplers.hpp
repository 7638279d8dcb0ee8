/// \file
/// Couplers of the extended model: draft gear, slack, damping, swing stops, and their breaking.
#pragma once

#include "model/air_brakes.hpp"
#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "train_derail/model/planar_model.hpp"

namespace train_derail::model {

/// The loops find the forces; what follows from them is found here.
class Couplers final : public Part {
 public:
  /// A coupler that breaks opens the pipe of `brakes`. `train`, `brakes` and `record` must outlive the part.
  Couplers(const PlanarModel& train, const inputs::Coupler& law, AirBrakes& brakes, Record& record);

  /// What the loops need; valid as long as the part lives.
  CouplerArrays arrays();
  bool broken(Eigen::Index i) const { return alive_[i] == 0.0; }
  /// Its draft force is at most `share` of what breaks it.
  bool carries_little(Eigen::Index i, double share) const { return -axial_[i] <= share * law_.break_draft; }
  /// Axial forces at the end of the last step, buff positive [N].
  const ArrayX& axial() const { return axial_; }
  /// The coupler `bare` (PlanarModel::coupler_between) with draft gear, damping and whether it has broken; its leading
  /// pin moves at `rate` [m/s] as seen from its trailing one.
  CouplerState<double> state(const CouplerState<double>& bare, const Vector2& rate, Eigen::Index i) const;
  /// Strain energy in state `y`.
  void add_energy(const double* y, EnergyLedger& energy) const;
  /// The loops have found the forces at the end of a step.
  void found(const CouplerPeaks& peaks) { peaks_ = peaks; }
  /// Puts the peaks of the forces at time t [s] into the record, if they are the largest.
  void note_peaks(double t);

  bool give_way(const Step& step) override;
  void walk(files::Archive& archive) override;

 private:
  double spring_energy(double gap) const;
  /// Where between the ends of the step the coupler breaks, and what by; of one that is beyond a limit at its end.
  BrokenCoupler first_limit(const Step& step, Eigen::Index i);

  const PlanarModel& train_;
  const inputs::Coupler law_;
  AirBrakes& brakes_;
  Record& record_;
  const double cos_break_;  // of the swing at which a coupler breaks; below -1: it never does
  CouplerPeaks peaks_;
  ArrayX alive_, damping_, axial_, damper_, ux_, uy_, cos_swing_, end_moment_;  // see CouplerArrays
};

}  // namespace train_derail::model
