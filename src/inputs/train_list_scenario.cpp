// A train list as a scenario, with what was assumed as comments.
#include <filesystem>
#include <map>
#include <optional>

#include <fmt/ranges.h>

#include "schema.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/train_list.hpp"
#include "train_derail/inputs/units.hpp"
#include "train_derail/inputs/writer.hpp"

namespace train_derail::inputs {

namespace {

/// Visitor of the schema that lists the values of a block.
class BlockLister {
 public:
  explicit BlockLister(std::vector<BlockEntry>& out) : out_(out) {}

  void text(const char* key, const std::string& value, const Doc& doc) { add(key, value, yaml_text(value), doc); }
  void number(const char* key, double value, const NumberInput& q, const Doc& doc) {
    const std::string shown =
        *q.shown != '\0' ? fmt::format("{:.9g} {}", from_si(value, q.unit, q.shown), q.shown) : number_text(value);
    add(key, number_text(value), shown, doc);
  }
  void number(const char* key, const std::optional<double>& value, const NumberInput& q, const Doc& doc) {
    if (value) number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range&, bool, const Doc& doc) {
    add(key, fmt::format("{}", value), fmt::format("{}", value), doc);
  }
  template <class E, class N>
  void choice(const char* key, E value, const N& names, const Doc& doc) {
    add(key, name_of(names, value), name_of(names, value), doc);
  }

 private:
  // Keys that act with some laws only are left out at their default, which is what an optional key of them has too.
  void add(const char* key, std::string si, std::string shown, const Doc& doc) {
    if (doc.when != nullptr && si == default_of(key)) return;
    out_.push_back({key, std::move(si), std::move(shown)});
  }
  static std::string default_of(std::string_view key) {
    for (const KeyValue& v : defaults()) {
      if (key == v.key.substr(v.key.find('.') + 1)) return v.value;
    }
    return "";
  }
  /// Of a block, with a key "consist[0].count" each.
  static const std::vector<KeyValue>& defaults() {
    static const std::vector<KeyValue> all = [] {
      Scenario one;
      one.consist.emplace_back();
      std::vector<KeyValue> of_block;
      for (KeyValue& v : key_values(one)) {
        if (v.key.compare(0, 11, "consist[0].") == 0) of_block.push_back(std::move(v));
      }
      return of_block;
    }();
    return all;
  }

  std::vector<BlockEntry>& out_;
};

/// A line of YAML with its comment.
std::string line(const std::string& text, const std::string& comment) {
  if (comment.empty()) return text + "\n";
  constexpr std::size_t kColumnOfComments = 35;
  return fmt::format("{:<{}}# {}\n", text + " ", kColumnOfComments, files::printable(comment));
}

}  // namespace

std::vector<BlockEntry> entries(const CarBlock& block) {
  std::vector<BlockEntry> all;
  BlockLister lister(all);
  describe_block(lister, block);
  return all;
}

std::string to_scenario(TrainList& train, const std::string& source, const std::string& base) {
  int cars = 0;
  double weight = 0.0, length = 0.0;
  for (const TrainList::Block& b : train.blocks) {
    cars += b.cars.count;
    weight += b.cars.count * b.cars.weight;
    length += b.cars.count * b.cars.length;
  }
  std::string motion;
  if (base.empty()) {
    motion = "initial:\n" + line("  speed: 40 mph", "assumed") + line("  yaw_rate: 0.2 rad/s", "assumed: the paper's");
    train.assumptions.emplace_back("initial.speed 40 mph and initial.yaw_rate 0.2 rad/s: not in a train list");
    train.assumptions.emplace_back("all other keys: the defaults, the paper's model (derail keys); or give --base");
  } else {
    train.assumptions.emplace_back("all but the cars, as the speed and the car that derails first: of " + base);
  }
  const std::string name = std::filesystem::path(source).filename().string();
  std::string out = fmt::format("# From {} by `derail import consist`.\n#\n# Assumed:\n", files::printable(name));
  for (const std::string& a : train.assumptions) out += "# - " + files::printable(a) + "\n";
  out += "\n";
  if (!base.empty()) out += "base: " + yaml_text(base) + "\n\n";
  out += fmt::format("title: \"Train of {} car{}, {:.0f} kip\"\n\n", cars, cars == 1 ? "" : "s", weight / kKip);
  out +=
      fmt::format("# {} blocks; {:.0f} ft between the pins in all.\nconsist:\n", train.blocks.size(), length / kFoot);
  constexpr const char* kOfType = "of the type";
  for (const TrainList::Block& b : train.blocks) {
    const CarBlock& c = b.cars;
    std::string what =
        c.count == 1 ? fmt::format("car {}", b.first) : fmt::format("cars {} to {}", b.first, b.first + c.count - 1);
    what += ": " + b.type;
    const std::map<std::string_view, std::string> comments{
        {"name", what},
        {"count", b.hazmat.empty() ? "" : fmt::format("hazardous material: {}", fmt::join(b.hazmat, ", "))},
        {"length", b.length_of_type ? kOfType : ""},
        {"weight", b.weight_of_type ? kOfType : ""}};
    const char* before = "  - ";
    for (const BlockEntry& entry : entries(c)) {
      const auto comment = comments.find(entry.key);
      out += line(fmt::format("{}{}: {}", before, entry.key, entry.shown),
                  comment == comments.end() ? kOfType : comment->second);
      before = "    ";
    }
  }
  if (const CouplerType* c = train.coupler) {
    out += "\n" + line("coupler:", fmt::format("{} on all cars; acts with model: spatial", c->name));
    const auto angle = [](double v) { return v == kInfinity ? ".inf" : fmt::format("{:.9g} deg", v / kDegree); };
    if (c->pitch_limit) out += "  pitch_limit: " + angle(*c->pitch_limit) + "\n";
    if (c->slip_height)
      out +=
          "  slip_height: " + (*c->slip_height == kInfinity ? ".inf" : fmt::format("{:.9g} m", *c->slip_height)) + "\n";
    if (c->vertical_hold) {
      out += "  vertical_hold: " +
             (*c->vertical_hold == kInfinity ? ".inf" : fmt::format("{:.9g} kip", *c->vertical_hold / kKip)) + "\n";
    }
    if (c->roll_limit) out += "  roll_limit: " + angle(*c->roll_limit) + "\n";
  }
  return motion.empty() ? out : out + "\n" + motion;
}

}  // namespace train_derail::inputs
