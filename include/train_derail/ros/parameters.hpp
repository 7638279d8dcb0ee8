// The node's inputs from the parameter server: its own parameters, and the scenario below them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <XmlRpc.h>
#include <yaml-cpp/yaml.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/ros/run_stream.hpp"

namespace train_derail::ros_face {

/// What the node itself can be told; README.md has the table.
struct NodeParameters {
  double rate = 1.0;  // simulated seconds per wall second; 0: as fast as the integrator goes [-]
  bool start_paused = false;
  bool exit_when_done = false;
  StreamOptions stream;
  bool publish_clock = true;
  bool publish_tf = true;
  std::string results_folder;       // absolute: what is written, bags and results of studies, lies below it
  std::string bag;                  // file or folder to record to, below results_folder; empty: no recording
  double overload_threshold = 0.1;  // share of wall time lost that is complained about [-]
  double diagnostics_period = 1.0;  // wall [s]
};

/// Everything a scenario is made from, kept so that a later restart can change parts of it.
struct ScenarioSource {
  /// Shared and never changed: assigning to a YAML::Node would write through to every copy of it.
  std::shared_ptr<const YAML::Node> tree;
  std::string name;                         // for errors
  std::string folder;                       // where a relative `base` of the scenario starts; "" if that is not known
  std::vector<inputs::Override> overrides;  // later ones win

  inputs::Scenario read() const;
  /// Adds overrides ("key=value"), replacing earlier ones of the same key. Throws inputs::InputError.
  void add_overrides(const std::vector<std::string>& texts);
};

/// `tree`: all parameters below `node_name`. Throws inputs::InputError: unknown parameter, wrong type, out of range.
NodeParameters read_node_parameters(const XmlRpc::XmlRpcValue& tree, const std::string& node_name);

/// The parameters scenario, speed and set below `node_name`. Throws inputs::InputError.
ScenarioSource read_scenario_source(const XmlRpc::XmlRpcValue& tree, const std::string& node_name);

/// What stands on the parameter server below `node_name`; an empty struct if nothing does.
XmlRpc::XmlRpcValue fetch_parameters(const std::string& node_name);

/// Numbers keep every digit. Throws inputs::InputError for what YAML cannot hold, and for what is nested too deeply.
/// `depth`: levels around the value.
YAML::Node to_yaml_tree(const XmlRpc::XmlRpcValue& value, const std::string& name, int depth = 0);

/// Throws inputs::InputError unless `rate` is 0 or within 0.001 to 1000.
void check_rate(double rate, const std::string& where);

}  // namespace train_derail::ros_face
