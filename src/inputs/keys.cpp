#include "train_derail/inputs/keys.hpp"

#include "schema.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::inputs {

namespace {

class Collector {
 public:
  Collector(std::vector<KeyValue>& out, std::string prefix) : out_(out), prefix_(std::move(prefix)) {}

  void text(const char* key, const std::string& value, const char* doc) { add(key, value, "", "", doc); }
  void number(const char* key, double value, const Quantity& q, const char* doc) {
    add(key, number_text(value), q.unit, q.shown, doc);
  }
  void number(const char* key, const std::optional<double>& value, const Quantity& q, const char* doc) {
    if (value) number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range&, bool, const char* doc) {
    add(key, fmt::format("{}", value), "1", "", doc);
  }
  template <class E, class N>
  void choice(const char* key, E value, const N& names, const char* doc) {
    for (const auto& [name, choice] : names) {
      if (choice == value) add(key, std::string(name), "", "", doc);
    }
  }
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const char*) {
    Collector child(out_, prefix_ + key + ".");
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>& items, F describe_it, const char*) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      Collector child(out_, fmt::format("{}{}[{}].", prefix_, key, i));
      describe_it(child, items[i]);
    }
  }

 private:
  void add(const char* key, std::string value, const char* unit, const char* shown, const char* doc) {
    out_.push_back({prefix_ + key, std::move(value), unit, shown, doc});
  }
  std::vector<KeyValue>& out_;
  const std::string prefix_;
};

}  // namespace

std::vector<KeyValue> key_values(const Scenario& scenario) {
  std::vector<KeyValue> out;
  Collector collector(out, "");
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
