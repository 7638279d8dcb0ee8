#include "train_derail/validation/plan.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "train_derail/inputs/error.hpp"

namespace train_derail::validation {

using inputs::InputError;

namespace {

constexpr double kShareTolerance = 1e-6;  // of shares that are written with few digits
constexpr double kSpeedExponentMax = 10.0;

std::int64_t members_of(const study::Study& study) {
  const bool sampled = study.plan == study::Plan::latin_hypercube;
  if (!sampled && !study.factors.empty()) {
    throw InputError("study", "plan", "", "every row needs a random sample of its own",
                     to_string(study::Plan::latin_hypercube));
  }
  if (study.engine != study::EngineChoice::purpose_built)
    throw InputError("study", "engine", to_string(study.engine), "knows no rails",
                     to_string(study::EngineChoice::purpose_built));
  for (const study::Factor& f : study.factors) {
    if (row_decides(f.key)) {
      throw InputError("study", "factors.key", f.key, "the rows of the table decide it", "any other key");
    }
  }
  return static_cast<std::int64_t>(sampled ? study.samples : 1) * study.replicates;
}

study::Study changed(study::Study study, const PlanChanges& changes) {
  if (changes.members > 0) {
    study.samples = changes.members;
    study.replicates = 1;
  }
  members_of(study);
  return changes.seeds_only ? seeds_only(std::move(study)) : study;
}

/// Reads a file of ways by cause.
class PlanReader {
 public:
  PlanReader(std::string path, const PlanChanges& changes) : path_(std::move(path)), changes_(changes) {}

  Plan read(const YAML::Node& root) { return root["base"] ? changed_base(root) : whole(root); }

 private:
  /// Ways of another file with other studies.
  Plan changed_base(const YAML::Node& root) {
    std::string title, base, fitted_on;
    std::map<std::string, std::string> studies;
    for (const auto& entry : root) {
      const std::string key = entry.first.as<std::string>("");
      if (key == "title" && entry.second.IsScalar()) title = entry.second.Scalar();
      else if (key == "base" && entry.second.IsScalar()) base = beside(entry.second);
      else if (key == "fitted_on" && entry.second.IsScalar()) fitted_on = beside(entry.second);
      else if (key == "studies" && entry.second.IsMap()) {
        for (const auto& study : entry.second) {
          if (!study.second.IsScalar())
            throw InputError(where(study.first), "studies", study.first.as<std::string>(""), "not a file of a study",
                             "the name of a way: a file");
          studies[study.first.as<std::string>("")] = beside(study.second);
        }
      } else {
        throw InputError(where(entry.first), key, "", "unknown key, or a value of the wrong kind",
                         "title, fitted_on: text, base: a file of ways, studies: a file for each of its ways");
      }
    }
    if (studies.empty()) throw InputError(path_, "studies", "", "empty", "a file of a study for each way of " + base);
    PlanReader reader(base, changes_);
    reader.studies_ = studies;
    Plan plan = reader.whole(inputs::load_file(base));
    for (const auto& [name, file] : studies) {
      const std::vector<const Way*> ways = plan.all_ways();
      if (std::none_of(ways.begin(), ways.end(), [&, n = name](const Way* w) { return w->name == n; }))
        throw InputError(path_, "studies", name, "no way of " + base, "a way that it has");
    }
    plan.rename(title);
    plan.source = path_;
    plan.fitted_on = fitted_on;
    return plan;
  }

  Plan whole(const YAML::Node& root) {
    std::string title, causes, fitted_on;
    YAML::Node groups;
    std::vector<ClassWay> classes;
    double counting = 0.0;
    for (const auto& entry : root) {
      const std::string key = entry.first.as<std::string>("");
      if (key == "title" && entry.second.IsScalar()) title = entry.second.Scalar();
      else if (key == "causes" && entry.second.IsScalar()) causes = beside(entry.second);
      else if (key == "fitted_on" && entry.second.IsScalar()) fitted_on = beside(entry.second);
      else if (key == "positions_counting_locomotives") counting = share(entry.first, entry.second, key);
      else if (key == "groups" && entry.second.IsMap()) groups = entry.second;
      else if (key == "classes" && entry.second.IsSequence()) classes = class_list(entry.second);
      else
        throw InputError(
            where(entry.first), key, "", "unknown key, or a value of the wrong kind",
            "title, causes, fitted_on: text, positions_counting_locomotives: a number, groups: ways by the name of a "
            "group, classes: a list of class and study");
    }
    if (causes.empty()) throw InputError(path_, "causes", "", "missing", "a file of causes by group");
    if (!groups.IsDefined() || groups.IsNull())
      throw InputError(path_, "groups", "", "missing", "ways by the name of a group");
    CauseGroups known = read_cause_groups(causes);
    std::map<std::string, std::vector<Way>> ways;
    for (const auto& entry : groups) {
      const std::string name = entry.first.as<std::string>("");
      const auto is_it = [&](const CauseGroups::Group& g) { return g.name == name; };
      if (std::none_of(known.groups.begin(), known.groups.end(), is_it)) {
        std::string names;
        for (const CauseGroups::Group& g : known.groups) names += (names.empty() ? "" : ", ") + g.name;
        throw InputError(where(entry.first), "groups." + name, "", "no group of " + causes, names);
      }
      ways[name] = list(entry.second, name);
    }
    Plan plan(std::move(title), std::move(known), std::move(ways), classes);
    plan.source = path_;
    plan.fitted_on = fitted_on;
    plan.positions_counting_locomotives = counting;
    return plan;
  }

