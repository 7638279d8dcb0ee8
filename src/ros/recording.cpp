#include "train_derail/ros/recording.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <yaml-cpp/yaml.h>

#include "train_derail/inputs/error.hpp"
#include "train_derail/inputs/reader.hpp"
#include "train_derail/ros/messages.hpp"
#include "train_derail/ros/topics.hpp"

namespace train_derail::ros_face {

namespace {

/// Calls `use` with each message of `Topic` in the bag, whatever the name of the node that sent it.
template <class Topic, class Use>
void for_each_message(const rosbag::Bag& bag, const Use& use) {
  const std::string ending(Topic::facts.name.substr(1));
  const auto wanted = [&](const rosbag::ConnectionInfo* connection) {
    const std::string& topic = connection->topic;
    return connection->datatype == ::ros::message_traits::datatype<typename Topic::Message>() &&
           topic.size() > ending.size() &&
           topic.compare(topic.size() - ending.size() - 1, std::string::npos, "/" + ending) == 0;
  };
  for (const rosbag::MessageInstance& instance : rosbag::View(bag, wanted)) {
    if (const auto message = instance.instantiate<typename Topic::Message>()) use(*message);
  }
}

/// The last of those that were sent by `time`; null if there is none.
template <class Sent>
const Sent* latest(const std::vector<Sent>& all, double time) {
  const auto after =
      std::upper_bound(all.begin(), all.end(), time, [](double t, const Sent& sent) { return t < sent.time; });
  return after == all.begin() ? nullptr : &*(after - 1);
}

constexpr double kRounding = 1.0e-9;

}  // namespace

Recording::Recording(const std::string& path, std::uint32_t run_id) {
  rosbag::Bag bag;
  try {
    bag.open(path, rosbag::bagmode::Read);
  } catch (const std::exception& e) {
    throw std::runtime_error(fmt::format("{}: not a bag that can be read: {}", path, e.what()));
  }
  std::map<std::uint32_t, Inputs> runs;
  for_each_message<InputsTopic>(bag, [&](const Inputs& m) { runs[m.run_id] = m; });
  if (runs.empty()) throw std::runtime_error(path + ": holds no run of train_derail");
  if (run_id == 0) run_id = runs.rbegin()->first;
  if (runs.count(run_id) == 0) {
    std::vector<std::uint32_t> there;
    for (const auto& run : runs) there.push_back(run.first);
    throw std::runtime_error(fmt::format("{}: no run {}; there are: {}", path, run_id, fmt::join(there, ", ")));
  }
  scenario_ = inputs::read_scenario(YAML::Load(runs[run_id].yaml), path);
  cars_ = model::expand(scenario_.consist);

  // A moment that was shown again later is not part of the run as it went.
  double last = -1.0;
  for_each_message<CarsTopic>(bag, [&](const CarStates& m) {
    if (m.run_id != run_id || !(m.time > last) || m.cars.size() != cars_.size()) return;
    last = m.time;
    moments_.push_back({m.time, from_message(m), {}});
  });
  if (moments_.empty()) throw std::runtime_error(fmt::format("{}: no states of run {}", path, run_id));
  auto moment = moments_.begin();
  for_each_message<CouplersTopic>(bag, [&](const CouplerForces& m) {
    if (m.run_id != run_id) return;
    while (moment != moments_.end() && moment->time < m.time) ++moment;
    if (moment != moments_.end() && moment->time == m.time) moment->couplers = from_message(m);
  });
  for (simulation::Snapshot& now : moments_) now.couplers.resize(cars_.size() - 1);
  for_each_message<OutcomeTopic>(bag, [&](const Outcome& m) {
    if (m.run_id != run_id || (!outcomes_.empty() && m.stop_time < outcomes_.back().time)) return;
    outcomes_.push_back({m.stop_time, from_message(m)});
  });
  for_each_message<ImpactsTopic>(bag, [&](const Impacts& m) {
    if (m.run_id == run_id) impacts_.push_back({m.time, from_message(m)});
  });
  for_each_message<EventsTopic>(bag, [&](const Event& m) {
    if (m.run_id != run_id) return;
    events_.push_back({(m.header.stamp - runs[run_id].header.stamp).toSec(), from_message(m)});
  });

  // Where bodies push each other, impacts say where cars came to touch; else an event names the fastest so far.
  if (!impacts_.empty()) {
    for (const model::Impact& i : impacts_.back().content) {
      touches_.push_back({i.closing_speed, i.closing_speed_normal, static_cast<int>(i.car_a) + 1,
                          static_cast<int>(i.car_b) + 1, i.time, i.x, i.y});
    }
  }
  if (touches_.empty()) {
    for (const Sent<scene::Occurrence>& e : events_) {
      if (e.content.type != Event::CONTACT) continue;
      const auto now = std::lower_bound(moments_.begin(), moments_.end() - 1, e.content.time,
                                        [](const simulation::Snapshot& s, double t) { return s.time < t; });
      const auto &a = now->cars.at(static_cast<std::size_t>(e.content.car) - 1),
                 &b = now->cars.at(static_cast<std::size_t>(e.content.other_car) - 1);
      touches_.push_back({e.content.value, e.content.value, e.content.car, e.content.other_car, e.content.time,
                          0.5 * (a.x + b.x), 0.5 * (a.y + b.y)});
    }
  }
}

std::size_t Recording::index(double t) const {
  const auto after = std::upper_bound(moments_.begin(), moments_.end(), t + kRounding,
                                      [](double time, const simulation::Snapshot& now) { return time < now.time; });
  return after == moments_.begin() ? 0 : static_cast<std::size_t>(after - moments_.begin()) - 1;
}

void Recording::advance(double t) {
  at_ = index(t);
  if (at_ == 0) events_taken_ = 0;
}

outcome::Outcome Recording::outcome_at(double t) const {
  const auto* sent = latest(outcomes_, t >= until() ? inputs::kInfinity : t + kRounding);
  return sent == nullptr ? outcome::Outcome() : sent->content;
}

const std::vector<model::Impact>& Recording::impacts() const {
  static const std::vector<model::Impact> kNone;
  const auto* sent = latest(impacts_, time() + kRounding);
  return sent == nullptr ? kNone : sent->content;
}

std::vector<scene::Occurrence> Recording::take_events(const simulation::Snapshot& now,
                                                      const outcome::Outcome& /*outcome*/) {
  std::vector<scene::Occurrence> taken;
  for (; events_taken_ < events_.size() && (ended() || events_[events_taken_].time <= now.time + kRounding);
       ++events_taken_) {
    taken.push_back(events_[events_taken_].content);
  }
  return taken;
}

}  // namespace train_derail::ros_face
