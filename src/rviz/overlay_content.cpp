#include "rviz/overlay_content.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "train_derail/fields/units.hpp"
#include "train_derail/outcome/outcome.hpp"

namespace train_derail::rviz_panel {

namespace {

/// Wall seconds for which an entry of the legend stays after its last use.
constexpr double kEntryHold = 2.0;
/// An outcome that is later than this after what is shown belongs to another moment [s].
constexpr double kSameMoment = 0.05;

std::string both(double value, const fields::Unit& unit) {
  return fmt::format("{} ({})", fields::in_shown(value, unit), fields::in_si(value, unit));
}

std::string count(std::uint32_t n, const char* thing) { return fmt::format("{} {}{}", n, thing, n == 1 ? "" : "s"); }

bool rails_yield(const NodeView& view) { return view.inputs && view.inputs->on_track_law == "rails"; }

/// The outcome, if it is of the run whose cars are shown.
const Outcome* outcome_of(const NodeView& view) {
  const bool same = view.outcome && view.cars && view.outcome->run_id == view.cars->run_id;
  return same ? view.outcome.get() : nullptr;
}

std::string state_text(const NodeView& view) {
  if (is_replay(view)) return "replay";
  if (!view.run_info) return {};
  switch (view.run_info->state) {
    case RunInfo::PAUSED: return "paused";
    case RunInfo::FAILED: return "computing failed: " + view.run_info->message;
    case RunInfo::ENDED: break;
    default: return {};
  }
  const Outcome* o = outcome_of(view);
  if (o != nullptr && o->stop_time > view.cars->time + kSameMoment) return "looking back";
  if (o == nullptr || o->ended == Outcome::RUNNING || o->ended >= outcome::kEndedTexts.size()) return "ended";
  return "ended: " + std::string(outcome::kEndedTexts[o->ended]);
}

/// A peak that there has been.
struct Peak {
  double force = 0.0;  // a magnitude [N]
  std::size_t coupler = 0;
  bool buff = true;

