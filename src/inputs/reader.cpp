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

#include "checker.hpp"
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
    throw InputError(kOverride, o.key, o.value, "not a valid key", "names joined by '.', list items as [0], [1], ...");
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

/// Notes in `sources` which groups are there only since then.
void apply(YAML::Node& root, const Override& o, std::map<std::string, std::string>& sources) {
  YAML::Node value;
  try {
    value = parse_yaml(o.value, false);
  } catch (const YamlMistake& m) {
    throw InputError(kOverride, o.key, o.value, m.problem, m.allowed);
  }
  if (value.IsScalar()) value.SetTag("!");  // as if it were in quotes, because PyYAML does not read overrides
  const std::vector<Step> steps = split(o);
  std::string path;
  YAML::Node node;
  node.reset(root);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const Step& step = steps[i];
    const bool last = i + 1 == steps.size();
    if (step.index >= 0) path += fmt::format("[{}]", step.index);
    else path += (path.empty() ? "" : ".") + step.name;
    if (step.index >= 0) {
      if (!node.IsSequence() || static_cast<std::size_t>(step.index) >= node.size()) {
        throw InputError(kOverride, o.key, o.value, fmt::format("there is no item [{}]", step.index),
                         node.IsSequence() ? fmt::format("[0] to [{}]", node.size() - 1) : "not a list");
      }
      if (last) node[step.index] = value;
      else node.reset(node[step.index]);
    } else {
      if (!node.IsMap() && !node.IsNull()) {
        throw InputError(kOverride, o.key, o.value, fmt::format("'{}' is not inside a group", step.name), "");
      }
      if (last) {
        node[step.name] = value;
      } else {
        if (!node[step.name]) {
          node[step.name] = YAML::Node(YAML::NodeType::Map);
          sources[path] = kOverride;
        }
        node.reset(node[step.name]);
      }
    }
  }
}

}  // namespace

Override parse_override(std::string_view text) {
  const auto equals = text.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    throw InputError(kOverride, "", std::string(text), "not of the form key=value",
                     "key=value, as in \"initial.speed=50 mph\"");
  }
  return {std::string(files::trimmed(text.substr(0, equals))), std::string(files::trimmed(text.substr(equals + 1)))};
}

namespace {

/// The path of a file that another one in `folder` names.
std::string beside(const std::string& folder, const std::string& name) {
  return (std::filesystem::path(folder) / name).lexically_normal().string();
}

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
      s = within(s->first, key) ? sources.erase(s) : std::next(s);
    }
    sources[key] = source;
  }
}

/// The files that a train list is made of.
struct TrainListFiles {
  std::string file, types;
};

template <class V, class F>
void describe_train_list_files(V& v, F& f) {
  v.text("file", f.file, "");
  v.text("types", f.types, "");
}

/// Tells `before_reading` which files the key `consist` names, as far as it can be understood.
void announce_train_list(const YAML::Node& tree, const std::string& folder,
                         const std::function<void(const std::string&)>& before_reading) {
  const YAML::Node consist = tree.IsMap() ? tree["consist"] : YAML::Node(YAML::NodeType::Undefined);
  if (!before_reading || !consist || !consist.IsMap()) return;
  for (const auto& item : consist) {
    if (item.second.IsScalar()) before_reading(beside(folder, item.second.Scalar()));
  }
}

/// The blocks that a train list has become, as a tree: as if they were written in quotes.
YAML::Node blocks_of(const TrainList& train) {
  YAML::Node blocks(YAML::NodeType::Sequence);
  for (const TrainList::Block& b : train.blocks) {
    YAML::Node block(YAML::NodeType::Map);
    for (const BlockEntry& entry : entries(b.cars)) {
      block[entry.key] = entry.si;
      block[entry.key].SetTag("!");
    }
    blocks.push_back(block);
  }
  return blocks;
}

}  // namespace

double coupler_length(const Layers& layers, const std::string& source, const std::vector<Override>& overrides) {
  const YAML::Node group = layers.tree.IsMap() ? layers.tree["coupler"] : YAML::Node(YAML::NodeType::Undefined);
  Coupler coupler;
  if (!group) return coupler.length;
  KeyPlaces places;
  TreeReader reader(group, "coupler.", source, overrides, places, layers.sources);
  describe_coupler(reader, coupler);
  reader.finish();
  check_at(places, source, [&] {
    Checker checker("coupler.");
    describe_coupler(checker, coupler);
  });
  return coupler.length;
}

