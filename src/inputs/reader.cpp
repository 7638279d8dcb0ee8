#include "train_derail/inputs/reader.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <iterator>
#include <set>
#include <system_error>

#include <fmt/ranges.h>

#include "schema.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/train_list.hpp"
#include "train_derail/inputs/units.hpp"
#include "tree_reader.hpp"
#include "yaml.hpp"

namespace train_derail::inputs {

namespace {

std::string error_text(int number) { return std::generic_category().message(number); }

/// A step of a key: "consist[0].count" has the steps consist, 0, count.
struct Step {
  std::string name;
  int index = -1;  // index in a list; -1: the step is a name
};

std::vector<Step> split(const Override& o) {
  const auto bad = [&] {
    throw InputError("override", o.key, o.value, "not a valid key", "names joined by '.', list items as [0], [1], ...");
  };
  std::vector<Step> steps;
  std::string_view rest = o.key;
  bool name_next = true;
  while (!rest.empty()) {
    if (rest.front() == '[') {
      const auto close = rest.find(']');
      Step step;
      if (name_next || close == std::string_view::npos) bad();
      const auto [end, error] = std::from_chars(rest.data() + 1, rest.data() + close, step.index);
      if (error != std::errc() || end != rest.data() + close || step.index < 0) bad();
      steps.push_back(step);
      rest.remove_prefix(close + 1);
    } else {
      if (!name_next) {
        if (rest.front() != '.') bad();
        rest.remove_prefix(1);
      }
      const auto end = std::min(rest.find_first_of(".["), rest.size());
      if (end == 0) bad();
      steps.push_back({std::string(rest.substr(0, end)), -1});
      rest.remove_prefix(end);
    }
    name_next = false;
  }
  if (steps.empty()) bad();
  return steps;
}

void apply(YAML::Node& root, const Override& o) {
  YAML::Node value;
  try {
    value = parse_yaml(o.value, false);
  } catch (const YamlMistake& m) {
    throw InputError("override", o.key, o.value, m.problem, m.allowed);
  }
  if (value.IsScalar()) value.SetTag("!");  // as if it were in quotes, because PyYAML does not read overrides
  const std::vector<Step> steps = split(o);
  YAML::Node node;
  node.reset(root);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const bool last = i + 1 == steps.size();
    if (step.index >= 0) {
      if (!node.IsSequence() || static_cast<std::size_t>(step.index) >= node.size()) {
        throw InputError("override", o.key, o.value, fmt::format("there is no item [{}]", step.index),
                         node.IsSequence() ? fmt::format("[0] to [{}]", node.size() - 1) : "not a list");
      }
      if (last) node[step.index] = value;
      else node.reset(node[step.index]);
    } else {
      if (!node.IsMap() && !node.IsNull()) {
        throw InputError("override", o.key, o.value, fmt::format("'{}' is not inside a group", step.name), "");
      }
      if (last) {
        node[step.name] = value;
      } else {
        if (!node[step.name]) node[step.name] = YAML::Node(YAML::NodeType::Map);
        node.reset(node[step.name]);
      }
    }
  }
}

}  // namespace

Override parse_override(std::string_view text) {
  const auto equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw InputError("override", "", std::string(text), "not of the form key=value",
                     "key=value, as in \"initial.speed=50 mph\"");
  }
  const auto trim = [](std::string_view s) {
    const auto first = s.find_first_not_of(" \t");
    if (first == std::string_view::npos) return std::string();
    return std::string(s.substr(first, s.find_last_not_of(" \t") - first + 1));
  };
  return {trim(text.substr(0, equals)), trim(text.substr(equals + 1))};
}

