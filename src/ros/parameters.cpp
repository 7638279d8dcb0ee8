#include "train_derail/ros/parameters.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <ros/param.h>

#include "train_derail/inputs/units.hpp"

namespace train_derail::ros_face {

namespace {

using inputs::InputError;
using XmlRpc::XmlRpcValue;

constexpr double kRateMin = 0.001, kRateMax = 1000.0;
constexpr char kRateRange[] = "0 (as fast as the integrator goes), or 0.001 to 1000";

std::string type_name(const XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean: return "a truth value";
    case XmlRpcValue::TypeInt:
    case XmlRpcValue::TypeDouble: return "a number";
    case XmlRpcValue::TypeString: return "text";
    case XmlRpcValue::TypeArray: return "a list";
    case XmlRpcValue::TypeStruct: return "a map of keys";
    default: return "neither number nor text";
  }
}

std::string number_text(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0.0 ? ".inf" : "-.inf";
  return fmt::format("{:.17g}", value);
}

/// As a person would have written it; for errors.
std::string value_text(const XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean: return static_cast<const bool&>(value) ? "true" : "false";
    case XmlRpcValue::TypeInt: return std::to_string(static_cast<const int&>(value));
    case XmlRpcValue::TypeDouble: return fmt::format("{}", static_cast<const double&>(value));
    case XmlRpcValue::TypeString: return static_cast<const std::string&>(value);
    default: return type_name(value);
  }
}

/// Finds "publish/clock" in a tree of parameters, remembers what was asked for, and complains about the rest.
class ParameterReader {
 public:
  ParameterReader(const XmlRpcValue& tree, std::string where) : tree_(tree), where_(std::move(where)) {}

  double number(const std::string& name, const std::string& unit, double fallback, double low, double high,
                std::string range = "") {
    const XmlRpcValue* value = find(name);
    if (value == nullptr) return fallback;
    if (range.empty()) range = fmt::format("{} to {}{}", low, high, unit == "1" ? "" : " " + unit);
    double number = 0.0;
    switch (value->getType()) {
      case XmlRpcValue::TypeInt: number = static_cast<const int&>(*value); break;
      case XmlRpcValue::TypeDouble: number = static_cast<const double&>(*value); break;
      case XmlRpcValue::TypeString: try { number = units_.to_si(static_cast<const std::string&>(*value), unit);
        } catch (const std::invalid_argument& e) {
          fail(name, *value, e.what(), range);
        }
        break;
      default: fail(name, *value, "must be a number, not " + type_name(*value), range);
    }
    if (!(number >= low && number <= high)) fail(name, *value, "out of range", range);
    return number;
  }

  int integer(const std::string& name, int fallback, int low, int high) {
    const double value = number(name, "1", fallback, low, high);
    if (value != std::floor(value)) {
      fail(name, *find(name), "must be a whole number", fmt::format("{} to {}", low, high));
    }
    return static_cast<int>(value);
  }

  bool flag(const std::string& name, bool fallback) {
    const XmlRpcValue* value = find(name);
    if (value == nullptr) return fallback;
    if (value->getType() == XmlRpcValue::TypeBoolean) return static_cast<const bool&>(*value);
    const std::string text = value_text(*value);
    if (value->getType() != XmlRpcValue::TypeString || (text != "true" && text != "false")) {
      fail(name, *value, "must be a truth value", "true, false");
    }
    return text == "true";
  }

  /// A number where text is expected counts as written (`speed: 20`).
  std::string text(const std::string& name, const std::string& fallback) {
    const XmlRpcValue* value = find(name);
    if (value == nullptr) return fallback;
    if (value->getType() == XmlRpcValue::TypeDouble) return number_text(static_cast<const double&>(*value));
    if (value->getType() == XmlRpcValue::TypeInt || value->getType() == XmlRpcValue::TypeString)
      return value_text(*value);
    fail(name, *value, "must be text, not " + type_name(*value), "");
  }

