#include "train_derail/validation/accidents.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <map>
#include <set>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "train_derail/files/csv.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::validation {

using inputs::InputError;

namespace {

constexpr int kCountMax = 1000;
constexpr double kSpeedMax = 300.0, kTonsMin = 10.0,
                 kTonsMax = 1000.0;  // mph, short tons; beyond these a typing mistake is likely

/// A row of the table.
struct Line {
  std::size_t number = 0;  // line of the file, from 1
  std::vector<std::string> fields;
};

struct File {
  std::string path;
  std::vector<std::string> names;
  std::vector<Line> rows;

  bool has(const std::string& column) const { return std::find(names.begin(), names.end(), column) != names.end(); }
  std::string where(const Line& line) const { return fmt::format("{}:{}", path, line.number); }
};

/// Reads all rows. Rows with a wrong number of fields are added to `errors`.
File read_lines(const std::string& path, std::vector<InputError>& errors) try {
  files::CsvReader in(path);
  File file;
  file.path = path;
  in.next(file.names);
  for (Line line; in.next(line.fields);) {
    line.number = in.line();
    // In published tables the rows end with a comma, but the head does not.
    if (line.fields.size() == file.names.size() + 1 && line.fields.back().empty()) line.fields.pop_back();
    if (line.fields.size() != file.names.size()) {
      errors.emplace_back(file.where(line), "", "", fmt::format("{} fields", line.fields.size()),
                          fmt::format("{}, one for each column", file.names.size()));
    } else {
      file.rows.push_back(line);
    }
  }
  return file;
} catch (const files::CsvError& e) {
  throw InputError(e.line() > 0 ? fmt::format("{}:{}", path, e.line()) : path, "", "", e.problem(),
                   "a table of accidents, CSV (docs/validation.md)");
}

/// Reads the columns of one row. Mistakes are collected in `errors`.
class RowReader {
 public:
  RowReader(const File& file, const Line& line, std::vector<InputError>& errors)
      : file_(file), line_(line), errors_(errors) {}

  const std::string& text(const std::string& column) const {
    const auto place = std::find(file_.names.begin(), file_.names.end(), column) - file_.names.begin();
    return line_.fields.at(static_cast<std::size_t>(place));
  }
  bool has(const std::string& column) const { return file_.has(column); }
  std::string text_if_any(const std::string& column) const { return has(column) ? text(column) : ""; }

  int count(const std::string& column, int min, int max) const {
    return number<int>(column, fmt::format("a whole number from {} to {}", min, max), min,
                       [&](int value) { return value >= min && value <= max; });
  }
  /// The same, but an empty field is 0.
  int count_or_blank(const std::string& column) const {
    return text_if_any(column).empty() ? 0 : count(column, 0, kCountMax);
  }
  /// A number from 0 on; an empty field is 0.
  double amount_or_blank(const std::string& column, double max) const {
    if (text(column).empty()) return 0.0;
    return number<double>(column, fmt::format("a number, 0 <= {} <= {}", column, max), max,
                          [&](double value) { return value >= 0.0 && value <= max; });
  }
  double positive(const std::string& column, double max) const {
    return number<double>(column, fmt::format("a number, 0 < {} <= {}", column, max), max,
                          [&](double value) { return value > 0.0 && value <= max; });
  }
  double tons(const std::string& column, int cars) const {
    const double min = kTonsMin * cars, max = kTonsMax * cars;
    return number<double>(column, fmt::format("a number, {} <= {} <= {}", min, column, max), max,
                          [&](double value) { return value >= min && value <= max; });
  }
  void wrong(const std::string& column, const std::string& value, const std::string& problem,
             const std::string& allowed) const {
    errors_.emplace_back(file_.where(line_), column, value, problem, allowed);
  }

 private:
  template <class T, class Fits>
  T number(const std::string& column, const std::string& allowed, T otherwise, Fits fits) const {
    const std::string& written = text(column);
    const auto value = files::number<T>(written);
    if (value && fits(*value)) return *value;
    constexpr const char* kKind = std::is_integral_v<T> ? "not a whole number" : "not a number";
    wrong(column, written, value ? "out of range" : kKind, allowed);
    return otherwise;
  }

