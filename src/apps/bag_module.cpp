/// \file
/// The module that `derail run --bag` loads.
#include <stdexcept>

#include "bag_output.hpp"
#include "train_derail/ros/bag_recorder.hpp"
#include "train_derail/ros/run_stream.hpp"

namespace train_derail::apps {

namespace {

class RecordedRun final : public BagOutput {
 public:
  RecordedRun(const std::string& path, files::Existing existing, const simulation::Simulation& simulation)
      : bag_(files::OutputFile(ros_face::bag_path(path), existing, nullptr, files::Compression::never),
             "/train_derail"),
        stream_({}, {&bag_}),
        view_(simulation, scene::kEventCouplerForce) {
    stream_.start_run(view_, {});
  }
  ~RecordedRun() override {
    if (!closed_) bag_.discard();
  }

  void grid_point(const simulation::Simulation& simulation) override {
    stream_.grid_point(view_, simulation.outcome());
    check();
  }

  std::string close(const simulation::Simulation& simulation, const outcome::Outcome& outcome) override {
    ros_face::RunState state;
    state.state = RunInfo::ENDED;
    if (!simulation.ended()) state.state = RunInfo::PAUSED;
    if (outcome.ended == outcome::Ended::integration_failed) state.state = RunInfo::FAILED;
    state.kept_until = simulation.time();
    stream_.end_run(view_, outcome, state);
    closed_ = true;
    bag_.close();
    check();
    return bag_.path();
  }

 private:
  void check() const {
    if (!bag_.error().empty()) throw std::runtime_error(bag_.error());
  }

  bool closed_ = false;
  ros_face::BagRecorder bag_;
  ros_face::RunStream stream_;
  ros_face::SimulationView view_;
};

}  // namespace

}  // namespace train_derail::apps

extern "C" train_derail::apps::BagOutput* train_derail_open_bag(
    const std::string& path, train_derail::files::Existing existing,
    const train_derail::simulation::Simulation& simulation) {
  return new train_derail::apps::RecordedRun(path, existing, simulation);
}
