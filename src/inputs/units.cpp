#include "train_derail/inputs/units.hpp"

#include <cctype>
#include <charconv>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string_view>

#include <udunits2.h>

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

/// The unit database, read at first use. One for the process, behind a lock: the library never frees all of a database,
/// and its parser is not made for several threads.
class Database {
 public:
  static Database& instance() {
    static Database database;
    return database;
  }

  std::mutex mutex;

  Unit parse(const std::string& text) const { return Unit(ut_parse(system_.get(), text.c_str(), UT_UTF8)); }

  Converter converter(const Unit& from, const std::string& from_text, const std::string& to_text) const {
    const Unit to = parse(to_text);
    if (!to) throw std::invalid_argument("unknown unit '" + to_text + "'");
    if (ut_are_convertible(from.get(), to.get()) == 0) {
      throw std::invalid_argument("wrong dimension: '" + from_text + "' cannot be converted to '" + to_text + "'");
    }
    return Converter(ut_get_converter(from.get(), to.get()));
  }

 private:
  struct SystemDeleter {
    void operator()(ut_system* s) const { ut_free_system(s); }
  };

  Database() {
    ut_set_error_message_handler(ut_ignore);
    system_.reset(ut_read_xml(nullptr));
    if (!system_) throw std::runtime_error("UDUNITS-2 cannot read its unit database");
    // Names railways use; without these UDUNITS would read "mph" as milliphot.
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

/// Units that nearly every scenario has. UDUNITS knows them as well; but reading its database takes longer than most runs.
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
    {"lbf ft", "N m", kPoundForce * kFoot},
    {"lbf ft/rad", "N m/rad", kPoundForce * kFoot},
    {"deg", "rad", kDegree},
    {"m", "m", 1.0},
    {"m/s", "m/s", 1.0},
    {"s", "s", 1.0},
    {"rad/s", "rad/s", 1.0},
};

/// Null if it is none of them.
const CommonUnit* common_unit(std::string_view unit, std::string_view si_unit) {
  for (const CommonUnit& c : kCommonUnits) {
    if (c.unit == unit && c.si_unit == si_unit) return &c;
  }
  return nullptr;
}

}  // namespace

double to_si(const std::string& text, const std::string& si_unit) {
  constexpr const char* kSpace = " \t";
  std::string_view rest = text;
  rest.remove_prefix(std::min(rest.find_first_not_of(kSpace), rest.size()));
  if (!rest.empty() && rest.front() == '+') rest.remove_prefix(1);
  double number = 0.0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error == std::errc::result_out_of_range) throw std::invalid_argument("number too large or too small");
  if (error != std::errc()) throw std::invalid_argument("not a number");
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  const auto first = rest.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return number;
  const std::string unit_text(rest.substr(first, rest.find_last_not_of(kSpace) - first + 1));
  if (const CommonUnit* common = common_unit(unit_text, si_unit)) return number * common->in_si;
  // UDUNITS would take "0.15.2" for 0.15 times .2.
  const bool second_number = (std::isdigit(static_cast<unsigned char>(unit_text[0])) != 0 || unit_text[0] == '.') &&
                             unit_text.compare(0, 2, "1/") != 0;
  Database& units = Database::instance();
  const std::lock_guard<std::mutex> lock(units.mutex);
  const Unit unit = second_number ? nullptr : units.parse(unit_text);
  if (!unit) throw std::invalid_argument("unknown unit '" + unit_text + "'");
  return cv_convert_double(units.converter(unit, unit_text, si_unit).get(), number);
}

double from_si(double value, const std::string& si_unit, const std::string& unit) {
  if (const CommonUnit* common = common_unit(unit, si_unit)) return value / common->in_si;
  Database& units = Database::instance();
  const std::lock_guard<std::mutex> lock(units.mutex);
  const Unit from = units.parse(si_unit);
  if (!from) throw std::invalid_argument("unknown unit '" + si_unit + "'");
  return cv_convert_double(units.converter(from, si_unit, unit).get(), value);
}

}  // namespace train_derail::inputs