  void take(double other, std::size_t number, bool is_buff) {
    if (other > force) *this = {other, number, is_buff};
  }
  void take(const std::vector<double>& by_coupler, bool is_buff) {
    for (std::size_t i = 0; i < by_coupler.size(); ++i) take(by_coupler[i], i + 1, is_buff);
  }
};

Peak peak_of(const NodeView& view) {
  Peak peak;
  const std::uint32_t run = view.cars->run_id;
  const double now = view.cars->time + kSameMoment;
  if (const Outcome* o = outcome_of(view)) {
    if (o->coupler_buff_peak_time <= now) peak.take(o->coupler_buff_peak, o->coupler_buff_peak_coupler, true);
    if (o->coupler_draft_peak_time <= now) peak.take(o->coupler_draft_peak, o->coupler_draft_peak_coupler, false);
  }
  // Forces come more often than outcomes. Their peaks are those of the run so far, not of a moment that is shown again.
  const bool looks_back = !view.forces.history.empty() && view.forces.history.back().time > now;
  if (view.forces.run_id == run && view.forces.time <= now && !looks_back) {
    peak.take(view.forces.buff_peak, true);
    peak.take(view.forces.draft_peak, false);
  }
  return peak;
}

void add_outcome(const NodeView& view, std::vector<Statement>& all) {
  const Outcome* o = outcome_of(view);
  const double now = view.cars->time + kSameMoment;
  if (o != nullptr && o->impacts > 0 && o->stop_time <= now) all.push_back({count(o->impacts, "impact")});
  if (const Peak peak = peak_of(view); peak.force >= scene::kForceSteps.front()) {
    all.push_back({fmt::format("peak force {}, {}, coupler {}", both(peak.force, fields::kForce),
                               peak.buff ? "buff" : "draft", peak.coupler)});
  }
  if (o != nullptr && o->touches > 0 && o->closing_time <= now && o->closing_speed_max > 0.0) {
    all.push_back({fmt::format("fastest closing {}, cars {} and {}", both(o->closing_speed_max, fields::kSpeed),
                               o->closing_car_a, o->closing_car_b)});
  }
}

}  // namespace

scene::Look look_of(const CarState& car, bool rails_yield) {
  return scene::look_of(rails_yield, car.past_pod, car.off_track, static_cast<model::Cause>(car.cause));
}

scene::Colours colours_of(const NodeView& view) {
  return view.run_info && view.run_info->colours == to_string(scene::Colours::posture) ? scene::Colours::posture
                                                                                       : scene::Colours::cause;
}

Strip make_strip(const NodeView& view) {
  Strip strip;
  if (!view.cars || view.cars->cars.empty()) return strip;
  const CarStates& now = *view.cars;
  if (view.inputs && view.inputs->run_id == now.run_id) strip.title = view.inputs->title;
  strip.run = fmt::format("run {} \u00b7 {:.2f} s", now.run_id, now.time);
  strip.state = state_text(view);

  const auto derailed = std::count_if(now.cars.begin(), now.cars.end(), [](const CarState& c) { return c.derailed; });
  strip.statements.push_back({fmt::format("derailed {} of {}", derailed, now.cars.size()), true});
  const geometry_msgs::Vector3& v = now.cars.back().twist.linear;
  strip.statements.push_back({"last car at " + both(std::hypot(v.x, v.y), fields::kSpeed)});
  if (view.couplers && view.couplers->run_id == now.run_id) {
    const auto broken = std::count_if(view.couplers->couplers.begin(), view.couplers->couplers.end(),
                                      [](const CouplerForce& c) { return c.broken; });
    if (broken > 0) strip.statements.push_back({count(static_cast<std::uint32_t>(broken), "coupler") + " broken"});
  }
  add_outcome(view, strip.statements);
  return strip;
}

Entries entries_now(const NodeView& view) {
  Entries entries;
  if (!view.cars) return entries;
  const bool yield = rails_yield(view), lies = colours_of(view) == scene::Colours::posture;
  for (const CarState& car : view.cars->cars) {
    if (lies) entries.add(scene::lie_of(car.tilt));
    else entries.add(look_of(car, yield));
  }
  if (view.couplers && view.couplers->run_id == view.cars->run_id) {
    for (const CouplerForce& coupler : view.couplers->couplers) {
      if (coupler.broken) {
        entries.add_broken();
      } else if (const int force_class = scene::force_class(coupler.axial_force); force_class != 0) {
        entries.add_force(force_class);
      }
    }
  }
  // Stars stand for a while where two cars come to touch.
  const Outcome* o = outcome_of(view);
  if (o != nullptr && o->ended == Outcome::RUNNING && o->touches > 0) entries.add_impact();
  return entries;
}

void Legend::use(const Entries& entries, std::uint32_t run_id, double now) {
  if (run_id != run_id_) uses_.clear();
  run_id_ = run_id;
  uses_.erase(std::remove_if(uses_.begin(), uses_.end(), [now](const Use& u) { return now - u.time > kEntryHold; }),
              uses_.end());
  uses_.push_back({entries, now});
  entries_ = {};
  for (const Use& use : uses_) entries_.add(use.entries);
}

std::pair<std::string, std::string> force_limit(int k) {
  const double force = scene::kForceSteps[static_cast<std::size_t>(k)];
  return {fmt::format("{:.0f}", force / inputs::kKip), fmt::format("{:.0f}", force / 1000.0)};
}

bool TrainMap::operator==(const TrainMap& o) const {
  const auto facts = [](const TrainMap& m) {
    return std::array{m.left,   m.right,  m.bottom,    m.top,         m.point_x,   m.point_y,
                      m.heap_x, m.heap_y, m.heap_turn, m.heap_length, m.heap_width};
  };
  const auto same = [](const MapCar& a, const MapCar& b) {
    return a.x == b.x && a.y == b.y && a.heading == b.heading && a.facts == b.facts;
  };
  return facts(*this) == facts(o) && north == o.north &&
         std::equal(cars.begin(), cars.end(), o.cars.begin(), o.cars.end(), same);
}

TrainMap make_map(const NodeView& view) {
  TrainMap map;
  if (!view.cars || view.cars->cars.empty()) return map;
  const std::vector<CarState>& cars = view.cars->cars;
  const auto at = [](const auto& p) { return Eigen::Vector2d(p.x, p.y); };
  const Eigen::Vector2d line = at(cars.front().pose.position) - at(cars.back().pose.position);
  const double heading = line.isZero() ? 0.0 : std::atan2(line.y(), line.x());
  const Eigen::Rotation2Dd to_map(-heading);
  if (view.inputs && view.inputs->run_id == view.cars->run_id && std::isfinite(view.inputs->track_heading)) {
    map.north = view.inputs->track_heading - heading;  // +x of the world is the direction of travel at the point
  }
  // The point of derailment is the origin of the world frame.
  Eigen::AlignedBox2d around(Eigen::Vector2d::Zero().eval());
  const bool yield = rails_yield(view), lies = colours_of(view) == scene::Colours::posture;
  for (const CarState& car : cars) {
    const Eigen::Vector2d p = to_map * at(car.pose.position);
    map.cars.push_back({p.x(), p.y(), car.theta - heading,
                        lies ? &facts_of(scene::lie_of(car.tilt)) : &facts_of(look_of(car, yield))});
    around.extend(p);
  }
  map.left = around.min().x() - kMapHalfCar;
  map.right = around.max().x() + kMapHalfCar;
  map.bottom = around.min().y() - kMapHalfCar;
  map.top = around.max().y() + kMapHalfCar;
  if (view.pile_up && view.pile_up->run_id == view.cars->run_id) {
    const geometry_msgs::Pose& pose = view.pile_up->pose;
    const Eigen::Vector2d p = to_map * at(pose.position);
    map.heap_x = p.x();
    map.heap_y = p.y();
    map.heap_turn = 2.0 * std::atan2(pose.orientation.z, pose.orientation.w) - heading;
    const Box box = heap_box(Eigen::Vector3d::Zero(), 0.0, view.pile_up->length, view.pile_up->width);
    map.heap_length = box.length;
    map.heap_width = box.width;
  }
  return map;
}

ScaleBar scale_bar(double most) {
  int feet = 100;
  for (const int longer : {200, 500, 1000, 2000, 5000}) {
    if (longer * inputs::kFoot <= most) feet = longer;
  }
  return {feet * inputs::kFoot, fmt::format("{} ft ({:.0f} m)", feet, feet * inputs::kFoot)};
}

}  // namespace train_derail::rviz_panel
