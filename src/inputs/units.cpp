#include "train_derail/inputs/units.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <udunits2.h>

#include "c_locale.hpp"
#include "train_derail/files/near_misses.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/scenario.hpp"

namespace train_derail::inputs {

namespace {

struct UnitDeleter {
  void operator()(ut_unit* u) const { ut_free(u); }
};
struct ConverterDeleter {
  void operator()(cv_converter* c) const { cv_free(c); }
};
using Unit = std::unique_ptr<ut_unit, UnitDeleter>;
using Converter = std::unique_ptr<cv_converter, ConverterDeleter>;

[[noreturn]] void refuse(const std::string& problem) { throw std::invalid_argument(problem); }

std::string quoted(std::string_view text) { return "'" + printable(text, kShownMax) + "'"; }

/// Whether a name is a unit with an SI prefix as railroads use it. UDUNITS accepts any prefix before any name, so that
/// "kmph" would be 1000 mph, and "Mkip" and "mmph" would be units. Such names are unknown here.
bool known_with_prefix(std::string_view name) {
  struct Prefixes {
    std::string_view base;
    std::initializer_list<std::string_view> prefixes;
  };
  static constexpr std::array<std::string_view, 6> kLongPrefixes{"kilo", "mega", "giga", "centi", "milli", "micro"};
  static const Prefixes kShort[] = {{"m", {"k", "d", "c", "m", "u", "\u00b5", "\u03bc"}},
                                    {"g", {"k", "M", "m"}},
                                    {"N", {"k", "M", "G", "m", "da"}},
                                    {"s", {"m", "u", "\u00b5", "\u03bc"}},
                                    {"rad", {"m"}},
                                    {"J", {"k", "M", "G"}},
                                    {"Pa", {"k", "M", "G"}}};
  for (const Prefixes& p : kShort) {
    for (const std::string_view prefix : p.prefixes) {
      if (name.size() == prefix.size() + p.base.size() && name.substr(0, prefix.size()) == prefix &&
          name.substr(prefix.size()) == p.base)
        return true;
    }
  }
  for (const std::string_view prefix : kLongPrefixes) {
    if (name.substr(0, prefix.size()) != prefix) continue;
    for (const std::string_view base :
         {"meter", "meters", "metre", "metres", "gram", "grams", "newton", "newtons", "second", "seconds", "radian",
          "radians", "joule", "joules", "pascal", "pascals"}) {
      if (name.substr(prefix.size()) == base) return true;
    }
  }
  return false;
}

/// The unit database of UDUNITS, read when it is first used. There is one for the process, behind a lock: the library
/// never frees all memory of a database, and its parser must not be used by several threads at once. It must be used in
/// the C locale.
class Database {
 public:
  static Database& instance() {
    static Database database;
    return database;
  }

  std::mutex mutex;

  Unit parse(const std::string& text) const { return Unit(ut_parse(system_.get(), text.c_str(), UT_UTF8)); }

  /// Whether a name is a unit without a prefix, or one with a usual prefix.
  bool knows(const std::string& name) const {
    if (known_with_prefix(name)) return true;
    return Unit(ut_get_unit_by_name(system_.get(), name.c_str())) ||
           Unit(ut_get_unit_by_symbol(system_.get(), name.c_str()));
  }

  static bool convertible(const Unit& a, const Unit& b) { return a && b && ut_are_convertible(a.get(), b.get()) != 0; }

  static Unit product(const Unit& a, const Unit& b) { return a && b ? Unit(ut_multiply(a.get(), b.get())) : nullptr; }

  static double convert(const Unit& from, const Unit& to, double value) {
    return cv_convert_double(Converter(ut_get_converter(from.get(), to.get())).get(), value);
  }

  /// Whether a unit contains an angle. UDUNITS itself takes radians for pure numbers.
  static bool angular(const Unit& unit) {
    std::array<char, 256> text{};
    const int length = ut_format(unit.get(), text.data(), text.size() - 1, UT_ASCII | UT_DEFINITION);
    return length > 0 && std::string_view(text.data()).find("rad") != std::string_view::npos;
  }

