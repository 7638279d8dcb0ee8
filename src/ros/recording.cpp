#include "train_derail/ros/recording.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <stdexcept>
#include <tuple>

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

[[noreturn]] void refuse(const std::string& path, const std::string& problem) {
  throw inputs::InputError(path, "", "", problem, "a bag with the topics of a run");
}

/// A bag that is open for reading. What goes wrong with it is said with its path.
class OpenBag {
 public:
  explicit OpenBag(const std::string& path) : path_(path) {
    try {
      bag_.open(path, rosbag::bagmode::Read);
    } catch (const rosbag::BagUnindexedException&) {
      refuse(path, "a bag that was cut off; `rosbag reindex` makes it whole");
    } catch (const std::exception& e) {
      refuse(path, fmt::format("not a bag that can be read: {}", e.what()));
    }
  }

  /// Calls `use` with the node and the message, for each message of `Topic`; if `node` is not empty, of this node only.
  template <class Topic, class Use>
  void for_each(const std::string& node, const Use& use) const {
    using Message = typename Topic::Message;
    const std::string ending = "/" + std::string(Topic::facts.name.substr(1));
    const auto wanted = [&](const rosbag::ConnectionInfo* connection) {
      const std::string& topic = connection->topic;
      return connection->datatype == ::ros::message_traits::datatype<Message>() && topic.size() > ending.size() &&
             topic.compare(topic.size() - ending.size(), std::string::npos, ending) == 0 &&
             (node.empty() || topic == node + ending);
    };
    try {
      for (const rosbag::MessageInstance& instance : rosbag::View(bag_, wanted)) {
        const auto message = instance.instantiate<Message>();
        if (!message)
          throw std::runtime_error(instance.getTopic() + " was recorded by another version of train_derail");
        const std::string& topic = instance.getTopic();
        use(topic.substr(0, topic.size() - ending.size()), *message);
      }
    } catch (const std::exception& e) {
      refuse(path_, e.what());
    }
  }

  std::vector<RunInBag> runs() const {
    std::vector<RunInBag> found;
    for_each<InputsTopic>("", [&](const std::string& node, const Inputs& m) {
      const auto same = [&](const RunInBag& r) { return r.node == node && r.run_id == m.run_id; };
      if (std::none_of(found.begin(), found.end(), same)) found.push_back({node, m.run_id});
    });
    std::sort(found.begin(), found.end(), [](const RunInBag& a, const RunInBag& b) {
      return std::tie(a.node, a.run_id) < std::tie(b.node, b.run_id);
    });
    if (!found.empty()) return found;
    bool cars = false;
    for_each<CarsTopic>("", [&](const std::string&, const CarStates&) { cars = true; });
    refuse(path_, cars ? "has ~cars, but no ~inputs, which say what train and what track it is"
                       : "holds no run of train_derail");
  }

 private:
  const std::string path_;
  rosbag::Bag bag_;
};

/// The last of those that were sent by `time`; null if there is none.
template <class Sent>
const Sent* latest(const std::vector<Sent>& all, double time) {
  const auto after =
      std::upper_bound(all.begin(), all.end(), time, [](double t, const Sent& sent) { return t < sent.time; });
  return after == all.begin() ? nullptr : &*(after - 1);
}

constexpr double kRounding = 1.0e-9;

}  // namespace

std::vector<RunInBag> runs_in_bag(const std::string& path) { return OpenBag(path).runs(); }

namespace {

RunInBag find_run(const std::string& path, std::uint32_t run_id) {
  const std::vector<RunInBag> runs = runs_in_bag(path);
  if (run_id == 0) {
    return *std::max_element(runs.begin(), runs.end(),
                             [](const RunInBag& a, const RunInBag& b) { return a.run_id < b.run_id; });
  }
  std::set<std::uint32_t> there;
  for (const RunInBag& run : runs) {
    if (run.run_id == run_id) return run;
    there.insert(run.run_id);
  }
  refuse(path, fmt::format("no run {}; there are: {}", run_id, fmt::join(there, ", ")));
}

}  // namespace

Recording::Recording(const std::string& path, std::uint32_t run_id) : Recording(path, find_run(path, run_id)) {}

Recording::Recording(const std::string& path, const RunInBag& run) {
  const OpenBag bag(path);
  const std::uint32_t run_id = run.run_id;
  std::optional<Inputs> inputs;
  bag.for_each<InputsTopic>(run.node, [&](const std::string&, const Inputs& m) {
    if (m.run_id != run_id) return;
    if (inputs && inputs->yaml != m.yaml) {
      throw std::runtime_error(fmt::format(
          "two runs of {} have the number {}: it was started again while it was recorded", run.node, run_id));
    }
    inputs = m;
  });
  if (!inputs) refuse(path, fmt::format("no run {} of {}", run_id, run.node));
  scenario_ = inputs::read_scenario(YAML::Load(inputs->yaml), path);
  cars_ = model::expand(scenario_.consist);

  // A moment that was shown again later is not part of the run as it went.
  double last = -1.0;
  bag.for_each<CarsTopic>(run.node, [&](const std::string&, const CarStates& m) {
    if (m.run_id != run_id || !(m.time > last) || m.cars.size() != cars_.size()) return;
    last = m.time;
    moments_.push_back({m.time, from_message(m), {}});
  });
  if (moments_.empty()) refuse(path, fmt::format("no states of run {}: nothing on {}/cars", run_id, run.node));
  auto moment = moments_.begin();
  bag.for_each<CouplersTopic>(run.node, [&](const std::string&, const CouplerForces& m) {
    if (m.run_id != run_id) return;
    while (moment != moments_.end() && moment->time < m.time) ++moment;
    if (moment != moments_.end() && moment->time == m.time) moment->couplers = from_message(m);
  });
  for (simulation::Snapshot& now : moments_) now.couplers.resize(cars_.size() - 1);
  bag.for_each<OutcomeTopic>(run.node, [&](const std::string&, const Outcome& m) {
    if (m.run_id != run_id || (!outcomes_.empty() && m.stop_time < outcomes_.back().time)) return;
    outcomes_.push_back({m.stop_time, from_message(m)});
  });
  bag.for_each<ImpactsTopic>(run.node, [&](const std::string&, const Impacts& m) {
    if (m.run_id == run_id) impacts_.push_back({m.time, from_message(m)});
  });
  bag.for_each<EventsTopic>(run.node, [&](const std::string&, const Event& m) {
    if (m.run_id != run_id) return;
    events_.push_back({(m.header.stamp - inputs->header.stamp).toSec(), from_message(m)});
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

std::vector<scene::Occurrence> Recording::take_events(const simulation::Snapshot& now) {
  std::vector<scene::Occurrence> taken;
  for (; events_taken_ < events_.size() && (ended() || events_[events_taken_].time <= now.time + kRounding);
       ++events_taken_) {
    taken.push_back(events_[events_taken_].content);
  }
  return taken;
}

}  // namespace train_derail::ros_face
