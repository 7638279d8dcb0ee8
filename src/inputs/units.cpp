#include "train_derail/inputs/units.hpp"

#include <cctype>
#include <charconv>
#include <stdexcept>
#include <string_view>

#include <udunits2.h>

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

}  // namespace

struct UnitSystem::Impl {
  struct SystemDeleter {
    void operator()(ut_system* s) const { ut_free_system(s); }
  };
  std::unique_ptr<ut_system, SystemDeleter> system;

  Impl() {
    ut_set_error_message_handler(ut_ignore);
    system.reset(ut_read_xml(nullptr));
    if (!system) throw std::runtime_error("UDUNITS-2 cannot read its unit database");
    // Names railways use; without these UDUNITS would read "mph" as milliphot.
    alias("mph", "mile/hour");
    alias("kph", "km/hour");
    alias("deg", "arc_degree");
    alias("kips", "kip");
    alias("tonf", "ton_force");
  }

  Unit parse(const std::string& text) const { return Unit(ut_parse(system.get(), text.c_str(), UT_UTF8)); }

  void alias(const char* name, const char* definition) {
    const Unit unit = parse(definition);
    if (!unit || ut_map_name_to_unit(name, UT_UTF8, unit.get()) != UT_SUCCESS) {
      throw std::runtime_error(std::string("UDUNITS-2 refuses the unit ") + name);
    }
  }

  Converter converter(const Unit& from, const std::string& from_text, const std::string& to_text) const {
    const Unit to = parse(to_text);
    if (!to) throw std::invalid_argument("unknown unit '" + to_text + "'");
    if (ut_are_convertible(from.get(), to.get()) == 0) {
      throw std::invalid_argument("wrong dimension: '" + from_text + "' cannot be converted to '" + to_text + "'");
    }
    return Converter(ut_get_converter(from.get(), to.get()));
  }
};

UnitSystem::UnitSystem() = default;
UnitSystem::~UnitSystem() = default;

UnitSystem::Impl& UnitSystem::impl() {
  if (!impl_) impl_ = std::make_unique<Impl>();
  return *impl_;
}

double UnitSystem::to_si(const std::string& text, const std::string& si_unit) {
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
  // UDUNITS would take "0.15.2" for 0.15 times .2.
  const bool second_number = (std::isdigit(static_cast<unsigned char>(unit_text[0])) != 0 || unit_text[0] == '.') &&
                             unit_text.compare(0, 2, "1/") != 0;
  const Unit unit = second_number ? nullptr : impl().parse(unit_text);
  if (!unit) throw std::invalid_argument("unknown unit '" + unit_text + "'");
  return cv_convert_double(impl().converter(unit, unit_text, si_unit).get(), number);
}

double UnitSystem::from_si(double value, const std::string& si_unit, const std::string& unit) {
  const Unit from = impl().parse(si_unit);
  if (!from) throw std::invalid_argument("unknown unit '" + si_unit + "'");
  return cv_convert_double(impl().converter(from, si_unit, unit).get(), value);
}

}  // namespace train_derail::inputs
