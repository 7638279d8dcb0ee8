#include "train_derail/inputs/warnings.hpp"

#include <algorithm>
#include <map>
#include <set>

#include <fmt/ranges.h>

#include "schema.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/keys.hpp"
#include "train_derail/inputs/units.hpp"

namespace train_derail::inputs {

namespace {

std::string shown(double value, const std::string& unit, const std::string& shown_unit) {
  if (value == kInfinity) return ".inf";
  if (unit == "1" && shown_unit.empty()) return fmt::format("{:.4g}", value);
  if (shown_unit.empty()) return fmt::format("{:.4g} {}", value, unit);
  return fmt::format("{:.4g} {}", from_si(value, unit, shown_unit), shown_unit);
}

/// Visitor of the schema that finds numbers outside their usual range, as far as they have an effect.
class UsualChecker {
 public:
  UsualChecker(std::vector<Warning>& out, std::string prefix, const Scenario& scenario, const When* idle)
      : out_(out), prefix_(std::move(prefix)), scenario_(scenario), idle_(idle) {}

  void text(const char*, const std::string&, const Doc&) {}
  void number(const char* key, double value, const NumberInput& q, const Doc& doc) {
    if (q.usual.contains(value) || idle_because(scenario_, idle_, doc) != nullptr) return;
    const auto end = [&](double v) { return shown(v, q.unit, q.shown); };
    const auto bare = [](const std::string& s) { return s.substr(0, s.find(' ')); };
    const bool more = value > q.usual.min;
    out_.push_back({prefix_ + key, end(value),
                    fmt::format("{} than usual: {} to {}{}", more ? "more" : "less", bare(end(q.usual.min)),
                                end(q.usual.max), q.usual.infinite ? ", or .inf" : "")});
  }
  void number(const char* key, const std::optional<double>& value, const NumberInput& q, const Doc& doc) {
    if (value) number(key, *value, q, doc);
  }
  template <class I>
  void integer(const char*, I, const Range&, bool, const Doc&) {}
  template <class E, class N>
  void choice(const char*, E, const N&, const Doc&) {}
  template <class G, class F>
  void group(const char* key, const G& g, F describe_it, const Doc& doc) {
    UsualChecker child(out_, prefix_ + key + ".", scenario_, idle_because(scenario_, idle_, doc));
    describe_it(child, g);
  }
  template <class G, class F>
  void list(const char* key, const std::vector<G>& items, F describe_it, const Doc& doc, bool) {
    for (std::size_t i = 0; i < items.size(); ++i) {
      UsualChecker child(out_, fmt::format("{}{}[{}].", prefix_, key, i), scenario_,
                         idle_because(scenario_, idle_, doc));
      describe_it(child, items[i]);
    }
  }

