#include "train_derail/ros/marker_scene.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "marker_parts.hpp"
#include "train_derail/scene/marks.hpp"
#include "train_derail/scene/painted_text.hpp"

namespace train_derail::ros_face {

using namespace scene;

namespace {

constexpr char kBodies[] = "cars", kParts[] = "car_parts", kFront[] = "couplers_front", kRear[] = "couplers_rear",
               kTouches[] = "touches";

/// Of a force's class, so that noise at a limit does not change the arrow all the time.
constexpr double kHysteresis = 0.1;
constexpr double kForcesInterval = 0.1;  // simulated [s]

constexpr int kFlashSteps = 5;
constexpr double kSpeedTextMin = 1.0;  // slower touches have no text [m/s]
constexpr double kTextHeight = 2.6, kTextClearX = 24.0, kTextClearY = 5.0;
constexpr std::size_t kTextsMax = 6;

void add_rectangle(Points& points, double x0, double x1, double half_width, double z) {
  add_quad(points, make_point(x1, -half_width, z), make_point(x1, half_width, z), make_point(x0, half_width, z),
           make_point(x0, -half_width, z));
}

/// Keeps `before` as long as the force is no more than a little beyond its limits.
int class_of(double force, int before) {
  const int now = force_class(force);
  if (now == before) return now;
  const double size = std::abs(force);
  const bool either_side = force_class(std::copysign(size * (1.0 + kHysteresis), force)) == before ||
                           force_class(std::copysign(size * (1.0 - kHysteresis), force)) == before;
  return either_side ? before : now;
}

std::string speed_text(double v) { return fmt::format("{:.1f} mph ({:.1f} m/s)", v / inputs::kMph, v); }

}  // namespace

MarkerScene::MarkerScene(const inputs::Scenario& scenario, const std::vector<model::Car>& cars, const Frames& frames,
                         double interval, Colours colours)
    : cars_(cars),
      frames_(frames),
      rails_yield_(scenario.ground.on_track_law == inputs::OnTrackLaw::rails),
      flash_time_(std::max(kFlashTime, interval)),
      colours_(colours),
      layer_step_(layer_step(inputs::model_of(scenario))),
      above_roofs_(above_roofs(cars)),
      now_(cars.size()),
      sent_(cars.size()) {
  for (std::size_t i = 0; i < cars_.size(); ++i) {
    CarShape shape = car_shape(cars_[i]);
    // A plate for the number, also over an open top.
    const std::string number = std::to_string(i + 1);
    const double roof = cars_[i].roof_height;
    add_rectangle(shape.body, -0.5 * kPlateLength, 0.5 * kPlateLength, 0.5 * std::min(kPlateWidth, cars_[i].width),
                  roof + 0.02);
    paint_text(shape.dark, number, kNumberHeight, roof + 0.06);
    // Drawbars, up to the middle of the couplers.
    const double half = 0.5 * cars_[i].length, end = half + 0.5 * scenario.coupler.length;
    if (i > 0) add_rectangle(shape.dark, half, end, kDrawbar, kDrawbarHeight);
    if (i + 1 < cars_.size()) add_rectangle(shape.dark, -end, -half, kDrawbar, kDrawbarHeight);
    shapes_.push_back(std::move(shape));
  }
}

MarkerScene::Shown MarkerScene::shown_of(const simulation::Snapshot& now, std::size_t car) const {
  const simulation::CarSnapshot& state = now.cars[car];
  Shown shown;
  shown.facts = colours_ == Colours::posture
                    ? &facts_of(lie_of(state.tilt()))
                    : &facts_of(look_of(rails_yield_, state.past_pod, state.off_track, state.cause));
  const auto see = [&](std::size_t coupler, bool& broken, int& force, int before) {
    broken = now.couplers[coupler].broken;
    force = broken ? 0 : class_of(now.couplers[coupler].axial_force, before);
  };
  if (car > 0) see(car - 1, shown.front_broken, shown.front_force, now_[car].front_force);
  if (car < now.couplers.size()) see(car, shown.rear_broken, shown.rear_force, now_[car].rear_force);
  return shown;
}

void MarkerScene::update(const simulation::Snapshot& now, const std::vector<outcome::FirstTouch>& touches) {
  for (std::size_t i = 0; i < now.cars.size(); ++i) now_[i] = shown_of(now, i);
  if (now.time < time_) forces_sent_ = -1.0;
  time_ = now.time;
  update_flashes(now, touches);
}

double MarkerScene::layer_height(std::size_t car) const { return layer_step_ * static_cast<double>(car % kLayers); }

visualization_msgs::Marker MarkerScene::body(std::size_t car) const {
  Marker m = make_triangles(frames_.car(static_cast<int>(car) + 1), kBodies, static_cast<int>(car) + 1,
                            now_[car].facts->colour);
  m.points = to_message(shapes_[car].body);
  m.pose.position.z = layer_height(car);
  m.frame_locked = 1;
  return m;
}

visualization_msgs::Marker MarkerScene::parts(std::size_t car) const {
  const Shown& shown = now_[car];
  Marker m = make_triangles(frames_.car(static_cast<int>(car) + 1), kParts, static_cast<int>(car) + 1, kInk);
  Points points = shapes_[car].dark;
  const CarShape& shape = shapes_[car];
  const double half = shape.top_end, width = shape.top_half_width, z = shape.top + 0.02;
  const int bars = shown.facts->bars;
  for (int i = 0; i < bars; ++i) {
    const double x = 0.5 * half + kBarSpacing * (i - 0.5 * (bars - 1));
    for (const double side : {-1.0, 1.0}) {
      add_rectangle(points, side * x - 0.5 * kBarWidth, side * x + 0.5 * kBarWidth, width, z);
    }
  }
  // The end of the roof is black.
  if (shown.front_broken) add_rectangle(points, (1.0 - kBrokenEnd) * half, half, width, z);
  if (shown.rear_broken) add_rectangle(points, -half, (kBrokenEnd - 1.0) * half, width, z);
  m.points = to_message(points);
  m.pose.position.z = layer_height(car);
  m.frame_locked = 1;
  return m;
}

std::optional<visualization_msgs::Marker> MarkerScene::arrow(std::size_t car, bool front) const {
  const int force = front ? now_[car].front_force : now_[car].rear_force;
  if (force == 0) return {};
  const double length = kArrowLengthMin + kArrowLengthStep * std::abs(force);
  Marker m = make_marker(frames_.car(static_cast<int>(car) + 1), front ? kFront : kRear, static_cast<int>(car) + 1,
                         Marker::ARROW, colour(force_colour(force)), length, kArrowWidth, kArrowHeight);
  // In buff the tip is at the end of the car, in draft the tail.
  const double end = (front ? 0.5 : -0.5) * cars_[car].length, outwards = front ? 1.0 : -1.0;
  const bool buff = force > 0;
  const double heading = buff ? outwards : -outwards;
  m.pose.position.x = buff ? end - outwards * length : end;
  m.pose.position.z = above_roof(cars_[car]);
  m.pose.orientation.w = heading > 0.0 ? 1.0 : 0.0;
  m.pose.orientation.z = heading > 0.0 ? 0.0 : 1.0;
  m.frame_locked = 1;
  return m;
}

visualization_msgs::MarkerArray MarkerScene::take_changes(bool all) {
  visualization_msgs::MarkerArray changes;
  auto& list = changes.markers;
  const bool forces = all || forces_sent_ < 0.0 || time_ >= forces_sent_ + kForcesInterval - 1.0e-9;
  if (forces) forces_sent_ = time_;
  for (std::size_t i = 0; i < cars_.size(); ++i) {
    Shown& sent = sent_[i];
    const Shown& now = now_[i];
    if (!now.same_body(sent)) {
      if (now.facts != sent.facts) list.push_back(body(i));
      list.push_back(parts(i));
      sent.facts = now.facts;
      sent.front_broken = now.front_broken;
      sent.rear_broken = now.rear_broken;
    }
    if (!forces) continue;
    for (const bool front : {true, false}) {
      int& before = front ? sent.front_force : sent.rear_force;
      const int force = front ? now.front_force : now.rear_force;
      if (force == before) continue;
      before = force;
      list.push_back(arrow(i, front).value_or(
          make_deletion(frames_.car(static_cast<int>(i) + 1), front ? kFront : kRear, static_cast<int>(i) + 1)));
    }
  }
  for (const auto& [key, before] : flashes_sent_) {
    const auto now = flashes_.find(key);
    if (now == flashes_.end()) list.push_back(make_deletion(frames_.world, kTouches, before.star.id));
    if (before.text && (now == flashes_.end() || !now->second.text)) {
      list.push_back(make_deletion(frames_.world, kTouches, before.text->id));
    }
  }
  for (const auto& [key, now] : flashes_) {
    const auto before = flashes_sent_.find(key);
    if (before != flashes_sent_.end() && before->second.step == now.step &&
        before->second.text.has_value() == now.text.has_value()) {
      continue;
    }
    list.push_back(now.star);
    if (now.text) list.push_back(*now.text);
  }
  flashes_sent_ = flashes_;
  return changes;
}

visualization_msgs::MarkerArray MarkerScene::whole() const {
  visualization_msgs::MarkerArray all;
  for (std::size_t i = 0; i < cars_.size(); ++i) {
    all.markers.push_back(body(i));
    all.markers.push_back(parts(i));
    for (const bool front : {true, false}) {
      if (const auto marker = arrow(i, front)) all.markers.push_back(*marker);
    }
  }
  for (const auto& [key, flash] : flashes_) {
    all.markers.push_back(flash.star);
    if (flash.text) all.markers.push_back(*flash.text);
  }
  return all;
}

visualization_msgs::MarkerArray MarkerScene::whole_on_empty() const {
  visualization_msgs::MarkerArray all = whole();
  Marker clear = make_deletion(frames_.world, "", 0);
  clear.action = Marker::DELETEALL;
  all.markers.insert(all.markers.begin(), clear);
  return all;
}

MarkerScene::Flash MarkerScene::make_flash(const outcome::FirstTouch& touch, double height, int id, int step,
                                           bool told) const {
  const double age = static_cast<double>(step) / kFlashSteps;
  const double radius = star_radius(touch.speed) * (1.0 - kStarFade * age);
  Flash flash;
  flash.step = step;
  flash.star = make_triangles(frames_.world, kTouches, id, kStarRim);
  flash.star.pose.position = message_point(touch.x, touch.y, height);
  for (int i = 0; i < 2 * kStarRays; ++i) {
    const auto corner = [&](int k) {
      const double r = radius * (k % 2 == 0 ? 1.0 : kStarInner), angle = k * 3.14159265358979323846 / kStarRays;
      return message_point(r * std::cos(angle), r * std::sin(angle), 0.0);
    };
    flash.star.points.insert(flash.star.points.end(), {message_point(0.0, 0.0, 0.0), corner(i), corner(i + 1)});
  }
  if (told) {
    flash.text = make_text(frames_.world, kTouches, id + 1, kTextHeight);
    flash.text->text = speed_text(touch.speed);
    flash.text->color.a = static_cast<float>(1.0 - kStarFade * age);
    flash.text->pose.position = message_point(touch.x, touch.y, height + kTextHeight);
  }
  return flash;
}

void MarkerScene::update_flashes(const simulation::Snapshot& now, const std::vector<outcome::FirstTouch>& touches) {
  const double time = now.time;
  std::vector<const outcome::FirstTouch*> recent;
  for (const outcome::FirstTouch& touch : touches) {
    if (touch.time <= time && time - touch.time < flash_time_) recent.push_back(&touch);
  }
  // The fastest have words, unless those of a faster one are in the way.
  std::stable_sort(recent.begin(), recent.end(), [](const auto* a, const auto* b) { return a->speed > b->speed; });
  std::vector<const outcome::FirstTouch*> told;
  std::map<TouchKey, Flash> flashes;
  for (const outcome::FirstTouch* touch : recent) {
    const auto in_the_way = [&](const outcome::FirstTouch* other) {
      return std::abs(other->x - touch->x) < kTextClearX && std::abs(other->y - touch->y) < kTextClearY;
    };
    const bool tell =
        touch->speed >= kSpeedTextMin && told.size() < kTextsMax && std::none_of(told.begin(), told.end(), in_the_way);
    if (tell) told.push_back(touch);
    const int step = static_cast<int>(kFlashSteps * (time - touch->time) / flash_time_);
    const int id = 2 * (touch->car_a * static_cast<int>(cars_.size()) + touch->car_b);
    const TouchKey key(touch->car_a, touch->car_b);
    const auto known = flashes_.find(key);
    const bool same = known != flashes_.end() && known->second.step == step && known->second.text.has_value() == tell;
    const double height = above_roofs_ + now.cars[static_cast<std::size_t>(touch->car_a) - 1].z;
    flashes.emplace(key, same ? known->second : make_flash(*touch, height, id, step, tell));
  }
  flashes_ = std::move(flashes);
}

}  // namespace train_derail::ros_face
