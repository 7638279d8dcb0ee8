// Turns runs into messages, in one order and with one set of stamps, whoever gets them.
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

struct StreamOptions {
  Frames frames;
  int markers_every = 1;                               // grid points; 0: no markers
  double event_coupler_force = 1000.0 * inputs::kKip;  // threshold of COUPLER_PEAK events [N]
};

/// What ~run_info says that a simulation does not know.
struct RunState {
  std::uint8_t state = RunInfo::RUNNING;      // of RunInfo
  double rate = 0.0;                          // wanted [-]
  std::vector<std::string> clock_publishers;  // if more than one
};

class RunStream {
 public:
  /// The sinks must outlive the stream.
  RunStream(const StreamOptions& options, std::vector<MessageSink*> sinks);

  /// The next run begins: its inputs and what holds at time 0.
  void start_run(const simulation::Simulation& simulation, const RunState& state);
  /// The simulation has reached the next point of its grid: clock, tf, cars, couplers, markers, events, all with one
  /// stamp; impacts and outcome once a simulated second.
  void grid_point(const simulation::Simulation& simulation, const outcome::Outcome& outcome);
  /// Last events, markers, impacts, outcome, state.
  void end_run(const simulation::Simulation& simulation, const outcome::Outcome& outcome, const RunState& state);

  /// After the end: time goes on by `seconds`, and tf with it, so that nobody who follows them stands still. Not in
  /// bags.
  void idle(double seconds);

  /// Sends the markers of the last grid point if they were left out.
  void complete_markers();
  void run_info(const simulation::Simulation& simulation, const RunState& state, const std::string& message = "");

  std::uint32_t run_id() const { return run_id_; }
  const ::ros::Time& now() const { return clock_.now(); }
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
  Impacts impacts_;  // as last sent
  std::uint32_t run_id_ = 0;
  std::int64_t grid_points_ = 0;  // of this run
  bool markers_empty_ = false;    // nothing of this run is shown yet

  // Of the last grid point, for complete_markers().
  bool markers_sent_ = false;
  simulation::Snapshot last_;
  outcome::Outcome last_outcome_;
  std::vector<outcome::Closing> last_touches_;  // recent enough to be shown
};

}  // namespace train_derail::ros_face
