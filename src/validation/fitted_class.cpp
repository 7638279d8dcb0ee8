#include "train_derail/validation/fitted_class.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::validation {

using inputs::InputError;

namespace {

struct AccidentColumn {
  const char* name;
  double (*value)(const Accident&);
};
constexpr std::array<AccidentColumn, 8> kColumns{{
    {"speed_mph", [](const Accident& a) { return a.speed_mph; }},
    {"n_cars", [](const Accident& a) { return static_cast<double>(a.n_cars); }},
    {"tons_per_car", [](const Accident& a) { return a.tons_per_car; }},
    {"empty_cars", [](const Accident& a) { return static_cast<double>(a.empty_cars.value_or(0)); }},
    {"head_end_locos", [](const Accident& a) { return static_cast<double>(a.head_end_locos); }},
    {"mid_locos", [](const Accident& a) { return static_cast<double>(a.mid_locos); }},
    {"rear_locos", [](const Accident& a) { return static_cast<double>(a.rear_locos); }},
    {"cars_from_pod_to_rear", [](const Accident& a) { return static_cast<double>(a.cars_from_pod_to_rear); }},
}};

const AccidentColumn* column(const std::string& name) {
  const auto found =
      std::find_if(kColumns.begin(), kColumns.end(), [&](const AccidentColumn& c) { return name == c.name; });
  return found == kColumns.end() ? nullptr : &*found;
}

bool has_range(const FittedClass& of, const char* name) {
  return std::any_of(of.ranges.begin(), of.ranges.end(), [&](const FittedClass::Range& r) { return r.column == name; });
}

}  // namespace

FittedClass read_fitted_class(const std::string& path) {
  const YAML::Node root = inputs::load_file(path);
  const auto where = [&](const YAML::Node& node) { return fmt::format("{}:{}", path, node.Mark().line + 1); };
  FittedClass of;
  of.path = path;
  if (!root.IsMap()) throw InputError(path, "", "", "not a group of keys", "title, ranges, causes");
  for (const auto& entry : root) {
    const std::string key = entry.first.as<std::string>("");
    const YAML::Node value = entry.second;
    if (key == "title" && value.IsScalar()) {
      of.title = value.as<std::string>();
    } else if (key == "ranges" && value.IsMap()) {
      for (const auto& range : value) {
        const std::string name = range.first.as<std::string>("");
        if (column(name) == nullptr) {
          std::string names;
          for (const AccidentColumn& c : kColumns) names += (names.empty() ? "" : ", ") + std::string(c.name);
          throw InputError(where(range.first), "ranges." + name, "", "unknown column", names);
        }
        const YAML::Node ends = range.second;
        const bool two = ends.IsSequence() && ends.size() == 2;
        const double low = two ? ends[0].as<double>(NAN) : NAN, high = two ? ends[1].as<double>(NAN) : NAN;
        if (!(low <= high))
          throw InputError(where(range.first), "ranges." + name, "", "not a range: two numbers, the smaller first",
                           "[least, largest]");
        of.ranges.push_back({name, low, high});
      }
    } else if (key == "causes" && value.IsSequence()) {
      for (const YAML::Node& cause : value) of.causes.push_back(cause.as<std::string>(""));
    } else {
      throw InputError(where(entry.first), key, "", "unknown key, or a value of the wrong kind",
                       "title: text, ranges: a group, causes: a list");
    }
  }
  return of;
}

std::string outside(const FittedClass& of, const Accident& accident) {
  std::string text;
  const auto add = [&](const std::string& what) { text += (text.empty() ? "" : "; ") + what; };
  for (const FittedClass::Range& range : of.ranges) {
    const double value = column(range.column)->value(accident);
    if (value >= range.low && value <= range.high) continue;
    add(fmt::format("{} {:g} (fitted: {:g} to {:g})", range.column, value, range.low, range.high));
  }
  if (!of.causes.empty() && !accident.cause.empty() &&
      std::find(of.causes.begin(), of.causes.end(), accident.cause) == of.causes.end()) {
    add("cause " + accident.cause);
  }
  return text;
}

std::vector<std::string> not_told(const FittedClass& of, const AccidentTable& table) {
  std::vector<std::string> names;
  const auto all = [&](auto missing) { return std::any_of(table.rows.begin(), table.rows.end(), missing); };
  if (!of.causes.empty() && all([](const Accident& a) { return a.cause.empty(); })) names.push_back("cause");
  if (has_range(of, "empty_cars") && all([](const Accident& a) { return !a.empty_cars; }))
    names.push_back("empty_cars");
  return names;
}

}  // namespace train_derail::validation
