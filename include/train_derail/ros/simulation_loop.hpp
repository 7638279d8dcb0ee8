/// \file
/// The loop of the one thread that owns the simulation. It advances the simulation along its output grid, keeps the
/// pace, publishes, and does what the services ask for.
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
#include "train_derail/ros/recording.hpp"
#include "train_derail/ros/run_stream.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// Flags between the loop and those who end or interrupt it. Any thread may use them.
struct LoopControl {
  std::atomic<bool> stop{false};       ///< the loop is to end
  std::atomic<bool> attention{false};  ///< somebody waits; a long step is to be interrupted
  std::atomic<bool> saving{false};     ///< a bag is being completed, which may take longer than a shutdown
};

/// What a restart is to start from.
struct RestartRequest {
  std::string scenario;                           ///< YAML; "": see parameters
  std::optional<XmlRpc::XmlRpcValue> parameters;  ///< the node's parameters, read anew; empty: the current scenario
  std::vector<std::string> overrides;             ///< changed inputs, "key=value"
  bool start_paused = false;                      ///< whether the run waits for ~resume or ~step
};

/// A run that is ready to begin.
struct NextRun {
  ScenarioSource source;              ///< what its scenario was made from
  simulation::Simulation simulation;  ///< at time 0
  bool paused = false;                ///< whether it waits
};

/// Reads and builds the run that is asked for, starting from `current` if nothing else is given. What else is given may
/// name files within `bounds`. The time it takes grows with the input, so the thread of the simulation must not call
/// it. Throws inputs::InputError.
NextRun prepare(const RestartRequest& request, const ScenarioSource& current,
                const std::shared_ptr<const FileBounds>& bounds);

/// How far a ~step has come.
struct StepProgress {
  std::uint32_t ticks = 0;  ///< grid points advanced
  double time = 0.0;        ///< simulated time of the run [s]
};

/// Owns the simulation of the node.
class SimulationLoop {
 public:
  /// Builds the first run, opens the bag and advertises the topics. Throws inputs::InputError if the scenario is not
  /// valid or the bag cannot be written; nothing is advertised then. `control` must outlive the loop.
  SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters, const FileBounds& bounds,
                 const ScenarioSource& source, LoopControl& control);
  /// The same for a run that was recorded.
  SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters, const FileBounds& bounds,
                 std::unique_ptr<Recording> recording, LoopControl& control);

  /// Runs until it is to stop, ROS shuts down, or, with exit_when_done, the run has ended. Returns the exit code of the
  /// node: 0; 1 if the bag could not be written; 3 if the integration failed.
  int run();

  /// Returns the queue by which other threads ask for what follows.
  CommandQueue& commands() { return commands_; }

  // Commands. Only work of commands() may call them. An answer that refuses says why.
  /// Lets the run stand where it is.
  Answer pause();
  /// Lets the run go on.
  Answer resume();
  /// Sets the wanted simulated seconds per wall second [-]; 0: as fast as the integrator goes.
  Answer set_rate(double rate);
  Answer set_colours(const std::string& name);
  /// Shows a run that stands still as it was at `time` [s]; `shown` becomes the time of the moment that is shown.
  Answer seek(double time, double& shown);
  /// Returns whether there may be other runs than the present one.
  Answer can_restart() const;
  /// Drops the current run and begins `next`.
  Answer restart(NextRun next);
  /// Returns what the current scenario was made from.
  const ScenarioSource& source() const { return source_; }
  /// Returns the files that another scenario may name: within the bounds of the node, and those that the first one
  /// named. Any thread may call it.
  const std::shared_ptr<const FileBounds>& scenario_bounds() const { return scenario_bounds_; }
  /// Called when the steps of step() are done, or at once if they are refused.
  using StepDone = std::function<void(const Answer&, const StepProgress&)>;
  /// Advances a paused run by `ticks` points of the grid, or by at least `seconds` of simulated time.
  void step(std::uint32_t ticks, double seconds, StepDone done);
  /// Returns the inputs of the run as they were sent.
  const Inputs& inputs() const { return stream_.inputs(); }
  /// Returns the number of the run, from 1.
  std::uint32_t run_id() const { return stream_.run_id(); }

 private:
  enum class State { paused, running, ended, failed };

  struct Stepping {
    std::int64_t left;  ///< grid points still to be advanced
    StepProgress progress;
    StepDone done;
  };

  SimulationLoop(::ros::NodeHandle& private_handle, const NodeParameters& parameters, const FileBounds& bounds,
                 LoopControl& control);
  void start_run(bool paused);
  /// Lets the first run go on once somebody watches, or when the time for that is over.
  void watch_for_viewers(WallTime now);
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
  void anchor() { pacer_.anchor(WallClock::now(), view_->time()); }
  bool has_ended() const { return state_ == State::ended || state_ == State::failed; }
  double interval() const { return view_->scenario().output.interval; }
  double kept_until() const;
  bool is_replay() const { return recording_ != nullptr; }
  std::string at_time() const;
  /// The simulation's, or that it threw.
  outcome::Outcome outcome() const;

  const NodeParameters parameters_;
  LoopControl& control_;
  ScenarioSource source_;
  std::shared_ptr<const FileBounds> scenario_bounds_;
  // One of the two, and how it is seen.
  std::optional<simulation::Simulation> simulation_;
  std::shared_ptr<Recording> recording_;
  std::shared_ptr<RunView> view_;
  CommandQueue commands_{&control_.attention};
  std::unique_ptr<BagRecorder> bag_;
  bool bag_failed_ = false;
  Publishers publishers_;
  Diagnostics diagnostics_;
  RunStream stream_;
  Pacer pacer_;
  ClockWatch clock_watch_;
  std::uint32_t clock_changes_seen_ = 0;
  WallTime viewers_due_{};  ///< until when the first run waits for somebody who watches; 0: it does not
  WallTime repeat_due_{};   ///< when all markers are sent again
  WallTime idle_due_{};     ///< when the next message of /clock is due after the end of a run
  WallTime publish_due_{};  ///< when the messages that have been gathered go, if the run goes as fast as it can

  State state_ = State::paused;
  std::string exception_;  ///< what the simulation threw; "" if it did not
  std::optional<Stepping> stepping_;
  std::int64_t tick_ = 0;  ///< point of the grid that was published last
  double late_max_ = 0.0;  ///< largest delay of a grid point since the last report, wall [s]
};

}  // namespace train_derail::ros_face
