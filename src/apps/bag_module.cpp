// The module behind `derail run --bag`.
#include <stdexcept>

#include "bag_output.hpp"
#include "train_derail/ros/bag_recorder.hpp"
#include "train_derail/ros/run_stream.hpp"

namespace train_derail::apps {

namespace {

class RecordedRun final : public BagOutput {
 public:
  RecordedRun(const std::string& path, const simulation::Simulation& simulation)
      : bag_(ros_face::bag_path(path), "/train_derail"), stream_({}, {&bag_}) {
    stream_.start_run(simulation, {});
  }

  void grid_point(const simulation::Simulation& simulation) override {
    stream_.grid_point(simulation, simulation.outcome());
    check();
  }

  void close(const simulation::Simulation& simulation) override {
    const outcome::Outcome outcome = simulation.outcome();
    const bool failed = outcome.ended == outcome::Ended::integration_failed;
    stream_.end_run(simulation, outcome, {failed ? RunInfo::FAILED : RunInfo::ENDED, 0.0});
    bag_.close();
    check();
  }

 private:
  void check() const {
    if (!bag_.error().empty()) throw std::runtime_error(bag_.error());
  }

  ros_face::BagRecorder bag_;
  ros_face::RunStream stream_;
};

}  // namespace

}  // namespace train_derail::apps

extern "C" train_derail::apps::BagOutput* train_derail_open_bag(
    const std::string& path, const train_derail::simulation::Simulation& simulation) {
  return new train_derail::apps::RecordedRun(path, simulation);
}
