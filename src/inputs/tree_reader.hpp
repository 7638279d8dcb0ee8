/// \file
/// Reads YAML into a scenario or study, by its schema.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "schema.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/units.hpp"
#include "yaml.hpp"

namespace train_derail::inputs {

/// Where a key is in the file and what is written there, for errors that are found later.
struct KeyPlace {
  std::string where;
  YAML::Node node;
};
using KeyPlaces = std::map<std::string, KeyPlace>;

inline std::string located(const std::string& source, const YAML::Mark& mark) {
  return mark.is_null() || mark.line < 0 ? source : fmt::format("{}:{}", source, mark.line + 1);
}

inline std::string written(const YAML::Node& node) {
  if (node.IsScalar()) return node.Scalar();
  if (node.IsNull()) return "nothing";
  YAML::Emitter out;
  out.SetMapFormat(YAML::Flow);
  out.SetSeqFormat(YAML::Flow);
  out << node;
  return out.c_str();
}

/// Whether a key is that of a group or list, or of something in it.
inline bool within(const std::string& key, const std::string& group) {
  return key.compare(0, group.size(), group) == 0 &&
         (key.size() == group.size() || key[group.size()] == '.' || key[group.size()] == '[');
}

/// Does `check`; an InputError of it gets the place and the text of its key in the file.
/// \param source  name of the file, for keys that it does not have.
template <class Check>
void check_at(const KeyPlaces& places, const std::string& source, const Check& check) {
  try {
    check();
  } catch (const InputError& e) {
    const auto place = places.find(e.key());
    if (place == places.end()) throw InputError(source, e.key(), e.value(), e.problem(), e.allowed());
    throw InputError(place->second.where, e.key(), written(place->second.node), e.problem(), e.allowed());
  }
}

/// Visitor of a schema that reads the values from a YAML map. Errors name the file, line, key and value.
class TreeReader {
 public:
  /// `sources`: files of keys that come from a base, as in Layers.
  TreeReader(YAML::Node node, std::string prefix, std::string source, const std::vector<Override>& overrides,
             KeyPlaces& places, std::map<std::string, std::string> sources = {})
      : node_(std::move(node)),
        prefix_(std::move(prefix)),
        source_(std::move(source)),
        overrides_(overrides),
        places_(places),
        sources_(std::move(sources)) {
    const std::string here = prefix_.empty() ? "" : prefix_.substr(0, prefix_.size() - 1);
    if (!node_.IsMap())
      throw InputError(where(here, node_), here, written(node_), "not a group of keys", "key: value lines");
    std::set<std::string> seen;
    for (const auto& item : node_) {
      const std::string key = written(item.first);
      if (!seen.insert(key).second) {
        throw InputError(where(prefix_ + key, item.first), prefix_ + key, written(item.second), "key given twice",
                         "once");
      }
    }
  }

  void text(const char* key, std::string& value, const Doc&) {
    const YAML::Node n = find(key, false, "text");
    if (!n) return;
    value = scalar(key, n, "text");
    if (n.Tag() == "?" && rewritten_number(value)) {
      fail(key, n, "a number where a text is needed; roslaunch (YAML 1.1) would change its digits",
           "\"" + value + "\" in quotes");
    }
  }

  /// Reads a text, or a group of keys, which is left as it is.
  void text_or_group(const char* key, std::string& value, YAML::Node& group, const Doc& doc) {
    const YAML::Node n = find(key, false, "text, or a group of keys");
    if (n && n.IsMap()) group.reset(n);
    else text(key, value, doc);
  }

  /// Reads a value of any kind as the text that is written.
  void value(const char* key, std::string& value, const Doc&) {
    if (const YAML::Node n = find(key, false, "a value")) value = scalar(key, n, "a value");
  }

  void number(const char* key, double& value, const NumberInput& q, const Doc&) {
    const std::string allowed = q.range.text(q.unit);
    if (const YAML::Node n = find(key, q.required, allowed)) value = convert(key, n, q, allowed);
  }
  void number(const char* key, std::optional<double>& value, const NumberInput& q, const Doc&) {
    const std::string allowed = q.range.text(q.unit);
    if (const YAML::Node n = find(key, q.required, allowed)) value = convert(key, n, q, allowed);
  }

  template <class I>
  void integer(const char* key, I& value, const Range& range, bool required, const Doc&) {
    const std::string allowed = "a whole number, " + range.text("1");
    const YAML::Node n = find(key, required, allowed);
    if (!n) return;
    std::string text = scalar(key, n, allowed);
    if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.erase(0, 1);
    const auto parsed = files::number<I>(text);
    if (!parsed) fail(key, n, "not a whole number", allowed);
    value = *parsed;
  }

  template <class E, class N>
  void choice(const char* key, E& value, const N& names, const Doc&) {
    std::string allowed;
    for (const auto& [name, unused] : names) allowed += (allowed.empty() ? "" : ", ") + std::string(name);
    const YAML::Node n = find(key, false, allowed);
    if (!n) return;
    const std::string text = scalar(key, n, allowed);
    for (const auto& [name, choice] : names) {
      if (name == text) {
        value = choice;
        return;
      }
    }
    fail(key, n, "unknown choice", allowed);
  }

