/// \file
/// The node's inputs on the parameter server: its own parameters, and the scenario below them.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <XmlRpc.h>
#include <yaml-cpp/yaml.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/ros/file_bounds.hpp"
#include "train_derail/ros/run_stream.hpp"

namespace train_derail::ros_face {

/// Parameters of the node itself; README.md has the table.
struct NodeParameters {
  double rate = 1.0;            ///< simulated seconds per wall second [-]; 0: as fast as the integrator goes
  bool start_paused = false;    ///< whether the first run waits for ~resume or ~step
  bool exit_when_done = false;  ///< whether the node ends with its run
  double viewers_wait = 0.0;    ///< how long the first run waits for somebody who watches, wall time [s]
  StreamOptions stream;         ///< what is in the messages
  double event_coupler_force = scene::kEventCouplerForce;  ///< threshold of COUPLER_PEAK events [N]
  bool publish_clock = true;                               ///< whether there is a topic /clock
  bool publish_tf = true;                                  ///< whether there are topics /tf and /tf_static
  std::string results_folder;       ///< absolute path; bags and results of studies are written below it
  std::string bag;                  ///< file or folder to record to, below results_folder; "": no recording
  double overload_threshold = 0.1;  ///< share of lost wall time above which the node warns [-]
  double diagnostics_period = 1.0;  ///< wall time between two reports on /diagnostics [s]
};

/// Everything a scenario is made from, kept so that a later restart can change parts of it.
struct ScenarioSource {
  /// Shared and never changed: assigning to a YAML::Node would write through to every copy of it.
  std::shared_ptr<const YAML::Node> tree;
  std::string name;                         ///< name for errors
  std::string folder;                       ///< where relative paths in the scenario start; "" if unknown
  std::vector<inputs::Override> overrides;  ///< changed inputs; later ones win
  /// What the scenario may name; none: whatever there is, as who started the node has chosen it.
  std::shared_ptr<const FileBounds> bounds;

  /// Reads and validates the scenario. Throws inputs::InputError.
  inputs::Scenario read() const;
  /// Returns the files that it names, itself or by its bases. Throws inputs::InputError if one cannot be read.
  std::vector<std::string> files() const;
  /// Adds overrides ("key=value"); they replace earlier ones of the same key. Throws inputs::InputError if one has no
  /// "=".
  void add_overrides(const std::vector<std::string>& texts);

 private:
  inputs::Layers layers(const std::function<void(const std::string&)>& ask) const;
};

/// Reads the node's own parameters. `tree` holds all parameters below `node_name`. Throws inputs::InputError if a
/// parameter is unknown, of the wrong type, or out of range.
NodeParameters read_node_parameters(const XmlRpc::XmlRpcValue& tree, const std::string& node_name);

/// Reads the parameters `scenario`, `scenario_file`, `speed` and `set` below `node_name`. Throws inputs::InputError if
/// there is no scenario, or if one of them cannot be read; the scenario itself is not yet checked.
ScenarioSource read_scenario_source(const XmlRpc::XmlRpcValue& tree, const std::string& node_name);

/// Returns what is on the parameter server below `node_name`; an empty struct if nothing is.
XmlRpc::XmlRpcValue fetch_parameters(const std::string& node_name);

/// Converts a parameter to YAML; numbers keep all their digits. `name` is for errors, `depth` the number of levels
/// around the value. Throws inputs::InputError for what YAML cannot hold, and for what is nested more than 32 levels
/// deep.
YAML::Node to_yaml_tree(const XmlRpc::XmlRpcValue& value, const std::string& name, int depth = 0);

/// Throws inputs::InputError unless `rate` is 0 or within 0.001 to 1000.
void check_rate(double rate, const std::string& where);

}  // namespace train_derail::ros_face
