#include "train_derail/scene/replay.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "train_derail/fields/units.hpp"
#include "train_derail/inputs/writer.hpp"
#include "train_derail/outcome/fields.hpp"
#include "train_derail/scene/car_shape.hpp"
#include "train_derail/scene/heap.hpp"
#include "train_derail/scene/marks.hpp"
#include "train_derail/scene/track_picture.hpp"
#include "train_derail/simulation/fields.hpp"
#include "train_derail/simulation/trajectory_csv.hpp"

namespace train_derail::scene {

using nlohmann::ordered_json;

namespace {

/// A field of cars or couplers that is kept, and the step of its whole numbers in SI units.
struct Kept {
  const char* name;
  double step;
};
constexpr double kCentimetre = 0.01, kAngleStep = 0.05 * inputs::kDegree, kQuaternionStep = 1.0 / 4096.0;
constexpr Kept kOfCars[] = {{"x", kCentimetre},
                            {"y", kCentimetre},
                            {"z", kCentimetre},
                            {"qx", kQuaternionStep},
                            {"qy", kQuaternionStep},
                            {"qz", kQuaternionStep},
                            {"qw", kQuaternionStep},
                            {"theta", kAngleStep},
                            {"vx", 0.01},
                            {"vy", 0.01},
                            {"front_truck_offset", kCentimetre},
                            {"rear_truck_offset", kCentimetre},
                            {"tilt", kAngleStep},
                            {"lateral_reach", kCentimetre}};
/// The largest forces are those since the moment before.
constexpr Kept kOfCouplers[] = {
    {"axial_force", 1000.0}, {"buff_peak", 1000.0}, {"draft_peak", 1000.0}, {"gap", 0.001}, {"broken", 1.0}};
constexpr std::size_t kCarChannels = std::size(kOfCars), kCouplerChannels = std::size(kOfCouplers);
constexpr std::size_t kHeightChannel = 2;
/// One number a moment: a Heap.
constexpr std::pair<const char*, double> kOfHeap[] = {{"x", kCentimetre},      {"y", kCentimetre},
                                                      {"z", kCentimetre},      {"yaw", kAngleStep},
                                                      {"length", kCentimetre}, {"width", kCentimetre}};
constexpr std::size_t kHeapChannels = std::size(kOfHeap);
constexpr std::size_t kLookChannel = kCarChannels + kCouplerChannels, kLieChannel = kLookChannel + 1,
                      kFirstHeapChannel = kLieChannel + 1, kChannels = kFirstHeapChannel + kHeapChannels;

/// Those of kOfCouplers whose largest value counts where moments are put together.
bool is_peak(std::size_t coupler_channel) {
  const std::string_view name = kOfCouplers[coupler_channel].name;
  return name == "buff_peak" || name == "draft_peak";
}

std::int32_t steps(double value, double step) {
  constexpr double kMost = 1 << 30;
  return std::isfinite(value) ? static_cast<std::int32_t>(std::clamp(std::round(value / step), -kMost, kMost)) : 0;
}

ordered_json of_unit(const fields::Unit& u) {
  const bool own = !u.table_si.empty();
  return {{"si", u.si},
          {"shown", u.shown},
          {"per_shown", u.per_shown},
          {"shown_digits", u.shown_digits},
          {"table_si", own ? u.table_si : u.si},
          {"per_table_si", own ? u.per_table_si : 1.0},
          {"table_si_digits", u.table_si_digits}};
}

template <class Record, std::size_t n>
ordered_json described(const fields::Fields<Record>& all, const Kept (&kept)[n]) {
  ordered_json list;
  for (const Kept& k : kept) {
    const fields::Field<Record>& field = *all.find(k.name);
    list.push_back({{"name", field.name},
                    {"title", field.title},
                    {"meaning", field.meaning},
                    {"unit", of_unit(field.unit)},
                    {"step", k.step}});
  }
  return list;
}

/// Millimetres are enough.
ordered_json flat(const Points& points) {
  ordered_json all = ordered_json::array();
  for (const Point& p : points) {
    for (const double v : {p.x, p.y, p.z}) all.push_back(std::round(1000.0 * v));
  }
  return all;
}

ordered_json of_colour(Rgb c) { return {c.r, c.g, c.b}; }

ordered_json of_outcome(const outcome::Outcome& outcome) {
  ordered_json rows = ordered_json::array();
  for (const auto& field : outcome::outcome_fields()) {
    if (field.title.empty() || (field.when && !field.when(outcome))) continue;
    const outcome::FieldRow row = outcome::row_of(field, outcome);
    rows.push_back({{"name", field.name},
                    {"title", field.title},
                    {"meaning", field.meaning},
                    {"si", row.si},
                    {"shown", row.shown},
                    {"note", row.note},
                    {"headline", field.leading}});
  }
  return rows;
}

ordered_json of_line(const Line& line) {
  ordered_json dash = ordered_json::array();
  if (line.dash > 0) dash = {line.dash, line.gap};
  return {{"colour", of_colour(line.colour)}, {"dash", dash}};
}

template <std::size_t n>
ordered_json of_looks(const std::array<LookFacts, n>& looks) {
  ordered_json list = ordered_json::array();
  for (const LookFacts& look : looks)
    list.push_back({{"words", look.words}, {"colour", of_colour(look.colour)}, {"bars", look.bars}});
  return list;
}

/// Sizes and colours of whatever is not a car, a force or the ground.
ordered_json of_marks(inputs::Model model) {
  ordered_json outline = ordered_json::array();
  for (const auto& [along, across] : kArrowOutline) outline.push_back({along, across});
  return {{"ink", of_colour(kInk)},
          {"star", of_colour(kStarRim)},
          {"star_rays", kStarRays},
          {"star_inner", kStarInner},
          {"star_fade", kStarFade},
          {"broken", of_colour(kBrokenColour)},
          {"broken_end", kBrokenEnd},
          {"plate", {kPlateLength, kPlateWidth}},
          {"bar_width", kBarWidth},
          {"bar_spacing", kBarSpacing},
          {"arrow", {kArrowLengthMin, kArrowLengthStep, kArrowWidth, kArrowHeight}},
          {"arrow_outline", outline},
          {"drawbar", {2.0 * kDrawbar, kDrawbarThickness}},
          {"drawbar_height", kDrawbarHeight},
          {"layers", kLayers},
          {"layer_step", layer_step(model)},
          {"flash", kFlashTime},
          {"now", of_colour(kNow)},
          {"chosen", of_colour(kChosen)},
          {"sky", of_colour(kSky)}};
}

}  // namespace

Replay::Replay(const inputs::Scenario& scenario, const std::vector<model::Car>& cars)
    : scenario_(scenario), cars_(cars), channels_(kChannels) {}

void Replay::add(const simulation::Snapshot& now, const std::vector<Occurrence>& events) {
  events_.insert(events_.end(), events.begin(), events.end());
  simulation::Snapshot next = now;
  if (pending_) simulation::keep_peaks(last_, next);
  last_ = std::move(next);
  pending_ = true;
  if (++skipped_ < stride_ && !times_.empty()) return;
  append(last_);
  pending_ = false;
  skipped_ = 0;
  while (times_.size() > 3 && times_.size() * cars_.size() > kReplayValuesMax) thin();
}

void Replay::append(const simulation::Snapshot& now) {
  times_.push_back(now.time);
  const auto& car_fields = simulation::car_fields();
  const auto& coupler_fields = simulation::coupler_fields();
  for (std::size_t k = 0; k < kCarChannels; ++k) {
    const auto& number = car_fields.find(kOfCars[k].name)->number;
    for (const auto& car : now.cars) channels_[k].push_back(steps(number(car), kOfCars[k].step));
  }
  for (std::size_t k = 0; k < kCouplerChannels; ++k) {
    const auto& number = coupler_fields.find(kOfCouplers[k].name)->number;
    for (const auto& c : now.couplers) channels_[kCarChannels + k].push_back(steps(number(c), kOfCouplers[k].step));
  }
  const bool yield = scenario_.ground.on_track_law == inputs::OnTrackLaw::rails;
  for (const auto& car : now.cars)
    channels_[kLookChannel].push_back(
        static_cast<std::int32_t>(look_of(yield, car.past_pod, car.off_track, car.cause)));
  for (const auto& car : now.cars) channels_[kLieChannel].push_back(static_cast<std::int32_t>(lie_of(car.tilt())));
  const Heap heap = find_heap(cars_, now.cars);
  const double of_heap[] = {heap.x, heap.y, heap.z, heap.yaw, heap.length, heap.width};
  for (std::size_t k = 0; k < kHeapChannels; ++k)
    channels_[kFirstHeapChannel + k].push_back(steps(of_heap[k], kOfHeap[k].second));
}

void Replay::thin() {
  const std::size_t before = times_.size();
  for (std::size_t k = 0; k < kChannels; ++k) {
    const bool of_couplers = k >= kCarChannels && k < kLookChannel;
    const std::size_t width = k >= kFirstHeapChannel ? 1 : of_couplers ? cars_.size() - 1 : cars_.size();
    const bool peak = of_couplers && is_peak(k - kCarChannels);
    std::vector<std::int32_t>& all = channels_[k];
    for (std::size_t from = 0, to = 0; from < before; from += 2, ++to) {
      for (std::size_t i = 0; i < width; ++i) {
        std::int32_t value = all[from * width + i];
        if (peak && from > 0) value = std::max(value, all[(from - 1) * width + i]);
        all[to * width + i] = value;
      }
    }
    all.resize((before + 1) / 2 * width);
  }
  for (std::size_t from = 0; from < before; from += 2) times_[from / 2] = times_[from];
  times_.resize((before + 1) / 2);
  pending_ = before % 2 == 0;  // the last moment went: it is half way to the next one
  skipped_ = pending_ ? stride_ : 0;
  stride_ *= 2;
}

std::string Replay::document(const ReplayNames& names, const outcome::Outcome& outcome,
                             const std::vector<outcome::FirstTouch>& touches) const {
  Replay whole = *this;
  if (pending_) whole.append(last_);  // the end of the run, whatever the stride

  ordered_json j;
  j["title"] = scenario_.title.empty() ? names.title : scenario_.title;
  j["caption"] = names.caption;
  j["inputs"] = inputs::to_yaml(scenario_);
  j["outcome"] = of_outcome(outcome);
  j["warnings"] = outcome.warnings;
  j["fields"] = {{"cars", described(simulation::car_fields(), kOfCars)},
                 {"couplers", described(simulation::coupler_fields(), kOfCouplers)},
                 {"heap", ordered_json::array()}};
  for (const auto& [name, step] : kOfHeap) j["fields"]["heap"].push_back({{"name", name}, {"step", step}});

  std::vector<const model::Car*> kinds;
  ordered_json shapes = ordered_json::array(), cars = ordered_json::array();
  const auto looks_like = [](const model::Car& a, const model::Car& b) {
    return a.body == b.body && a.length == b.length && a.width == b.width && a.truck_spacing == b.truck_spacing &&
           a.floor_height == b.floor_height && a.roof_height == b.roof_height;
  };
  for (const model::Car& car : cars_) {
    const auto known =
        std::find_if(kinds.begin(), kinds.end(), [&](const model::Car* kind) { return looks_like(*kind, car); });
    cars.push_back({{"body", car.body},
                    {"shape", known - kinds.begin()},
                    {"length", car.length},
                    {"width", car.width},
                    {"roof", car.roof_height},
                    {"above", above_roof(car)},
                    {"weight", car.weight},
                    {"centre_height", car.centre_height}});
    if (known != kinds.end()) continue;
    kinds.push_back(&car);
    const CarShape shape = car_shape(car);
    shapes.push_back({{"body", flat(shape.body)},
                      {"dark", flat(shape.dark)},
                      {"top", shape.top},
                      {"top_half_width", shape.top_half_width},
                      {"top_end", shape.top_end}});
  }
  j["cars"] = cars;
  j["shapes"] = shapes;
  j["car_units"] = {{"length", of_unit(fields::kLength)}, {"weight", of_unit(fields::kForce)}};

  const TrackPicture track = track_picture(scenario_, cars_);
  ordered_json& t = j["track"];
  t["height"] = track.height;
  t["parts"] = ordered_json::array();
  for (const auto& [points, colour] :
       {std::pair(&track.ground, kGround), std::pair(&track.ballast, kBallast), std::pair(&track.ties, kTie),
        std::pair(&track.rails, kRail), std::pair(&track.ruler, kRuler), std::pair(&track.pod, kPod)})
    t["parts"].push_back({{"colour", of_colour(colour)}, {"points", flat(*points)}});
  t["north"] = track.north ? ordered_json{track.north->x, track.north->y} : ordered_json();
  t["pod_name"] = {track.pod_name.x, track.pod_name.y, track.pod_name.z};

  j["looks"] = of_looks(kLookFacts);
  j["lies"] = of_looks(kLieFacts);
  j["forces"]["steps"] = kForceSteps;
  for (int k = -kForceClasses; k <= kForceClasses; ++k) j["forces"]["colours"].push_back(of_colour(force_colour(k)));
  j["marks"] = of_marks(inputs::model_of(scenario_));

  j["lines"] = {{"buff", of_line(kBuffLine)},
                {"draft", of_line(kDraftLine)},
                {"first", of_line(kFirstLine)},
                {"second", of_line(kSecondLine)}};
  for (const EventFacts& kind : kEventFacts) j["event_colours"][kind.name] = of_colour(kind.colour);
  // Where rails never yield, cars past the point have a colour of their own.
  if (scenario_.ground.on_track_law != inputs::OnTrackLaw::rails)
    j["event_colours"][kEventFacts[kCarPastPod].name] = of_colour(facts_of(Look::past_point).colour);
  j["events"] = ordered_json::array();
  for (const Occurrence& e : events_) {
    j["events"].push_back({{"time", e.time},
                           {"kind", kEventFacts[static_cast<std::size_t>(e.type)].name},
                           {"car", e.car},
                           {"other", e.other_car},
                           {"coupler", e.coupler},
                           {"text", e.text}});
  }
  j["touches"] = ordered_json::array();
  for (const outcome::FirstTouch& f : touches) {
    const auto later = std::lower_bound(whole.times_.begin(), whole.times_.end(), f.time);
    const auto moment =
        std::min<std::size_t>(static_cast<std::size_t>(later - whole.times_.begin()), whole.times_.size() - 1);
    const std::vector<std::int32_t>& heights = whole.channels_[kHeightChannel];
    const double z =
        kCentimetre * heights[moment * cars_.size() + static_cast<std::size_t>(f.car_a) - 1] + above_roofs(cars_);
    j["touches"].push_back(
        {{"time", f.time}, {"x", f.x}, {"y", f.y}, {"z", z}, {"speed", f.speed}, {"radius", star_radius(f.speed)}});
  }
  j["times"] = whole.times_;

  std::string text = j.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  text.back() = ',';  // the closing brace; numbers follow that are too many for a tree
  text += "\"channels\":[";
  for (const std::vector<std::int32_t>& channel : whole.channels_) {
    if (&channel != &whole.channels_.front()) text += ',';
    fmt::format_to(std::back_inserter(text), "[{}]", fmt::join(channel, ","));
  }
  return text + "]}";
}

std::string page_document(const ReplayPage& page, const std::vector<std::string>& runs) {
  const ordered_json head{{"version", TRAIN_DERAIL_VERSION}, {"title", page.title}, {"notes", page.notes}};
  std::string text = head.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  text.back() = ',';
  return text + fmt::format("\"runs\":[{}]}}", fmt::join(runs, ","));
}

}  // namespace train_derail::scene
