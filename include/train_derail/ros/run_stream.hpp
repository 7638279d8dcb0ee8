/// \file
/// Turns runs into messages. Their order and stamps are the same, whoever receives them.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "train_derail/ros/frames.hpp"
#include "train_derail/ros/marker_scene.hpp"
#include "train_derail/ros/message_sink.hpp"
#include "train_derail/ros/pile_up_follower.hpp"
#include "train_derail/ros/run_history.hpp"
#include "train_derail/ros/run_view.hpp"
#include "train_derail/ros/sim_clock.hpp"

namespace train_derail::ros_face {

/// What is in the messages.
struct StreamOptions {
  Frames frames;          ///< names of tf frames
  int markers_every = 1;  ///< grid points from one look at the markers to the next; 0: no markers
  scene::Colours colours = scene::Colours::cause;  ///< of the cars in the markers
  std::size_t history_bytes = 0;                   ///< memory for the moments of a run, to be shown again
};

/// Parts of ~run_info that the simulation does not know.
struct RunState {
  std::uint8_t state = RunInfo::RUNNING;      ///< a constant of RunInfo
  double rate = 0.0;                          ///< wanted simulated seconds per wall second [-]
  bool replay = false;                        ///< whether the run was recorded earlier
  double kept_until = 0.0;                    ///< simulated time up to which show() knows the run [s]
  std::vector<std::string> clock_publishers;  ///< nodes that publish /clock, if there is more than one
};

/// The messages of one run after the other.
class RunStream {
 public:
  /// Sends to all `sinks`, which must outlive the stream.
  RunStream(const StreamOptions& options, std::vector<MessageSink*> sinks);

  /// Forgets the moments of the run so far: another one is to begin.
  void forget() { history_.clear(); }
  /// Begins the next run: sends its inputs and what holds at time 0.
  void start_run(RunView& run, const RunState& state);
  /// To be called when the run has reached the next point of its output grid. Sends clock, tf, cars, couplers, the
  /// heap, changed markers and events, all with one stamp, the outcome ten times a simulated second and
  /// impacts once.
  void grid_point(RunView& run);
  /// Ends the run: sends the last events, markers and impacts, the final outcome, and the state.
  void end_run(RunView& run, const outcome::Outcome& outcome, const RunState& state);

  /// After the end of a run: lets /clock go on by `seconds`, and tf with it, so that nodes that follow them do not
  /// stand still. Bags do not have this.
  void idle(double seconds);
  /// Sends clock, tf, cars, couplers, the heap, markers and outcome as they were at an earlier moment, with new stamps.
  /// Bags, which hold the run, do not have this.
  void show(const RunView& run, const simulation::Snapshot& moment, const outcome::Outcome& outcome);
  /// Returns the moments of this run so far.
  const RunHistory& history() const { return history_; }

  /// Sends the changes of the markers that were left out so far.
  void complete_markers();
  /// Changes what the colours of the cars say, of this run and of those to come, and sends the cars anew.
  void colour_by(scene::Colours colours);
  /// Sends all markers, for somebody who has just come.
  void repeat_markers();
  /// Sends ~run_info; `message` says why the run has ended or failed.
  void run_info(const RunView& run, const RunState& state, const std::string& message = "");

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
    for (MessageSink* sink : sinks_) {
      if (!showing_ || !sink->is_read_from_the_middle()) sink->send<Topic>(message);
    }
  }
  tf2_msgs::TFMessage moving_frames(const std_msgs::Header& header) const;
  /// Sends what moves, as it is in `last_`.
  void send_moment(const RunView& run);
  void send_grid_point(RunView& run);
  void send_events(const std::vector<scene::Occurrence>& events);
  void send_outcome();
  /// Whether this grid point is one of those that are `spacing` apart, simulated [s].
  bool is_due(const RunView& run, double spacing) const;
  /// If there is something new.
  void send_impacts(const RunView& run);
  /// Whoever reads a bag from its middle finds everything again after a while.
  void repeat_for_readers();
  void send_markers(bool all);
  /// Sends all markers to those who read from the middle, or to the others.
  void send_whole(bool to_readers);
  visualization_msgs::MarkerArray stamped(visualization_msgs::MarkerArray array) const;
  bool markers_wanted() const;

  StreamOptions options_;
  const std::vector<MessageSink*> sinks_;
  SimClock clock_;
  PileUpFollower pile_up_;
  std::optional<MarkerScene> scene_;
  RunHistory history_;
  Inputs inputs_;
  Impacts impacts_;  ///< as last sent
  std::uint32_t run_id_ = 0;
  std::int64_t grid_points_ = 0;  ///< grid points of this run so far
  bool markers_empty_ = false;    ///< whether nothing of this run is shown yet
  bool showing_ = false;          ///< whether what is sent is no part of the run, but looks back at it
  bool looked_back_ = false;      ///< since readers of bags last got all markers
  double whole_markers_ = 0.0;    ///< when readers of bags last got all markers, simulated [s]

  // Of what was sent last.
  bool markers_sent_ = false;
  std::vector<model::Car> cars_;  // of the run
  simulation::Snapshot last_;
  std::shared_ptr<const outcome::Outcome> outcome_;  ///< newest; costly, so not found at every grid point
  scene::Heap heap_;
  std::vector<outcome::FirstTouch> touches_;  ///< recent enough to be shown
};

}  // namespace train_derail::ros_face