  /// Part of a tf frame id.
  std::string frame(const std::string& name, const std::string& fallback, bool may_be_empty) {
    const std::string id = text(name, fallback);
    const auto legal = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '/'; };
    if (!std::all_of(id.begin(), id.end(), legal) || (!id.empty() && id[0] == '/') || (id.empty() && !may_be_empty)) {
      throw InputError(where_, name, id, "not a frame name", "letters, digits, _ and /; not beginning with /");
    }
    return id;
  }

  const XmlRpcValue* find(const std::string& name) {
    known_.push_back(name);
    const XmlRpcValue* here = &tree_;
    for (std::size_t begin = 0; begin <= name.size();) {
      const std::size_t end = std::min(name.find('/', begin), name.size());
      const std::string key = name.substr(begin, end - begin);
      if (here->getType() != XmlRpcValue::TypeStruct || !here->hasMember(key)) return nullptr;
      here = &(*here)[key];
      begin = end + 1;
    }
    return here;
  }

  void refuse_unknown() const { refuse_unknown(tree_, ""); }

 private:
  void refuse_unknown(const XmlRpcValue& tree, const std::string& prefix) const {
    if (tree.getType() != XmlRpcValue::TypeStruct) return;
    for (const auto& [key, value] : tree) {
      const std::string name = prefix + key;
      if (std::find(known_.begin(), known_.end(), name) != known_.end()) continue;
      const bool group = std::any_of(known_.begin(), known_.end(),
                                     [&](const std::string& known) { return known.rfind(name + "/", 0) == 0; });
      if (!group) throw InputError(where_, name, value_text(value), "unknown parameter", known_names());
      if (value.getType() != XmlRpcValue::TypeStruct) fail(name, value, "must be a map of keys", known_names());
      refuse_unknown(value, name + "/");
    }
  }

  std::string known_names() const {
    std::string names;
    for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
    return names;
  }

  [[noreturn]] void fail(const std::string& name, const XmlRpcValue& value, const std::string& problem,
                         const std::string& allowed) const {
    throw InputError(where_, name, value_text(value), problem, allowed);
  }

  const XmlRpcValue& tree_;
  std::string where_;
  inputs::UnitSystem units_;
  std::vector<std::string> known_;
};

}  // namespace

YAML::Node to_yaml_tree(const XmlRpcValue& value, const std::string& name) {
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean:
    case XmlRpcValue::TypeInt:
    case XmlRpcValue::TypeString: return YAML::Node(value_text(value));
    case XmlRpcValue::TypeDouble: return YAML::Node(number_text(static_cast<const double&>(value)));
    case XmlRpcValue::TypeArray: {
      YAML::Node list(YAML::NodeType::Sequence);
      for (int i = 0; i < value.size(); ++i) list.push_back(to_yaml_tree(value[i], fmt::format("{}[{}]", name, i)));
      return list;
    }
    case XmlRpcValue::TypeStruct: {
      YAML::Node map(YAML::NodeType::Map);
      for (const auto& [key, child] : value) map[key] = to_yaml_tree(child, name + "/" + key);
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
  p.bag = reader.text("bag", p.bag);
  p.publish_clock = reader.flag("publish/clock", p.publish_clock);
  p.publish_tf = reader.flag("publish/tf", p.publish_tf);
  stream.markers_every = reader.integer("publish/markers_every", stream.markers_every, 0, 1000);
  stream.event_coupler_force = reader.number("events/coupler_force", "N", stream.event_coupler_force, 0.0, 1.0e12);
  p.overload_threshold = reader.number("overload_threshold", "1", p.overload_threshold, 0.01, 1.0);
  p.diagnostics_period = reader.number("diagnostics_period", "s", p.diagnostics_period, 0.05, 60.0);
  reader.find("scenario");
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

inputs::Scenario ScenarioSource::read() const { return inputs::read_scenario(YAML::Clone(*tree), name, overrides); }

void ScenarioSource::add_overrides(const std::vector<std::string>& texts) {
  for (const std::string& text : texts) {
    const inputs::Override added = inputs::parse_override(text);
    const auto same_key = [&](const inputs::Override& o) { return o.key == added.key; };
    overrides.erase(std::remove_if(overrides.begin(), overrides.end(), same_key), overrides.end());
    overrides.push_back(added);
  }
}

}  // namespace train_derail::ros_face
