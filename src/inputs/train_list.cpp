#include "train_derail/inputs/train_list.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/ranges.h>

#include "checker.hpp"
#include "schema.hpp"
#include "train_derail/files/csv.hpp"
#include "train_derail/files/near_misses.hpp"
#include "train_derail/files/number.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/units.hpp"

namespace train_derail::inputs {

namespace {

enum Column { kPosition, kKind, kLoad, kWeight, kLength, kHazmat, kCoupler, kColumns };

/// A column of a train list and the other names that it may have, as bare_name() gives them.
struct ColumnNames {
  const char* name;
  const char* meaning;
  const char* si;  // "": no unit
  std::vector<const char*> also;
};
const std::array<ColumnNames, kColumns> kColumnNames{{
    {"position",
     "place in the train, the foremost first; without it: as the rows stand",
     "",
     {"pos", "order", "sequence", "seq", "#", "no", "place", "car position", "train position", "position in train"}},
    {"kind",
     "a type of the table below, another word for it, or an AAR car type code",
     "",
     {"type", "car type", "car kind", "aar", "aar code", "aar type", "aar car type", "car type code", "type code",
      "equipment type", "equipment", "mechanical designation"}},
    {"load",
     "loaded or empty",
     "",
     {"loaded", "loaded or empty", "load empty", "l e", "le", "status", "load status", "load or empty"}},
    {"gross weight",
     "of the car with its load",
     "N",
     {"weight", "gross", "gross weight on rail", "gross rail load", "grl", "total weight", "gross wt", "wt"}},
    {"length",
     "over the pulling faces",
     "m",
     {"car length", "outside length", "length over pulling faces", "length over couplers", "len", "lgth"}},
    {"hazmat",
     "yes or no, or a UN number; without effect on the motion",
     "",
     {"hazardous", "hazardous material", "dangerous goods", "dangerous", "hm", "un", "un number", "placard"}},
    {"coupler", "a coupler of the table below", "", {"coupler type", "couplers", "coupling"}},
}};

/// Units in headers and behind values.
struct UnitWord {
  const char* word;
  const char* si;
  double value;
  const char* meaning;  // where it is not clear by itself
};
constexpr double kTonne = 1000.0 * kStandardGravity;
constexpr std::array<UnitWord, 28> kUnits{{
    {"ft", "m", kFoot, ""},
    {"feet", "m", kFoot, ""},
    {"foot", "m", kFoot, ""},
    {"in", "m", kFoot / 12.0, ""},
    {"inches", "m", kFoot / 12.0, ""},
    {"m", "m", 1.0, ""},
    {"meters", "m", 1.0, ""},
    {"metres", "m", 1.0, ""},
    {"cm", "m", 0.01, ""},
    {"mm", "m", 0.001, ""},
    {"tons", "N", 2.0 * kKip, "short tons of 2000 lb"},
    {"ton", "N", 2.0 * kKip, "short tons of 2000 lb"},
    {"short tons", "N", 2.0 * kKip, ""},
    {"us tons", "N", 2.0 * kKip, ""},
    {"long tons", "N", 2.24 * kKip, ""},
    {"t", "N", kTonne, "tonnes of 1000 kg"},
    {"tonnes", "N", kTonne, ""},
    {"tonne", "N", kTonne, ""},
    {"metric tons", "N", kTonne, ""},
    {"kg", "N", kStandardGravity, ""},
    {"lb", "N", kPoundForce, ""},
    {"lbs", "N", kPoundForce, ""},
    {"pounds", "N", kPoundForce, ""},
    {"klb", "N", kKip, ""},
    {"klbs", "N", kKip, ""},
    {"kip", "N", kKip, ""},
    {"kips", "N", kKip, ""},
    {"kN", "N", 1000.0, ""},
}};

const UnitWord* unit_of(const std::string& bare, std::string_view si) {
  const auto found = std::find_if(kUnits.begin(), kUnits.end(),
                                  [&](const UnitWord& u) { return si == u.si && bare == bare_name(u.word); });
  return found == kUnits.end() ? nullptr : found;
}

std::string unit_list(std::string_view si) {
  std::vector<const char*> words;
  for (const UnitWord& u : kUnits) {
    if (si == u.si) words.push_back(u.word);
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

bool names_column(const std::string& bare, const ColumnNames& column) {
  return bare == bare_name(column.name) ||
         std::any_of(column.also.begin(), column.also.end(), [&](const char* also) { return bare == bare_name(also); });
}

/// Where a column of the program stands in the table.
struct Place {
  std::size_t field = 0;
  std::string header;
  const UnitWord* unit = nullptr;  // of the header
};

class Reader {
 public:
  Reader(const std::string& path, const CarTypes& types, double coupler_length)
      : types_(types), coupler_length_(coupler_length), table_(path), path_(path) {}

  TrainList read() {
    find_columns();
    for (std::vector<std::string> row; table_.next(row);) {
      if (std::all_of(row.begin(), row.end(), [](const std::string& f) { return files::trimmed(f).empty(); })) continue;
      if (cars_.size() == static_cast<std::size_t>(kCarsMax))
        throw InputError(here(), "", "", "too many cars", fmt::format("at most {}", kCarsMax));
      read_car(row);
    }
    if (cars_.empty()) throw InputError(path_, "", "", "the train has no cars", "one row a car");
    put_in_order();
    join();
    choose_coupler();
    list_assumptions();
    return std::move(result_);
  }

 private:
  struct Car {
    std::size_t line = 0;
    int position = 0;
    CarBlock block;
    const CarType* type = nullptr;
    bool hazmat = false, weight_of_type = false, length_of_type = false, loaded = false;
    std::string coupler;
  };

  std::string here() const { return fmt::format("{}:{}", path_, table_.line()); }
  [[noreturn]] void refuse(Column c, const std::string& value, const std::string& problem,
                           const std::string& allowed) const {
    throw InputError(here(), places_[c] ? places_[c]->header : kColumnNames[c].name, value, problem, allowed);
  }

  void find_columns() {
    std::vector<std::string> known;
    for (const ColumnNames& c : kColumnNames) {
      known.emplace_back(c.name);
      known.insert(known.end(), c.also.begin(), c.also.end());
    }
    for (std::size_t i = 0; i < table_.names().size(); ++i) {
      const std::string header(files::trimmed(table_.names()[i]));
      if (header.empty()) continue;
      const auto open = header.find_first_of("([");
      const std::string in_brackets = open == std::string::npos ? "" : header.substr(open);
      const std::string bare = bare_name(header.substr(0, open));
      std::optional<Column> found;
      const UnitWord* unit = nullptr;
      for (int c = 0; c < kColumns && !found; ++c) {
        if (names_column(bare, kColumnNames[c])) found = static_cast<Column>(c);
      }
      if (!found && in_brackets.empty()) {  // length_ft
        for (int c = 0; c < kColumns && !found; ++c) {
          for (const UnitWord& u : kUnits) {
            const std::string word = bare_name(u.word);
            if (std::string_view(kColumnNames[c].si) != u.si || bare.size() <= word.size() ||
                bare.compare(bare.size() - word.size(), word.size(), word) != 0 ||
                !names_column(bare.substr(0, bare.size() - word.size()), kColumnNames[c]))
              continue;
            found = static_cast<Column>(c);
            unit = &u;
          }
        }
      }
      if (!found) {
        unknown(header, known);
        continue;
      }
      const std::string si = kColumnNames[*found].si;
      if (!in_brackets.empty() && !si.empty()) {
        unit = unit_of(bare_name(in_brackets), si);
        if (unit == nullptr) throw InputError(path_ + ":1", header, in_brackets, "unknown unit", unit_list(si));
      }
      if (places_[*found])
        throw InputError(path_ + ":1", header, "", fmt::format("means the same as '{}'", places_[*found]->header),
                         "one column of each kind");
      places_[*found] = Place{i, header, unit};
    }
    if (!places_[kKind]) {
      throw InputError(path_ + ":1", kColumnNames[kKind].name, "", "no such column",
                       fmt::format("{}, {}", kColumnNames[kKind].name, fmt::join(kColumnNames[kKind].also, ", ")));
    }
  }

  /// A column that is not known is left out, and said; one that is misspelt is an error.
  void unknown(const std::string& header, const std::vector<std::string>& known) {
    const std::string bare = bare_name(header.substr(0, header.find_first_of("([")));
    constexpr std::size_t kShort = 3;
    for (const std::string& name : known) {
      if (bare.size() > kShort && files::one_slip(bare, bare_name(name)))
        throw InputError(path_ + ":1", header, "", "unknown column", fmt::format("'{}', or another name", name));
    }
    unused_.push_back(header);
  }

  std::string field(const std::vector<std::string>& row, Column c) const {
    return places_[c] ? std::string(files::trimmed(row[places_[c]->field])) : "";
  }

  /// A quantity with the unit of its header or its own; nothing if the field is empty.
  std::optional<double> quantity(const std::vector<std::string>& row, Column c) {
    const std::string text = field(row, c), si = kColumnNames[c].si;
    if (text.empty()) return std::nullopt;
    const UnitWord* unit = places_[c]->unit;
    if (const auto bare = files::number<double>(text)) {
      if (unit == nullptr)
        refuse(c, text, "no unit, neither here nor in the name of the column",
               fmt::format("a unit in the header, as in \"{} ({})\": {}", kColumnNames[c].name,
                           si == "m" ? "ft" : "tons", unit_list(si)));
      if (*unit->meaning != '\0') said_units_[unit->word] = unit->meaning;
      return *bare * unit->value;
    }
    const auto blank = text.find_first_not_of("0123456789.+-eE");
    const UnitWord* own = blank == std::string::npos ? nullptr : unit_of(bare_name(text.substr(blank)), si);
    const auto value = files::number<double>(files::trimmed(std::string_view(text).substr(0, blank)));
    if (own == nullptr || !value)
      refuse(c, text, "not a number, or not one with a known unit",
             fmt::format("digits with a decimal point, without commas; units: {}", unit_list(si)));
    if (*own->meaning != '\0') said_units_[own->word] = own->meaning;
    return *value * own->value;
  }

  void read_car(const std::vector<std::string>& row) {
    Car car;
    car.line = table_.line();
    if (places_[kPosition]) {
      const std::string text = field(row, kPosition);
      const auto position = files::number<int>(text);
      if (!position || *position < 0) refuse(kPosition, text, "not a place in a train", "a whole number from 0");
      car.position = *position;
    }
    const std::string kind = field(row, kKind);
    car.type = types_.type(kind);
    if (car.type == nullptr) refuse_kind(kind);

    const std::optional<bool> loaded = load(row);
    const std::optional<double> weight = quantity(row, kWeight), length = quantity(row, kLength);
    const CarType& type = *car.type;
    if (!weight && !loaded && type.empty != type.loaded)
      refuse(kWeight, "", "neither a gross weight nor loaded or empty", "one of the two for each car");
    car.weight_of_type = !weight;
    car.length_of_type = !length;
    car.loaded = loaded.value_or(true);
    CarBlock& b = car.block;
    b.count = 1;
    b.weight = weight.value_or(car.loaded ? type.loaded : type.empty);
    const double over_faces = length.value_or(type.length);
    if (over_faces <= coupler_length_)
      refuse(kLength, field(row, kLength), "not longer than a coupler",
             fmt::format("> {:.4g} m over the pulling faces", coupler_length_));
    b.length = over_faces - coupler_length_;
    b.truck_spacing = type.truck_spacing * over_faces / type.length;
    if (*b.truck_spacing > b.length)
      refuse(kLength, field(row, kLength), "too short: the trucks would stand beyond the pins",
             fmt::format("a length for which {} suits", type.name));
    take_body(b, type);
    // A car brakes with one force, loaded or empty.
    if (type.loaded > b.weight) b.loaded_weight = type.loaded;
    check_ranges(b, row);
    if (weight && loaded && type.loaded > type.empty) {
      const bool heavy = *weight > 0.5 * (type.empty + type.loaded);
      if (heavy != *loaded)
        odd_.push_back(fmt::format("line {}: {}, but a gross weight of {:.4g} kip", car.line,
                                   *loaded ? "loaded" : "empty", *weight / kKip));
    }
    car.hazmat = hazmat(row);
    if (const std::string coupler = field(row, kCoupler); !coupler.empty()) {
      const CouplerType* known = types_.coupler(coupler);
      if (known == nullptr) {
        std::vector<std::string> names;
        for (const CouplerType& c : types_.couplers) names.push_back(c.name);
        refuse(kCoupler, coupler, "unknown coupler", fmt::format("{}", fmt::join(names, ", ")));
      }
      car.coupler = known->name;
    }
    cars_.push_back(std::move(car));
  }

  [[noreturn]] void refuse_kind(const std::string& kind) const {
    std::vector<std::string> names;
    for (const CarType& t : types_.types) names.push_back(t.name);
    const std::vector<std::string> near = files::near_misses(kind, types_.words());
    refuse(kKind, kind, kind.empty() ? "no kind of car" : "unknown kind of car",
           near.empty()
               ? fmt::format("{}, their other words, AAR codes, types of your own (--types)", fmt::join(names, ", "))
               : fmt::format("near it: {}", fmt::join(near, ", ")));
  }

  std::optional<bool> load(const std::vector<std::string>& row) const {
    const std::string text = field(row, kLoad), bare = bare_name(text);
    if (bare.empty()) return std::nullopt;
    for (const char* word : {"l", "ld", "load", "loaded", "full", "yes", "y", "true", "1"}) {
      if (bare == word) return true;
    }
    for (const char* word : {"e", "mt", "mty", "empty", "no", "n", "false", "0"}) {
      if (bare == word) return false;
    }
    refuse(kLoad, text, "neither loaded nor empty", "loaded, load, L, full, yes; empty, E, MT, no");
  }

  bool hazmat(const std::vector<std::string>& row) const {
    const std::string text = field(row, kHazmat), bare = bare_name(text);
    for (const char* word : {"", "no", "n", "none", "false", "0"}) {
      if (bare == word) return false;
    }
    for (const char* word : {"yes", "y", "true", "1", "x", "hm", "hazmat"}) {
      if (bare == word) return true;
    }
    const std::string digits = bare.compare(0, 2, "un") == 0 || bare.compare(0, 2, "na") == 0 ? bare.substr(2) : bare;
    constexpr std::size_t kUnDigits = 4;
    if (digits.size() == kUnDigits && files::number<int>(digits)) return true;
    refuse(kHazmat, text, "not understood", "yes, no, or a number such as UN1267");
  }

  /// The ranges of a scenario, told as those of the list.
  void check_ranges(const CarBlock& b, const std::vector<std::string>& row) const {
    try {
      Checker checker("");
      describe_block(checker, b);
    } catch (const InputError& e) {
      const Column c = e.key() == "weight" ? kWeight : e.key() == "length" ? kLength : kKind;
      refuse(c, field(row, c), fmt::format("{} {}: {}", e.key(), e.value(), e.problem()), e.allowed());
    }
  }

  void put_in_order() {
    if (!places_[kPosition]) return;
    std::stable_sort(cars_.begin(), cars_.end(), [](const Car& a, const Car& b) { return a.position < b.position; });
    for (std::size_t i = 1; i < cars_.size(); ++i) {
      const Car &before = cars_[i - 1], &car = cars_[i];
      if (car.position == before.position + 1) continue;
      const bool twice = car.position == before.position;
      throw InputError(fmt::format("{}:{}", path_, car.line), places_[kPosition]->header,
                       fmt::format("{}", car.position),
                       twice ? fmt::format("the same as in line {}", before.line)
                             : fmt::format("nothing stands at {}", before.position + 1),
                       "each place once, without gaps");
    }
  }

  static bool equal(const CarBlock& a, const CarBlock& b) {
    const std::vector<BlockEntry> own = entries(a), other = entries(b);
    return std::equal(own.begin(), own.end(), other.begin(), other.end(), [](const auto& x, const auto& y) {
      return x.key == y.key && (x.si == y.si || std::string_view(x.key) == "count");
    });
  }

  void join() {
    for (std::size_t i = 0; i < cars_.size(); ++i) {
      const Car& car = cars_[i];
      const int number = static_cast<int>(i) + 1;
      std::vector<TrainList::Block>& blocks = result_.blocks;
      if (!blocks.empty() && blocks.back().type == car.type->name && equal(blocks.back().cars, car.block) &&
          blocks.back().weight_of_type == car.weight_of_type && blocks.back().length_of_type == car.length_of_type) {
        ++blocks.back().cars.count;
      } else {
        blocks.push_back({car.block, number, car.type->name, {}, car.weight_of_type, car.length_of_type});
      }
      if (car.hazmat) blocks.back().hazmat.push_back(number);
    }
  }

  void choose_coupler() {
    std::map<std::string, int> counts;
    for (const Car& car : cars_) ++counts[car.coupler];
    if (counts.size() == 1 && counts.begin()->first.empty()) return;
    if (counts.size() == 1) {
      result_.coupler = types_.coupler(counts.begin()->first);
      return;
    }
    std::vector<std::string> each;
    for (const auto& [name, count] : counts)
      each.push_back(fmt::format("{} {}", name.empty() ? "not said" : name, count));
    assume("couplers differ (cars: {}): all get that of the group coupler; coupler_type of a block sets its own",
           fmt::join(each, ", "));
  }

  template <class... A>
  void assume(fmt::format_string<A...> text, A&&... arguments) {
    result_.assumptions.push_back(fmt::format(text, std::forward<A>(arguments)...));
  }

  /// "83 cars (covered_hopper 80, boxcar 3)", by a condition.
  template <class Condition>
  std::string count(Condition condition) const {
    std::map<std::string, int> by_type;
    int all = 0;
    for (const Car& car : cars_) {
      if (!condition(car)) continue;
      ++by_type[car.type->name];
      ++all;
    }
    std::vector<std::string> each;
    for (const auto& [name, n] : by_type) each.push_back(fmt::format("{} {}", name, n));
    return all == 0 ? "" : fmt::format("{} car{} ({})", all, all == 1 ? "" : "s", fmt::join(each, ", "));
  }

  void list_assumptions() {
    if (!places_[kPosition]) assume("order: as the rows stand, the foremost car first; no column of positions");
    for (const auto& [word, meaning] : said_units_) assume("{}: {}", word, meaning);
    if (const std::string cars = count([](const Car& c) { return c.weight_of_type && c.loaded; }); !cars.empty())
      assume("gross weight of {}: of the type, loaded", cars);
    if (const std::string cars = count([](const Car& c) { return c.weight_of_type && !c.loaded; }); !cars.empty())
      assume("gross weight of {}: of the type, empty", cars);
    if (const std::string cars = count([](const Car& c) { return c.length_of_type; }); !cars.empty())
      assume("length of {}: of the type", cars);
    assume("L, between the pins: length over the pulling faces less {:.4g} ft, the coupler.length of the scenario",
           coupler_length_ / kFoot);
    assume("width, truck spacing and heights of all cars: of the type; truck spacing in proportion to the length");
    for (const std::string& text : odd_) assume("{}: the weight is taken", text);
    if (!unused_.empty()) assume("columns that are not used: {}", fmt::join(unused_, ", "));
  }

  const CarTypes& types_;
  const double coupler_length_;
  files::CsvTable table_;
  const std::string path_;
  std::array<std::optional<Place>, kColumns> places_;
  std::vector<Car> cars_;
  std::vector<std::string> unused_, odd_;
  std::map<std::string, std::string> said_units_;
  TrainList result_;
};

}  // namespace

TrainList read_train_list(const std::string& path, const CarTypes& types, double coupler_length) {
  try {
    return Reader(path, types, coupler_length).read();
  } catch (const files::CsvError& e) {
    throw InputError(e.line() > 0 ? fmt::format("{}:{}", path, e.line()) : path, "", "", e.problem(), "");
  }
}

std::string describe_train_lists(const CarTypes& types) {
  std::string out = "| column | unit | other names | what |\n|---|---|---|---|\n";
  for (const ColumnNames& c : kColumnNames) {
    const std::string_view si = c.si;
    out += fmt::format("| {} | {} | {} | {} |\n", c.name,
                       si.empty()  ? ""
                       : si == "m" ? "length"
                                   : "weight",
                       fmt::join(c.also, ", "), c.meaning);
  }
  out += fmt::format("\n| units of | words |\n|---|---|\n| length | {} |\n| weight | {} |\n", unit_list("m"),
                     unit_list("N"));
  out += "\n| word | means |\n|---|---|\n";
  for (const UnitWord& u : kUnits) {
    if (*u.meaning != '\0') out += fmt::format("| {} | {} |\n", u.word, u.meaning);
  }
  out +=
      "\n| kind | AAR codes | other words | length, ft | empty, kip | loaded, kip | block |\n"
      "|---|---|---|---|---|---|---|\n";
  for (const CarType& t : types.types) {
    out += fmt::format("| {} | {} | {} | {:.6g} | {:.6g} | {:.6g} | {} |\n", t.name, fmt::join(t.codes, " "),
                       fmt::join(t.also, ", "), t.length / kFoot, t.empty / kKip, t.loaded / kKip, t.body);
  }
  out += "\n| coupler | other words |\n|---|---|\n";
  for (const CouplerType& c : types.couplers) out += fmt::format("| {} | {} |\n", c.name, fmt::join(c.also, ", "));
  return out;
}

}  // namespace train_derail::inputs
