#include "train_derail/inputs/keys.hpp"

#include <cstring>

#include "schema.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::inputs {

namespace {

class Collector {
 public:
  Collector(std::vector<KeyValue>& out, std::string prefix, const Scenario& scenario, const When* idle = nullptr)
      : out_(out), prefix_(std::move(prefix)), scenario_(scenario), idle_(idle) {}

  void text(const char* key, const std::string& value, const Doc& doc) { add(key, value, "", "", false, doc); }
  void number(const char* key, double value, const NumberInput& q, const Doc& doc) {
    add(key, number_text(value), q.unit, q.shown, false, doc);
  }
  void number(const char* key, const std::optional<double>& value, const NumberInput& q, const Doc& doc) {
    if (value) number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range&, bool, const Doc& doc) {
    add(key, fmt::format("{}", value), "1", "", true, doc);
  }
  template <class E, class N>
  void choice(const char* key, E value, const N& names, const Doc& doc) {
    for (const auto& [name, choice] : names) {
      if (choice == value) add(key, std::string(name), "", "", false, doc);
    }
  }
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const Doc& doc) {
    Collector child(out_, prefix_ + key + ".", scenario_, idle_because(scenario_, idle_, doc));
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>& items, F describe_it, const Doc& doc, bool) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      Collector child(out_, fmt::format("{}{}[{}].", prefix_, key, i), scenario_, idle_because(scenario_, idle_, doc));
      describe_it(child, items[i]);
    }
  }

 private:
  void add(const char* key, std::string value, const char* unit, const char* shown, bool whole, const Doc& doc) {
    const When* idle = idle_because(scenario_, idle_, doc);
    out_.push_back({prefix_ + key, std::move(value), unit, shown, whole, doc.text, idle == nullptr ? "" : idle->text});
  }
  std::vector<KeyValue>& out_;
  const std::string prefix_;
  const Scenario& scenario_;
  const When* idle_;  // reason why the group does not act; null if it acts
};

/// Visitor of the schema that sets the value of one key.
class Setter {
 public:
  Setter(const Override& wanted, std::string prefix, bool& found)
      : wanted_(wanted), prefix_(std::move(prefix)), found_(found) {}

  void text(const char* key, std::string& value, const Doc&) {
    if (is(key)) value = wanted_.value;
  }
  template <class D>
  void number(const char* key, D& value, const NumberInput& q, const Doc&) {
    if (!is(key)) return;
    if (wanted_.value == ".inf") {
      value = kInfinity;
    } else {
      double parsed = 0.0;
      parse(parsed, "not a number", q.range.text(q.unit));
      value = parsed;
    }
  }
  template <class I>
  void integer(const char* key, I& value, const Range& range, bool, const Doc&) {
    if (is(key)) parse(value, "not a whole number", range.text("1"));
  }
  template <class E, class N>
  void choice(const char* key, E& value, const N& names, const Doc&) {
    if (!is(key)) return;
    std::string allowed;
    for (const auto& [name, choice] : names) {
      if (name == wanted_.value) {
        value = choice;
        return;
      }
      allowed += (allowed.empty() ? "" : ", ") + std::string(name);
    }
    throw InputError("scenario", wanted_.key, wanted_.value, "unknown choice", allowed);
  }
  template <class G, class F>
  void group(const char* key, G& g, F describe_it, const Doc&) {
    descend(prefix_ + key + ".", g, describe_it);
  }
  template <class G, class F>
  void list(const char* key, std::vector<G>& items, F describe_it, const Doc&, bool) {
    for (std::size_t i = 0; i < items.size(); ++i)
      descend(fmt::format("{}{}[{}].", prefix_, key, i), items[i], describe_it);
  }

 private:
  template <class G, class F>
  void descend(const std::string& prefix, G& g, F describe_it) {
    if (wanted_.key.compare(0, prefix.size(), prefix) != 0) return;
    Setter child(wanted_, prefix, found_);
    describe_it(child, g);
  }
  bool is(const char* key) {
    const bool match = wanted_.key.size() == prefix_.size() + std::strlen(key) &&
                       wanted_.key.compare(prefix_.size(), std::string::npos, key) == 0;
    found_ = found_ || match;
    return match;
  }
  template <class N>
  void parse(N& value, const char* problem, const std::string& allowed) {
    const std::string& text = wanted_.value;
    const auto parsed = files::number<N>(text);
    if (!parsed) throw InputError("scenario", wanted_.key, text, problem, allowed);
    value = *parsed;
  }

  const Override& wanted_;
  const std::string prefix_;
  bool& found_;
};

}  // namespace

Scenario with_values(Scenario base, const std::vector<Override>& values) {
  for (const Override& o : values) {
    bool found = false;
    Setter setter(o, "", found);
    describe(setter, base);
    if (!found) throw InputError("scenario", o.key, o.value, "unknown key", "");
  }
  validate(base);
  return base;
}

std::vector<KeyValue> key_values(const Scenario& scenario) {
  std::vector<KeyValue> out;
  Collector collector(out, "", scenario);
  describe(collector, scenario);
  return out;
}

KeyValue key_value(const Scenario& scenario, const std::string& key) {
  std::string keys;
  for (KeyValue& v : key_values(scenario)) {
    if (v.key == key) return v;
    keys += (keys.empty() ? "" : ", ") + v.key;
  }
  throw InputError("scenario", key, "", "unknown key, or it has no value", keys);
}

}  // namespace train_derail::inputs
