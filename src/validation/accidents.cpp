#include "train_derail/validation/accidents.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "train_derail/files/csv.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::validation {

using inputs::CarBlock;
using inputs::InputError;

namespace {

constexpr double kShortTon = 2000.0 * inputs::kPoundForce;  // N
constexpr int kCountMax = 1000;
constexpr double kSpeedMax = 300.0, kTonsMax = 1000.0;  // mph, short tons: more is a slip of the pen

bool is_locomotive(const CarBlock& block) { return block.name == "locomotive"; }

/// The last row that was read, column by column.
class RowReader {
 public:
  RowReader(const files::CsvTable& table, const std::string& path, const std::vector<std::string>& fields)
      : table_(table), fields_(fields), where_(fmt::format("{}:{}", path, table.line())) {}

  const std::string& where() const { return where_; }

  int count(const char* column, int min, int max) const {
    return number<int>(column, fmt::format("a whole number from {} to {}", min, max),
                       [&](int value) { return value >= min && value <= max; });
  }
  double positive(const char* column, double max) const {
    return number<double>(column, fmt::format("a number, 0 < {} <= {}", column, max),
                          [&](double value) { return value > 0.0 && value <= max; });
  }

 private:
  template <class T, class Fits>
  T number(const char* column, const std::string& allowed, Fits fits) const {
    const std::string& text = fields_[table_.column(column)];
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) throw InputError(where(), column, text, "not a number of this kind", allowed);
    if (!fits(value)) throw InputError(where(), column, text, "out of range", allowed);
    return value;
  }

  const files::CsvTable& table_;
  const std::vector<std::string>& fields_;
  const std::string where_;
};

Accident read_row(const files::CsvTable& table, const std::string& path, const std::vector<std::string>& fields) {
  const RowReader reader(table, path, fields);
  Accident a;
  a.line = table.line();
  a.fields = fields;
  a.speed_mph = reader.positive("speed_mph", kSpeedMax);
  a.n_cars = reader.count("n_cars", 1, kCountMax);
  a.tons_per_car = reader.positive("tons_per_car", kTonsMax);
  a.head_end_locos = reader.count("head_end_locos", 0, kCountMax);
  a.mid_locos = reader.count("mid_locos", 0, kCountMax);
  a.rear_locos = reader.count("rear_locos", 0, kCountMax);
  a.first_car_position = reader.count("first_car_position", 1, a.n_cars);
  a.cars_from_pod_to_rear = reader.count("cars_from_pod_to_rear", 1, a.n_cars);
  a.cars_derailed = reader.count("cars_derailed", 1, a.n_cars);
  if (a.first_car_position - 1 + a.cars_from_pod_to_rear != a.n_cars) {
    throw InputError(reader.where(), "cars_from_pod_to_rear", fmt::format("{}", a.cars_from_pod_to_rear),
                     fmt::format("does not go with first_car_position = {} and n_cars = {}", a.first_car_position, a.n_cars),
                     fmt::format("n_cars - first_car_position + 1 = {}", a.n_cars - a.first_car_position + 1));
  }
  return a;
}

}  // namespace

AccidentTable read_accidents(const std::string& path) try {
  files::CsvTable table(path);
  for (const char* column : {"speed_mph", "n_cars", "tons_per_car", "head_end_locos", "mid_locos", "rear_locos",
                             "first_car_position", "cars_from_pod_to_rear", "cars_derailed"}) {
    if (!table.has(column)) throw InputError(path + ":1", column, "", "missing column", "a column of this name (docs/validation.md)");
  }
  AccidentTable accidents{path, table.names(), {}};
  for (std::vector<std::string> fields; table.next(fields);) accidents.rows.push_back(read_row(table, path, fields));
  if (accidents.rows.empty()) throw InputError(path, "", "", "no accidents", "at least one row");
  return accidents;
} catch (const files::CsvError& e) {
  throw InputError(e.line() > 0 ? fmt::format("{}:{}", path, e.line()) : path, "", "", e.problem(), "a table of accidents, CSV (docs/validation.md)");
}

inputs::Scenario scenario_of(const inputs::Scenario& base, const Accident& a) {
  const CarBlock *locomotive = nullptr, *car = nullptr, *last = nullptr;
  for (const CarBlock& block : base.consist) {
    if (is_locomotive(block)) {
      if (locomotive == nullptr) locomotive = &block;
    } else {
      if (car == nullptr) car = &block;
      last = &block;
    }
  }
  if (car == nullptr) {
    throw InputError("scenario", "consist", "", "no block of cars to make trains of", "a block whose name is not locomotive");
  }

  CarBlock remote = locomotive == nullptr ? CarBlock{} : *locomotive;
  remote.brake_source = inputs::BrakeSource::remote;
  std::vector<CarBlock> consist;
  const CarBlock* previous = nullptr;
  const auto add = [&](const CarBlock& block, int count) {
    if (count == 0) return;
    if (&block == previous) {
      consist.back().count += count;
      return;
    }
    previous = &block;
    consist.push_back(block);
    consist.back().count = count;
    if (!is_locomotive(block)) consist.back().weight = a.tons_per_car * kShortTon;
  };
  const int ahead = a.first_car_position - 1, cars = ahead + a.cars_from_pod_to_rear;
  const int before_middle = a.mid_locos > 0 ? cars / 2 : 0;
  if (locomotive != nullptr) add(*locomotive, a.head_end_locos);
  add(*car, before_middle);
  if (locomotive != nullptr) add(remote, a.mid_locos);
  add(*car, cars - 1 - before_middle);
  add(*last, 1);
  if (locomotive != nullptr) add(remote, a.rear_locos);

  inputs::Scenario scenario = base;
  scenario.consist = consist;
  scenario.initial.speed = a.speed_mph * inputs::kMph;
  const bool middle_ahead = a.mid_locos > 0 && ahead >= before_middle;
  const int locomotives_ahead = locomotive == nullptr ? 0 : a.head_end_locos + (middle_ahead ? a.mid_locos : 0);
  scenario.initial.cars_ahead = ahead + locomotives_ahead;
  return scenario;
}

bool row_decides(const std::string& key) {
  const auto ends_with = [&](const std::string& end) {
    return key.size() >= end.size() && key.compare(key.size() - end.size(), end.size(), end) == 0;
  };
  return key == "initial.speed" || key == "initial.cars_ahead" ||
         (key.compare(0, 8, "consist[") == 0 && (ends_with("].count") || ends_with("].weight") || ends_with("].name")));
}

Derailed count_derailed(const inputs::Scenario& scenario, const simulation::Snapshot& snapshot) {
  Derailed derailed;
  std::size_t vehicle = 0;
  for (const CarBlock& block : scenario.consist) {
    for (int i = 0; i < block.count; ++i, ++vehicle) {
      if (snapshot.cars.at(vehicle).derailed) ++(is_locomotive(block) ? derailed.locomotives : derailed.cars);
    }
  }
  return derailed;
}

}  // namespace train_derail::validation
