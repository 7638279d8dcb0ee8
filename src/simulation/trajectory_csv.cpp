#include "train_derail/simulation/trajectory_csv.hpp"

#include <algorithm>
#include <ostream>
#include <stdexcept>

#include <fmt/ranges.h>

#include "train_derail/files/near_misses.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/simulation/fields.hpp"

namespace train_derail::simulation {

namespace {

constexpr const char *kTime = "time_s", *kCar = "car";

// Numbers are most of it, and the names of choices need no quotes.
void append(std::string& line, const fields::Value& value, const std::vector<std::string_view>& names) {
  line += ',';
  if (const auto* number = std::get_if<double>(&value)) fmt::format_to(std::back_inserter(line), "{}", *number);
  else line += fields::text(value, names);
}

std::string name_of(const TableChoice::Column& c) {
  return c.car != nullptr ? fields::column(c.car->name, c.car->unit) : fields::column(c.coupler->name, c.coupler->unit);
}

std::vector<TableChoice::Column> all_columns() {
  std::vector<TableChoice::Column> all;
  for (const auto& field : car_fields()) all.push_back({&field, nullptr});
  for (const auto& field : coupler_fields()) all.push_back({nullptr, &field});
  return all;
}

}  // namespace

TableChoice::TableChoice() : columns_(all_columns()) {}

TableChoice::TableChoice(const std::vector<std::string>& columns, std::vector<int> cars) : cars_(std::move(cars)) {
  std::sort(cars_.begin(), cars_.end());
  cars_.erase(std::unique(cars_.begin(), cars_.end()), cars_.end());
  const std::vector<Column> all = all_columns();
  if (columns.empty()) columns_ = all;
  for (const std::string& name : columns) {
    if (name == kTime || name == kCar) continue;
    const auto found = std::find_if(all.begin(), all.end(), [&](const Column& c) {
      return name == name_of(c) || name == (c.car != nullptr ? c.car->name : c.coupler->name);
    });
    if (found == all.end()) {
      std::vector<std::string> names;
      for (const Column& c : all) names.push_back(name_of(c));
      const std::vector<std::string> near = files::near_misses(name, names);
      throw std::invalid_argument(fmt::format("no column '{}'; {}: {}", files::printable(name, files::kShownMax),
                                              near.empty() ? "the columns are" : "near it",
                                              fmt::join(near.empty() ? names : near, ", ")));
    }
    const auto same = [&](const Column& c) { return c.car == found->car && c.coupler == found->coupler; };
    if (std::any_of(columns_.begin(), columns_.end(), same))
      throw std::invalid_argument(fmt::format("column '{}' is asked for twice", name_of(*found)));
    columns_.push_back(*found);
  }
}

void write_csv_header(std::ostream& out, const TableChoice& choice) {
  std::string line = fmt::format("{},{}", kTime, kCar);
  for (const TableChoice::Column& column : choice.columns()) line += "," + name_of(column);
  out << line << '\n';
}

void write_csv_rows(std::ostream& out, const Snapshot& s, const TableChoice& choice) {
  std::string text;
  const auto add = [&](std::size_t k) {
    fmt::format_to(std::back_inserter(text), "{},{}", s.time, k + 1);
    for (const TableChoice::Column& column : choice.columns()) {
      if (column.car != nullptr) append(text, column.car->get(s.cars[k]), column.car->names);
      else if (k < s.couplers.size()) append(text, column.coupler->get(s.couplers[k]), column.coupler->names);
      else text += ',';
    }
    text += '\n';
  };
  if (choice.cars().empty()) {
    for (std::size_t k = 0; k < s.cars.size(); ++k) add(k);
  }
  for (const int car : choice.cars()) {
    if (const auto k = static_cast<std::size_t>(car - 1); k < s.cars.size()) add(k);
  }
  out << text;
}

void keep_peaks(const Snapshot& before, Snapshot& now) {
  for (std::size_t i = 0; i < now.couplers.size(); ++i) {
    CouplerSnapshot& to = now.couplers[i];
    const CouplerSnapshot& from = before.couplers[i];
    if (from.buff_peak >= to.buff_peak) {
      to.buff_peak = from.buff_peak;
      to.buff_peak_time = from.buff_peak_time;
    }
    if (from.draft_peak >= to.draft_peak) {
      to.draft_peak = from.draft_peak;
      to.draft_peak_time = from.draft_peak_time;
    }
  }
}

const Snapshot* ThinnedStates::add(std::int64_t tick, Snapshot state) {
  if (!kept_) keep_peaks(*state_, state);
  kept_ = !state_ || tick % every_ == 0;  // the first one and those of the coarser grid
  state_ = std::move(state);
  return kept_ ? &*state_ : nullptr;
}

}  // namespace train_derail::simulation