namespace {

/// Returns the tree with the blocks of the train list that its key `consist` names. `assumed` takes what was assumed.
YAML::Node with_consist(const Layers& layers, const std::string& source, const std::vector<Override>& overrides,
                        std::vector<std::string>& assumed) {
  const YAML::Node consist = layers.tree["consist"];
  TrainListFiles files;
  KeyPlaces places;
  const std::vector<Override> none;  // those of the blocks come when there are blocks
  TreeReader reader(consist, "consist.", source, none, places, layers.sources);
  describe_train_list_files(reader, files);
  reader.finish();
  if (files.file.empty()) {
    throw InputError(reader.where("consist", consist), "consist.file", "", "no file of a train list",
                     "a list of blocks, or {file: TRAIN.csv, types: TYPES.yaml}");
  }
  const CarTypes own = files.types.empty() ? CarTypes() : car_types(beside(layers.consist_folder, files.types));
  const TrainList train =
      read_train_list(beside(layers.consist_folder, files.file), files.types.empty() ? car_types() : own,
                      coupler_length(layers, source, overrides));
  assumed = train.assumptions;
  if (train.coupler != nullptr)
    assumed.emplace_back("couplers: those of the group coupler, not those of the train list");
  YAML::Node copy(YAML::NodeType::Map);
  for (const auto& item : layers.tree)
    copy.force_insert(item.first, item.second.is(consist) ? blocks_of(train) : item.second);
  return copy;
}

/// Completes a tree by its bases, see layers(). `chain`: paths of the files that have led here, links followed.
Layers layers_of(const YAML::Node& tree, const std::string& source, const std::string& folder,
                 const std::function<void(const std::string&)>& before_reading, std::vector<std::string> chain) {
  namespace fs = std::filesystem;
  const YAML::Node base = tree.IsMap() ? tree["base"] : YAML::Node(YAML::NodeType::Undefined);
  announce_train_list(tree, folder, before_reading);
  if (!base) return {tree, {}, folder};
  const auto refuse = [&](const std::string& problem, const std::string& allowed) {
    throw InputError(located(source, base.Mark()), "base", written(base), problem, allowed);
  };
  if (!base.IsScalar() || base.Scalar().empty())
    refuse("not the name of a file", "a scenario file, relative to this one");
  const std::string path = beside(folder, base.Scalar());
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
  if (tree["consist"]) all.consist_folder = folder;
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

/// Returns the whole tree: with overrides, and with the blocks of a train list. `assumed` takes what was assumed.
Layers whole(const Layers& written_layers, const std::string& source, const std::vector<Override>& overrides,
             std::vector<std::string>& assumed) {
  // Copied only if needed, because a copy loses the line numbers.
  Layers layers = written_layers;
  if (!overrides.empty()) layers.tree.reset(YAML::Clone(written_layers.tree));
  YAML::Node root = layers.tree;
  if (!overrides.empty() && !root.IsMap())
    throw InputError(source, "", written(root), "not a group of keys", "key: value lines");
  // Those of the blocks come when there are blocks.
  const auto of_consist = [](const Override& o) { return o.key.compare(0, 7, "consist") == 0; };
  for (const Override& o : overrides) {
    if (!of_consist(o)) apply(root, o, layers.sources);
  }
  const YAML::Node consist = root.IsMap() ? static_cast<const YAML::Node&>(root)["consist"] : YAML::Node();
  if (consist && consist.IsMap()) root.reset(with_consist(layers, source, overrides, assumed));
  for (const Override& o : overrides) {
    if (of_consist(o)) apply(root, o, layers.sources);
  }
  layers.tree.reset(root);
  return layers;
}

}  // namespace

Scenario read_scenario(const Layers& layers, const std::string& source, const std::vector<Override>& overrides) {
  Scenario scenario;
  const Layers all = whole(layers, source, overrides, scenario.assumptions);
  KeyPlaces places;
  TreeReader reader(all.tree, "", source, overrides, places, all.sources);
  describe(reader, scenario);
  reader.finish();
  check_at(places, source, [&] { validate(scenario); });
  return scenario;
}

namespace {

[[noreturn]] void refuse_file(const std::string& path, const std::string& problem, const std::string& allowed) {
  throw InputError(path, "", "", "cannot be read: " + problem, allowed);
}

void require_plain(const std::string& path, const struct stat& status) {
  if (S_ISREG(status.st_mode)) return;
  refuse_file(path,
              S_ISDIR(status.st_mode)    ? "a folder"
              : S_ISFIFO(status.st_mode) ? "a pipe"
              : S_ISSOCK(status.st_mode) ? "a socket"
                                         : "a device",
              "a file");
}

}  // namespace

void require_file(const std::string& path) {
  struct stat status {};
  if (::stat(path.c_str(), &status) != 0) refuse_file(path, error_text(errno), "");
  require_plain(path, status);
}

std::string read_file(const std::string& path, std::size_t bytes_max) {
  // Looked at before opening: opening a pipe would wait for a writer, and opening some devices starts an action.
  require_file(path);
  struct stat status {};
  struct Descriptor {
    int number;
    ~Descriptor() {
      if (number >= 0) ::close(number);
    }
  } const file{::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)};
  if (file.number < 0 || ::fstat(file.number, &status) != 0) refuse_file(path, error_text(errno), "");
  require_plain(path, status);  // another file may have taken its place since
  const auto too_long = [&] {
    return InputError(path, "", "", "file too long", fmt::format("at most {} bytes", bytes_max));
  };
  if (static_cast<std::uintmax_t>(status.st_size) > bytes_max) throw too_long();
  std::string text;
  std::vector<char> block(std::size_t{64} * 1024);
  for (;;) {
    const ssize_t got = ::read(file.number, block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) refuse_file(path, error_text(errno), "");
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
