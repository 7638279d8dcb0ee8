// Typed reading of a node's own parameters; errors name node, key, value, allowed range.
#pragma once

#include <string>
#include <vector>

#include <XmlRpc.h>

#include "train_derail/inputs/error.hpp"

namespace train_derail::ros_face {

/// With every digit, as YAML writes it.
std::string number_text(double value);
/// As a person would have written it; for errors.
std::string value_text(const XmlRpc::XmlRpcValue& value);

/// Finds "publish/clock" in a tree of parameters, remembers what was asked for, and complains about the rest.
/// Everything throws inputs::InputError.
class ParameterReader {
 public:
  /// `tree` must outlive the reader; `where` is the node's name.
  ParameterReader(const XmlRpc::XmlRpcValue& tree, std::string where) : tree_(tree), where_(std::move(where)) {}

  /// In the SI unit `unit`, written bare or with a unit of its own; `range` says low to high in other words.
  double number(const std::string& name, const std::string& unit, double fallback, double low, double high,
                std::string range = "");
  int integer(const std::string& name, int fallback, int low, int high);
  bool flag(const std::string& name, bool fallback);
  /// A number where text is expected counts as written (`speed: 20`).
  std::string text(const std::string& name, const std::string& fallback);
  /// Part of a tf frame id.
  std::string frame(const std::string& name, const std::string& fallback, bool may_be_empty);
  /// Name of a node or topic, relative or from the root.
  std::string graph_name(const std::string& name, const std::string& fallback);

  /// Nothing if it is not set.
  const XmlRpc::XmlRpcValue* find(const std::string& name);
  /// Call it when all known parameters have been asked for.
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