  const File& file_;
  const Line& line_;
  std::vector<InputError>& errors_;
};

/// What all tables have of a row.
Accident begin_row(const RowReader& reader, const Line& line) {
  Accident a;
  a.line = line.number;
  a.fields = line.fields;
  a.speed_mph = reader.positive("speed_mph", kSpeedMax);
  a.cause = reader.text_if_any("cause");
  return a;
}

constexpr int kCaboosesMax = 2;

/// What is neither loaded nor empty are cabooses.
void check_loads(const RowReader& reader, const Accident& a) {
  const int others = a.n_cars - *a.loaded_cars - *a.empty_cars;
  if (others >= 0 && others <= kCaboosesMax) return;
  reader.wrong("loaded", fmt::format("{}", *a.loaded_cars),
               fmt::format("does not fit empty = {} and n_cars = {}", *a.empty_cars, a.n_cars),
               fmt::format("loaded + empty from n_cars - {} to n_cars", kCaboosesMax));
}

Accident read_row(const File& file, const Line& line, std::vector<InputError>& errors) {
  const std::size_t before = errors.size();
  const RowReader reader(file, line, errors);
  Accident a = begin_row(reader, line);
  a.n_cars = reader.count("n_cars", 1, kCountMax);
  const int most = errors.size() == before ? a.n_cars : kCountMax;
  a.tons_per_car = reader.tons("tons_per_car", 1);
  a.head_end_locos = reader.count("head_end_locos", 0, kCountMax);
  a.mid_locos = reader.count("mid_locos", 0, kCountMax);
  a.rear_locos = reader.count("rear_locos", 0, kCountMax);
  a.first_car_position = reader.count("first_car_position", 1, most);
  a.cars_from_pod_to_rear = reader.count("cars_from_pod_to_rear", 1, most);
  a.cars_derailed = reader.count("cars_derailed", 1, most);
  for (const char* column : {"empty_cars", "empty"}) {
    if (file.has(column) && !a.empty_cars) a.empty_cars = reader.count_or_blank(column);
  }
  if (a.empty_cars && file.has("loaded")) a.loaded_cars = reader.count_or_blank("loaded");
  if (errors.size() == before && a.loaded_cars) check_loads(reader, a);
  if (errors.size() == before && a.first_car_position - 1 + a.cars_from_pod_to_rear != a.n_cars) {
    reader.wrong("cars_from_pod_to_rear", fmt::format("{}", a.cars_from_pod_to_rear),
                 fmt::format("does not fit first_car_position = {} and n_cars = {}", a.first_car_position, a.n_cars),
                 fmt::format("n_cars - first_car_position + 1 = {}", a.n_cars - a.first_car_position + 1));
  }
  return a;
}

// Of a table of posture, which knows neither weights nor where in the train it began: middle of what is usual.
constexpr double kTonsLoaded = 131.5, kTonsEmpty = 32.5;  // short tons
constexpr int kLocomotives = 2;

/// A row of a table of posture. The weight follows from how many of the derailed cars were loaded.
Accident read_posture_row(const File& file, const Line& line, std::vector<InputError>& errors) {
  const std::size_t before = errors.size();
  const RowReader reader(file, line, errors);
  Accident a = begin_row(reader, line);
  a.n_cars = reader.count("cars_in_train", 1, kCountMax);
  a.cars_derailed = reader.count("cars_derailed_narrative", 1, errors.size() == before ? a.n_cars : kCountMax);
  a.over = reader.count("on_side_or_over", 0, errors.size() == before ? a.cars_derailed : kCountMax);
  const int loads = reader.count_or_blank("loads_derailed_form"),
            empties = reader.count_or_blank("empties_derailed_form");
  if (errors.size() > before) return a;
  const int known = std::max(loads + empties, 1);
  a.tons_per_car = (kTonsLoaded * (known - empties) + kTonsEmpty * empties) / known;
  a.head_end_locos = kLocomotives;
  a.first_car_position = 1 + (a.n_cars - a.cars_derailed) / 2;
  a.cars_from_pod_to_rear = a.n_cars - a.first_car_position + 1;
  return a;
}

/// Throws InputError, which names them, if the table lacks columns.
void require(const File& file, std::initializer_list<const char*> columns) {
  std::vector<std::string> missing;
  for (const char* column : columns) {
    if (!file.has(column)) missing.emplace_back(column);
  }
  if (missing.size() == 1)
    throw InputError(file.path + ":1", missing[0], "", "missing column", "a column of this name (docs/validation.md)");
  if (!missing.empty())
    throw InputError(file.path + ":1", "", "", fmt::format("missing columns: {}", fmt::join(missing, ", ")),
                     "a table of accidents, CSV (docs/validation.md)");
}

// Columns of form 6180.54 of the Federal Railroad Administration. A row is one report. A suffix 1 means what the train
// had, a suffix 2 what of it derailed. CARS, CARSDMG, CARSHZD count cars with hazardous materials: in the train,
// damaged or derailed, releasing. POSITON1 is the first car involved, POSITON2 the one that caused it.
const std::vector<std::string> kFormColumns{"RAILROAD", "INCDTNO",  "TYPE",   "TRNSPD",  "TONS",
                                            "POSITON1", "HEADEND1", "LOADF1", "LOADP1",  "EMPTYF1",
                                            "EMPTYP1",  "LOADF2",   "LOADP2", "EMPTYF2", "EMPTYP2"};
const std::vector<std::string> kMadeColumns{"date",
                                            "railroad",
                                            "incdtno",
                                            "state",
                                            "station",
                                            "speed_mph",
                                            "n_cars",
                                            "loaded",
                                            "empty",
                                            "trailing_tons",
                                            "tons_per_car",
                                            "head_end_locos",
                                            "mid_locos",
                                            "rear_locos",
                                            "first_car_position",
                                            "cars_from_pod_to_rear",
                                            "causing_car_position",
                                            "cars_derailed",
                                            "loaded_derailed",
                                            "empty_derailed",
                                            "locos_derailed",
                                            "cause",
                                            "track_class",
                                            "hazmat_cars",
                                            "hazmat_damaged",
                                            "hazmat_released"};

bool is_form(const File& file) { return file.has("INCDTNO") && file.has("TRNSPD"); }

/// Some exports name the cause CAUSE, others ACCAUSE.
const char* cause_column(const File& file) { return file.has("CAUSE") ? "CAUSE" : "ACCAUSE"; }

/// Why a report is none of a derailment of a freight train that can be reckoned; nothing if it is one.
using LeftOut = std::optional<Remark>;

LeftOut not_such_a_train(const RowReader& reader, std::size_t line) {
  struct Wanted {
    const char *column, *value, *why;
  };
  for (const Wanted& w : {Wanted{"TYPE", "01", "no derailment"},
                          {"TYPEQ", "1", "no freight train"},
                          {"TYPTRK", "1", "not on a main track"}}) {
    const std::string& is = reader.text_if_any(w.column);
    // Some exports write 1 for 01. A column that the export lacks is not asked for; a blank field is another kind.
    const bool same = is == w.value || "0" + is == w.value || is == "0" + std::string(w.value);
    if (!same && reader.has(w.column))
      return Remark{line, fmt::format("{} = '{}': {}; allowed: {}", w.column, is, w.why, w.value), w.why};
  }
  return {};
}

// Beyond these a mistake in the report is likely.
constexpr double kFormTonsMin = 20.0, kFormTonsMax = 160.0;  // short tons a car

LeftOut not_usable(const RowReader& reader, const Accident& a, double tons) {
  const auto out = [&](const std::string& what, const std::string& why) {
    return Remark{a.line, what + ": " + why, why};
  };
  if (a.n_cars < 1) {
    const std::string other = reader.text_if_any("INCDTNO2");
    return out(
        fmt::format("LOADF1 + LOADP1 + EMPTYF1 + EMPTYP1 + CABOOSE1 = 0{}",
                    other.empty() ? "" : ", the train is in the report of " + reader.text_if_any("RR2") + ", " + other),
        "no cars");
  }
  if (!(a.speed_mph > 0.0)) return out(fmt::format("TRNSPD = '{}'", reader.text("TRNSPD")), "speed not above 0");
  if (a.cars_derailed < 1 || a.cars_derailed > a.n_cars)
    return out(fmt::format("LOADF2 + LOADP2 + EMPTYF2 + EMPTYP2 + CABOOSE2 = {} of {} cars", a.cars_derailed, a.n_cars),
               a.cars_derailed < 1 ? "no car derailed" : "more cars derailed than the train has");
  const double each = tons / a.n_cars;
  if (each < kFormTonsMin || each > kFormTonsMax)
    return out(fmt::format("TONS = '{}' for {} cars", reader.text("TONS"), a.n_cars),
               fmt::format("weight of a car not from {} to {} tons", kFormTonsMin, kFormTonsMax));
  if (a.first_car_position < 1 || a.first_car_position > a.n_cars + a.head_end_locos)
    return out(fmt::format("POSITON1 = '{}' of {} cars", reader.text("POSITON1"), a.n_cars),
               "position not in the train");
  return {};
}

Accident read_form_row(const File& file, const Line& line, std::vector<InputError>& errors, std::vector<Remark>& notes,
                       LeftOut& left_out) {
  const std::size_t before = errors.size();
  const RowReader reader(file, line, errors);
  const auto sum = [&](std::initializer_list<const char*> columns) {
    int total = 0;
    for (const char* column : columns) total += reader.count_or_blank(column);
    return total;
  };
  Accident a;
  a.line = line.number;
  left_out = not_such_a_train(reader, line.number);
  if (left_out) return a;
  constexpr double kFormMost = 1e6;  // tons of a train
  a.loaded_cars = sum({"LOADF1", "LOADP1"});
  a.empty_cars = sum({"EMPTYF1", "EMPTYP1"});
  a.n_cars = *a.loaded_cars + *a.empty_cars + sum({"CABOOSE1"});
  if (a.n_cars > kCountMax)
    reader.wrong("LOADF1 + LOADP1 + EMPTYF1 + EMPTYP1 + CABOOSE1", fmt::format("{}", a.n_cars), "too many cars",
                 fmt::format("at most {}", kCountMax));
  a.speed_mph = reader.amount_or_blank("TRNSPD", kSpeedMax);
  const double tons = reader.amount_or_blank("TONS", kFormMost);
  a.head_end_locos = sum({"HEADEND1"});
  a.mid_locos = sum({"MIDMAN1", "MIDREM1"});
  a.rear_locos = sum({"RMAN1", "RREM1"});
  a.cause = reader.text(cause_column(file));
  a.cars_derailed = sum({"LOADF2", "LOADP2", "EMPTYF2", "EMPTYP2", "CABOOSE2"});
  a.first_car_position = reader.count_or_blank("POSITON1");
  const int loads_derailed = sum({"LOADF2", "LOADP2"}), empties_derailed = sum({"EMPTYF2", "EMPTYP2"}),
            locomotives_derailed = sum({"HEADEND2", "MIDMAN2", "MIDREM2", "RMAN2", "RREM2"}),
            causing = sum({"POSITON2"}), hazmat = sum({"CARS"}), damaged = sum({"CARSDMG"}),
            released = sum({"CARSHZD"});
  if (errors.size() > before) return a;
  left_out = not_usable(reader, a, tons);
  if (left_out) return a;
  a.tons_per_car = std::round(10.0 * tons / a.n_cars) / 10.0;
  // The form asks for the position among the cars, but some railroads count the locomotives ahead of them too.
  if (a.first_car_position > a.n_cars) {
    a.first_car_position -= a.head_end_locos;
    notes.push_back({a.line,
                     fmt::format("POSITON1 = '{}' in a train of {} cars must include the locomotives: {} is used",
                                 reader.text("POSITON1"), a.n_cars, a.first_car_position),
                     ""});
  }
  a.cars_from_pod_to_rear = a.n_cars - a.first_car_position + 1;
  const auto date = reader.text_if_any("YEAR4") + "-" + reader.text_if_any("MONTH") + "-" + reader.text_if_any("DAY");
  const auto whole = [](int value) { return fmt::format("{}", value); };
  a.fields = {date,
              reader.text("RAILROAD"),
              reader.text("INCDTNO"),
              reader.text_if_any("STATE"),
              reader.text_if_any("STATION"),
              fmt::format("{}", a.speed_mph),
              whole(a.n_cars),
              whole(*a.loaded_cars),
              whole(*a.empty_cars),
              fmt::format("{}", tons),
              fmt::format("{}", a.tons_per_car),
              whole(a.head_end_locos),
              whole(a.mid_locos),
              whole(a.rear_locos),
              whole(a.first_car_position),
              whole(a.cars_from_pod_to_rear),
              whole(causing),
              whole(a.cars_derailed),
              whole(loads_derailed),
              whole(empties_derailed),
              whole(locomotives_derailed),
              a.cause,
              reader.text_if_any("TRKCLAS"),
              whole(hazmat),
              whole(damaged),
              whole(released)};
  return a;
}

/// Returns all numbers under which railroads have reported the accident of a row.
std::vector<std::string> names_of_accident(const RowReader& reader) {
  std::string day;
  for (const char* column : {"YEAR4", "YEAR", "MONTH", "DAY"}) day += reader.text_if_any(column);
  std::vector<std::string> names;
  for (const auto& [railroad, number] : {std::pair{"RAILROAD", "INCDTNO"}, {"RR2", "INCDTNO2"}, {"RR3", "INCDTNO3"}}) {
    const std::string of = reader.text_if_any(railroad), which = reader.text_if_any(number);
    // An industry that owns the track does not report.
    if (!of.empty() && !which.empty() && which != "INDUSTRY") names.push_back(day + " " + of + " " + which);
  }
  return names;
}

/// Reads reports of form 6180.54. Several railroads may report one accident; a wrong report is no mistake if another
/// report of the accident can be used.
void read_form(const File& file, AccidentTable& table, std::vector<InputError>& errors) {
  for (const std::string& column : kFormColumns) {
    if (file.has(column)) continue;
    throw InputError(file.path + ":1", column, "", "missing column",
                     "the columns of form 6180.54 (docs/validation.md)");
  }
  if (!file.has(cause_column(file)))
    throw InputError(file.path + ":1", "CAUSE", "", "missing column", "CAUSE or ACCAUSE (docs/validation.md)");
  table.columns = kMadeColumns;
  struct Report {
    Accident accident;
    std::vector<InputError> errors;
    std::vector<Remark> notes;
    LeftOut left_out;

    bool good() const { return errors.empty() && !left_out; }
  };
  std::vector<Report> reports;
  std::map<std::string, std::size_t> accident_of;   // index of the accident for each number under which it is reported
  std::vector<std::vector<std::size_t>> accidents;  // indices of the reports of each accident
  for (const Line& line : file.rows) {
    Report report;
    report.accident = read_form_row(file, line, report.errors, report.notes, report.left_out);
    const std::vector<std::string> names = names_of_accident(RowReader(file, line, report.errors));
    std::size_t accident = accidents.size();
    for (const std::string& name : names) {
      if (const auto found = accident_of.find(name); found != accident_of.end())
        accident = std::min(accident, found->second);
    }
    if (accident == accidents.size()) accidents.emplace_back();
    for (const std::string& name : names) accident_of.emplace(name, accident);
    accidents[accident].push_back(reports.size());
    reports.push_back(std::move(report));
  }
  for (const std::vector<std::size_t>& of_one : accidents) {
    const auto good = std::find_if(of_one.begin(), of_one.end(), [&](std::size_t i) { return reports[i].good(); });
    const std::size_t kept = good == of_one.end() ? of_one.front() : *good;
    for (const std::size_t i : of_one) {
      if (i == kept) continue;
      const std::size_t line = reports[kept].accident.line;
      table.left_out.push_back({reports[i].accident.line,
                                fmt::format("a second report of the accident in line {}", line),
                                "a second report of an accident"});
    }
    if (reports[kept].left_out) {
      table.left_out.push_back(*reports[kept].left_out);
    } else if (good == of_one.end()) {
      errors.insert(errors.end(), reports[kept].errors.begin(), reports[kept].errors.end());
    } else {
      table.rows.push_back(std::move(reports[kept].accident));
      table.notes.insert(table.notes.end(), reports[kept].notes.begin(), reports[kept].notes.end());
    }
  }
  std::sort(table.rows.begin(), table.rows.end(), [](const Accident& a, const Accident& b) { return a.line < b.line; });
}

/// Returns 12 for an error in "table.csv:12".
std::size_t line_of(const InputError& e) {
  const std::string& where = e.where();
  return static_cast<std::size_t>(std::strtoull(where.c_str() + where.rfind(':') + 1, nullptr, 10));
}

}  // namespace

