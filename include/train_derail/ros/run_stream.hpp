/// \file
/// Turns runs into messages. Their order and stamps are the same, whoever receives them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/ros/event_detector.hpp"
#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/marker_scene.hpp"
#include "train_derail/ros/message_sink.hpp"
#include "train_derail/ros/pile_up_follower.hpp"
#include "train_derail/ros/sim_clock.hpp"
#include "train_derail/simulation/simulation.hpp"

namespace train_derail::ros_face {

/// What is in the messages.
struct StreamOptions {
  Frames frames;          ///< names of tf frames
  int markers_every = 1;  ///< grid points from one array of markers to the next; 0: no markers
  double event_coupler_force = 1000.0 * inputs::kKip;  ///< threshold of COUPLER_PEAK events [N]
};

/// Parts of ~run_info that the simulation does not know.
struct RunState {
  std::uint8_t state = RunInfo::RUNNING;      ///< a constant of RunInfo
  double rate = 0.0;                          ///< wanted simulated seconds per wall second [-]
  std::vector<std::string> clock_publishers;  ///< nodes that publish /clock, if there is more than one
};

/// The messages of one run after the other.
class RunStream {
 public:
  /// Sends to all `sinks`, which must outlive the stream.
  RunStream(const StreamOptions& options, std::vector<MessageSink*> sinks);

  /// Begins the next run: sends its inputs and what holds at time 0.
  void start_run(const simulation::Simulation& simulation, const RunState& state);
  /// To be called when the simulation has reached the next point of its output grid. Sends clock, tf, cars, couplers,
  /// markers and events, all with one stamp, and impacts and outcome once a simulated second.
  void grid_point(const simulation::Simulation& simulation, const outcome::Outcome& outcome);
  /// Ends the run: sends the last events, markers and impacts, the final outcome, and the state.
  void end_run(const simulation::Simulation& simulation, const outcome::Outcome& outcome, const RunState& state);

  /// After the end of a run: lets /clock go on by `seconds`, and tf with it, so that nodes that follow them do not
  /// stand still. Bags do not have this.
  void idle(double seconds);

  /// Sends the markers of the last grid point if they were left out.
  void complete_markers();
  /// Sends ~run_info; `message` says why the run has ended or failed.
  void run_info(const simulation::Simulation& simulation, const RunState& state, const std::string& message = "");

  /// Returns the number of the run, from 1; 0 before the first.
  std::uint32_t run_id() const { return run_id_; }
  /// Returns the newest stamp in use.
  const ::ros::Time& now() const { return clock_.now(); }
  /// Returns the inputs of the run as they were sent.
  const Inputs& inputs() const { return inputs_; }

 private:
  std_msgs::Header header() const;
  template <class Topic>
  void send(const typename Topic::Message& message) const {
    for (MessageSink* sink : sinks_) sink->send<Topic>(message);
  }
  tf2_msgs::TFMessage moving_frames(const std_msgs::Header& header) const;
  void send_grid_point(const simulation::Simulation& simulation, const outcome::Outcome& outcome);
  void send_events(const simulation::Simulation& simulation, const outcome::Outcome& outcome);
  /// If there is something new.
  void send_impacts(const simulation::Simulation& simulation);
  void send_markers();
  bool markers_wanted() const;

  const StreamOptions options_;
  const std::vector<MessageSink*> sinks_;
  SimClock clock_;
  EventDetector events_;
  PileUpFollower pile_up_;
  std::optional<MarkerScene> scene_;
  Inputs inputs_;
  Impacts impacts_;  ///< as last sent
  std::uint32_t run_id_ = 0;
  std::int64_t grid_points_ = 0;  ///< grid points of this run so far
  bool markers_empty_ = false;    ///< whether nothing of this run is shown yet

  // Of the last grid point, for complete_markers().
  bool markers_sent_ = false;
  simulation::Snapshot last_;
  Heap heap_;  ///< of it
  outcome::Outcome last_outcome_;
  std::vector<outcome::FirstTouch> last_touches_;  ///< touches that are recent enough to be shown
};

}  // namespace train_derail::ros_face