  std::string where(const YAML::Node& node) const { return fmt::format("{}:{}", path_, node.Mark().line + 1); }
  std::string beside(const YAML::Node& node) const {
    return (std::filesystem::path(path_).parent_path() / node.Scalar()).string();
  }

  double share(const YAML::Node& at, const YAML::Node& node, const std::string& key) const {
    const double share = node.as<double>(NAN);
    if (!(share >= 0.0 && share <= 1.0))
      throw InputError(where(at), key, node.as<std::string>(""), "out of range", "0 to 1");
    return share;
  }

  double exponent(const YAML::Node& at, const YAML::Node& node, const std::string& key) const {
    const double exponent = node.as<double>(NAN);
    if (!(std::abs(exponent) <= kSpeedExponentMax))
      throw InputError(where(at), key, node.as<std::string>(""), "out of range",
                       fmt::format("-{0:g} to {0:g}", kSpeedExponentMax));
    return exponent;
  }

  /// A list of {class: file, study: file}.
  std::vector<ClassWay> class_list(const YAML::Node& node) {
    const std::string allowed = "a list of class: a file, study: a file";
    std::vector<ClassWay> found;
    for (const YAML::Node& item : node) {
      if (!item.IsMap() || item.size() != 2 || !item["class"] || !item["study"])
        throw InputError(where(item), "classes", "", "not a class and a study", allowed);
      if (!studies_.empty()) continue;  // a class has the study that it was made for, or none
      ClassWay c;
      c.of = read_fitted_class(beside(item["class"]));
      c.way.study =
          changed(study::read_study_file(beside(item["study"]), changes_.overrides, changes_.spread), changes_);
      c.way.name = std::filesystem::path(c.way.study.source).stem().string();
      found.push_back(std::move(c));
    }
    return found;
  }

  std::vector<Way> list(const YAML::Node& node, const std::string& group) {
    const std::string allowed = "a list of ways: name, share, speed_exponent, study";
    if (!node.IsSequence() || node.size() == 0)
      throw InputError(where(node), "groups." + group, "", "not a list", allowed);
    std::vector<Way> ways;
    double sum = 0.0;
    for (const YAML::Node& item : node) {
      ways.push_back(way(item, group, allowed));
      sum += ways.back().share;
    }
    if (std::abs(sum - 1.0) > kShareTolerance)
      throw InputError(where(node), "groups." + group, fmt::format("{:g}", sum), "the sum of the shares", "1");
    return ways;
  }
  Way way(const YAML::Node& node, const std::string& group, const std::string& allowed) {
    Way w;
    std::string file;
    if (!node.IsMap()) throw InputError(where(node), "groups." + group, "", "not a group of keys", allowed);
    for (const auto& entry : node) {
      const std::string key = entry.first.as<std::string>("");
      if (key == "name" && entry.second.IsScalar()) {
        w.name = entry.second.Scalar();
      } else if (key == "share") {
        w.share = share(entry.first, entry.second, "groups." + group + ".share");
      } else if (key == "speed_exponent") {
        w.speed_exponent = exponent(entry.first, entry.second, "groups." + group + ".speed_exponent");
      } else if (key == "study" && entry.second.IsScalar()) {
        file = beside(entry.second);
      } else {
        throw InputError(where(entry.first), "groups." + group + "." + key, "",
                         "unknown key, or a value of the wrong kind", allowed);
      }
    }
    if (file.empty()) throw InputError(where(node), "groups." + group + ".study", "", "missing", "a file of a study");
    if (w.name.empty()) w.name = std::filesystem::path(file).stem().string();
    if (!studies_.empty()) {
      const auto other = studies_.find(w.name);
      if (other == studies_.end())
        throw InputError(where(node), "studies." + w.name, "", "missing in the file that has this one as its base",
                         "a file of a study");
      file = other->second;
    }
    w.study = changed(study::read_study_file(file, changes_.overrides, changes_.spread), changes_);
    return w;
  }