void refuse(const std::string& path, std::size_t rows, const std::vector<InputError>& errors) {
  if (errors.empty()) return;
  if (errors.size() == 1) throw errors.front();
  constexpr std::size_t kShown = 50;
  std::set<std::string> wrong;
  for (const InputError& e : errors) wrong.insert(e.where());
  std::string text = fmt::format("{} of {} rows cannot be used; --skip-invalid leaves them out", wrong.size(), rows);
  if (errors.size() > kShown) text += fmt::format("; the first {} of {} mistakes", kShown, errors.size());
  const auto shown = static_cast<std::ptrdiff_t>(std::min(kShown, errors.size()));
  throw InputError(path, text + ":", std::vector<InputError>(errors.begin(), errors.begin() + shown));
}

AccidentTable read_accidents(const std::string& path, bool skip_invalid) {
  std::vector<InputError> errors;
  const File file = read_lines(path, errors);
  const std::size_t all = file.rows.size() + errors.size();
  AccidentTable table{path, file.names, {}, {}, {}};
  if (is_form(file)) {
    read_form(file, table, errors);
  } else {
    const bool posture = file.has("on_side_or_over");
    if (posture) {
      require(file, {"speed_mph", "cars_in_train", "cars_derailed_narrative", "loads_derailed_form",
                     "empties_derailed_form"});
      table.notes.push_back(
          {1,
           fmt::format("a table of posture: assumed are {} short tons a loaded car, {} an empty one, by the derailed "
                       "ones, {} locomotives in front, and that the derailed cars were in the middle of the train",
                       kTonsLoaded, kTonsEmpty, kLocomotives),
           ""});
    } else {
      require(file, {"speed_mph", "n_cars", "tons_per_car", "head_end_locos", "mid_locos", "rear_locos",
                     "first_car_position", "cars_from_pod_to_rear", "cars_derailed"});
    }
    for (const Line& line : file.rows) {
      const std::size_t before = errors.size();
      Accident row = posture ? read_posture_row(file, line, errors) : read_row(file, line, errors);
      if (errors.size() == before) table.rows.push_back(std::move(row));
    }
  }
  if (!skip_invalid) refuse(path, all, errors);
  for (const InputError& e : errors) {
    const std::string what = std::string(e.what()).substr(e.where().size() + 2);  // without file and line
    const auto told = std::find_if(table.left_out.begin(), table.left_out.end(),
                                   [&](const Remark& r) { return r.line == line_of(e); });
    if (told == table.left_out.end()) table.left_out.push_back({line_of(e), what, "cannot be read"});
    else told->text += "; " + what;
  }
  std::stable_sort(table.left_out.begin(), table.left_out.end(),
                   [](const Remark& a, const Remark& b) { return a.line < b.line; });
  if (all == 0) throw InputError(path, "", "", "no accidents", "at least one row");
  if (table.rows.empty())
    throw InputError(path, "", "", fmt::format("none of {} rows can be used", all), "at least one");
  return table;
}

std::vector<std::string> left_out_counts(const AccidentTable& table) {
  std::map<std::string, int> counts;
  for (const Remark& r : table.left_out) ++counts[r.why];
  std::vector<std::pair<int, std::string>> sorted;
  for (const auto& [why, count] : counts) sorted.emplace_back(-count, why);
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::string> texts;
  for (const auto& [count, why] : sorted) texts.push_back(fmt::format("{}: {}", -count, why));
  return texts;
}

}  // namespace train_derail::validation