 private:
  struct SystemDeleter {
    void operator()(ut_system* s) const { ut_free_system(s); }
  };

  Database() {
    ut_set_error_message_handler(ut_ignore);
    system_.reset(ut_read_xml(nullptr));
    if (!system_)
      throw std::runtime_error("UDUNITS-2 cannot read its unit database (environment variable UDUNITS2_XML_PATH?)");
    // Names that railroads use. Without these, UDUNITS would read "mph" as milliphot.
    alias("mph", "mile/hour");
    alias("kph", "km/hour");
    alias("deg", "arc_degree");
    alias("kips", "kip");
    alias("tonf", "ton_force");
  }

  void alias(const char* name, const char* definition) const {
    const Unit unit = parse(definition);
    if (!unit || ut_map_name_to_unit(name, UT_UTF8, unit.get()) != UT_SUCCESS) {
      throw std::runtime_error(std::string("UDUNITS-2 refuses the unit ") + name);
    }
  }

  std::unique_ptr<ut_system, SystemDeleter> system_;
};

/// Units that nearly every scenario uses or shows. UDUNITS knows them too, and reads them to the same bits, but reading
/// its database takes longer than the rest of the start of a run.
struct CommonUnit {
  std::string_view unit, si_unit;
  double in_si;
};
constexpr CommonUnit kCommonUnits[] = {
    {"ft", "m", kFoot},
    {"ft/s", "m/s", kFoot},
    {"mph", "m/s", kMph},
    {"kip", "N", kKip},
    {"lbf/ft", "N/m", kPoundForce / kFoot},
    {"lbf ft", "N m", kPoundForce* kFoot},
    {"lbf ft/rad", "N m/rad", kPoundForce* kFoot},
    {"deg", "rad", kDegree},
    {"in", "m", kFoot / 12.0},
    {"kip/in", "N/m", kKip / (kFoot / 12.0)},
    {"mm", "m", 1e-3},
    {"km/h", "m/s", 1.0 / 3.6},
    {"kN", "N", 1e3},
    {"MN/m", "N/m", 1e6},
    {"1/km", "1/m", 1e-3},
    {"percent", "1", 1e-2},
    {"ms", "s", 1e-3},
    {"m", "m", 1.0},
    {"m/s", "m/s", 1.0},
    {"s", "s", 1.0},
    {"rad/s", "rad/s", 1.0},
};

/// Returns the common unit, or null if it is none of them.
const CommonUnit* common_unit(std::string_view unit, std::string_view si_unit) {
  for (const CommonUnit& c : kCommonUnits) {
    if (c.unit == unit && c.si_unit == si_unit) return &c;
  }
  return nullptr;
}

/// Units to be proposed for each SI unit of an input, the usual one first.
struct Advice {
  std::string_view si_unit;
  std::initializer_list<const char*> units;
};
const std::initializer_list<Advice> kAdvice{
    {"m/s", {"mph", "km/h", "ft/s", "m/s", "knot"}},
    {"m", {"ft", "m", "in", "mm", "cm", "km", "mile", "yard"}},
    {"N", {"kip", "kN", "lbf", "N", "MN", "kgf", "tonf"}},
    {"N/m", {"lbf/ft", "kip/ft", "lbf/in", "kip/in", "N/m", "kN/m", "MN/m", "kN/mm"}},
    {"N m", {"lbf ft", "kip ft", "N m", "kN m", "MN m"}},
    {"N m/rad", {"lbf ft/rad", "kip ft/rad", "N m/rad", "kN m/rad", "MN m/rad", "lbf ft/deg"}},
    {"rad", {"deg", "rad"}},
    {"rad/s", {"rad/s", "deg/s", "rpm"}},
    {"s", {"s", "ms", "min"}},
    {"kg m2", {"slug ft2", "kg m2", "lb ft2"}},
    {"1/m", {"deg/(100 ft)", "1/m", "1/km"}},
    {"1", {"percent"}}};

/// Returns only the letters and digits of a unit, in lower case.
std::string bare(std::string_view unit) {
  std::string out;
  for (const char c : unit) {
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      out += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return out;
}

/// Returns " (probably km/h)" if the unit seems to be misspelt, else a list of the units for this SI unit.
std::string advice(std::string_view unit, std::string_view si_unit) {
  const auto* known =
      std::find_if(kAdvice.begin(), kAdvice.end(), [&](const Advice& a) { return a.si_unit == si_unit; });
  if (known == kAdvice.end()) return "";
  struct Slip {
    std::string_view written, meant;
  };
  static constexpr Slip kSlips[] = {{"kmph", "km/h"},
                                    {"kms", "km/h"},
                                    {"kmhr", "km/h"},
                                    {"kmperh", "km/h"},
                                    {"kmperhour", "km/h"},
                                    {"kmphr", "km/h"},
                                    {"mps", "m/s"},
                                    {"fps", "ft/s"},
                                    {"kts", "knot"},
                                    {"kt", "knot"},
                                    {"kn", "knot"},
                                    {"mip", "mph"},
                                    {"ftlb", "lbf ft"},
                                    {"ftlbf", "lbf ft"},
                                    {"ftlbs", "lbf ft"},
                                    {"lbft", "lbf ft"},
                                    {"lbsft", "lbf ft"},
                                    {"klb", "kip"},
                                    {"klbf", "kip"},
                                    {"tf", "tonf"},
                                    {"m", "min"},
                                    {"sek", "s"},
                                    {"msec", "ms"},
                                    {"k", "kip"},
                                    {"kp", "kgf"},
                                    {"rads", "rad/s"},
                                    {"degs", "deg/s"},
                                    {"klbs", "kip"},
                                    {"ftlb", "lbf ft/rad"},
                                    {"ftlbf", "lbf ft/rad"},
                                    {"ftlbrad", "lbf ft/rad"},
                                    {"ftlbfrad", "lbf ft/rad"},
                                    {"lbftrad", "lbf ft/rad"},
                                    {"dps", "deg/s"}};
  const std::string written = bare(unit);
  const auto probably = [](const char* meant) { return fmt::format(" (probably {})", meant); };
  for (const Slip& slip : kSlips) {
    for (const char* meant : known->units) {
      if (slip.written == written && slip.meant == meant) return probably(meant);
    }
  }
  for (const char* meant : known->units) {
    if (written == bare(meant)) return probably(meant);
  }
  for (const char* meant : known->units) {
    if (written.size() > 2 && bare(meant).size() > 1 && files::one_slip(written, bare(meant))) return probably(meant);
  }
  std::string all;
  for (const char* u : known->units) all += (all.empty() ? " (known: " : ", ") + std::string(u);
  return all + ", ...)";
}

bool digit(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

/// Checks a unit and returns it as UDUNITS reads it. Allowed are known names, joined by spaces, '*', '.', '-', '/' or
/// "per", with whole exponents. Numbers are allowed only in parentheses, as in "deg/(100 ft)". UDUNITS itself accepts
/// more, for example "37 mph 2" as 74 mph.
std::string checked(const Database& units, std::string_view text, std::string_view si_unit) {
  std::string out;
  const auto unknown = [&] { refuse("unknown unit " + quoted(text) + advice(text, si_unit)); };
  bool after_name = false;  // whether an exponent may follow
  int open = 0;
  for (std::string_view rest = text; !rest.empty();) {
    const files::Character c = files::first_character(rest);
    const auto is_letter = [](const files::Character& x) {
      return x.valid &&
             ((x.code < 0x80 && (std::isalpha(static_cast<int>(x.code)) != 0 || x.code == '_' || x.code == '%')) ||
              x.code == 0xb5 || x.code == 0x3bc || x.code == 0xb0);
    };
    if (is_letter(c)) {
      std::size_t size = 0;
      while (size < rest.size()) {
        const files::Character next = files::first_character(rest.substr(size));
        if (!is_letter(next)) break;
        size += next.bytes;
      }
      const std::string name(rest.substr(0, size));
      rest.remove_prefix(size);
      if (name == "per" || name == "PER") {
        out += '/';
        after_name = false;
        continue;
      }
      if (!units.knows(name)) unknown();
      out += name;
      after_name = true;
      continue;
    }
    if (c.code == 0xb2 || c.code == 0xb3) {  // the characters for squared and cubed
      if (!after_name) unknown();
      out += c.code == 0xb2 ? '2' : '3';
      after_name = false;
      rest.remove_prefix(c.bytes);
      continue;
    }
    if (c.code == 0xb7 || c.code == 0x22c5) {  // the dots that stand for multiplication
      out += ' ';
      after_name = false;
      rest.remove_prefix(c.bytes);
      continue;
    }
    if (!c.valid || c.code >= 0x80) {
      refuse(fmt::format("unit {} has a character that no unit has (U+{:04X})", quoted(text),
                         static_cast<unsigned>(c.code)));
    }
    const char ch = rest[0];
    if (after_name &&
        (digit(ch) || ch == '^' || rest.substr(0, 2) == "**" || (ch == '-' && rest.size() > 1 && digit(rest[1])))) {
      std::string exponent;
      if (ch == '^') rest.remove_prefix(1);
      if (ch == '*') rest.remove_prefix(2);
      if (!rest.empty() && (rest[0] == '-' || rest[0] == '+')) {
        if (rest[0] == '-') exponent = "-";
        rest.remove_prefix(1);
      }
      if (rest.empty() || !digit(rest[0]) || rest[0] > '4' || (rest.size() > 1 && (digit(rest[1]) || rest[1] == '.')))
        unknown();
      out += exponent + rest[0];
      rest.remove_prefix(1);
      after_name = false;
      continue;
    }
    if (digit(ch)) {
      const bool in_parentheses = !out.empty() && out.back() == '(',
                 reciprocal = out.empty() && rest.size() > 1 && ch == '1' && rest[1] == '/';
      if (!in_parentheses && !reciprocal)
        refuse("a second number in " + quoted(text) + ": write one number and one unit" + advice(text, si_unit));
      std::size_t size = 0;
      while (size < rest.size() && (digit(rest[size]) || rest[size] == '.')) ++size;
      out += rest.substr(0, size);
      rest.remove_prefix(size);
      continue;
    }
    if (ch == ' ' || ch == '*' || ch == '.' || ch == '-') {
      if (out.empty()) unknown();
      if (out.back() != ' ') out += ' ';
    } else if (ch == '/' || ch == '(' || ch == ')') {
      out += ch;
      open += ch == '(' ? 1 : ch == ')' ? -1 : 0;
      if (open < 0) unknown();
    } else {
      unknown();
    }
    after_name = ch == ')';
    rest.remove_prefix(1);
  }
  if (open != 0) unknown();
  return out;
}

/// Returns 46.5 for "46 ft 6 in" or 46' 6". `first` is the number that has been read, `rest` the text behind it.
/// Returns nothing if the text is not of this kind.
std::optional<double> feet_and_inches(double first, std::string_view rest) {
  const auto skip = [&] { rest.remove_prefix(std::min(rest.find_first_not_of(" -"), rest.size())); };
  const auto word = [&](std::initializer_list<std::string_view> words) {
    for (const std::string_view w : words) {
      if (rest.substr(0, w.size()) == w) {
        rest.remove_prefix(w.size());
        skip();
        return true;
      }
    }
    return false;
  };
  double inches = 0.0;
  if (word({"\"", "''", "\u2033", "\u201d"})) return rest.empty() ? std::optional<double>(first / 12.0) : std::nullopt;
  if (!word({"feet", "foot", "ft.", "ft", "'", "\u2032", "\u2019"})) return std::nullopt;
  if (rest.empty()) return first;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), inches);
  if (error != std::errc()) return std::nullopt;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  skip();
  if (!rest.empty() && !word({"inches", "inch", "in.", "in", "\"", "''", "\u2033", "\u201d"})) return std::nullopt;
  return rest.empty() ? std::optional<double>(first + std::copysign(inches / 12.0, first)) : std::nullopt;
}

}  // namespace

double to_si(const std::string& text, const std::string& si_unit) {
  constexpr const char* kSpace = " \t";
  std::string_view rest = text;
  rest.remove_prefix(std::min(rest.find_first_not_of(kSpace), rest.size()));
  if (rest.size() > 1 && rest.front() == '+' && rest[1] != '-') rest.remove_prefix(1);
  double number = 0.0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error == std::errc::result_out_of_range) refuse("number too large or too small");
  if (error != std::errc()) refuse("not a number");
  if (!std::isfinite(number)) refuse("not a finite number");
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  const auto first = rest.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return number;
  const std::string unit_text(rest.substr(first, rest.find_last_not_of(kSpace) - first + 1));
  if (const CommonUnit* common = common_unit(unit_text, si_unit)) return number * common->in_si;

