#include "train_derail/inputs/car_types.hpp"

#include <algorithm>
#include <cctype>

#include "car_types_text.hpp"
#include "checker.hpp"
#include "schema.hpp"
#include "tree_reader.hpp"

namespace train_derail::inputs {

namespace {

const NumberInput kHeight{"m", "ft", between(0.1, 10)}, kWeight{"N", "kip", between(1e3, 1e7)},
    kTruckWeight{"N", "kip", between(0, 1e6)}, kLength{"m", "ft", between(1, 100)};

template <class V, class B>
void describe_body(V& v, B& b) {
  v.text("name", b.name, "");
  v.number("empty", b.empty, required(kWeight), "");
  v.number("loaded", b.loaded, required(kWeight), "");
  v.number("centre_empty", b.centre_empty, required(kHeight), "");
  v.number("centre_loaded", b.centre_loaded, required(kHeight), "");
  v.number("floor", b.floor, required(kHeight), "");
  v.number("roof", b.roof, required(kHeight), "");
  v.number("underframe", b.underframe, required(kHeight), "");
  v.number("underframe_width", b.underframe_width, required(kHeight), "");
  v.number("truck", b.truck, required(kTruckWeight), "");
  v.number("roll_inertia", b.roll_inertia, required({"m2", "", between(0.1, 10)}), "");
}

template <class V, class T>
void describe_type(V& v, T& t) {
  v.text("name", t.name, "");
  v.text("body", t.body, "");
  v.texts("codes", t.codes, "");
  v.texts("also", t.also, "");
  v.number("length", t.length, required(kLength), "");
  v.number("width", t.width, required(kLength), "");
  v.number("truck_spacing", t.truck_spacing, required(kLength), "");
  v.number("empty", t.empty, required(kWeight), "");
  v.number("loaded", t.loaded, required(kWeight), "");
  v.number("floor", t.floor, kHeight, "");
  v.number("roof", t.roof, kHeight, "");
  v.number("underframe", t.underframe, kHeight, "");
  v.number("underframe_width", t.underframe_width, kHeight, "");
  v.number("centre_empty", t.centre_empty, kHeight, "");
  v.number("centre_loaded", t.centre_loaded, kHeight, "");
}

template <class V, class C>
void describe_coupler_type(V& v, C& c) {
  v.text("name", c.name, "");
  v.texts("also", c.also, "");
  v.number("pitch_limit", c.pitch_limit, {"rad", "deg", between(0, 1.5)}, "");
  v.number("slip_height", c.slip_height, {"m", "in", between_or_infinite(0.01, 1e6)}, "");
  v.number("vertical_hold", c.vertical_hold, {"N", "kip", between_or_infinite(1, 1e12)}, "");
  v.number("roll_limit", c.roll_limit, {"rad", "deg", between_or_infinite(0, 100)}, "");
}

template <class V, class B>
void describe_bodies(V& v, B& bodies) {
  v.list(
      "bodies", bodies, [](auto& w, auto& b) { describe_body(w, b); }, "", false);
}

template <class V, class T>
void describe_types(V& v, T& t) {
  v.list(
      "types", t.types, [](auto& w, auto& x) { describe_type(w, x); }, "", false);
  v.list(
      "couplers", t.couplers, [](auto& w, auto& c) { describe_coupler_type(w, c); }, "", false);
}

void check_type(const CarType& t, const std::string& prefix) {
  const auto wrong = [&](const char* name, const std::string& value, const char* problem, const std::string& allowed) {
    refuse(prefix + name, value, problem, allowed);
  };
  if (bare_name(t.name).empty()) wrong("name", t.name, "no letter or digit", "a name such as covered_hopper");
  if (t.body.empty()) wrong("body", t.body, "missing", "a name of a block, such as tank_car, hopper, boxcar, flat");
  for (const std::string& code : t.codes) {
    if (code.size() != 1 || std::isupper(static_cast<unsigned char>(code.front())) == 0)
      wrong("codes", code, "not the first letter of a code", "[A, B, ...]");
  }
  if (t.truck_spacing > t.length)
    wrong("truck_spacing", fmt::format("{}", t.truck_spacing), "larger than the length",
          fmt::format("(0, {}] m", t.length));
  if (t.loaded < t.empty)
    wrong("loaded", fmt::format("{}", t.loaded), "less than empty", fmt::format(">= {} N", t.empty));
}

/// Reads what `describe` (of a visitor and a T) describes, and checks it.
template <class T, class Describe, class Check>
T read(const YAML::Node& tree, const std::string& source, const Describe& describe, const Check& check_across) {
  const std::vector<Override> none;
  KeyPlaces places;
  T all;
  TreeReader reader(tree, "", source, none, places);
  describe(reader, all);
  reader.finish();
  check_at(places, source, [&] {
    Checker checker("");
    describe(checker, all);
    check_across(all);
  });
  return all;
}

CarTypes read_types(const YAML::Node& tree, const std::string& source) {
  return read<CarTypes>(
      tree, source, [](auto& v, auto& t) { describe_types(v, t); },
      [](const CarTypes& all) {
        for (std::size_t i = 0; i < all.types.size(); ++i) check_type(all.types[i], fmt::format("types[{}].", i));
      });
}

bool is_word_for(const std::string& bare, const std::string& name, const std::vector<std::string>& also) {
  return bare == bare_name(name) ||
         std::any_of(also.begin(), also.end(), [&](const std::string& word) { return bare == bare_name(word); });
}

}  // namespace

CouplerHold coupler_hold(const Coupler& coupler, const std::string& lead, const std::string& trail) {
  const CarTypes& known = car_types();
  const CouplerType& usual = *known.coupler(Coupler().type);  // leaves nothing out
  const auto hold = [&](const std::string& type) {
    const CouplerType& c = *known.coupler(type.empty() ? coupler.type : type);
    return CouplerHold{
        c.pitch_limit.value_or(usual.pitch_limit.value()), c.slip_height.value_or(usual.slip_height.value()),
        c.vertical_hold.value_or(usual.vertical_hold.value()), c.roll_limit.value_or(usual.roll_limit.value())};
  };
  const CouplerHold a = hold(lead), b = hold(trail);
  return {coupler.pitch_limit.value_or(std::min(a.pitch_limit, b.pitch_limit)),
          coupler.slip_height.value_or(std::max(a.slip_height, b.slip_height)),
          coupler.vertical_hold.value_or(std::min(a.vertical_hold, b.vertical_hold)),
          coupler.roll_limit.value_or(std::max(a.roll_limit, b.roll_limit))};
}

std::string bare_name(std::string_view text) {
  std::string bare;
  for (const char c : text) {
    const auto u = static_cast<unsigned char>(c);
    if (std::isalnum(u) != 0 || c == '#' || u >= 0x80) bare += static_cast<char>(u < 0x80 ? std::tolower(u) : u);
  }
  return bare;
}

const CarType* CarTypes::type(std::string_view text) const {
  const std::string bare = bare_name(text);
  for (const CarType& t : types) {
    if (is_word_for(bare, t.name, t.also)) return &t;
  }
  // AAR car type codes: a letter and three digits.
  const bool digits = std::all_of(bare.begin() + (bare.empty() ? 0 : 1), bare.end(),
                                  [](unsigned char c) { return std::isdigit(c) != 0; });
  if (!digits || (bare.size() != 4 && bare.size() != 1)) return nullptr;
  for (const CarType& t : types) {
    for (const std::string& code : t.codes) {
      if (bare_name(code) == bare.substr(0, 1)) return &t;
    }
  }
  return nullptr;
}

const CouplerType* CarTypes::coupler(std::string_view text) const {
  const std::string bare = bare_name(text);
  const auto found = std::find_if(couplers.begin(), couplers.end(),
                                  [&](const CouplerType& c) { return is_word_for(bare, c.name, c.also); });
  return found == couplers.end() ? nullptr : &*found;
}

std::vector<std::string> CarTypes::words() const {
  std::vector<std::string> all;
  for (const CarType& t : types) {
    all.push_back(t.name);
    all.insert(all.end(), t.also.begin(), t.also.end());
    for (const std::string& code : t.codes) all.push_back(code);
  }
  return all;
}

// What the library carries in itself is plain YAML (a test reads the files as any other): it is parsed once, not twice.

const CarTypes& car_types() {
  static const CarTypes all = read_types(YAML::Load(kCarTypesText), "config/types/car_types.yaml");
  return all;
}

CarTypes car_types(const std::string& path) {
  CarTypes own = read_types(load_file(path), path);
  const CarTypes& package = car_types();
  own.types.insert(own.types.end(), package.types.begin(), package.types.end());
  own.couplers.insert(own.couplers.end(), package.couplers.begin(), package.couplers.end());
  return own;
}

const std::vector<CarBody>& car_bodies() {
  static const auto all = read<std::vector<CarBody>>(
      YAML::Load(kCarBodiesText), "config/types/car_bodies.yaml", [](auto& v, auto& b) { describe_bodies(v, b); },
      [](const auto&) {});
  return all;
}

const CarBody& body_of(std::string_view name) {
  const std::vector<CarBody>& all = car_bodies();
  return *std::find_if(all.begin(), all.end() - 1, [&](const CarBody& b) { return b.name == name; });
}

double centre_height(const CarBody& body, double weight) {
  const double load = std::clamp((weight - body.empty) / (body.loaded - body.empty), 0.0, 1.0);
  return body.centre_empty + load * (body.centre_loaded - body.centre_empty);
}

void take_body(CarBlock& block, const CarType& type) {
  block.name = type.body;
  block.width = type.width;
  block.floor_height = type.floor;
  block.roof_height = type.roof;
  block.underframe_height = type.underframe;
  block.underframe_width = type.underframe_width;
  block.centre_height.reset();
  if (!type.centre_empty && !type.centre_loaded) return;
  CarBody body = body_of(type.body);
  body.centre_empty = type.centre_empty.value_or(body.centre_empty);
  body.centre_loaded = type.centre_loaded.value_or(body.centre_loaded);
  body.empty = type.empty;
  body.loaded = type.loaded > type.empty ? type.loaded : type.empty + 1.0;
  block.centre_height = centre_height(body, block.weight);
}

}  // namespace train_derail::inputs
