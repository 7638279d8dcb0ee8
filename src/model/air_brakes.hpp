/// \file
/// Brakes of the cars on the track: the friction of the paper, or an emergency application of air brakes.
#pragma once

#include <vector>

#include "model/extended_kernels.hpp"
#include "model/part.hpp"
#include "train_derail/inputs/scenario.hpp"
#include "train_derail/model/train.hpp"

namespace train_derail::model {

class AirBrakes final : public Part {
 public:
  /// `loops` must outlive the part.
  AirBrakes(const inputs::Scenario& scenario, const std::vector<Car>& cars, const ExtendedKernels& loops);

  /// Along the track over the load of the car, at the time of prepare(): one a car [-].
  const ArrayX& share() const { return share_; }
  /// The same once brakes that have been applied are full.
  double full_share(Eigen::Index car) const;
  /// When the emergency signal comes to the car, as is known now; infinite: not at all [s].
  double signal(Eigen::Index car) const { return signal_[car]; }
  /// The brake pipe is opened at time t [s] between car `coupler` and the next (coupler -1: at the head of the train).
  void vent(double t, Eigen::Index coupler);
  /// The brake pipe is opened at time t [s] under car `car`.
  void part(double t, Eigen::Index car);

  void prepare(double t) override;
  void walk(files::Archive& archive) override;

 private:
  void open(double t, double place);
  /// When brakes build up; to be called whenever a signal has changed.
  void find_changes();

  const inputs::Brakes law_;
  const ExtendedKernels& loops_;
  std::vector<bool> source_;  // vents by radio
  ArrayX ratio_;              // B of each car [-]
  ArrayX pipe_;               // place of each car along the brake pipe [m]
  ArrayX signal_;             // when the emergency signal comes [s]
  ArrayX share_;
  // Before the first brake builds up, and once all that have been applied are full, shares need not be found again.
  bool known_ = false;  // share_ has been found, at found_at_ [s], and no signal has changed since then
  double found_at_ = 0.0, changes_from_ = inputs::kInfinity, changes_to_ = -inputs::kInfinity;
};

}  // namespace train_derail::model