  if (rest[0] == ',') refuse("a comma in a number: write a decimal point (0.5), and nothing between thousands");
  if (rest[0] == '_') refuse("an underscore in a number");
  if (number == 0.0 && (rest[0] == 'x' || rest[0] == 'X') && rest.size() > 1 &&
      std::isxdigit(static_cast<unsigned char>(rest[1])) != 0) {
    refuse("a hexadecimal number");
  }
  // A second decimal point is not the beginning of a unit: "0.15.2".
  if (first == 0 && rest[0] == '.') refuse("unknown unit " + quoted(unit_text));
  if (si_unit == "m" && unit_text.find_first_of("0123456789'\"\xe2") != std::string::npos) {
    if (const auto feet = feet_and_inches(number, unit_text))
      refuse(fmt::format("feet and inches: write {:.6g} ft", *feet));
  }
  const CLocale c_locale;
  Database& units = Database::instance();
  const std::lock_guard<std::mutex> lock(units.mutex);
  const Unit to = units.parse(si_unit), unit = units.parse(checked(units, unit_text, si_unit));
  if (!to) refuse("unknown unit " + quoted(si_unit));
  if (!unit) refuse("unknown unit " + quoted(unit_text) + advice(unit_text, si_unit));
  const std::string wrong = fmt::format("wrong dimension: {} cannot be converted to '{}'", quoted(unit_text), si_unit);
  if (!Database::convertible(unit, to)) {
    const Unit kilogram = units.parse("kg"), gravity = units.parse("m/s2");
    if (si_unit == "N" && Database::convertible(unit, kilogram)) {
      const double weight = Database::convert(unit, kilogram, number) * kStandardGravity;
      const auto rounded = [](double v) { return v < 100.0 ? fmt::format("{:.3g}", v) : fmt::format("{:.0f}", v); };
      refuse(
          fmt::format("a mass, but a weight is needed: {} kN, {} kip", rounded(1e-3 * weight), rounded(weight / kKip)));
    }
    if (Database::convertible(Database::product(unit, gravity), to))
      refuse(wrong + ": a mass instead of a force (write lbf, kgf or N, not lb or kg)");
    if (Database::convertible(unit, Database::product(to, gravity)))
      refuse(wrong + ": a force instead of a mass (write lb or kg, not lbf, kgf or N)");
    refuse(wrong);
  }
  const bool angle = Database::angular(unit);
  if (angle && si_unit == "1") refuse(wrong + ": an angle");
  if (!angle && (si_unit == "rad" || (si_unit == "rad/s" && (unit_text == "Hz" || unit_text == "hertz")))) {
    refuse(wrong + ": not an angle" + advice(unit_text, si_unit));
  }
  const double value = Database::convert(unit, to, number);
  if (!std::isfinite(value)) refuse("number too large or too small");
  return value;
}

double from_si(double value, const std::string& si_unit, const std::string& unit) {
  if (const CommonUnit* common = common_unit(unit, si_unit)) return value / common->in_si;
  const CLocale c_locale;
  Database& units = Database::instance();
  const std::lock_guard<std::mutex> lock(units.mutex);
  const Unit from = units.parse(si_unit), to = units.parse(checked(units, unit, si_unit));
  if (!from) refuse("unknown unit " + quoted(si_unit));
  if (!to) refuse("unknown unit " + quoted(unit));
  if (!Database::convertible(from, to))
    refuse(fmt::format("wrong dimension: '{}' cannot be converted to {}", si_unit, quoted(unit)));
  return Database::convert(from, to, value);
}

}  // namespace train_derail::inputs
