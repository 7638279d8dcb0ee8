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
#include "train_derail/ros/clock_watch.hpp"
#include "train_derail/ros/command_queue.hpp"
#include "train_derail/ros/diagnostics.hpp"
#include "train_derail/ros/file_bounds.hpp"
#include "train_derail/ros/pacer.hpp"
#include "train_derail/ros/parameters.hpp"
#include "train_derail/ros/publishers.hpp"
#include "train_derail/ros/run_stream.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// How the loop and those who end it speak to each other, from any thread.
struct LoopControl {
  std::atomic<bool> stop{false};       // end
  std::atomic<bool> attention{false};  // somebody waits: a long step is to be interrupted
  std::atomic<bool> saving{false};     // a bag is made whole, which may take longer than a shutdown should
};

/// What a restart is asked to start from.
struct RestartRequest {
  std::string scenario;                           // YAML; empty: see parameters
  std::optional<XmlRpc::XmlRpcValue> parameters;  // the node's, read anew; empty: the current scenario
  std::vector<std::string> overrides;             // "key=value"
  bool start_paused = false;
};

/// A run that can begin.
struct NextRun {
  ScenarioSource source;
  simulation::Simulation simulation;
  bool paused = false;
};

/// Reads and builds what is asked for, from `current` if nothing else is given. Takes as long as the input is large:
/// not for the simulation's thread. Throws inputs::InputError.
NextRun prepare(const RestartRequest& request, const ScenarioSource& current);

struct StepProgress {
  std::uint32_t ticks = 0;  // done
  double time = 0.0;        // simulated [s]
};

class SimulationLoop {
 public:
  /// Throws inputs::InputError if the scenario is not valid or the bag cannot be written; nothing is advertised then.
  SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters, const FileBounds& bounds,
                 const ScenarioSource& source, LoopControl& control);

  /// Until it is to stop, ROS shuts down, or the run has ended and parameters.exit_when_done. Returns the exit code.
  int run();

  CommandQueue& commands() { return commands_; }

  // Commands: only from within work of commands(). Those that can be refused say why.
  Answer pause();
  Answer resume();
  Answer set_rate(double rate);
  Answer restart(NextRun next);
  const ScenarioSource& source() const { return source_; }
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
  /// After the end of a run: nodes that sleep by /clock sleep no longer than they meant to.
  void keep_time_going(WallTime now);
  void watch_clock();
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
  LoopControl& control_;
  ScenarioSource source_;
  std::optional<simulation::Simulation> simulation_;
  CommandQueue commands_{&control_.attention};
  std::unique_ptr<BagRecorder> bag_;
  bool bag_failed_ = false;
  Publishers publishers_;
  Diagnostics diagnostics_;
  RunStream stream_;
  Pacer pacer_;
  ClockWatch clock_watch_;
  std::uint32_t clock_changes_seen_ = 0;
  WallTime idle_due_{};  // the next message of /clock after the end of a run

  State state_ = State::paused;
  std::string exception_;  // of the run; empty if there was none
  std::optional<Stepping> stepping_;
  std::int64_t tick_ = 0;  // the grid's point that was published last
  double late_max_ = 0.0;  // s
};

}  // namespace train_derail::ros_face
