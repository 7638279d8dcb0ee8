// What comes out, described once: each number, count, flag or text of a record has one entry with its name, unit, title
// and meaning. JSON, CSV, tables, journals, messages, the panel and the reference tables walk the entries.
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

/// A unit of the SI, the unit that people read beside it, and how both stand in tables.
struct Unit {
  std::string_view si;             ///< UDUNITS notation; "1": a pure number or count; "": neither (flags, texts)
  std::string_view shown;          ///< the one people read, "mph"; "" if the same
  double per_shown = 1.0;          ///< SI value of one `shown`
  int shown_digits = 0;            ///< behind the point, in tables
  std::string_view table_si = "";  ///< SI unit of a convenient size for tables, "kN"; "" if `si`
  double per_table_si = 1.0;       ///< SI value of one `table_si`
  int table_si_digits = 0;         ///< behind the point
};

/// A value: a number in SI, a count (also the place of a choice among its names), a flag, a text, several lines.
using Value = std::variant<double, std::int64_t, bool, std::string, std::vector<std::string>>;

/// One entry: a member of Record, or something that follows from it.
template <class Record>
struct Field {
  std::string_view name;                ///< in JSON, CSV, studies and messages
  Unit unit;                            //
  std::string_view title;               ///< for tables; "" if the value has no row of its own
  std::string_view meaning;             ///< one sentence
  std::vector<std::string_view> names;  ///< of a choice: what its values are called, in order; else empty

  std::function<Value(const Record&)> get;
  std::function<void(Record&, const Value&)> set;  ///< empty if the value follows from others

  /// Whether the row of a table says anything; empty: always.
  std::function<bool(const Record&)> when;
  /// What stands behind the value in a table: where, when; empty: nothing.
  std::function<std::string(const Record&)> note;
  bool compared = false;  ///< a number that studies and comparisons are made of

  Field& shown_when(std::function<bool(const Record&)> condition) {
    when = std::move(condition);
    return *this;
  }
  Field& noting(std::function<std::string(const Record&)> text) {
    note = std::move(text);
    return *this;
  }
  Field& in_studies() {
    compared = true;
    return *this;
  }
  Field& named(std::vector<std::string_view> all) {
    names = std::move(all);
    return *this;
  }
};

/// All entries of a record, in the order in which they are shown.
template <class Record>
class Fields {
 public:
  /// A member that `access(record)` gives by reference, for a const record and for one that is not.
  template <class Access>
  Field<Record>& add(std::string_view name, const Unit& unit, std::string_view title, std::string_view meaning,
                     const Access& access) {
    using Member = std::remove_const_t<std::remove_reference_t<decltype(access(std::declval<Record&>()))>>;
    Field<Record>& field = entry(name, unit, title, meaning);
    field.get = [access](const Record& r) -> Value { return to_value(access(r)); };
    field.set = [access](Record& r, const Value& v) { access(r) = from_value<Member>(v); };
    return field;
  }
  /// A value that follows from others.
  template <class Compute>
  Field<Record>& derive(std::string_view name, const Unit& unit, std::string_view title, std::string_view meaning,
                        const Compute& compute) {
    Field<Record>& field = entry(name, unit, title, meaning);
    field.get = [compute](const Record& r) -> Value { return to_value(compute(r)); };
    return field;
  }

  auto begin() const { return all_.begin(); }
  auto end() const { return all_.end(); }
  std::size_t size() const { return all_.size(); }
  /// Null if there is none of that name.
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

/// As a number; a flag is 0 or 1. Not for texts.
double number(const Value& value);
/// For CSV: numbers with all their digits, flags as 0 and 1, a choice by its name; lines joined by "; ".
std::string text(const Value& value, const std::vector<std::string_view>& names);
/// Name of a column of CSV: with the unit, where there is one: "gap_m", "moment_lead_N_m".
std::string column(std::string_view name, const Unit& unit);
/// " 12.34 m/s" and "27.6 mph", digits as the unit has them; the second is empty if both units are the same.
std::string in_si(double value, const Unit& unit);
std::string in_shown(double value, const Unit& unit);

}  // namespace train_derail::fields
