/// \file
/// Records and their descriptions as dicts and arrays of Python.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "train_derail/fields/field.hpp"

namespace train_derail::python {

namespace py = pybind11;

inline py::str text(std::string_view s) { return {s.data(), s.size()}; }

/// Bytes that are no UTF-8 are replaced, as in JSON.
inline py::str readable(const std::string& s) {
  return py::reinterpret_steal<py::str>(PyUnicode_DecodeUTF8(s.data(), static_cast<py::ssize_t>(s.size()), "replace"));
}

inline py::object to_python(const fields::Value& value, const std::vector<std::string_view>& names) {
  if (!names.empty()) return text(names.at(static_cast<std::size_t>(std::get<std::int64_t>(value))));
  if (const auto* plain = std::get_if<std::string>(&value)) return readable(*plain);
  if (const auto* lines = std::get_if<std::vector<std::string>>(&value)) {
    py::list list;
    for (const std::string& line : *lines) list.append(readable(line));
    return list;
  }
  if (const auto* count = std::get_if<std::int64_t>(&value)) return py::int_(*count);
  if (const auto* flag = std::get_if<bool>(&value)) return py::bool_(*flag);
  return py::float_(std::get<double>(value));
}

/// A record as a dict, names and values as in JSON.
template <class Record>
py::dict to_dict(const fields::Fields<Record>& all, const Record& record) {
  py::dict dict;
  for (const auto& field : all) dict[text(field.name)] = to_python(field.get(record), field.names);
  return dict;
}

/// What is said of each field: a list of (name, type, unit, shown unit, SI value of a shown unit, title, meaning,
/// choices, column of CSV).
template <class Record>
py::list descriptions(const fields::Fields<Record>& all) {
  py::list list;
  for (const auto& field : all) {
    const py::object sample = to_python(field.get(Record{}), field.names);
    py::list choices;
    for (const std::string_view name : field.names) choices.append(text(name));
    list.append(py::make_tuple(text(field.name), py::type::of(sample), text(field.unit.si), text(field.unit.shown),
                               field.unit.per_shown, text(field.title), text(field.meaning), py::tuple(choices),
                               fields::column(field.name, field.unit)));
  }
  return list;
}

/// The fields of many records, each an array of numbers. Filled without the interpreter.
template <class Record>
class Columns {
 public:
  explicit Columns(const fields::Fields<Record>& all) : all_(all), values_(all.size()) {}

  void add(const Record& record) {
    std::size_t i = 0;
    for (const auto& field : all_) {
      if (field.number) values_[i].push_back(field.number(record));
      ++i;
    }
  }

  /// A dict of arrays of this shape; the interpreter must be held. Counts are int64, flags bool, choices their names.
  py::dict take(const std::vector<py::ssize_t>& shape) {
    py::dict dict;
    std::size_t i = 0;
    for (const auto& field : all_) {
      if (field.number) dict[text(field.name)] = array(field, std::move(values_[i]), shape);
      ++i;
    }
    return dict;
  }

 private:
  static py::object array(const fields::Field<Record>& field, std::vector<double>&& values,
                          const std::vector<py::ssize_t>& shape) {
    const fields::Value sample = field.get(Record{});
    auto* kept = new std::vector<double>(std::move(values));
    const py::capsule owner(kept, [](void* p) { delete static_cast<std::vector<double>*>(p); });
    py::object numbers = py::array_t<double>(shape, kept->data(), owner);
    if (std::holds_alternative<double>(sample)) return numbers;
    if (std::holds_alternative<bool>(sample)) return numbers.attr("astype")(py::dtype::of<bool>());
    py::object counts = numbers.attr("astype")(py::dtype::of<std::int64_t>());
    if (field.names.empty()) return counts;
    py::list names;
    for (const std::string_view name : field.names) names.append(text(name));
    return py::module_::import("numpy").attr("array")(names)[counts];
  }

  const fields::Fields<Record>& all_;
  std::vector<std::vector<double>> values_;
};

}  // namespace train_derail::python
