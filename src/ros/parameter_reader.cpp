#include "train_derail/ros/parameter_reader.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>
#include <ros/names.h>

#include "train_derail/inputs/units.hpp"

namespace train_derail::ros_face {

using inputs::InputError;
using XmlRpc::XmlRpcValue;

namespace {

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

}  // namespace

std::string number_text(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0.0 ? ".inf" : "-.inf";
  // A point, as in the file: 60.0 is no count of cars, there or here.
  const std::string text = fmt::format("{:.17g}", value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string value_text(const XmlRpcValue& value) {
  switch (value.getType()) {
    case XmlRpcValue::TypeBoolean: return static_cast<const bool&>(value) ? "true" : "false";
    case XmlRpcValue::TypeInt: return std::to_string(static_cast<const int&>(value));
    case XmlRpcValue::TypeDouble: return fmt::format("{}", static_cast<const double&>(value));
    case XmlRpcValue::TypeString: return static_cast<const std::string&>(value);
    default: return type_name(value);
  }
}

double ParameterReader::number(const std::string& name, const std::string& unit, double fallback, double low,
                               double high, std::string range) {
  const XmlRpcValue* value = find(name);
  if (value == nullptr) return fallback;
  if (range.empty()) range = fmt::format("{} to {}{}", low, high, unit == "1" ? "" : " " + unit);
  double number = 0.0;
  switch (value->getType()) {
    case XmlRpcValue::TypeInt: number = static_cast<const int&>(*value); break;
    case XmlRpcValue::TypeDouble: number = static_cast<const double&>(*value); break;
    case XmlRpcValue::TypeString: try { number = inputs::to_si(static_cast<const std::string&>(*value), unit);
      } catch (const std::invalid_argument& e) {
        fail(name, *value, e.what(), range);
      }
      break;
    default: fail(name, *value, "must be a number, not " + type_name(*value), range);
  }
  if (!(number >= low && number <= high)) fail(name, *value, "out of range", range);
  return number;
}

int ParameterReader::integer(const std::string& name, int fallback, int low, int high) {
  const double value = number(name, "1", fallback, low, high);
  if (value != std::floor(value)) {
    fail(name, *find(name), "must be a whole number", fmt::format("{} to {}", low, high));
  }
  return static_cast<int>(value);
}

bool ParameterReader::flag(const std::string& name, bool fallback) {
  const XmlRpcValue* value = find(name);
  if (value == nullptr) return fallback;
  if (value->getType() == XmlRpcValue::TypeBoolean) return static_cast<const bool&>(*value);
  const std::string text = value_text(*value);
  if (value->getType() != XmlRpcValue::TypeString || (text != "true" && text != "false")) {
    fail(name, *value, "must be a truth value", "true, false");
  }
  return text == "true";
}

std::string ParameterReader::text(const std::string& name, const std::string& fallback) {
  const XmlRpcValue* value = find(name);
  if (value == nullptr) return fallback;
  if (value->getType() == XmlRpcValue::TypeDouble) return number_text(static_cast<const double&>(*value));
  if (value->getType() == XmlRpcValue::TypeInt || value->getType() == XmlRpcValue::TypeString)
    return value_text(*value);
  fail(name, *value, "must be text, not " + type_name(*value), "");
}

std::string ParameterReader::frame(const std::string& name, const std::string& fallback, bool may_be_empty) {
  const std::string id = text(name, fallback);
  const auto legal = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '/'; };
  if (!std::all_of(id.begin(), id.end(), legal) || (!id.empty() && id[0] == '/') || (id.empty() && !may_be_empty)) {
    throw InputError(where_, name, id, "not a frame name", "letters, digits, _ and /; not beginning with /");
  }
  return id;
}

std::string ParameterReader::graph_name(const std::string& name, const std::string& fallback) {
  const std::string id = text(name, fallback);
  std::string problem;
  if (id.empty() || !::ros::names::validate(id, problem)) {
    throw InputError(where_, name, id, "not a name of a node", "letters, digits, _ and /; not empty");
  }
  return id;
}

const XmlRpcValue* ParameterReader::find(const std::string& name) {
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

void ParameterReader::refuse_unknown() const { refuse_unknown(tree_, ""); }

void ParameterReader::refuse_unknown(const XmlRpcValue& tree, const std::string& prefix) const {
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

std::string ParameterReader::known_names() const {
  std::string names;
  for (const std::string& name : known_) names += (names.empty() ? "" : ", ") + name;
  return names;
}

void ParameterReader::fail(const std::string& name, const XmlRpcValue& value, const std::string& problem,
                           const std::string& allowed) const {
  throw InputError(where_, name, value_text(value), problem, allowed);
}

}  // namespace train_derail::ros_face
