#include "train_derail/model/train_model.hpp"

namespace train_derail::model {

TrainModel::TrainModel(const inputs::Scenario& scenario)
    : cars_(expand(scenario.consist)),
      coupler_(scenario.coupler),
      ground_(scenario.ground),
      initial_(scenario.initial) {}

}  // namespace train_derail::model
