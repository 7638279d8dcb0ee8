#include "rviz/input_table.hpp"

#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "inputs/schema.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/units.hpp"

namespace train_derail::rviz_panel {

namespace {

using inputs::NumberInput;
using inputs::Range;

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

bool is_number(const std::string& text) {
  double unused = 0.0;
  const char* const begin = text.data() + (text[0] == '+' ? 1 : 0);
  const char* const end = text.data() + text.size();
  return !text.empty() && std::from_chars(begin, end, unused).ptr == end;
}

/// "667.2 kN": forces and stiffnesses have many digits in SI.
std::string si_text(double value, const std::string& unit) {
  if (unit[0] == 'N' && std::isfinite(value)) {
    if (std::abs(value) >= 1.0e6) return fmt::format("{:.4g} M{}", value * 1.0e-6, unit);
    if (std::abs(value) >= 1.0e3) return fmt::format("{:.4g} k{}", value * 1.0e-3, unit);
  }
  return fmt::format("{:.4g} {}", value, unit);
}

class Lister {
 public:
  Lister(InputTable& table, std::string prefix) : table_(table), prefix_(std::move(prefix)) {}

  void text(const char* key, const std::string& value, const inputs::Doc& doc) {
    InputItem& item = add(key, doc.text);
    item.value = item.exact = value;
  }
  void number(const char* key, double value, const NumberInput& q, const inputs::Doc& doc) {
    InputItem& item = add(key, doc.text);
    const std::string si = q.unit;
    item.unit_si = si == "1" ? "" : si;
    item.unit = *q.shown != '\0' ? q.shown : item.unit_si;
    const bool converted = item.unit != item.unit_si;
    const auto shown = [&](double v) { return converted && std::isfinite(v) ? inputs::from_si(v, si, item.unit) : v; };
    item.exact = fmt::format("{}", value);
    item.value = value == inputs::kInfinity ? ".inf" : fmt::format("{:.6g}", shown(value));
    if (!item.unit.empty() && std::isfinite(value)) item.value += " " + item.unit;
    if (converted) item.value_si = si_text(value, si);
    Range range = q.range;
    range.min = shown(range.min);
    range.max = shown(range.max);
    item.allowed = range.text(item.unit.empty() ? "1" : item.unit);
  }
  void number(const char* key, const std::optional<double>& value, const NumberInput& q, const inputs::Doc& doc) {
    if (value) number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range& range, bool, const inputs::Doc& doc) {
    InputItem& item = add(key, doc.text);
    item.value = item.exact = fmt::format("{}", value);
    item.allowed = "a whole number, " + range.text("1");
  }
  template <class E, class N>
  void choice(const char* key, E value, const N& names, const inputs::Doc& doc) {
    InputItem& item = add(key, doc.text);
    for (const auto& [name, choice] : names) {
      item.choices.emplace_back(name);
      item.allowed += (item.allowed.empty() ? "" : ", ") + std::string(name);
      if (choice == value) item.value = item.exact = std::string(name);
    }
  }
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const inputs::Doc&) {
    Lister child(table_, prefix_ + key + ".");
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>& items, F describe_it, const inputs::Doc&, bool) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      Lister child(table_, fmt::format("{}{}[{}].", prefix_, key, i));
      describe_it(child, items[i]);
    }
  }

 private:
  InputItem& add(const char* key, const char* meaning) {
    InputItem& item = table_[prefix_ + key];
    item.meaning = meaning;
    return item;
  }

  InputTable& table_;
  const std::string prefix_;
};

}  // namespace

InputTable make_input_table(const inputs::Scenario& scenario) {
  InputTable table;
  Lister lister(table, "");
  inputs::describe(lister, scenario);
  for (const inputs::KeyValue& v : inputs::key_values(scenario)) table.at(v.key).acts_with = v.acts_with;
  return table;
}

CheckedInput check_input(const YAML::Node& tree, const InputTable& table, const std::string& key,
                         const std::string& typed) {
  CheckedInput checked;
  checked.text = trimmed(typed);
  const auto before = table.find(key);
  if (before == table.end()) {
    checked.error = key + ": not in this scenario";
    return checked;
  }
  if (!before->second.unit.empty() && is_number(checked.text)) checked.text += " " + before->second.unit;
  try {
    const inputs::Scenario scenario = inputs::read_scenario(tree, "inputs", {{key, checked.text}});
    const InputItem now = make_input_table(scenario).at(key);
    checked.value_si = now.value_si;
    checked.as_before = now.exact == before->second.exact;
  } catch (const inputs::InputError& e) {
    checked.error = e.what();
  }
  return checked;
}

std::vector<std::string> split_overrides(const std::string& text) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(';', begin), text.size());
    if (const std::string part = trimmed(text.substr(begin, end - begin)); !part.empty()) parts.push_back(part);
    begin = end + 1;
  }
  return parts;
}

}  // namespace train_derail::rviz_panel
