/// \file
/// The module that `derail run --bag` and `derail replay` load.
#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "bag_input.hpp"
#include "bag_output.hpp"
#include "train_derail/ros/bag_recorder.hpp"
#include "train_derail/ros/recording.hpp"
#include "train_derail/ros/run_stream.hpp"
#include "train_derail/scene/replay.hpp"

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

  void grid_point() override {
    stream_.grid_point(view_);
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

std::string document_of(const std::string& path, const ros_face::RunInBag& run, const std::string& name,
                        const std::string& caption) {
  ros_face::Recording recording(path, run);
  scene::Replay replay(recording.scenario(), recording.cars());
  for (const simulation::Snapshot& now : recording.moments()) {
    recording.advance(now.time);
    replay.add(now, recording.take_events(now));
  }
  return replay.document({name, caption}, recording.outcome(), recording.touches());
}

/// "run 2", with the node where there are several.
std::string caption_of(const ros_face::RunInBag& run, bool several_nodes) {
  return several_nodes ? fmt::format("{}, run {}", run.node, run.run_id) : fmt::format("run {}", run.run_id);
}

std::vector<std::string> documents_of(const std::string& path, std::uint32_t run_id, const std::string& name) {
  const std::vector<ros_face::RunInBag> all = ros_face::runs_in_bag(path);
  const bool nodes = std::any_of(all.begin(), all.end(), [&](const auto& run) { return run.node != all[0].node; });
  std::vector<std::string> documents;
  for (const ros_face::RunInBag& run : all) {
    if (run_id == 0 || run.run_id == run_id) documents.push_back(document_of(path, run, name, caption_of(run, nodes)));
  }
  // Says which there are.
  if (documents.empty()) ros_face::Recording(path, run_id);
  return documents;
}

}  // namespace

}  // namespace train_derail::apps

extern "C" void train_derail_read_bag(const std::string& path, std::uint32_t run_id, const std::string& name,
                                      std::vector<std::string>& documents) {
  documents = train_derail::apps::documents_of(path, run_id, name);
}

extern "C" train_derail::apps::BagOutput* train_derail_open_bag(
    const std::string& path, train_derail::files::Existing existing,
    const train_derail::simulation::Simulation& simulation) {
  return new train_derail::apps::RecordedRun(path, existing, simulation);
}
