// All that the panel has to do with ROS: what the node sends, and what it is asked for. Knows neither Qt nor RViz.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "rviz/force_record.hpp"
#include "rviz/worker.hpp"
#include "train_derail/CarStates.h"
#include "train_derail/CouplerForces.h"
#include "train_derail/Inputs.h"
#include "train_derail/Outcome.h"
#include "train_derail/PileUp.h"
#include "train_derail/RunInfo.h"
#include "train_derail/scene/palette.hpp"

namespace train_derail::rviz_panel {

/// The cars at the last point of the grid.
struct TrainNow {
  std::uint32_t run_id = 0;  // 0: not known yet
  double time = 0.0;         // simulated [s]
  double speed_last = 0.0;   // of the last car [m/s]
  std::uint32_t past_pod = 0, off_track = 0;
};

/// What is left of a run that another one has followed.
struct PreviousRun {
  Outcome::ConstPtr outcome;  // the latest of it; null: there was none
  Inputs::ConstPtr inputs;    // null: not known
};

/// How the node has answered a service call.
struct Answer {
  std::uint64_t number = 0;  // counts answers from 1
  std::string service;       // "restart"
  bool success = false;
  std::string message;  // the service's, verbatim; or that none came
};

/// What is known of the node at one instant.
struct NodeView {
  std::string node;        // resolved; empty if the name is not valid
  std::string name_error;  // then
  bool present = false;    // its services can be reached
  std::string player;      // another node that publishes its topics, most likely rosbag play; empty: none
  std::vector<std::string> clock_publishers;  // if more than one: time jumps
  RunInfo::ConstPtr run_info;
  Inputs::ConstPtr inputs;
  Outcome::ConstPtr outcome;
  CarStates::ConstPtr cars;  // these three: the last ones
  CouplerForces::ConstPtr couplers;
  PileUp::ConstPtr pile_up;
  TrainNow train;
  ForceRecord forces;
  PreviousRun previous;
  std::string scenario_file;            // the node was started with, on its machine; empty: not known
  std::optional<double> achieved_rate;  // simulated seconds per wall second, while running
  std::set<std::string> pending;        // services that have not answered yet
  Answer answer;                        // the last one; number 0: none
};

/// Whether what the node publishes comes from a bag: there is nothing to drive.
inline bool is_replay(const NodeView& view) { return !view.present && !view.player.empty(); }

/// The node plays a run that was recorded: its inputs cannot be changed.
inline bool plays_a_recording(const NodeView& view) { return view.run_info && view.run_info->replay; }

/// The run is over, whatever has ended it.
inline bool has_ended(const NodeView& view) {
  return view.run_info && (view.run_info->state == RunInfo::ENDED || view.run_info->state == RunInfo::FAILED);
}

/// Finds the node, follows it when it goes and comes, and never makes the caller wait. All methods are for one thread;
/// what they lead to happens on threads of its own.
class NodeLink {
 public:
  explicit NodeLink(const std::string& node);
  ~NodeLink();
  NodeLink(const NodeLink&) = delete;
  NodeLink& operator=(const NodeLink&) = delete;

  /// Looks to another node; what was known is forgotten.
  void set_node(const std::string& node);
  NodeView view() const;

  // The answers come by view().
  void resume();
  void pause();
  void step(std::uint32_t ticks);
  void set_rate(double rate);
  void set_colours(scene::Colours colours);
  /// `scenario`: the whole of it as YAML; empty: the present one.
  void restart(const std::vector<std::string>& overrides, bool start_paused, const std::string& scenario = "");
  /// Shows the run as it was at `time` [s]. One call at a time is under way; of those that are asked for meanwhile only
  /// the last is made. Only a refusal is an answer.
  void seek(double time);

 private:
  struct Core;
  template <class Service>
  void call(Worker& worker, const std::string& service, const typename Service::Request& request);

  std::shared_ptr<Core> core_;
  Worker probe_, steps_, calls_;  // ~step may take its time: what may cut it short does not queue behind it
};

}  // namespace train_derail::rviz_panel
