/// \file
/// Pull of the locomotives until the emergency signal comes to them (inputs::Traction).
#pragma once

#include <vector>

#include "model/air_brakes.hpp"
#include "model/part.hpp"
#include "model/trucks.hpp"

namespace train_derail::model {

/// A locomotive that pulls on.
struct Locomotive {
  Eigen::Index car;
  double held;   ///< its share of the force that held the train at its speed [N]
  double most;   ///< N
  double speed;  ///< of the train at the start [m/s]
  double pull;   ///< as found last, forward positive [N]

  /// Finds it at the speed `along`, forward [m/s].
  void find(bool pulls, double along);
};
/// Those of a train; none where traction.law is none. `uphill`: what pulls the train back where it begins, beside
/// track.grade [N].
std::vector<Locomotive> locomotives_of(const inputs::Scenario& scenario, const std::vector<Car>& cars,
                                       double uphill = 0.0);

/// It acts on locomotives whose trucks are both on the rails, along their heading.
class Traction final : public Part {
 public:
  /// `brakes`, `trucks` and `record` must outlive the part.
  Traction(const inputs::Scenario& scenario, const std::vector<Car>& cars, const AirBrakes& brakes,
           const Trucks& trucks, Record& record);

  void add(double t, double h, const CarColumns& cars, const Wrenches& sum) override;
  void account(double h, const CarColumns& before, const CarColumns& after) override;
  /// Whatever it depends on belongs to others.
  void walk(files::Archive& /*archive*/) override {}

 private:
  const AirBrakes& brakes_;
  const Trucks& trucks_;
  Record& record_;
  std::vector<Locomotive> locomotives_;
};

}  // namespace train_derail::model
