/// \file
/// Output fields, described once. Each number, count, flag or text of a record (car, coupler, outcome) has one entry
/// with its name, unit, title and meaning. JSON, CSV, tables, journals, messages, the panel and the reference tables
/// all go through these entries.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace train_derail::fields {

/// The SI unit of a value, the unit that people read beside it, and how both are printed in tables.
struct Unit {
  std::string_view si;     ///< SI unit in UDUNITS notation; "1" for a pure number or count, "" for flags and texts
  std::string_view shown;  ///< unit that people read, "mph"; "" if it is the SI unit
  double per_shown = 1.0;  ///< SI value of one unit `shown`
  int shown_digits = 0;    ///< digits after the decimal point in tables, for `shown`
  std::string_view table_si = "";  ///< SI unit of convenient size for tables, "kN"; "" if it is `si`
  double per_table_si = 1.0;       ///< SI value of one unit `table_si`
  int table_si_digits = 0;         ///< digits after the decimal point in tables, for `table_si`
  bool table_powers = false;       ///< whether tables print it in powers of ten, "1.2e-06"
};

/// The value of a field: a number in SI units, a whole number (a count, or the index of a choice among its names), a
/// flag, a text, or several lines of text.
using Value = std::variant<double, std::int64_t, bool, std::string, std::vector<std::string>>;

/// One field of a record: one of its members, or a value that is computed from them.
template <class Record>
struct Field {
  std::string_view name;                ///< name in JSON, CSV, studies and messages
  Unit unit;                            ///< units of the value
  std::string_view title;               ///< title in tables; "" if the value has no row of its own
  std::string_view meaning;             ///< explanation in one sentence
  std::vector<std::string_view> names;  ///< for a choice: the names of its values by index; else empty
  std::vector<std::string_view> words;  ///< for a choice: what tables print for its values by index; empty: the names

  std::function<Value(const Record&)> get;  ///< reads the value from a record
  /// Reads the value as a number, a flag as 0 or 1, without the detour by a Value; empty for texts.
  std::function<double(const Record&)> number;
  std::function<void(Record&, const Value&)>
      set;  ///< writes it to a record; empty if the value is computed from others

  /// Whether a table shows the row for this record; empty means always.
  std::function<bool(const Record&)> when;
  /// Remark behind the value in a table, such as where and when; empty means no remark.
  std::function<std::string(const Record&)> note;
  bool compared = false;  ///< whether it is a quantity, that is a number for studies and comparisons
  bool headline = false;  ///< whether short lists show it, such as the panel of RViz
  bool leading = false;   ///< whether the shortest list shows it, where a window is low

  /// Sets `when`.
  Field& shown_when(std::function<bool(const Record&)> condition) {
    when = std::move(condition);
    return *this;
  }
  /// Sets `note`.
  Field& noting(std::function<std::string(const Record&)> text) {
    note = std::move(text);
    return *this;
  }
  /// Makes the field a quantity.
  Field& in_studies() {
    compared = true;
    return *this;
  }
  /// Marks it for short lists, such as the panel of RViz.
  Field& as_headline() {
    headline = true;
    return *this;
  }
  /// Marks it for the shortest list too.
  Field& as_leading_headline() {
    leading = true;
    return as_headline();
  }
  /// Sets the names of a choice.
  Field& named(std::vector<std::string_view> all) {
    names = std::move(all);
    return *this;
  }
  /// Sets the words of a choice.
  Field& worded(std::vector<std::string_view> all) {
    words = std::move(all);
    return *this;
  }
};

/// All fields of a record, in the order in which they are shown.
template <class Record>
class Fields {
 public:
  /// Adds a member of the record. `access(record)` returns a reference to it, for const and for other records. The
  /// reference that add() returns is valid until the next field is added.
  template <class Access>
  Field<Record>& add(std::string_view name, const Unit& unit, std::string_view title, std::string_view meaning,
                     const Access& access) {
    using Member = std::remove_const_t<std::remove_reference_t<decltype(access(std::declval<Record&>()))>>;
    Field<Record>& field = entry(name, unit, title, meaning);
    reads(field, access);
    field.set = [access](Record& r, const Value& v) { access(r) = from_value<Member>(v); };
    return field;
  }
  /// Adds a value that `compute(record)` makes from other members.
  template <class Compute>
  Field<Record>& derive(std::string_view name, const Unit& unit, std::string_view title, std::string_view meaning,
                        const Compute& compute) {
    Field<Record>& field = entry(name, unit, title, meaning);
    reads(field, compute);
    return field;
  }

  /// Fields in their order.
  auto begin() const { return all_.begin(); }
  auto end() const { return all_.end(); }
  /// Number of fields.
  std::size_t size() const { return all_.size(); }
  /// Returns the field of this name, or null if there is none.
  const Field<Record>* find(std::string_view name) const {
    for (const Field<Record>& field : all_) {
      if (field.name == name) return &field;
    }
    return nullptr;
  }

 private:
  Field<Record>& entry(std::string_view name, const Unit& unit, std::string_view title, std::string_view meaning) {
    Field<Record>& field = all_.emplace_back();
    field.name = name;
    field.unit = unit;
    field.title = title;
    field.meaning = meaning;
    return field;
  }
  template <class Read>
  static void reads(Field<Record>& field, const Read& read) {
    field.get = [read](const Record& r) -> Value { return to_value(read(r)); };
    using Member = std::decay_t<decltype(read(std::declval<const Record&>()))>;
    if constexpr (std::is_arithmetic_v<Member> || std::is_enum_v<Member>)
      field.number = [read](const Record& r) { return static_cast<double>(read(r)); };
  }
  template <class T>
  static Value to_value(const T& member) {
    if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, double> || std::is_same_v<T, std::string> ||
                  std::is_same_v<T, std::vector<std::string>>) {
      return member;
    } else {
      static_assert(std::is_integral_v<T> || std::is_enum_v<T>);
      return static_cast<std::int64_t>(member);
    }
  }
  template <class T>
  static T from_value(const Value& value) {
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>)
      return static_cast<T>(std::get<std::int64_t>(value));
    else if constexpr (std::is_enum_v<T>) return static_cast<T>(std::get<std::int64_t>(value));
    else return std::get<T>(value);
  }

  std::vector<Field<Record>> all_;
};

/// Returns a value as text for CSV: numbers with all their digits, flags as 0 and 1, a choice by its name, several
/// lines joined by "; ".
std::string text(const Value& value, const std::vector<std::string_view>& names);
/// Returns the name of a column of CSV. It ends with the SI unit if there is one: "gap_m", "moment_lead_N_m".
std::string column(std::string_view name, const Unit& unit);
/// Returns a number as tables print it in SI units, without its unit: "12.34".
std::string number_in_si(double value, const Unit& unit);
/// Returns the unit of these numbers, "m/s" or "kN"; empty for pure numbers.
std::string unit_in_si(const Unit& unit);
/// Returns a number as tables print it in SI units, "12.34 m/s"; a pure number without a unit.
std::string in_si(double value, const Unit& unit);
/// Returns a number in the unit that people read, without it; empty if that is the SI unit, and for pure numbers.
std::string number_in_shown(double value, const Unit& unit);
/// The same in the unit that people read, "27.6 mph"; empty if that is the SI unit, and for pure numbers.
std::string in_shown(double value, const Unit& unit);

}  // namespace train_derail::fields
