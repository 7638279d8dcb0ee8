/// \file
/// Typed reading of a node's own parameters. Errors name node, key, value and allowed range.
#pragma once

#include <string>
#include <vector>

#include <XmlRpc.h>

#include "train_derail/inputs/error.hpp"

namespace train_derail::ros_face {

/// Returns `value` with all its digits, as YAML writes it.
std::string number_text(double value);
/// Returns `value` as a person would have written it; for errors.
std::string value_text(const XmlRpc::XmlRpcValue& value);

/// Finds parameters such as "publish/clock" in a tree, remembers which were asked for, and refuses the rest. Every
/// function throws inputs::InputError if a value has the wrong type or is out of range, and returns `fallback` if none
/// is set.
class ParameterReader {
 public:
  /// `tree` must outlive the reader; `where` is the node's name.
  ParameterReader(const XmlRpc::XmlRpcValue& tree, std::string where) : tree_(tree), where_(std::move(where)) {}

  /// Returns a number in the SI unit `unit`, within [low, high]. It may be written bare or with a unit of its own.
  /// `range` says in words what is allowed; "" means from low to high.
  double number(const std::string& name, const std::string& unit, double fallback, double low, double high,
                std::string range = "");
  /// Returns a whole number within [low, high].
  int integer(const std::string& name, int fallback, int low, int high);
  /// Returns a truth value.
  bool flag(const std::string& name, bool fallback);
  /// Returns a text. A number where a text is expected counts as it was written (`speed: 20`).
  std::string text(const std::string& name, const std::string& fallback);
  /// Returns a part of the name of a tf frame.
  std::string frame(const std::string& name, const std::string& fallback, bool may_be_empty);
  /// Returns the name of a node or topic, relative or from the root.
  std::string graph_name(const std::string& name, const std::string& fallback);

  /// Returns the parameter, or null if it is not set.
  const XmlRpc::XmlRpcValue* find(const std::string& name);
  /// Throws inputs::InputError if there are parameters that nobody has asked for. To be called last.
  void refuse_unknown() const;

 private:
  void refuse_unknown(const XmlRpc::XmlRpcValue& tree, const std::string& prefix) const;
  std::string known_names() const;
  [[noreturn]] void fail(const std::string& name, const XmlRpc::XmlRpcValue& value, const std::string& problem,
                         const std::string& allowed) const;

  const XmlRpc::XmlRpcValue& tree_;
  std::string where_;
  std::vector<std::string> known_;
};

}  // namespace train_derail::ros_face
