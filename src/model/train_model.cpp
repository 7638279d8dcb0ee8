#include "train_derail/model/train_model.hpp"

namespace train_derail::model {

TrainModel::TrainModel(const inputs::Scenario& scenario)
    : cars_(expand(scenario.consist)),
      coupler_(scenario.coupler),
      ground_(scenario.ground),
      initial_(scenario.initial) {}

Footprint TrainModel::footprint(const double* y, Eigen::Index car) const {
  const CarMotion m = car_motion(y, car);
  return {m.centre, m.axis, 0.5 * at(car).length, 0.5 * at(car).width};
}

}  // namespace train_derail::model