namespace {

/// Lays the values of `over` over those of `under`, and records in `sources` from which file each value comes.
void lay_over(YAML::Node under, const YAML::Node& over, const std::string& prefix, const std::string& source,
              std::map<std::string, std::string>& sources) {
  std::set<std::string> seen;
  for (const auto& item : over) {
    const std::string name = written(item.first), key = prefix.empty() ? name : prefix + "." + name;
    if (!seen.insert(name).second) {
      throw InputError(located(source, item.first.Mark()), key, written(item.second), "key given twice", "once");
    }
    if (prefix.empty() && name == "base") continue;
    const YAML::Node below = static_cast<const YAML::Node&>(under)[name];
    // A train list is taken as a whole, as a list of blocks is.
    if (below && below.IsMap() && item.second.IsMap() && key != "consist") {
      lay_over(below, item.second, key, source, sources);
      continue;
    }
    under.remove(name);
    under.force_insert(item.first, item.second);  // keeps its line number
    for (auto s = sources.lower_bound(key); s != sources.end() && s->first.compare(0, key.size(), key) == 0;) {
      const bool inside = s->first.size() == key.size() || s->first[key.size()] == '.' || s->first[key.size()] == '[';
      s = inside ? sources.erase(s) : std::next(s);
    }
    sources[key] = source;
  }
}

/// Returns the tree with the files that `consist` names as seen from `folder`.
YAML::Node with_train_list(const YAML::Node& tree, const std::string& folder,
                           const std::function<void(const std::string&)>& before_reading) {
  const YAML::Node consist = tree.IsMap() ? tree["consist"] : YAML::Node(YAML::NodeType::Undefined);
  if (!consist || !consist.IsMap()) return tree;
  YAML::Node named(YAML::NodeType::Map), copy(YAML::NodeType::Map);
  for (const auto& item : consist) {
    if (!item.second.IsScalar()) return tree;  // refused when it is read
    if (const std::string key = item.first.Scalar(); key != "file" && key != "types") {
      named.force_insert(item.first, item.second);  // so is this
      continue;
    }
    const std::string path = (std::filesystem::path(folder) / item.second.Scalar()).lexically_normal().string();
    if (before_reading) before_reading(path);
    named.force_insert(item.first, YAML::Node(path));
  }
  for (const auto& item : tree) {
    // Nodes of the tree itself keep their line numbers.
    if (item.second.is(consist)) copy.force_insert(item.first, named);
    else copy.force_insert(item.first, item.second);
  }
  return copy;
}

}  // namespace

double coupler_length(const YAML::Node& tree) {
  const YAML::Node group = tree.IsMap() ? tree["coupler"] : YAML::Node(YAML::NodeType::Undefined);
  if (group && group.IsMap()) {
    if (const YAML::Node length = group["length"]; length && length.IsScalar()) {
      try {
        return to_si(length.Scalar(), "m");
      } catch (const std::invalid_argument&) {  // told when the group is read
      }
    }
  }
  return Coupler{}.length;
}

