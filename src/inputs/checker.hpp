/// \file
/// Checks the range of every number of a scenario or study.
#pragma once

#include <cmath>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "schema.hpp"
#include "train_derail/files/text.hpp"
#include "train_derail/inputs/error.hpp"

namespace train_derail::inputs {

[[noreturn]] inline void refuse(const std::string& key, const std::string& value, const std::string& problem,
                                const std::string& allowed) {
  throw InputError("scenario", key, value, problem, allowed);
}

/// Visitor of a schema that throws InputError for the first value out of its range.
class Checker {
 public:
  explicit Checker(std::string prefix) : prefix_(std::move(prefix)) {}

  void text(const char* key, const std::string& value, const Doc&) {
    constexpr std::size_t kBytesMax = 1000;
    if (value.size() > kBytesMax)
      refuse(prefix_ + key, value, fmt::format("{} bytes long", value.size()), fmt::format("at most {}", kBytesMax));
    for (std::string_view rest = value; !rest.empty();) {
      const files::Character c = files::first_character(rest);
      if (!c.valid || (files::is_control(c.code) && c.code != '\n' && c.code != '\t')) {
        refuse(prefix_ + key, value, c.valid ? "a control character" : "not UTF-8", "printable text");
      }
      rest.remove_prefix(c.bytes);
    }
  }
  void text_or_group(const char* key, const std::string& value, const YAML::Node&, const Doc& doc) {
    text(key, value, doc);
  }
  void value(const char*, const std::string&, const Doc&) {}
  void texts(const char*, const std::vector<std::string>&, const Doc&) {}

  void number(const char* key, double value, const NumberInput& q, const Doc&) {
    if (q.range.contains(value)) return;
    refuse(prefix_ + key, fmt::format("{}", value), std::isfinite(value) ? "out of range" : "not a finite number",
           q.range.text(q.unit));
  }
  void number(const char* key, const std::optional<double>& value, const NumberInput& q, const Doc& doc) {
    if (value) number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range& range, bool, const Doc&) {
    if (!range.contains(static_cast<double>(value))) {
      refuse(prefix_ + key, fmt::format("{}", value), "out of range", range.text("1"));
    }
  }
  template <class E, class N>
  void choice(const char*, E, const N&, const Doc&) {}
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const Doc&) {
    Checker child(prefix_ + key + ".");
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>& items, F describe_it, const Doc&, bool required) {
    if (required && items.empty()) refuse(prefix_ + key, "", "the train has no cars", "at least one block of cars");
    for (std::size_t i = 0; i < items.size(); ++i) {
      Checker child(fmt::format("{}{}[{}].", prefix_, key, i));
      describe_it(child, items[i]);
    }
  }

 private:
  std::string prefix_;
};

}  // namespace train_derail::inputs
