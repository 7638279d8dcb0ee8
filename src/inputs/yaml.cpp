#include "yaml.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <sstream>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <yaml-cpp/depthguard.h>
#include <yaml-cpp/eventhandler.h>

#include "train_derail/files/number.hpp"
#include "train_derail/files/text.hpp"

namespace train_derail::inputs {

namespace {

[[noreturn]] void refuse(const YAML::Mark& mark, std::string value, std::string problem, std::string allowed) {
  throw YamlMistake{mark.is_null() ? 0 : mark.line + 1, std::move(value), std::move(problem), std::move(allowed)};
}

/// Removes all characters that `of` accepts from the front of `text`, and returns how many they were.
template <class Of>
std::size_t take(std::string_view& text, Of of) {
  std::size_t n = 0;
  while (n < text.size() && of(text[n])) ++n;
  text.remove_prefix(n);
  return n;
}

bool digit(char c) { return c >= '0' && c <= '9'; }
bool digit_or_underscore(char c) { return digit(c) || c == '_'; }

/// Removes ":59" from the front of the text, once or more. Returns whether there was any.
bool take_sexagesimal(std::string_view& text) {
  bool any = false;
  while (text.size() >= 2 && text[0] == ':' && digit(text[1])) {
    const bool two = text.size() >= 3 && digit(text[2]) && text[1] <= '5';
    text.remove_prefix(two ? 3 : 2);
    any = true;
  }
  return any;
}

/// Whether the text is a date, year-month-day, with or without a time behind it.
bool timestamp(std::string_view text) {
  const auto number = [&](std::size_t least, std::size_t most) {
    const std::size_t n = take(text, digit);
    return n >= least && n <= most;
  };
  const auto one = [&](char c) {
    if (text.empty() || text[0] != c) return false;
    text.remove_prefix(1);
    return true;
  };
  if (!number(4, 4) || !one('-') || !number(1, 2) || !one('-') || !number(1, 2)) return false;
  if (text.empty()) return true;  // with a one-digit month PyYAML reads a text; it is taken as a date here all the same
  if (!one('T') && !one('t') && take(text, [](char c) { return c == ' ' || c == '\t'; }) == 0) return false;
  return number(1, 2) && one(':') && number(2, 2) && one(':') && number(2, 2);
}

/// What PyYAML (and rosparam) make of a scalar without quotes, as far as it is not a text.
enum class ScalarKind { text, truth, integer, real, date, value, merge, angle };

struct Resolved {
  ScalarKind kind = ScalarKind::text;
  bool plain_decimal = true;  // for numbers: without underscores, and to base 10
};

Resolved resolve(std::string_view s) {
  for (const char* word : {"yes", "Yes", "YES", "no", "No", "NO", "true", "True", "TRUE", "false", "False", "FALSE",
                           "on", "On", "ON", "off", "Off", "OFF"}) {
    if (s == word) return {ScalarKind::truth};
  }
  if (s == "=") return {ScalarKind::value};
  if (s == "<<") return {ScalarKind::merge};
  if ((s.substr(0, 4) == "deg(" || s.substr(0, 4) == "rad(") && s.find(')') == s.size() - 1) return {ScalarKind::angle};
  if (timestamp(s)) return {ScalarKind::date};

  std::string_view r = s;
  const bool sign = !r.empty() && (r[0] == '-' || r[0] == '+');
  if (sign) r.remove_prefix(1);
  for (const char* word : {".inf", ".Inf", ".INF", ".nan", ".NaN", ".NAN"}) {
    if (r == word && (!sign || word[1] == 'i' || word[1] == 'I')) return {ScalarKind::real};
  }
  const auto exponent = [](std::string_view& t) {  // PyYAML needs a sign in the exponent
    if (t.empty()) return true;
    if (t[0] != 'e' && t[0] != 'E') return false;
    t.remove_prefix(1);
    if (t.empty() || (t[0] != '-' && t[0] != '+')) return false;
    t.remove_prefix(1);
    return take(t, digit) > 0 && t.empty();
  };
  const bool underscore = s.find('_') != std::string_view::npos;
  if (r.empty()) return {};
  if (r[0] == '.') {
    r.remove_prefix(1);
    if (sign || r.empty() || !digit(r[0])) return {};
    take(r, digit_or_underscore);
    return exponent(r) ? Resolved{ScalarKind::real, !underscore} : Resolved{};
  }
  if (!digit(r[0])) return {};
  if (r.size() > 2 && r[0] == '0' && (r[1] == 'b' || r[1] == 'x')) {
    const bool hex = r[1] == 'x';
    r.remove_prefix(2);
    take(r, [&](char c) {
      return c == '_' || (hex ? digit(c) || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F') : c == '0' || c == '1');
    });
    return r.empty() ? Resolved{ScalarKind::integer, false} : Resolved{};
  }
  const std::string_view whole = r.substr(
      0, r.size() - [&] {
        std::string_view t = r;
        take(t, digit_or_underscore);
        return t.size();
      }());
  r.remove_prefix(whole.size());
  if (!r.empty() && r[0] == ':') {
    if (!take_sexagesimal(r)) return {};
    if (r.empty()) return whole[0] != '0' ? Resolved{ScalarKind::integer, false} : Resolved{};
    if (r[0] != '.') return {};
    r.remove_prefix(1);
    take(r, digit_or_underscore);
    return r.empty() ? Resolved{ScalarKind::real, false} : Resolved{};
  }
  if (r.empty()) {
    if (whole[0] != '0' || whole.size() == 1) return {ScalarKind::integer, !underscore};
    const bool octal =
        std::all_of(whole.begin(), whole.end(), [](char c) { return (c >= '0' && c <= '7') || c == '_'; });
    return octal ? Resolved{ScalarKind::integer, false} : Resolved{};
  }
  if (r[0] != '.') return {};
  r.remove_prefix(1);
  take(r, digit_or_underscore);
  return exponent(r) ? Resolved{ScalarKind::real, !underscore} : Resolved{};
}

/// Whether a whole number fits into the 32 bits with which XML-RPC, and so roslaunch, passes it on.
bool fits_xml_rpc(std::string_view decimal) {
  if (decimal[0] == '+') decimal.remove_prefix(1);
  return files::number<std::int32_t>(decimal).has_value();
}

/// Checks and counts what the parser finds, before a tree is made of it.
class Inspector final : public YAML::EventHandler {
 public:
  explicit Inspector(bool roslaunch_reads_it) : roslaunch_reads_it_(roslaunch_reads_it) {}

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (++documents_ > 1) refuse(mark, "", "a second YAML document begins here", "one document, without a line ---");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { leaf(mark, anchor); }

  void OnAnchor(const YAML::Mark& mark, const std::string& name) override {
    if (!names_.insert(name).second)
      refuse(mark, "", "a second anchor of this name, which roslaunch refuses", "each &name once");
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto known = anchors_.find(anchor);
    if (known == anchors_.end())
      refuse(mark, "", "an alias inside the value that it stands for",
             "anchors (&name) that end before their aliases (*name)");
    add(mark, known->second.nodes, known->second.levels);
    item();
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    check_tag(mark, tag, value);
    const bool key = next_is_key();
    if (roslaunch_reads_it_ && tag == "?" && !(key && value == "<<")) {
      if (const std::string other = other_reading(value); !other.empty()) {
        refuse(mark, value, "roslaunch (YAML 1.1) would read this as " + other,
               "\"" + value + "\" in quotes, or write it in another way");
      }
    }
    leaf(mark, anchor);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    begin(mark, tag, anchor, false);
  }
  void OnSequenceEnd() override { end(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    begin(mark, tag, anchor, true);
  }
  void OnMapEnd() override { end(); }

 private:
  struct Size {
    std::size_t nodes, levels;
  };
  struct Frame {
    YAML::anchor_t anchor;
    std::size_t nodes_before, deepest;
    bool map, at_value;
  };

  static void check_tag(const YAML::Mark& mark, const std::string& tag, const std::string& value) {
    if (tag != "?" && tag != "!" && !tag.empty())
      refuse(mark, value, "a tag (" + tag + ")", "plain YAML without !tags");
  }

  bool next_is_key() const { return !open_.empty() && open_.back().map && !open_.back().at_value; }
  void item() {
    if (!open_.empty()) open_.back().at_value = !open_.back().at_value;
  }

  /// Counts nodes that reach `levels` levels below the place where the parser is.
  void add(const YAML::Mark& mark, std::size_t nodes, std::size_t levels) {
    nodes_ += nodes;
    if (nodes_ > kYamlNodesMax)
      refuse(mark, "", "too many values", fmt::format("at most {}, with aliases expanded", kYamlNodesMax));
    const std::size_t level = open_.size() + levels;
    if (level > kYamlDepthMax)
      refuse(mark, "", "nested too deeply", fmt::format("at most {} levels, with aliases expanded", kYamlDepthMax));
    if (!open_.empty()) open_.back().deepest = std::max(open_.back().deepest, level);
  }

  void leaf(const YAML::Mark& mark, YAML::anchor_t anchor) {
    add(mark, 1, 1);
    if (anchor != 0) anchors_[anchor] = {1, 1};
    item();
  }

  void begin(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, bool map) {
    if (tag == "!") refuse(mark, "", "a tag (!)", "plain YAML without !tags");
    check_tag(mark, tag, "");
    add(mark, 1, 1);
    open_.push_back({anchor, nodes_ - 1, open_.size() + 1, map, false});
  }

  void end() {
    const Frame f = open_.back();
    open_.pop_back();
    if (f.anchor != 0) anchors_[f.anchor] = {nodes_ - f.nodes_before, f.deepest - open_.size()};
    if (!open_.empty()) open_.back().deepest = std::max(open_.back().deepest, f.deepest);
    item();
  }

  const bool roslaunch_reads_it_;
  int documents_ = 0;
  std::size_t nodes_ = 0;
  std::vector<Frame> open_;
  std::map<YAML::anchor_t, Size> anchors_;
  std::set<std::string> names_;  // names of anchors
};

/// Refuses characters that PyYAML refuses or reads as the end of a line.
void check_characters(std::string_view text) {
  int line = 1;
  bool comment = false, space = true;
  if (text.substr(0, 3) == "\xef\xbb\xbf") text.remove_prefix(3);
  while (!text.empty()) {
    const files::Character c = files::first_character(text);
    if (!c.valid)
      throw YamlMistake{line, "", fmt::format("a byte that is not UTF-8 (0x{:02x})", static_cast<unsigned>(c.code)),
                        "text in UTF-8"};
    if (c.code == '\t' && !comment) throw YamlMistake{line, "", "a tab", "spaces; in quotes \\t"};
    if (files::is_control(c.code) && c.code != '\n' && c.code != '\r' && c.code != '\t') {
      throw YamlMistake{line, "", fmt::format("a control character (U+{:04X})", static_cast<unsigned>(c.code)),
                        "printable characters; in quotes \\x.."};
    }
    if (c.code == '#' && space) comment = true;
    space = c.code == ' ' || c.code == '\t';
    if (c.code == '\n') {
      ++line;
      comment = false;
      space = true;
    }
    text.remove_prefix(c.bytes);
  }
}

bool is_merge_key(const YAML::Node& key) { return key.IsScalar() && key.Tag() == "?" && key.Scalar() == "<<"; }

/// Copies the keys of the groups that merge keys (<<) name into the group that has the merge key. Own keys win, then
/// those of the first group named. A node that several places share is treated when it is first met.
void resolve_merges(YAML::Node node) {
  if (node.IsSequence()) {
    for (YAML::Node item : node) resolve_merges(item);
  }
  if (!node.IsMap()) return;
  for (const auto& item : node) resolve_merges(item.second);

  std::set<std::string> own;
  std::vector<YAML::Node> merge_keys;
  YAML::Node sources;
  for (const auto& item : node) {
    if (is_merge_key(item.first)) {
      merge_keys.push_back(item.first);
      sources.reset(item.second);
    } else if (item.first.IsScalar()) {
      own.insert(item.first.Scalar());
    }
  }
  if (merge_keys.empty()) return;
  if (merge_keys.size() > 1) refuse(merge_keys[1].Mark(), "<<", "key given twice", "once: <<: [*one, *other]");
  const auto merge = [&](const YAML::Node& source) {
    if (!source.IsMap())
      refuse(merge_keys[0].Mark(), "<<", "can merge only groups of keys", "<<: *name or <<: [*one, *other]");
    std::vector<std::pair<YAML::Node, YAML::Node>> added;
    for (const auto& item : source) {
      if (item.first.IsScalar() && own.insert(item.first.Scalar()).second) added.emplace_back(item.first, item.second);
    }
    for (const auto& [key, value] : added) node.force_insert(key, value);
  };
  if (sources.IsSequence()) {
    for (const auto& source : sources) merge(source);
  } else {
    merge(sources);
  }
  node.remove(merge_keys[0]);
}

}  // namespace

std::string other_reading(const std::string& plain) {
  const Resolved r = resolve(plain);
  switch (r.kind) {
    case ScalarKind::text:
    case ScalarKind::real: return r.plain_decimal ? "" : "another number: underscores and colons count there";
    case ScalarKind::truth:
      if (plain == "true" || plain == "false") return "";
      return "a truth value";
    case ScalarKind::integer:
      if (!r.plain_decimal) return "another number: 010 is octal there, 0x1f, 1_000 and 1:30 are numbers";
      if (plain == "-0") return "0";
      return fits_xml_rpc(plain)
                 ? ""
                 : "a whole number that is too large: above 2147483647 it needs a decimal point or quotes";
    case ScalarKind::date: return "a date";
    case ScalarKind::value: return "no value";
    case ScalarKind::merge: return "a merge key, not a value";
    case ScalarKind::angle: return "an angle, computed in radians: write \"5 deg\"";
  }
  return "";
}

bool rewritten_number(const std::string& plain) {
  const Resolved r = resolve(plain);
  return r.kind == ScalarKind::real || (r.kind == ScalarKind::integer && plain[0] == '+');
}

YAML::Node parse_yaml(const std::string& text, bool roslaunch_reads_it) {
  if (text.size() > kYamlBytesMax) {
    throw YamlMistake{0, "", fmt::format("{} bytes long", text.size()), fmt::format("at most {} bytes", kYamlBytesMax)};
  }
  check_characters(text);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    Inspector inspector(roslaunch_reads_it);
    while (parser.HandleNextDocument(inspector)) {
    }
    YAML::Node root = YAML::Load(text);
    resolve_merges(root);
    return root;
  } catch (const YAML::DeepRecursion& e) {
    refuse(e.mark, "", "nested too deeply", fmt::format("at most {} levels", kYamlDepthMax));
  } catch (const YAML::Exception& e) {
    refuse(e.mark, "", "not YAML: " + e.msg, "");
  }
}

}  // namespace train_derail::inputs
