#include <cmath>

#include "schema.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"

namespace train_derail::inputs {

namespace {

[[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& problem,
                         const std::string& allowed) {
  throw InputError("scenario", key, value, problem, allowed);
}

class Checker {
 public:
  explicit Checker(std::string prefix) : prefix_(std::move(prefix)) {}

  void text(const char*, const std::string&, const char*) {}

  void number(const char* key, double value, const Quantity& q, const char*) {
    if (q.range.contains(value)) return;
    refuse(prefix_ + key, fmt::format("{}", value), std::isfinite(value) ? "out of range" : "not a finite number",
           q.range.text(q.unit));
  }
  void number(const char* key, const std::optional<double>& value, const Quantity& q, const char* doc) {
    if (value) number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char* key, I value, const Range& range, bool, const char*) {
    if (!range.contains(static_cast<double>(value))) {
      refuse(prefix_ + key, fmt::format("{}", value), "out of range", range.text("1"));
    }
  }
  template <class E, class N>
  void choice(const char*, E, const N&, const char*) {}
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const char*) {
    Checker child(prefix_ + key + ".");
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>& items, F describe_it, const char*) {
    if (items.empty()) refuse(prefix_ + key, "", "empty train", "at least one block of cars");
    for (std::size_t i = 0; i < items.size(); ++i) {
      Checker child(fmt::format("{}{}[{}].", prefix_, key, i));
      describe_it(child, items[i]);
    }
  }

 private:
  std::string prefix_;
};

void check_across(const Scenario& s) {
  int cars = 0;
  for (std::size_t i = 0; i < s.consist.size(); ++i) {
    const CarBlock& b = s.consist[i];
    const auto key = [i](const char* name) { return fmt::format("consist[{}].{}", i, name); };
    const auto either = [&](const char* name, const std::optional<double>& value, const char* factor_name,
                            const std::optional<double>& factor) {
      if (value && factor) {
        refuse(key(factor_name), fmt::format("{}", *factor), fmt::format("given beside {}", name), "one of the two");
      }
    };
    either("truck_spacing", b.truck_spacing, "truck_spacing_factor", b.truck_spacing_factor);
    either("yaw_inertia", b.yaw_inertia, "yaw_inertia_factor", b.yaw_inertia_factor);
    if (b.truck_spacing && *b.truck_spacing > b.length) {
      refuse(key("truck_spacing"), fmt::format("{}", *b.truck_spacing), "trucks farther apart than the coupler pins",
             fmt::format("(0, {}] m", b.length));
    }
    cars += b.count;
    if (cars > kCarsMax) {
      refuse(key("count"), fmt::format("{}", b.count), fmt::format("the train has {} cars up to here", cars),
             fmt::format("at most {} in all", kCarsMax));
    }
  }
  if (s.coupler.slack >= 2.0 * s.coupler.length) {
    refuse("coupler.slack", fmt::format("{}", s.coupler.slack), "as long as the coupler itself",
           fmt::format("[0, {}) m", 2.0 * s.coupler.length));
  }
  if (s.solver.fixed_step && s.solver.method == Method::bdf) {
    refuse("solver.fixed_step", fmt::format("{}", *s.solver.fixed_step), "bdf chooses its own steps",
           "leave it out, or solver.method cash_karp or dormand_prince");
  }
}

}  // namespace

void validate(const Scenario& scenario) {
  Checker checker("");
  describe(checker, scenario);
  check_across(scenario);
}

}  // namespace train_derail::inputs