namespace {

/// Returns the tree with the blocks of the train list that its key `consist` names. `assumed`: takes what was
/// assumed, if given.
YAML::Node with_consist(const YAML::Node& root, const std::string& where, std::vector<std::string>* assumed) {
  constexpr const char* kAllowed = "a list of blocks, or {file: TRAIN.csv, types: TYPES.yaml}";
  const YAML::Node consist = root["consist"];
  std::string file, types;
  for (const auto& item : consist) {
    const std::string key = written(item.first);
    std::string* path = key == "file" ? &file : key == "types" ? &types : nullptr;
    if (path == nullptr || !item.second.IsScalar())
      throw InputError(located(where, item.first.Mark()), "consist." + key, written(item.second),
                       "no file of a train list", kAllowed);
    *path = item.second.Scalar();
  }
  if (file.empty()) throw InputError(where, "consist", written(consist), "no file of a train list", kAllowed);
  const CarTypes own = types.empty() ? CarTypes() : car_types(types);
  const TrainList train = read_train_list(file, types.empty() ? car_types() : own, coupler_length(root));
  YAML::Node blocks(YAML::NodeType::Sequence);
  for (const CarBlock& b : train.consist()) {
    YAML::Node block(YAML::NodeType::Map);
    const auto put = [&](const char* key, const std::string& value) {
      block[key] = value;
      block[key].SetTag("!");  // as if it were in quotes
    };
    const auto number = [&](const char* key, const std::optional<double>& value) {
      if (value) put(key, fmt::format("{}", *value));
    };
    put("name", b.name);
    put("count", fmt::format("{}", b.count));
    number("length", b.length);
    number("weight", b.weight);
    number("width", b.width);
    number("truck_spacing", b.truck_spacing);
    number("centre_height", b.centre_height);
    number("floor_height", b.floor_height);
    number("roof_height", b.roof_height);
    blocks.push_back(block);
  }
  if (assumed != nullptr) {
    *assumed = train.assumptions;
    if (train.coupler != nullptr)
      assumed->emplace_back("couplers: those of the group coupler, not those of the train list");
  }
  YAML::Node copy(YAML::NodeType::Map);
  for (const auto& item : root) copy.force_insert(item.first, item.second.is(consist) ? blocks : item.second);
  return copy;
}

/// Completes a tree by its bases, see layers(). `chain`: paths of the files that have led here, links followed.
Layers layers_of(const YAML::Node& written_tree, const std::string& source, const std::string& folder,
                 const std::function<void(const std::string&)>& before_reading, std::vector<std::string> chain) {
  namespace fs = std::filesystem;
  const YAML::Node base = written_tree.IsMap() ? written_tree["base"] : YAML::Node(YAML::NodeType::Undefined);
  const YAML::Node tree = with_train_list(written_tree, folder, before_reading);
  if (!base) return {tree, {}};
  const auto refuse = [&](const std::string& problem, const std::string& allowed) {
    throw InputError(located(source, base.Mark()), "base", written(base), problem, allowed);
  };
  if (!base.IsScalar() || base.Scalar().empty())
    refuse("not the name of a file", "a scenario file, relative to this one");
  const std::string path = (fs::path(folder) / base.Scalar()).lexically_normal().string();
  std::error_code ignored;
  const std::string resolved = fs::weakly_canonical(path, ignored).string();
  if (std::find(chain.begin(), chain.end(), resolved) != chain.end()) {
    refuse(fmt::format("the base files form a circle: {} -> {}", fmt::join(chain, " -> "), resolved),
           "a file that does not lead back to this one");
  }
  chain.push_back(resolved);
  if (chain.size() > kBasesMax + 1) {
    refuse(fmt::format("too many bases: {}", fmt::join(chain, " -> ")), fmt::format("at most {}", kBasesMax));
  }
  if (before_reading) before_reading(path);
  YAML::Node below;
  try {
    below = load_file(path);
  } catch (const InputError& e) {
    throw InputError(e.where(), e.key(), e.value(), fmt::format("{} (base of {})", e.problem(), source), e.allowed());
  }
  if (!below.IsMap()) refuse("not a scenario: no group of keys", "a scenario file, relative to this one");
  Layers all = layers_of(below, path, fs::path(path).parent_path().string(), before_reading, chain);
  all.sources.try_emplace("", path);
  lay_over(all.tree, tree, "", source, all.sources);
  return all;
}

}  // namespace

Layers layers(const YAML::Node& tree, const std::string& source, const std::string& folder,
              const std::function<void(const std::string&)>& before_reading) {
  std::error_code ignored;
  return layers_of(tree, source, folder, before_reading, {std::filesystem::weakly_canonical(source, ignored).string()});
}

Scenario read_scenario(const YAML::Node& tree, const std::string& source, const std::vector<Override>& overrides) {
  return read_scenario(layers(tree, source, std::filesystem::path(source).parent_path().string()), source, overrides);
}

