#include "model/traction.hpp"

#include "train_derail/model/traction_law.hpp"

namespace train_derail::model {

void Locomotive::find(bool pulls, double along) { pull = pulls ? traction_force(held, most, speed, along) : 0.0; }

std::vector<Locomotive> locomotives_of(const inputs::Scenario& scenario, const std::vector<Car>& cars, double uphill) {
  std::vector<Locomotive> found;
  if (scenario.traction.law == inputs::TractionLaw::none) return found;
  double weight = 0.0, of_locomotives = 0.0;
  std::size_t car = 0;
  for (const inputs::CarBlock& block : scenario.consist) {
    const bool pulls = inputs::is_locomotive(block);
    for (int i = 0; i < block.count; ++i, ++car) {
      weight += cars[car].weight;
      if (!pulls) continue;
      of_locomotives += cars[car].weight;
      found.push_back({static_cast<Eigen::Index>(car), 0.0, scenario.traction.adhesion * cars[car].weight,
                       scenario.initial.speed, 0.0});
    }
  }
  for (Locomotive& l : found) {
    l.held = (held_force(scenario.brakes.rolling_resistance, scenario.track.grade, weight) + uphill) *
             (cars[static_cast<std::size_t>(l.car)].weight / of_locomotives);
  }
  return found;
}

Traction::Traction(const inputs::Scenario& scenario, const std::vector<Car>& cars, const AirBrakes& brakes,
                   const Trucks& trucks, Record& record)
    : brakes_(brakes), trucks_(trucks), record_(record), locomotives_(locomotives_of(scenario, cars)) {}

void Traction::add(double t, double /*h*/, const CarColumns& cars, const Wrenches& sum) {
  for (Locomotive& l : locomotives_) {
    const Eigen::Index k = l.car;
    l.find(t < brakes_.signal(k) && !trucks_.derailed(k), cars.vx[k] * cars.cosine[k] + cars.vy[k] * cars.sine[k]);
    sum.fx[k] += l.pull * cars.cosine[k];
    sum.fy[k] += l.pull * cars.sine[k];
  }
}

void Traction::account(double h, const CarColumns& before, const CarColumns& after) {
  for (const Locomotive& l : locomotives_) {
    const Eigen::Index k = l.car;
    const double vx = 0.5 * (before.vx[k] + after.vx[k]), vy = 0.5 * (before.vy[k] + after.vy[k]);
    record_.spent.work_on_track -= h * l.pull * (vx * before.cosine[k] + vy * before.sine[k]);
  }
}

}  // namespace train_derail::model
