// The one thread that owns the simulation: advances it along the grid of simulated time, paces it, publishes, and does
// what the services ask for.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/ros/bag_recorder.hpp"
#include "train_derail/ros/command_queue.hpp"
#include "train_derail/ros/diagnostics.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/publishers.hpp"
#include "train_derail/ros/run_stream.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// What a restart starts from.
struct RestartRequest {
  std::string scenario;                           // YAML; empty: see parameters
  std::optional<XmlRpc::XmlRpcValue> parameters;  // the node's, read anew; empty: the current scenario
  std::vector<std::string> overrides;             // "key=value"
  bool start_paused = false;
};

struct StepProgress {
  std::uint32_t ticks = 0;  // done
  double time = 0.0;        // simulated [s]
};

class SimulationLoop {
 public:
  /// Throws inputs::InputError if the scenario is not valid or the bag cannot be written; nothing is advertised then.
  SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters, const ScenarioSource& source);

  /// Until `stop` is set, ROS shuts down, or the run has ended and parameters.exit_when_done. Returns the exit code.
  int run(const std::atomic<bool>& stop);

  CommandQueue& commands() { return commands_; }

  // Commands: only from within work of commands(). Those that can be refused say why.
  Answer pause();
  Answer resume();
  Answer set_rate(double rate);
  /// Throws inputs::InputError, leaving everything as it was.
  Answer restart(const RestartRequest& request);
  /// Calls `done` when the steps are done, or at once if they are refused.
  using StepDone = std::function<void(const Answer&, const StepProgress&)>;
  void step(std::uint32_t ticks, double seconds, StepDone done);
  const Inputs& inputs() const { return stream_.inputs(); }
  std::uint32_t run_id() const { return stream_.run_id(); }

 private:
  enum class State { paused, running, ended, failed };

  struct Stepping {
    std::int64_t left;
    StepProgress progress;
    StepDone done;
  };

  void start_run(simulation::Simulation simulation, bool paused);
  void tick();
  void end_run();
  void finish_step(const Answer& answer);
  void publish_run_info();
  /// Complains once if the recording has failed.
  void watch_bag();
  RunState run_state() const;
  void report(WallTime now);
  void anchor() { pacer_.anchor(WallClock::now(), simulation_->time()); }
  bool has_ended() const { return state_ == State::ended || state_ == State::failed; }
  double interval() const { return simulation_->scenario().output.interval; }
  std::string at_time() const;
  /// The simulation's, or that it threw.
  outcome::Outcome outcome() const;

  const NodeParameters parameters_;
  ScenarioSource source_;
  std::optional<simulation::Simulation> simulation_;
  CommandQueue commands_;
  std::unique_ptr<BagRecorder> bag_;
  bool bag_failed_ = false;
  Publishers publishers_;
  Diagnostics diagnostics_;
  RunStream stream_;
  Pacer pacer_;

  State state_ = State::paused;
  std::string exception_;  // of the run; empty if there was none
  std::optional<Stepping> stepping_;
  std::int64_t tick_ = 0;  // the grid's point that was published last
  double late_max_ = 0.0;  // s
};

}  // namespace train_derail::ros_face
