#include "train_derail/inputs/writer.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <set>

#include <nlohmann/json.hpp>

#include "schema.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/units.hpp"

namespace train_derail::inputs {

std::string yaml_text(const std::string& value) {
  return nlohmann::json(value).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

namespace {

class Writer {
 public:
  /// \param given  keys of optional numbers that are no comments; null: all
  Writer(std::string& out, std::string prefix, std::string indent, std::string first_indent,
         const std::set<std::string>* given)
      : out_(out),
        prefix_(std::move(prefix)),
        indent_(std::move(indent)),
        first_(std::move(first_indent)),
        given_(given) {}

  void text(const char* key, const std::string& value, const Doc&) { line(key, yaml_text(value)); }
  void number(const char* key, double value, const NumberInput& q, const Doc&) {
    std::string comment = std::string(q.unit) == "1" ? "" : q.unit;
    if (*q.shown != '\0' && std::isfinite(value)) {
      comment += fmt::format("; {:.6g} {}", from_si(value, q.unit, q.shown), q.shown);
    }
    line(key, number_text(value), comment);
  }
  void number(const char* key, const std::optional<double>& value, const NumberInput& q, const Doc& doc) {
    if (!value) return;
    const bool left_out = given_ != nullptr && given_->count(prefix_ + key) == 0;
    if (left_out) first_ += "# ";
    number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range&, bool, const Doc&) {
    const bool small =
        static_cast<std::int64_t>(value) <= std::numeric_limits<std::int32_t>::max();  // roslaunch reads no larger ones
    line(key, fmt::format(small ? "{}" : "\"{}\"", value));
  }
  template <class E, class N>
  void choice(const char* key, E value, const N& names, const Doc&) {
    for (const auto& [name, choice] : names) {
      if (choice == value) line(key, std::string(name));
    }
  }
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const Doc&) {
    line(key, "");
    Writer child(out_, prefix_ + key + ".", indent_ + "  ", indent_ + "  ", given_);
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>& items, F describe_it, const Doc&, bool) {
    line(key, items.empty() ? "[]" : "");
    for (std::size_t i = 0; i < items.size(); ++i) {
      Writer child(out_, fmt::format("{}{}[{}].", prefix_, key, i), indent_ + "    ", indent_ + "  - ", given_);
      describe_it(child, items[i]);
    }
  }

 private:
  void line(const char* key, const std::string& value, const std::string& comment = "") {
    out_ += fmt::format("{}{}:{}{}{}\n", first_, key, value.empty() ? "" : " ", value,
                        comment.empty() ? "" : "  # " + comment);
    first_ = indent_;
  }

  std::string& out_;
  std::string prefix_, indent_, first_;
  const std::set<std::string>* given_;
};

/// Returns the scenario with the default factors in blocks that give neither a value nor a factor.
Scenario with_defaults(Scenario s) {
  for (CarBlock& b : s.consist) {
    if (!b.truck_spacing && !b.truck_spacing_factor) b.truck_spacing_factor = CarBlock::kDefaultTruckSpacingFactor;
    if (!b.yaw_inertia && !b.yaw_inertia_factor) b.yaw_inertia_factor = CarBlock::kDefaultYawInertiaFactor;
  }
  return s;
}

class Lister {
 public:
  Lister(std::string& out, std::string prefix, const When* when = nullptr)
      : out_(out), prefix_(std::move(prefix)), when_(when) {}

  void text(const char* key, const std::string& value, const Doc& doc) { row(key, "text", yaml_text(value), doc); }
  void number(const char* key, double value, const NumberInput& q, const Doc& doc) {
    row(key, allowed(q), q.required ? "required" : number_text(value), doc);
  }
  void number(const char* key, const std::optional<double>& value, const NumberInput& q, const Doc& doc) {
    row(key, allowed(q), value ? number_text(*value) : "none", doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range& range, bool required, const Doc& doc) {
    row(key, "whole number, " + range.text("1"), required ? "required" : fmt::format("{}", value), doc);
  }
  template <class E, class N>
  void choice(const char* key, E value, const N& names, const Doc& doc) {
    std::string allowed, preset;
    for (const auto& [name, choice] : names) {
      allowed += (allowed.empty() ? "" : " | ") + std::string(name);
      if (choice == value) preset = name;
    }
    row(key, allowed, preset, doc);
  }
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const Doc& doc) {
    Lister child(out_, prefix_ + key + ".", doc.when);
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>&, F describe_it, const Doc&, bool) {
    Lister child(out_, fmt::format("{}{}[i].", prefix_, key), when_);
    const G defaults;
    describe_it(child, defaults);
  }

 private:
  static std::string allowed(const NumberInput& q) {
    const std::string all = q.range.text(q.unit);
    return q.usual.max == kInfinity ? all : all + "; usual: " + q.usual.text(q.unit);
  }
  void row(const char* key, const std::string& allowed, const std::string& preset, const Doc& doc) {
    out_ += fmt::format("{}\n    allowed: {}\n    default: {}\n    {}\n", prefix_ + key, allowed, preset, doc.text);
    // Only the condition of the key is written, if it has one: it includes the condition of its group.
    if (const When* when = doc.when != nullptr ? doc.when : when_)
      out_ += fmt::format("    acts with: {}\n", when->text);
  }
  std::string& out_;
  std::string prefix_;
  const When* when_;  // condition of the group; null if it always acts
};

}  // namespace

std::string to_yaml(const Scenario& scenario) {
  std::string out;
  Writer writer(out, "", "", "", nullptr);
  const Scenario full = with_defaults(scenario);
  describe(writer, full);
  return out;
}

std::string to_yaml(const Scenario& scenario, const Scenario& acting) {
  std::set<std::string> given;
  for (const KeyValue& v : key_values(with_defaults(scenario))) given.insert(v.key);
  std::string out;
  Writer writer(out, "", "", "", &given);
  const Scenario full = with_defaults(acting);
  describe(writer, full);
  return out;
}

std::string describe_keys() {
  std::string out;
  Lister lister(out, "");
  lister.text("base", "",
              {"A scenario file to start from, relative to this one: what this file leaves out is as it is "
               "there. Not for --set."});
  const Scenario defaults;
  describe(lister, defaults);
  return out;
}

}  // namespace train_derail::inputs
