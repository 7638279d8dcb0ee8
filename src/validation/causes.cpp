#include "train_derail/validation/causes.hpp"

#include <algorithm>
#include <cctype>
#include <set>

#include <fmt/format.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::validation {

using inputs::InputError;

namespace {

constexpr const char* kAllowed = "source: text, groups: a list of name, title, codes, families";

bool is_name(const std::string& text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isalnum(c) != 0 || c == '_'; });
}

/// Reads the file of groups. What it has met it keeps, so that nothing is in two groups.
class GroupsReader {
 public:
  explicit GroupsReader(const std::string& path) : path_(path) {}

  CauseGroups read() {
    const YAML::Node root = inputs::load_file(path_);
    CauseGroups all;
    all.path = path_;
    if (!root.IsMap()) throw InputError(path_, "", "", "not a group of keys", kAllowed);
    for (const auto& entry : root) {
      const std::string key = entry.first.as<std::string>("");
      if (key == "source" && entry.second.IsScalar()) continue;
      if (key != "groups" || !entry.second.IsSequence())
        throw InputError(where(entry.first), key, "", "unknown key, or a value of the wrong kind", kAllowed);
      for (const YAML::Node& node : entry.second) all.groups.push_back(group(node));
    }
    if (all.groups.empty()) throw InputError(path_, "groups", "", "no groups", "at least one");
    return all;
  }

 private:
  std::string where(const YAML::Node& node) const { return fmt::format("{}:{}", path_, node.Mark().line + 1); }

  CauseGroups::Group group(const YAML::Node& node) {
    CauseGroups::Group g;
    if (!node.IsMap()) throw InputError(where(node), "groups", "", "not a group of keys", kAllowed);
    for (const auto& entry : node) {
      const std::string key = entry.first.as<std::string>("");
      const YAML::Node value = entry.second;
      if (key == "name" && value.IsScalar()) g.name = value.Scalar();
      else if (key == "title" && value.IsScalar()) g.title = value.Scalar();
      else if (key == "codes" && value.IsSequence()) g.codes = texts(value, "code");
      else if (key == "families" && value.IsSequence()) g.families = texts(value, "family");
      else
        throw InputError(where(entry.first), "groups." + key, "", "unknown key, or a value of the wrong kind",
                         kAllowed);
    }
    if (!is_name(g.name)) throw InputError(where(node), "groups.name", g.name, "not a name", "letters, digits and _");
    once(node, "name", g.name);
    return g;
  }
  std::vector<std::string> texts(const YAML::Node& list, const std::string& kind) {
    std::vector<std::string> found;
    for (const YAML::Node& item : list) {
      found.push_back(item.as<std::string>(""));
      if (found.back().empty())
        throw InputError(where(item), "groups", "", "not a " + kind, "a text that is not empty");
      once(item, kind, found.back());
    }
    return found;
  }
  void once(const YAML::Node& node, const std::string& kind, const std::string& text) {
    if (!seen_.insert(kind + " " + text).second)
      throw InputError(where(node), "groups", text, "the same " + kind + " twice", "every " + kind + " once");
  }

  std::string path_;
  std::set<std::string> seen_;
};

}  // namespace

CauseGroups::Found CauseGroups::find(const std::string& code) const {
  for (const Group& g : groups) {
    if (std::find(g.codes.begin(), g.codes.end(), code) != g.codes.end()) return {&g, true};
  }
  const auto begins = [&](const std::string& family) { return code.compare(0, family.size(), family) == 0; };
  for (const Group& g : groups) {
    if (std::any_of(g.families.begin(), g.families.end(), begins)) return {&g, false};
  }
  return {groups.empty() ? nullptr : &groups.back(), false};
}

CauseGroups read_cause_groups(const std::string& path) { return GroupsReader(path).read(); }

std::vector<std::string> unlisted_causes(const CauseGroups& groups, const AccidentTable& table) {
  std::map<std::string, int> unlisted;
  for (const Accident& a : table.rows) {
    if (!groups.find(a.cause).listed) ++unlisted[a.cause];
  }
  std::vector<std::string> remarks;
  for (const auto& [code, count] : unlisted) {
    const std::string& group = groups.find(code).group->name;
    remarks.push_back(code.empty() ? fmt::format("{} rows do not tell their cause: they count as {}", count, group)
                                   : fmt::format("cause {} in {} rows is not listed in {}: it counts as {}", code,
                                                 count, groups.path, group));
  }
  return remarks;
}

}  // namespace train_derail::validation