namespace {

/// Returns the whole tree: with overrides, and with the blocks of a train list. `assumed`: as in with_consist().
YAML::Node whole(const Layers& layers, const std::string& source, const std::vector<Override>& overrides,
                 std::vector<std::string>* assumed) {
  // Copied only if needed, because a copy loses the line numbers.
  YAML::Node root = overrides.empty() ? layers.tree : YAML::Clone(layers.tree);
  if (!overrides.empty() && !root.IsMap())
    throw InputError(source, "", written(root), "not a group of keys", "key: value lines");
  // Those of the blocks come when there are blocks.
  const auto of_consist = [](const Override& o) { return o.key.compare(0, 7, "consist") == 0; };
  for (const Override& o : overrides) {
    if (!of_consist(o)) apply(root, o);
  }
  const YAML::Node consist = root.IsMap() ? static_cast<const YAML::Node&>(root)["consist"] : YAML::Node();
  if (consist && consist.IsMap()) {
    auto from = layers.sources.find("consist");
    if (from == layers.sources.end()) from = layers.sources.find("");
    root.reset(with_consist(root, from == layers.sources.end() ? source : from->second, assumed));
  }
  for (const Override& o : overrides) {
    if (of_consist(o)) apply(root, o);
  }
  return root;
}

}  // namespace

std::vector<std::string> assumptions(const std::string& path, const std::vector<Override>& overrides) {
  std::vector<std::string> assumed;
  whole(layers(load_file(path), path, std::filesystem::path(path).parent_path().string()), path, overrides, &assumed);
  return assumed;
}

Scenario read_scenario(const Layers& layers, const std::string& source, const std::vector<Override>& overrides) {
  const YAML::Node root = whole(layers, source, overrides, nullptr);
  Scenario scenario;
  KeyPlaces places;
  TreeReader reader(root, "", source, overrides, places, layers.sources);
  describe(reader, scenario);
  reader.finish();
  try {
    validate(scenario);
  } catch (const InputError& e) {
    const auto place = places.find(e.key());
    if (place == places.end()) throw InputError(source, e.key(), e.value(), e.problem(), e.allowed());
    throw InputError(place->second.where, e.key(), written(place->second.node), e.problem(), e.allowed());
  }
  return scenario;
}

std::string read_file(const std::string& path, std::size_t bytes_max) {
  const auto refuse = [&](const std::string& problem, const std::string& allowed) -> InputError {
    return {path, "", "", problem, allowed};
  };
  // Looked at before opening: opening a pipe would wait for a writer, and opening some devices starts an action.
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) throw refuse(std::string("cannot be read: ") + error_text(errno), "");
  const auto check = [&] {
    if (S_ISREG(status.st_mode)) return;
    const char* kind = S_ISDIR(status.st_mode)    ? "a folder"
                       : S_ISFIFO(status.st_mode) ? "a pipe"
                       : S_ISSOCK(status.st_mode) ? "a socket"
                                                  : "a device";
    throw refuse(std::string("cannot be read: ") + kind, "a file");
  };
  check();
  struct Descriptor {
    int number;
    ~Descriptor() {
      if (number >= 0) ::close(number);
    }
  } const file{::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)};
  if (file.number < 0 || ::fstat(file.number, &status) != 0)
    throw refuse(std::string("cannot be read: ") + error_text(errno), "");
  check();  // another file may have taken its place since
  const auto too_long = [&] { return refuse("file too long", fmt::format("at most {} bytes", bytes_max)); };
  if (static_cast<std::uintmax_t>(status.st_size) > bytes_max) throw too_long();
  std::string text;
  std::vector<char> block(std::size_t{64} * 1024);
  for (;;) {
    const ssize_t got = ::read(file.number, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) throw refuse(std::string("cannot be read: ") + error_text(errno), "");
    if (got == 0) return text;
    text.append(block.data(), static_cast<std::size_t>(got));
    if (text.size() > bytes_max) throw too_long();  // the file grows, or its size was not known before
  }
}

YAML::Node load_file(const std::string& path) { return load_text(read_file(path, kYamlBytesMax), path); }

YAML::Node load_text(const std::string& text, const std::string& source) {
  try {
    return parse_yaml(text, true);
  } catch (const YamlMistake& m) {
    throw InputError(m.line > 0 ? fmt::format("{}:{}", source, m.line) : source, "", m.value, m.problem, m.allowed);
  }
}

Scenario read_scenario_file(const std::string& path, const std::vector<Override>& overrides) {
  return read_scenario(load_file(path), path, overrides);
}

}  // namespace train_derail::inputs
