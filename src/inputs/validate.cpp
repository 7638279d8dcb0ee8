#include <algorithm>

#include "checker.hpp"
#include "schema.hpp"
#include "train_derail/inputs/car_types.hpp"
#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/extent.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/inputs/terrain_grid.hpp"

namespace train_derail::inputs {

namespace {

constexpr double kSamplesMax = 1e7, kOutputsMax = 1e6, kTornBinsMax = 1e6, kGridHeightMax = 1e3;

/// Null if no part beyond the paper's model is switched on.
const PartInput* first_part(const Scenario& s) {
  const auto on = [&s](const PartInput& part) { return !part.value(s).empty(); };
  const auto* found = std::find_if(kParts.begin(), kParts.end(), on);
  return found == kParts.end() ? nullptr : found;
}

void check_parts(const Scenario& s) {
  const bool rails = s.ground.on_track_law == OnTrackLaw::rails;
  for (const PartInput& p : kParts) {
    if (p.needs_rails && !rails && !p.value(s).empty())
      refuse(p.key, p.value(s), "works only with ground.on_track_law: rails", "that law, or leave this key out");
  }
  const PartInput* part = first_part(s);
  const std::string part_text = part == nullptr ? "" : fmt::format("{}: {}", part->key, part->value(s));
  if (s.model == Model::paper && part != nullptr)
    refuse("model", "paper", fmt::format("this model has no {}", part_text), "extended, or leave it out");
  const Model model = model_of(s);
  if (model != Model::paper && s.solver.method != Method::semi_implicit) {
    refuse("solver.method", name_of(kMethods, s.solver.method),
           part != nullptr ? fmt::format("{} cannot be computed by this method", part_text)
                           : fmt::format("model: {} cannot be computed by this method", name_of(kModels, model)),
           name_of(kMethods, Method::semi_implicit));
  }
  if (model_of(s) == Model::extended && s.ground.on_track_law == OnTrackLaw::guided) {
    refuse("ground.on_track_law", "guided", "cannot be computed by the extended model",
           "rails, isotropic, along_track");
  }
  if (model == Model::spatial && !rails) {
    refuse("ground.on_track_law", name_of(kOnTrackLaws, s.ground.on_track_law), "cannot be computed by model: spatial",
           "rails");
  }
  if (s.solver.method == Method::semi_implicit && !s.solver.fixed_step)
    refuse("solver.fixed_step", "", "missing: semi_implicit needs a fixed step", "(0, 1] s");
  const auto in_order = [](const auto& stretches, const char* list, const char* what) {
    for (std::size_t i = 1; i < stretches.size(); ++i) {
      const double end = stretches[i - 1].start + stretches[i - 1].length;
      if (stretches[i].start < end) {
        refuse(fmt::format("{}[{}].start", list, i), fmt::format("{}", stretches[i].start),
               fmt::format("the {0} begins before the end of the previous {0}", what), fmt::format(">= {} m", end));
      }
    }
  };
  in_order(s.track.curves, "track.curves", "curve");
  in_order(s.track.grades, "track.grades", "grade");
  in_order(s.terrain.sections, "terrain.sections", "section");
  for (std::size_t i = 0; i < s.ground.patches.size(); ++i) {
    const GroundPatch& p = s.ground.patches[i];
    const auto rises = [&](const char* name, double from, double to) {
      if (!(from < to))
        refuse(fmt::format("ground.patches[{}].{}", i, name), fmt::format("{}", to),
               fmt::format("not greater than {}_from", name[0]), fmt::format("> {} m", from));
    };
    rises("x_to", p.x_from, p.x_to);
    rises("y_to", p.y_from, p.y_to);
  }
}

/// Checks how many steps, samples and pieces of track a run would need, before it is started.
void check_counts(const Scenario& s) {
  const auto check = [](double count, double most, const char* key, double value, const char* what, double divided,
                        const char* unit) {
    if (count <= most) return;
    refuse(key, fmt::format("{}", value), fmt::format("{:.3g} {}", count, what),
           fmt::format("at most {:.0f}, so >= {:.6g} {}", most, divided / most, unit));
  };
  const double time = s.stop.time_max;
  check(time / s.outcome.sample_interval, kSamplesMax, "outcome.sample_interval", s.outcome.sample_interval,
        "samples up to stop.time_max", time, "s");
  check(time / s.output.interval, kOutputsMax, "output.interval", s.output.interval, "output times up to stop.time_max",
        time, "s");
  if (s.solver.fixed_step) {
    check(time / *s.solver.fixed_step, static_cast<double>(s.solver.steps_max), "solver.fixed_step",
          *s.solver.fixed_step, "steps up to stop.time_max, more than solver.steps_max", time, "s");
  }
  if (s.ground.on_track_law == OnTrackLaw::rails && s.rails.torn_length > 0.0) {
    const TrackExtent e = track_extent(s);
    check((e.to - e.from) / s.rails.torn_length, kTornBinsMax, "rails.torn_length", s.rails.torn_length,
          "pieces of track that can be torn up", e.to - e.from, "m");
  }
  const auto items = [](std::size_t count, std::size_t most, const char* key) {
    if (count > most) refuse(key, fmt::format("{} items", count), "too many", fmt::format("at most {}", most));
  };
  items(s.track.curves.size(), kCurvesMax, "track.curves");
  items(s.track.grades.size(), kCurvesMax, "track.grades");
  items(s.terrain.sections.size(), kCurvesMax, "terrain.sections");
  items(s.terrain.grid.rows.size(), kCurvesMax, "terrain.grid.rows");
  items(s.obstacles.places.size(), kCurvesMax, "obstacles.places");
  items(s.ground.patches.size(), kPatchesMax, "ground.patches");
}

/// A grid is whole, and nothing else says what it says.
void check_grid(const Terrain& t) {
  if (t.grid.rows.empty()) return;
  if (t.grid.rows.size() < 2) refuse("terrain.grid.rows", "1 item", "too few", "none, or at least 2");
  std::size_t across = 0;
  for (std::size_t i = 0; i < t.grid.rows.size(); ++i) {
    const std::string key = fmt::format("terrain.grid.rows[{}].heights", i);
    std::size_t count = 0;
    each_height(t.grid.rows[i].heights, [&](std::string_view word, std::optional<double> height) {
      if (!height || !(std::abs(*height) <= kGridHeightMax))
        refuse(key, std::string(word), "not a height", fmt::format("[{0}, {1}] m", -kGridHeightMax, kGridHeightMax));
      ++count;
    });
    if (i == 0) across = count;
    if (count != across || count < 2)
      refuse(key, fmt::format("{} heights", count), "rows must have the same number of heights",
             i == 0 ? "at least 2" : fmt::format("{}, as the first row", across));
  }
  for (const auto& [key, has] :
       {std::pair("terrain.sections", !t.sections.empty()), std::pair("terrain.bank_left", t.bank_left != 0.0),
        std::pair("terrain.bank_right", t.bank_right != 0.0)}) {
    if (has) refuse(key, "", "given beside terrain.grid", "one of the two");
  }
}

void check_coupler(const std::string& key, const std::string& type) {
  // The usual type is known without reading all types, which takes longer than the rest of the start of a run.
  static const std::string usual = Coupler().type;
  if (type == usual || car_types().coupler(type) != nullptr) return;
  std::vector<std::string> names;
  for (const CouplerType& c : car_types().couplers) names.push_back(c.name);
  refuse(key, type, "unknown type of coupler", fmt::format("{}", fmt::join(names, ", ")));
}

/// What is left of a car without its trucks has to weigh something.
void check_trucks(const CarBlock& b, const std::string& prefix) {
  constexpr double kShare = 0.8;  // of a car's weight, that its trucks may be
  const double truck = b.truck_weight.value_or(body_of(b.name).truck), most = 0.5 * kShare * b.weight;
  if (truck <= most) return;
  refuse(prefix + "truck_weight", fmt::format("{:.6g}", truck),
         fmt::format("two of them are more than {} of weight = {:.6g} N{}", kShare, b.weight,
                     b.truck_weight ? "" : "; it goes with the name of the block"),
         fmt::format("<= {:.6g} N", most));
}

/// The body of a block stands upright, with the centre of mass below its top. What it leaves out is by its name.
void check_body(const CarBlock& b, const std::string& prefix) {
  if (!b.floor_height && !b.roof_height && !b.centre_height && !b.underframe_height && !b.underframe_width) return;
  const CarBody& usual = body_of(b.name);
  const double floor = b.floor_height.value_or(usual.floor), roof = b.roof_height.value_or(usual.roof),
               centre = b.centre_height.value_or(centre_height(usual, b.weight));
  const auto against = [](const char* name, double height, bool given) {
    return fmt::format("{} = {:.6g} m{}", name, height, given ? "" : ", which goes with the name of the block");
  };
  if (!(roof > floor)) {
    if (b.roof_height)
      refuse(prefix + "roof_height", fmt::format("{}", roof),
             "not above " + against("floor_height", floor, b.floor_height.has_value()),
             fmt::format("> {:.6g} m", floor));
    refuse(prefix + "floor_height", fmt::format("{}", floor), "not below " + against("roof_height", roof, false),
           fmt::format("< {:.6g} m", roof));
  }
  if (b.underframe_height && *b.underframe_height > floor)
    refuse(prefix + "underframe_height", fmt::format("{}", *b.underframe_height),
           "above " + against("floor_height", floor, b.floor_height.has_value()), fmt::format("<= {:.6g} m", floor));
  if (b.underframe_width && *b.underframe_width > b.width)
    refuse(prefix + "underframe_width", fmt::format("{}", *b.underframe_width),
           fmt::format("wider than width = {:.6g} m", b.width), fmt::format("<= {:.6g} m", b.width));
  if (centre < roof) return;
  if (b.centre_height)
    refuse(prefix + "centre_height", fmt::format("{}", centre),
           "not below " + against("roof_height", roof, b.roof_height.has_value()), fmt::format("< {:.6g} m", roof));
  refuse(prefix + "roof_height", fmt::format("{}", roof),
         fmt::format("not above centre_height = {:.6g} m, which goes with the name and weight of the block", centre),
         fmt::format("> {:.6g} m, or give centre_height too", centre));
}

void check_across(const Scenario& s) {
  check_coupler("coupler.type", s.coupler.type);
  for (std::size_t i = 0; i < s.consist.size(); ++i) {
    if (const std::string& type = s.consist[i].coupler_type; !type.empty())
      check_coupler(fmt::format("consist[{}].coupler_type", i), type);
  }
  int cars = 0;
  for (std::size_t i = 0; i < s.consist.size(); ++i) {
    const CarBlock& b = s.consist[i];
    const auto key = [i](const char* name) { return fmt::format("consist[{}].{}", i, name); };
    const auto either = [&](const char* name, const std::optional<double>& value, const char* factor_name,
                            const std::optional<double>& factor) {
      if (value && factor) {
        refuse(key(factor_name), fmt::format("{}", *factor), fmt::format("given together with {}", name),
               "only one of the two");
      }
    };
    either("truck_spacing", b.truck_spacing, "truck_spacing_factor", b.truck_spacing_factor);
    either("yaw_inertia", b.yaw_inertia, "yaw_inertia_factor", b.yaw_inertia_factor);
    if (b.truck_spacing && *b.truck_spacing > b.length) {
      refuse(key("truck_spacing"), fmt::format("{}", *b.truck_spacing),
             "larger than the length between the coupler pins", fmt::format("(0, {}] m", b.length));
    }
    if (b.yaw_inertia) {
      const double unit = b.weight / kStandardGravity * b.length * b.length;
      if (!kYawInertiaFactors.contains(*b.yaw_inertia / unit)) {
        refuse(key("yaw_inertia"), fmt::format("{}", *b.yaw_inertia),
               fmt::format("is {:.3g} M L^2", *b.yaw_inertia / unit),
               fmt::format("[{:.4g}, {:.4g}] kg m2, that is {} to {} M L^2", kYawInertiaFactors.min * unit,
                           kYawInertiaFactors.max * unit, kYawInertiaFactors.min, kYawInertiaFactors.max));
      }
    }
    check_body(b, key(""));
    if (model_of(s) == Model::spatial) check_trucks(b, key(""));
    cars += b.count;
    if (cars > kCarsMax) {
      refuse(key("count"), fmt::format("{}", b.count), fmt::format("the train has {} cars up to this block", cars),
             fmt::format("at most {} in all", kCarsMax));
    }
  }
  if (s.initial.cars_ahead >= cars) {
    refuse("initial.cars_ahead", fmt::format("{}", s.initial.cars_ahead), "leaves no car to derail",
           fmt::format("0 to {}", cars - 1));
  }
  if (s.coupler.slack >= 2.0 * s.coupler.length) {
    refuse("coupler.slack", fmt::format("{}", s.coupler.slack), "too large for coupler.length",
           fmt::format("[0, {}) m", 2.0 * s.coupler.length));
  }
  check_grid(s.terrain);
  check_parts(s);
  check_counts(s);
  if (s.solver.fixed_step && s.solver.method == Method::bdf) {
    refuse("solver.fixed_step", fmt::format("{}", *s.solver.fixed_step), "the method bdf cannot use a fixed step",
           "leave it out, or solver.method cash_karp or dormand_prince");
  }
}

}  // namespace

TrackExtent track_extent(const Scenario& s) {
  double train = 0.0;
  for (const CarBlock& b : s.consist) train += b.count * (b.length + s.coupler.length);
  constexpr double kMargin = 100.0, kFarthest = 6000.0;
  TrackExtent e{-(train + kMargin), std::min(kMargin + train + s.initial.speed * s.stop.time_max, kFarthest)};
  for (const Curve& c : s.track.curves) {
    e.from = std::min(e.from, c.start);
    e.to = std::max(e.to, c.start + c.length);
  }
  return e;
}

std::vector<PartOn> parts_beyond_the_paper(const Scenario& s) {
  std::vector<PartOn> on;
  for (const PartInput& part : kParts)
    if (const std::string value(part.value(s)); !value.empty()) on.push_back({part.key, value});
  return on;
}

Model model_of(const Scenario& s) {
  if (s.model != Model::by_parts) return s.model;
  return first_part(s) == nullptr ? Model::paper : Model::extended;
}

void validate(const Scenario& scenario) {
  Checker checker("");
  describe(checker, scenario);
  check_across(scenario);
}

}  // namespace train_derail::inputs
