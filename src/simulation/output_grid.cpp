#include "train_derail/simulation/output_grid.hpp"

namespace train_derail::simulation {

OutputGrid::OutputGrid(Simulation& simulation)
    : simulation_(simulation),
      point_(static_cast<std::int64_t>(simulation.time() / simulation.scenario().output.interval)) {
  // The quotient may have been rounded down from the point where the run stands.
  const double interval = simulation.scenario().output.interval;
  while (static_cast<double>(point_ + 1) * interval <= simulation.time()) ++point_;
}

bool OutputGrid::advance(const std::atomic<bool>* stop) {
  const double before = simulation_.time();
  ++point_;
  simulation_.advance(static_cast<double>(point_) * simulation_.scenario().output.interval, stop);
  return simulation_.time() > before;
}

}  // namespace train_derail::simulation