  std::string path_;
  const PlanChanges& changes_;
  std::map<std::string, std::string> studies_;  // instead of those of the file, by the name of a way; empty: as there
};

/// A number from 0 to 1 that belongs to an accident and a purpose (1, 2, ...), the same for all its members.
double chance_of(const study::Study& study, const Accident& accident, std::int64_t purpose) {
  constexpr std::int64_t kStream = std::int64_t{1} << 40;  // beyond the numbers of runs and of samples of rows
  constexpr double kSeeds = 9007199254740992.0;
  const std::int64_t number = -purpose * kStream - static_cast<std::int64_t>(accident.line);
  return static_cast<double>(study::run_of(study, number).seed) / kSeeds;
}

}  // namespace

Plan::Plan(study::Study study) : source(study.source), fitted_on(study.fitted_on), title_(study.title) {
  Way way;
  way.study = std::move(study);
  ways_[""].push_back(std::move(way));
}

Plan::Plan(std::string title, CauseGroups causes, std::map<std::string, std::vector<Way>> ways,
           const std::vector<ClassWay>& classes)
    : title_(std::move(title)), causes_(std::move(causes)), ways_(std::move(ways)) {
  std::optional<std::int64_t> members;
  const auto check = [&](const Way& w) {
    const std::int64_t now = members_of(w.study);
    if (members && now != *members)
      throw InputError(w.study.source, "samples", fmt::format("{}", now), "members of a row differ from way to way",
                       fmt::format("{}, as elsewhere", *members));
    members = now;
  };
  for (const CauseGroups::Group& g : causes_.groups) {
    const auto found = ways_.find(g.name);
    if (found == ways_.end() || found->second.empty())
      throw InputError(causes_.path, "groups", g.name, "the plan has no way in which accidents of this group begin",
                       "one or more");
    for (const Way& w : found->second) check(w);
  }
  for (const ClassWay& c : classes) {
    check(c.way);
    classes_.push_back({c.of, {c.way}});
  }
}

std::string Plan::group_of(const Accident& accident) const {
  return by_cause() ? causes_.find(accident.cause).group->name : "";
}

const std::vector<Way>& Plan::ways_of(const Accident& accident) const {
  for (const ClassWays& c : classes_) {
    if (outside(c.of, accident).empty()) return c.ways;
  }
  return ways_of_group(group_of(accident));
}
std::vector<std::pair<std::string, const Way*>> Plan::class_ways() const {
  std::vector<std::pair<std::string, const Way*>> found;
  for (const ClassWays& c : classes_) found.emplace_back(c.of.path, &c.ways.front());
  return found;
}
const std::vector<Way>& Plan::ways_of_group(const std::string& group) const { return ways_.at(group); }

std::vector<double> Plan::shares_of(const Accident& accident) const {
  std::vector<double> shares;
  for (const Way& w : ways_of(accident))
    shares.push_back(w.share * std::pow(accident.speed_mph / kShareSpeed, w.speed_exponent));
  const double sum = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share /= sum;
  return shares;
}

const Way& Plan::way_of(const Accident& accident, std::int64_t member) const {
  const std::vector<Way>& ways = ways_of(accident);
  const auto members = static_cast<double>(members_of(ways.front().study));
  double place = chance_of(ways.front().study, accident, 1) + static_cast<double>(member) / members;
  place -= std::floor(place);
  const std::vector<double> shares = shares_of(accident);
  for (std::size_t i = 0; i < ways.size(); ++i) {
    if (place < shares[i]) return ways[i];
    place -= shares[i];
  }
  return ways.back();
}

Accident Plan::seen_by(const Accident& accident, std::int64_t member) const {
  Accident seen = accident;
  const bool of_class = std::any_of(classes_.begin(), classes_.end(),
                                    [&](const ClassWays& c) { return outside(c.of, accident).empty(); });
  if (positions_counting_locomotives == 0.0 || of_class) return seen;
  constexpr double kGolden = 0.6180339887498949;  // so that each way has its part of them
  double place = chance_of(first(), accident, 2) + kGolden * static_cast<double>(member);
  place -= std::floor(place);
  if (place >= positions_counting_locomotives) return seen;
  const int ahead = std::min(accident.head_end_locos, accident.first_car_position - 1);
  seen.first_car_position -= ahead;
  seen.cars_from_pod_to_rear += ahead;
  return seen;
}

std::vector<const Way*> Plan::all_ways() const {
  std::vector<const Way*> all;
  for (const auto& [name, ways] : ways_) {
    for (const Way& w : ways) all.push_back(&w);
  }
  for (const ClassWays& c : classes_) all.push_back(&c.ways.front());
  return all;
}

const study::Study& Plan::first() const { return all_ways().front()->study; }

std::vector<std::string> Plan::keys() const {
  std::vector<std::string> keys;
  for (const Way* w : all_ways()) {
    for (const study::Factor& f : w->study.factors) {
      if (std::find(keys.begin(), keys.end(), f.key) == keys.end()) keys.push_back(f.key);
    }
  }
  return keys;
}

Plan read_plan(const std::string& path, const PlanChanges& changes) {
  const YAML::Node root = inputs::load_file(path);
  if (root.IsMap() && (root["groups"] || root["studies"])) return PlanReader(path, changes).read(root);
  return changed(study::read_study_file(path, changes.overrides, changes.spread), changes);
}

study::Study seeds_only(study::Study study) {
  study.replicates = static_cast<int>(members_of(study));
  study.factors.clear();
  study.plan = study::Plan::grid;
  return study;
}

std::int64_t members_a_row(const Plan& plan) {
  for (const Way* w : plan.all_ways()) members_of(w->study);
  return members_of(plan.first());
}

}  // namespace train_derail::validation
