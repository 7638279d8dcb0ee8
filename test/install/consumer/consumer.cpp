// A program of somebody else's, compiled with flags of its own. What it prints has been computed by the library alone.
#include <cstdio>

#include "train_derail/inputs/reader.hpp"
#include "train_derail/model/derailment_model.hpp"
#include "train_derail/model/extended_model.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace td = train_derail;

template <class Model>
void start(const td::inputs::Scenario& scenario) {
  const Model model(scenario);
  const td::model::StateVector kept = model.initial_state();
  Eigen::VectorXd state = model.initial_state();
  state.conservativeResize(state.size() + 3);
  Eigen::ArrayXd gap, rate;
  model.gaps(state.data(), gap, rate);
  td::ArrayX cosine(1), sine;
  model.headings(kept.data(), cosine, sine);
  std::printf("%ld cars, gap %a, cosine %a\n", static_cast<long>(model.car_count()), gap[0], cosine[cosine.size() - 1]);
}

int main(int count, char** arguments) {
  for (int i = 1; i < count; ++i) {
    const td::inputs::Scenario scenario = td::inputs::read_scenario_file(arguments[i]);
    if (scenario.ground.on_track_law == td::inputs::OnTrackLaw::rails) start<td::model::ExtendedModel>(scenario);
    else start<td::model::DerailmentModel>(scenario);
    td::simulation::Simulation simulation(scenario, Eigen::VectorXd(td::simulation::Simulation(scenario).state()));
    simulation.run();
    td::model::StateVector state = simulation.state();
    const Eigen::MatrixXd square = state * state.transpose();
    const td::outcome::Outcome outcome = simulation.outcome();
    std::printf("off track %d, buff %a, x %a, %s\n", outcome.cars_off_track, outcome.coupler_buff_peak.force, state[0],
                square.trace() > 0.0 ? "moved" : "did not move");
    std::printf("%zu impacts\n", simulation.incidents().impacts.size());
  }
}
