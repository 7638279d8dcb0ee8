#include "train_derail/ros/parameters.hpp"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <ros/param.h>

#include "train_derail/ros/file_bounds.hpp"
#include "train_derail/ros/parameter_reader.hpp"

namespace train_derail::ros_face {

namespace {

using inputs::InputError;
using XmlRpc::XmlRpcValue;

constexpr double kRateMin = 0.001, kRateMax = 1000.0;
constexpr int kDepthMax = 32;  // of a scenario on the parameter server
constexpr std::size_t kMebibyte = 1U << 20;
constexpr int kHistoryMemory = 256, kHistoryMemoryMax = 65536;  // MiB
constexpr char kRateRange[] = "0 (as fast as the integrator goes), or 0.001 to 1000";

}  // namespace

YAML::Node to_yaml_tree(const XmlRpcValue& value, const std::string& name, int depth) {
  if (depth > kDepthMax)
    throw InputError(name, "", "", "nested too deeply", fmt::format("at most {} levels", kDepthMax));
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean:
    case XmlRpcValue::TypeInt:
    case XmlRpcValue::TypeString: return YAML::Node(value_text(value));
    case XmlRpcValue::TypeDouble: return YAML::Node(number_text(static_cast<const double&>(value)));
    case XmlRpcValue::TypeArray: {
      YAML::Node list(YAML::NodeType::Sequence);
      for (int i = 0; i < value.size(); ++i)
        list.push_back(to_yaml_tree(value[i], fmt::format("{}[{}]", name, i), depth + 1));
      return list;
    }
    case XmlRpcValue::TypeStruct: {
      YAML::Node map(YAML::NodeType::Map);
      for (const auto& [key, child] : value) map[key] = to_yaml_tree(child, name + "/" + key, depth + 1);
      return map;
    }
    default: throw InputError(name, "", "", "binary data or a date", "numbers, text, truth values, lists and maps");
  }
}

void check_rate(double rate, const std::string& where) {
  if (rate == 0.0 || (rate >= kRateMin && rate <= kRateMax)) return;
  throw InputError(where, "rate", fmt::format("{}", rate), "out of range", kRateRange);
}

NodeParameters read_node_parameters(const XmlRpcValue& tree, const std::string& node_name) {
  ParameterReader reader(tree, node_name);
  NodeParameters p;
  p.rate = reader.number("rate", "1", p.rate, 0.0, kRateMax, kRateRange);
  check_rate(p.rate, node_name);
  p.start_paused = reader.flag("start_paused", p.start_paused);
  p.exit_when_done = reader.flag("exit_when_done", p.exit_when_done);
  StreamOptions& stream = p.stream;
  stream.frames.world = reader.frame("world_frame", stream.frames.world, false);
  stream.frames.prefix = reader.frame("frame_prefix", stream.frames.prefix, true);
  p.results_folder = reader.text("results_folder", "");
  if (p.results_folder.empty()) p.results_folder = default_results_folder();
  if (p.results_folder.front() != '/') {
    throw InputError(node_name, "results_folder", p.results_folder, "relative path",
                     "an absolute path on the node's machine");
  }
  p.bag = reader.text("bag", p.bag);
  p.publish_clock = reader.flag("publish/clock", p.publish_clock);
  p.publish_tf = reader.flag("publish/tf", p.publish_tf);
  stream.markers_every = reader.integer("publish/markers_every", stream.markers_every, 0, 1000);
  stream.colours = scene::colours_of(node_name, "publish/colours",
                                     reader.text("publish/colours", std::string(to_string(stream.colours))));
  p.event_coupler_force = reader.number("events/coupler_force", "N", p.event_coupler_force, 0.0, 1.0e12);
  p.viewers_wait = reader.number("viewers_wait", "s", p.viewers_wait, 0.0, 600.0);
  stream.history_bytes =
      kMebibyte * static_cast<std::size_t>(reader.integer("history_memory", kHistoryMemory, 0, kHistoryMemoryMax));
  p.overload_threshold = reader.number("overload_threshold", "1", p.overload_threshold, 0.01, 1.0);
  p.diagnostics_period = reader.number("diagnostics_period", "s", p.diagnostics_period, 0.05, 60.0);
  reader.find("scenario");
  reader.find("scenario_file");
  reader.find("checked");  // by sim.launch: what derail check says of it
  reader.find("speed");
  reader.find("set");
  // The scenario's own keys are the scenario reader's business.
  if (tree.getType() == XmlRpcValue::TypeStruct) reader.refuse_unknown();
  return p;
}

ScenarioSource read_scenario_source(const XmlRpcValue& tree, const std::string& node_name) {
  ParameterReader reader(tree, node_name);
  ScenarioSource source;
  source.name = node_name + "/scenario";
  const XmlRpcValue* scenario = reader.find("scenario");
  if (scenario == nullptr) {
    throw InputError(
        source.name, "", "", "parameter not set",
        "a scenario, loaded by roslaunch train_derail sim.launch or `rosparam load FILE " + source.name + "`");
  }
  source.folder = std::filesystem::path(reader.text("scenario_file", "")).parent_path().string();
  source.tree = std::make_shared<const YAML::Node>(to_yaml_tree(*scenario, source.name));
  if (const std::string speed = reader.text("speed", ""); !speed.empty()) {
    source.add_overrides({"initial.speed=" + speed});
  }
  const std::string set = reader.text("set", "");
  std::vector<std::string> overrides;
  for (std::size_t begin = 0; begin < set.size();) {
    const std::size_t end = std::min(set.find(';', begin), set.size());
    const std::string text = set.substr(begin, end - begin);
    if (text.find_first_not_of(" \t\n") != std::string::npos) overrides.push_back(text);
    begin = end + 1;
  }
  source.add_overrides(overrides);
  return source;
}

XmlRpcValue fetch_parameters(const std::string& node_name) {
  XmlRpcValue tree;
  ::ros::param::get(node_name, tree);
  return tree;
}

inputs::Layers ScenarioSource::layers(const std::function<void(const std::string&)>& ask) const {
  return inputs::layers(YAML::Clone(*tree), name, folder, [&](const std::string& path) {
    if (folder.empty() && std::filesystem::path(path).is_relative()) {
      throw InputError(name, "base or consist", path, "relative, and the parameter scenario_file does not say to what",
                       "an absolute path");
    }
    ask(path);
  });
}

inputs::Scenario ScenarioSource::read() const {
  const auto anywhere = [](const std::string&) {};
  return inputs::read_scenario(layers(bounds ? bounds->asking(name) : anywhere), name, overrides);
}

std::vector<std::string> ScenarioSource::files() const {
  std::vector<std::string> named;
  layers([&](const std::string& path) { named.push_back(path); });
  return named;
}

void ScenarioSource::add_overrides(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    const inputs::Override added = inputs::parse_override(text);
    const auto same_key = [&](const inputs::Override& o) { return o.key == added.key; };
    overrides.erase(std::remove_if(overrides.begin(), overrides.end(), same_key), overrides.end());
    overrides.push_back(added);
  }
}

}  // namespace train_derail::ros_face