 private:
  std::vector<Warning>& out_;
  const std::string prefix_;
  const Scenario& scenario_;
  const When* idle_;
};

/// Returns "consist[0].count" for "consist[17].count".
std::string of_first_item(const std::string& key) {
  const auto open = key.find('['), close = key.find(']');
  return open == std::string::npos ? key : key.substr(0, open) + "[0]" + key.substr(close + 1);
}

std::map<std::string, std::string> make_defaults() {
  Scenario one_of_each;
  one_of_each.consist.emplace_back();
  one_of_each.ground.patches.emplace_back();
  one_of_each.obstacles.places.emplace_back();
  one_of_each.track.curves.emplace_back();
  one_of_each.track.grades.emplace_back();
  one_of_each.terrain.sections.emplace_back();
  one_of_each.terrain.grid.rows.emplace_back();
  std::map<std::string, std::string> values;
  for (KeyValue& v : key_values(one_of_each)) values[v.key] = std::move(v.value);
  return values;
}

/// What every key has if nobody sets it. The same for all scenarios, so made once: every member of an ensemble asks.
const std::map<std::string, std::string>& defaults() {
  static const std::map<std::string, std::string> values = make_defaults();
  return values;
}

Warning idle(const KeyValue& v) {
  const bool number = !v.unit.empty() && !v.whole && v.value != ".inf";
  return {v.key, number ? shown(to_si(v.value, v.unit), v.unit, v.shown_unit) : v.value,
          "no effect: it acts with " + v.acts_with};
}

bool is_passenger_car(const std::string& name) {
  const std::string lower = files::lower_case(name);
  const auto has = [&](const char* word) { return lower.find(word) != std::string::npos; };
  return has("passenger") || has("coach") || has("sleep") || has("diner") || has("multiple_unit") || has("emu") ||
         has("dmu") || has("tram") || has("metro");
}

/// Adds a warning for trains of a kind that has not been compared with real accidents. The accidents that this program
/// was compared with are those of North American freight trains.
void judge_train(const Scenario& s, std::vector<Warning>& out) {
  for (std::size_t i = 0; i < s.consist.size(); ++i) {
    if (!is_passenger_car(s.consist[i].name)) continue;
    out.push_back({fmt::format("consist[{}].name", i), s.consist[i].name,
                   "a passenger car: nothing here was compared with derailments of passenger trains; "
                   "config/passenger.yaml has couplers and "
                   "brakes of such trains with their sources"});
    return;
  }
  const bool parts = s.ground.on_track_law == OnTrackLaw::rails && s.brakes.law == BrakeLaw::air;
  if (!parts) return;
  constexpr double kWeakestFreightCoupler = 1.0e6,
                   kLoadedCar = 1.0e6;  // N; below what the model was fitted to
  if (s.coupler.break_draft < kWeakestFreightCoupler) {
    out.push_back({"coupler.break_draft", shown(s.coupler.break_draft, "N", "kip"),
                   "a screw coupling, not one of North American freight cars: nothing here was compared with "
                   "derailments of such trains; "
                   "config/uic_freight.yaml has couplers and brakes of UIC freight trains with their sources"});
    return;
  }
  double weight = 0.0;
  int cars = 0;
  for (const CarBlock& b : s.consist) {
    if (is_locomotive(b)) continue;
    weight += b.count * b.weight;
    cars += b.count;
  }
  // With these, the model was compared with derailments of any freight.
  const bool any_freight = s.rails.load_exponent < 1.0 && s.ground.load_exponent < 1.0;
  if (cars > 0 && weight < cars * kLoadedCar && !any_freight) {
    out.push_back({"consist", shown(weight / cars, "N", "kip") + " a car",
                   "lighter than the loaded North American cars (263 to 286 kip) that the couplers, brakes and rails "
                   "of config/accident.yaml were fitted to: too many empty cars would derail; with empty cars take the "
                   "values of config/variants/freight.yaml (freight3d.yaml in space) and give each block its "
                   "loaded_weight; UIC trains: config/uic_freight.yaml"});
  }
}

/// Adds a warning for each type of coupler that holds without limit what a key of the group coupler limits all the
/// same. Other values beside a type are meant to take the place of the type's.
void judge_couplers(const Scenario& s, std::vector<Warning>& out) {
  if (model_of(s) != Model::spatial) return;
  std::set<std::string> seen{Coupler().type};  // which nobody need have chosen
  const auto judge = [&](const std::string& key, const std::string& word) {
    if (word.empty() || !seen.insert(word).second) return;
    const CouplerType* type = car_types().coupler(word);
    if (type == nullptr) return;
    const Coupler& c = s.coupler;
    const auto judge_limit = [&](const char* name, const std::optional<double>& of_type,
                                 const std::optional<double>& given) {
      if (of_type != kInfinity || !given || *given == kInfinity) return;
      const KeyValue v = key_value(s, std::string("coupler.") + name);
      out.push_back(
          {key, word,
           fmt::format("has no effect on {0}: coupler.{0} = {1} holds for all couplers; with .inf there a {2} "
                       "coupler is what it is",
                       name, shown(*given, v.unit, v.shown_unit), type->name)});
    };
    judge_limit("slip_height", type->slip_height, c.slip_height);
    judge_limit("vertical_hold", type->vertical_hold, c.vertical_hold);
    judge_limit("roll_limit", type->roll_limit, c.roll_limit);
  };
  judge("coupler.type", s.coupler.type);
  for (std::size_t i = 0; i < s.consist.size(); ++i)
    judge(fmt::format("consist[{}].coupler_type", i), s.consist[i].coupler_type);
}

}  // namespace

std::string to_string(const Warning& w) {
  std::string text = w.key;
  if (!w.value.empty()) text += " = " + printable(w.value, kShownMax);
  return text.empty() ? w.text : text + ": " + w.text;
}

std::vector<Warning> warnings(const Scenario& scenario) {
  std::vector<Warning> out;
  UsualChecker usual(out, "", scenario, nullptr);
  describe(usual, scenario);
  const std::map<std::string, std::string>& preset = defaults();
  std::map<std::string, std::pair<std::size_t, int>> of_items;  // of an item's key: its warning, how many more have it
  for (const KeyValue& v : key_values(scenario)) {
    if (v.acts_with.empty()) continue;
    const std::string item = of_first_item(v.key);
    const auto known = preset.find(item);
    if (known != preset.end() && known->second == v.value) continue;
    const auto [place, fresh] = of_items.try_emplace(item, out.size(), 0);
    if (fresh) out.push_back(idle(v));
    else ++place->second.second;
  }
  for (const auto& [item, more] : of_items)
    if (more.second > 0) out[more.first].text += fmt::format("; so do {} more", more.second);
  judge_train(scenario, out);
  judge_couplers(scenario, out);
  if (!scenario.assumptions.empty())
    out.push_back({"consist", "", fmt::format("a train list; assumed: {}", fmt::join(scenario.assumptions, "; "))});
  return out;
}

std::vector<Warning> warnings(const Scenario& scenario, const std::vector<Override>& given) {
  std::vector<Warning> out = warnings(scenario);
  for (const KeyValue& v : key_values(scenario)) {
    const auto is_it = [&](const auto& x) { return x.key == v.key; };
    if (!v.acts_with.empty() && std::any_of(given.begin(), given.end(), is_it) &&
        std::none_of(out.begin(), out.end(), is_it)) {
      out.push_back(idle(v));
    }
  }
  return out;
}

}  // namespace train_derail::inputs
