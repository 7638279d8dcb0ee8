#include "train_derail/scene/event_detector.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "train_derail/outcome/incidents_csv.hpp"

namespace train_derail::scene {

namespace {

std::string speed_text(double v) { return fmt::format("{:.2f} m/s ({:.1f} mph)", v, v / inputs::kMph); }

std::string force_text(double f) {
  return fmt::format("{:.0f} kN ({:.0f} kip) {}", std::abs(f) / 1000.0, std::abs(f) / inputs::kKip,
                     f >= 0.0 ? "buff" : "draft");
}

std::string_view cause_text(model::Cause cause) { return model::kCauseTexts[static_cast<std::size_t>(cause)]; }

std::string ended_text(const outcome::Outcome& outcome) {
  std::string text = fmt::format("ended after {:.2f} s: {}; {} cars past the point of derailment, {} off the track",
                                 outcome.stop_time, outcome::kEndedTexts[static_cast<std::size_t>(outcome.ended)],
                                 outcome.cars_past_pod, outcome.cars_off_track);
  return outcome.message.empty() ? text : text + ": " + outcome.message;
}

}  // namespace

std::vector<Occurrence> EventDetector::observe(const simulation::Snapshot& now, const outcome::Outcome& outcome,
                                               const model::Incidents& incidents) {
  std::vector<Occurrence> found;
  if (ended_) return found;
  past_pod_.resize(now.cars.size(), false);
  off_track_.resize(now.cars.size(), false);
  derailed_.resize(now.cars.size(), false);
  peaks_.resize(now.couplers.size());
  const bool last = outcome.ended != outcome::Ended::running;

  for (std::size_t i = 0; i < now.cars.size(); ++i) {
    const simulation::CarSnapshot& car = now.cars[i];
    const int number = static_cast<int>(i) + 1;
    const double speed = std::hypot(car.vx, car.vy);
    if (car.past_pod && !past_pod_[i]) {
      past_pod_[i] = true;
      found.push_back({kCarPastPod, now.time, number, 0, 0, speed,
                       fmt::format("car {} past the point of derailment at {}", number, speed_text(speed))});
    }
    if (car.off_track && !off_track_[i]) {
      off_track_[i] = true;
      found.push_back({kCarOffTrack, now.time, number, 0, 0, speed,
                       fmt::format("car {} off the track at {}", number, speed_text(speed))});
    }
  }
  observe_incidents(now, incidents, found);
  for (std::size_t i = 0; i < now.couplers.size(); ++i) {
    const simulation::CouplerSnapshot& b = now.couplers[i];
    const bool buff = b.buff_peak >= b.draft_peak;
    observe_coupler(static_cast<int>(i) + 1, buff ? b.buff_peak_time : b.draft_peak_time,
                    buff ? b.buff_peak : -b.draft_peak, last, found);
  }
  const outcome::FirstTouch& closing = outcome.closing_speed_max;
  if (outcome.touches > touches_ && (touches_ == 0 || closing.speed > fastest_)) {
    fastest_ = closing.speed;
    found.push_back({kContact, closing.time, closing.car_a, closing.car_b, 0, closing.speed,
                     fmt::format("cars {} and {} touch, closing at {}: the fastest touch so far", closing.car_a,
                                 closing.car_b, speed_text(closing.speed))});
  }
  touches_ = outcome.touches;
  if (last) {
    ended_ = true;
    found.push_back({kEnd, outcome.stop_time, 0, 0, 0, 0.0, ended_text(outcome)});
  }
  return found;
}

std::vector<Occurrence> EventDetector::observe(const simulation::Snapshot& now,
                                               const simulation::Simulation& simulation) {
  if (simulation.ended()) return observe(now, simulation.outcome(), simulation.incidents());
  outcome::Outcome so_far;  // with no more of it than events need before the end
  const std::vector<outcome::FirstTouch>& touches = simulation.touches();
  so_far.touches = static_cast<int>(touches.size());
  const auto fastest =
      std::max_element(touches.begin(), touches.end(), [](const auto& a, const auto& b) { return a.speed < b.speed; });
  if (fastest != touches.end()) so_far.closing_speed_max = *fastest;
  return observe(now, so_far, simulation.incidents());
}

void EventDetector::observe_incidents(const simulation::Snapshot& now, const model::Incidents& incidents,
                                      std::vector<Occurrence>& found) {
  for (; derailments_ < incidents.derailments.size(); ++derailments_) {
    const model::Derailment& d = incidents.derailments[derailments_];
    const auto i = static_cast<std::size_t>(d.car);
    if (derailed_[i]) continue;
    derailed_[i] = true;
    const int number = static_cast<int>(d.car) + 1;
    const double speed = std::hypot(now.cars[i].vx, now.cars[i].vy);
    found.push_back({kCarDerailed, d.time, number, 0, 0, speed,
                     fmt::format("car {} derailed {}, {} truck first, at {}", number, cause_text(d.cause),
                                 d.front ? "front" : "rear", speed_text(speed))});
  }
  for (; broken_ < incidents.broken.size(); ++broken_) {
    const model::BrokenCoupler& b = incidents.broken[broken_];
    const int number = static_cast<int>(b.coupler) + 1;
    found.push_back(
        {kCouplerBroken, b.time, 0, 0, number, b.axial_force,
         fmt::format("coupler {} broken by {} at {}", number, model::to_string(b.by), force_text(b.axial_force))});
  }
}

void EventDetector::observe_coupler(int number, double time, double force, bool last, std::vector<Occurrence>& found) {
  Peak& peak = peaks_[static_cast<std::size_t>(number - 1)];
  const double size = std::abs(force);
  if (size > threshold_ && (!peak.over || size > std::abs(peak.force))) peak = {true, force, time};
  if (peak.over && (last || size < 0.5 * threshold_)) {
    found.push_back({kCouplerPeak, peak.time, 0, 0, number, peak.force,
                     fmt::format("coupler {} peaked at {}", number, force_text(peak.force))});
    peak = {};
  }
}

}  // namespace train_derail::scene