  template <class G, class F>
  void group(const char* key, G& g, F describe_it, const Doc&) {
    if (const YAML::Node n = find(key, false, "")) {
      read_child(n, source_, prefix_ + key, g, describe_it);
    } else {  // the group is missing: its required keys are reported by their names
      read_child(YAML::Node(YAML::NodeType::Map), located(source_, node_.Mark()), prefix_ + key, g, describe_it);
    }
  }

  template <class G, class F>
  void list(const char* key, std::vector<G>& items, F describe_it, const Doc&, bool required) {
    const YAML::Node n = find(key, required, "a list of groups");
    if (!n) return;
    if (!n.IsSequence()) fail(key, n, "not a list", "a list of groups, each starting with '- '");
    items.clear();
    for (std::size_t i = 0; i < n.size(); ++i) {
      G item;
      read_child(n[i], source_, fmt::format("{}{}[{}]", prefix_, key, i), item, describe_it);
      items.push_back(std::move(item));
    }
  }

  /// Reads a list of values as the texts that are written.
  void texts(const char* key, std::vector<std::string>& values, const Doc&) {
    const YAML::Node n = find(key, false, "a list of values");
    if (!n) return;
    if (!n.IsSequence()) fail(key, n, "not a list", "[value, value, ...]");
    values.clear();
    for (const auto& item : n) values.push_back(scalar(key, item, "[value, value, ...]"));
  }

  /// Throws InputError if the map has a key that the schema did not ask for.
  void finish() const {
    for (const auto& item : node_) {
      const std::string key = written(item.first);
      if (asked_.count(key) != 0) continue;
      if (prefix_.empty() && key.compare(0, 2, "x-") == 0) continue;  // keys with x- are only there for anchors
      std::string allowed;
      for (const auto& name : asked_) allowed += (allowed.empty() ? "" : ", ") + name;
      const std::string path = prefix_ + key;
      for (const Override& o : overrides_) {  // the file may not even have the group that it names
        if (o.key != path && within(o.key, path) && source_of(path) == kOverride)
          throw InputError(kOverride, o.key, o.value, fmt::format("unknown key '{}'", path), allowed);
      }
      throw InputError(where(path, item.first), path, written(item.second), "unknown key", allowed);
    }
  }

  /// Where a key is, with its file and line, or kOverride.
  std::string where(const std::string& path, const YAML::Node& node) const {
    for (const Override& o : overrides_) {
      if (within(path, o.key)) return kOverride;
    }
    return located(source_of(path), node.Mark());
  }

 private:
  template <class G, class F>
  void read_child(const YAML::Node& node, const std::string& source, const std::string& path, G& g, F describe_it) {
    TreeReader child(node, path + ".", source, overrides_, places_, sources_);
    describe_it(child, g);
    child.finish();
  }

  /// Returns the file that a key comes from: that of the nearest group around it with an entry in `sources_`.
  const std::string& source_of(std::string path) const {
    if (sources_.empty()) return source_;
    for (;;) {
      const auto found = sources_.find(path);
      if (found != sources_.end()) return found->second;
      if (path.empty()) return source_;
      const auto end = path.find_last_of(".[");
      path.erase(end == std::string::npos ? 0 : end);
    }
  }

  YAML::Node find(const char* key, bool required, const std::string& allowed) {
    asked_.insert(key);
    const YAML::Node n = static_cast<const YAML::Node&>(node_)[key];
    if (!n) {
      if (required) throw InputError(where(prefix_, node_), prefix_ + key, "", "missing", allowed);
      return YAML::Node(YAML::NodeType::Undefined);
    }
    std::string place = where(prefix_ + key, n);
    if (n.IsNull()) {  // yaml-cpp gives the line of the next key for it
      for (const auto& item : node_) {
        if (item.second.is(n)) place = where(prefix_ + key, item.first);
      }
      if (*allowed.c_str() != '\0') throw InputError(place, prefix_ + key, written(n), "the value is missing", allowed);
    }
    places_.insert_or_assign(prefix_ + key, KeyPlace{place, n});
    return n;
  }

  [[noreturn]] void fail(const char* key, const YAML::Node& n, const std::string& problem,
                         const std::string& allowed) const {
    throw InputError(where(prefix_ + key, n), prefix_ + key, written(n), problem, allowed);
  }

  std::string scalar(const char* key, const YAML::Node& n, const std::string& allowed) const {
    if (!n.IsScalar()) fail(key, n, "must be a single value", allowed);
    return n.Scalar();
  }

  double convert(const char* key, const YAML::Node& n, const NumberInput& q, const std::string& allowed) {
    const std::string text = scalar(key, n, allowed);
    for (const char* word : {".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"}) {
      if (text == word) return kInfinity;
    }
    for (const char* word : {"-.inf", "-.Inf", "-.INF", ".nan", ".NaN", ".NAN"}) {
      if (text == word) fail(key, n, "not a finite number", allowed);
    }
    try {
      return to_si(text, q.unit);
    } catch (const std::invalid_argument& e) {
      const std::string example =
          *q.shown != '\0' ? fmt::format(" (a number, or with a unit as in \"1 {}\")", q.shown) : "";
      fail(key, n, e.what(), allowed + example);
    }
  }

  const YAML::Node node_;
  const std::string prefix_, source_;
  const std::vector<Override>& overrides_;
  KeyPlaces& places_;
  const std::map<std::string, std::string> sources_;
  std::set<std::string> asked_;
};

}  // namespace train_derail::inputs
