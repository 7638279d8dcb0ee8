#include "rviz/node_link.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <map>
#include <mutex>
#include <utility>

#include <ros/callback_queue.h>
#include <ros/message_event.h>
#include <ros/names.h>
#include <ros/node_handle.h>
#include <ros/param.h>
#include <ros/service.h>
#include <ros/spinner.h>
#include <std_srvs/Trigger.h>

#include "rviz/service_call.hpp"
#include "train_derail/Restart.h"
#include "train_derail/Seek.h"
#include "train_derail/SetColours.h"
#include "train_derail/SetRate.h"
#include "train_derail/Step.h"
#include "train_derail/ros/clock_watch.hpp"
#include "train_derail/ros/topics.hpp"

namespace train_derail::rviz_panel {

namespace {

using Clock = std::chrono::steady_clock;  // simulated time stands still while the node is paused

constexpr std::chrono::milliseconds kProbePeriod(500);
/// Probes that find the node while it sends nothing, before the panel subscribes anew: the master may be another one.
constexpr int kSilentProbesMax = 6;
/// Over how long the achieved rate is taken, and how close together its samples are, wall [s].
constexpr double kRateWindow = 2.0;
constexpr double kRateSpacing = 0.1;
/// Peaks are not to be missed at rate 0.
constexpr std::uint32_t kForcesQueue = 1000;
/// Inputs kept by run: a message of another topic may still speak of the run before.
constexpr std::size_t kRunsKept = 3;

double seconds_between(Clock::time_point a, Clock::time_point b) {
  return std::chrono::duration<double>(b - a).count();
}

/// Simulated seconds per wall second over the last seconds.
class RateMeter {
 public:
  void clear() { samples_.clear(); }
  void add(Clock::time_point now, double time) {
    if (!samples_.empty() && time < samples_.back().time) clear();
    if (!samples_.empty() && seconds_between(samples_.back().wall, now) < kRateSpacing) return;
    samples_.push_back({now, time});
    while (samples_.size() > 2 && seconds_between(samples_.front().wall, now) > kRateWindow) samples_.pop_front();
  }
  std::optional<double> rate(Clock::time_point now) const {
    if (samples_.size() < 2) return {};
    const Sample &first = samples_.front(), &before = samples_[samples_.size() - 2], &last = samples_.back();
    // A node that has fallen silent counts with the silence.
    const double silence = seconds_between(last.wall, now);
    const bool silent = silence > 3.0 * seconds_between(before.wall, last.wall);
    const double wall = seconds_between(first.wall, last.wall) + (silent ? silence : 0.0);
    if (wall < 3.0 * kRateSpacing) return {};
    return (last.time - first.time) / wall;
  }

 private:
  struct Sample {
    Clock::time_point wall;
    double time;
  };
  std::deque<Sample> samples_;
};

}  // namespace

/// Shared with jobs that may outlive the link.
struct NodeLink::Core {
  // What stands here only.
  mutable std::mutex mutex;
  NodeView data;
  RateMeter rate;
  std::optional<double> seek_to;  // wanted, and not yet asked for
  std::map<std::uint32_t, Inputs::ConstPtr>
      inputs;                  // of the run shown and of those before it that may become `previous`
  Outcome::ConstPtr farthest;  // the latest outcome of the run shown
  boost::shared_ptr<::ros::M_string> forces_sender;  // connection that the forces come by

  BreakableCalls service_calls;

  // Probe thread only.
  std::string subscribed_to;
  int silent_probes = 0;
  ros_face::ClockRivals clock;

  ::ros::CallbackQueue queue;
  ::ros::NodeHandle handle;
  std::mutex subscribers_mutex;
  bool closed = false;
  std::vector<::ros::Subscriber> subscribers;
  ::ros::AsyncSpinner spinner{1, &queue};

  Core() {
    handle.setCallbackQueue(&queue);
    spinner.start();
  }

  void set_node(const std::string& name) {
    NodeView fresh;
    if (name.empty()) fresh.name_error = "empty name";
    else if (::ros::names::validate(name, fresh.name_error)) fresh.node = ::ros::names::resolve(name, false);
    {
      const std::lock_guard<std::mutex> lock(mutex);
      fresh.answer.number = data.answer.number;
      data = fresh;
      rate.clear();
      seek_to.reset();
      inputs.clear();
      farthest.reset();
    }
    service_calls.break_off();
  }

  void probe() {
    const std::string node = current_node();
    const bool present = !node.empty() && ::ros::ok() && ::ros::service::exists(node + "/get_inputs", false);
    bool was_present = false;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (node != data.node) return;  // changed meanwhile
      was_present = data.present;
      silent_probes = present && !data.run_info ? silent_probes + 1 : 0;
    }
    if (!present) service_calls.break_off();
    // A replay has topics, but no services.
    const bool anew = node != subscribed_to || (present && (!was_present || silent_probes >= kSilentProbesMax));
    if (anew) subscribe(node);
    std::string scenario_file;
    if (present && anew) ::ros::param::get(node + "/scenario_file", scenario_file);
    const bool published = has_publishers();
    const std::vector<std::string>& clock_publishers = clock.look();
    const std::lock_guard<std::mutex> lock(mutex);
    data.clock_publishers = clock_publishers;
    if (node != data.node) return;
    data.present = present;
    if (present && anew) data.scenario_file = scenario_file;
    if (!published) data.player.clear();
  }

  bool has_publishers() {
    const std::lock_guard<std::mutex> lock(subscribers_mutex);
    return std::any_of(subscribers.begin(), subscribers.end(),
                       [](const ::ros::Subscriber& s) { return s.getNumPublishers() > 0; });
  }

  std::string current_node() const {
    const std::lock_guard<std::mutex> lock(mutex);
    return data.node;
  }

  /// Drops the old subscriptions first: a node that has come back must send its latched messages again.
  void subscribe(const std::string& node) {
    const std::lock_guard<std::mutex> subscribers_lock(subscribers_mutex);
    subscribers.clear();
    if (closed || node.empty()) return;
    {
      const std::lock_guard<std::mutex> lock(mutex);
      if (node != data.node) return;
      data.run_info.reset();
      data.inputs.reset();
      data.outcome.reset();
      data.cars.reset();
      data.couplers.reset();
      data.pile_up.reset();
      data.train = {};
      data.forces = {};
      data.previous = {};
      data.player.clear();
      rate.clear();
      inputs.clear();
      farthest.reset();
    }
    silent_probes = 0;
    subscribed_to = node;
    subscribers = {
        handle.subscribe(ros_face::topic_name(ros_face::RunInfoTopic::facts, node), 10, &Core::on_run_info, this),
        handle.subscribe(ros_face::topic_name(ros_face::InputsTopic::facts, node), 2, &Core::on_inputs, this),
        handle.subscribe(ros_face::topic_name(ros_face::OutcomeTopic::facts, node), 2, &Core::on_outcome, this),
        handle.subscribe(ros_face::topic_name(ros_face::CarsTopic::facts, node), 2, &Core::on_cars, this),
        handle.subscribe(ros_face::topic_name(ros_face::CouplersTopic::facts, node), kForcesQueue, &Core::on_couplers,
                         this),
        handle.subscribe(ros_face::topic_name(ros_face::PileUpTopic::facts, node), 2, &Core::on_pile_up, this),
    };
  }

  void close() {
    service_calls.close();
    {
      const std::lock_guard<std::mutex> lock(subscribers_mutex);
      closed = true;
      subscribers.clear();
    }
    spinner.stop();
  }

  /// Of every message: who publishes the node's topics without being it. `mutex` is held.
  template <class Message>
  void see_publisher(const ::ros::MessageEvent<Message const>& event) {
    const std::string name = event.getPublisherName();
    data.player = name == data.node ? "" : name;
  }
  void on_run_info(const ::ros::MessageEvent<RunInfo const>& event) {
    const RunInfo::ConstPtr message = event.getConstMessage();
    const std::lock_guard<std::mutex> lock(mutex);
    see_publisher(event);
    const bool was_running = data.run_info && data.run_info->state == RunInfo::RUNNING;
    if (!was_running || message->state != RunInfo::RUNNING || message->rate != data.run_info->rate) rate.clear();
    data.run_info = message;
  }
  void on_inputs(const ::ros::MessageEvent<Inputs const>& event) {
    const std::lock_guard<std::mutex> lock(mutex);
    see_publisher(event);
    data.inputs = event.getConstMessage();
    inputs[data.inputs->run_id] = data.inputs;
    while (inputs.size() > kRunsKept) inputs.erase(inputs.begin());
  }
  void on_outcome(const ::ros::MessageEvent<Outcome const>& event) {
    const std::lock_guard<std::mutex> lock(mutex);
    see_publisher(event);
    const Outcome::ConstPtr message = event.getConstMessage();
    // Of a run that has not moved there is nothing to compare with.
    if (farthest && farthest->run_id < message->run_id && farthest->stop_time > 0.0) {
      const auto known = inputs.find(farthest->run_id);
      data.previous = {farthest, known == inputs.end() ? nullptr : known->second};
    }
    // A run that is looked back at sends outcomes of earlier moments.
    if (!farthest || farthest->run_id != message->run_id || farthest->stop_time <= message->stop_time)
      farthest = message;
    data.outcome = message;
  }
  void on_cars(const ::ros::MessageEvent<CarStates const>& event) {
    const CarStates::ConstPtr message = event.getConstMessage();
    TrainNow train;
    train.run_id = message->run_id;
    train.time = message->time;
    for (const CarState& car : message->cars) {
      train.past_pod += car.past_pod ? 1 : 0;
      train.off_track += car.off_track ? 1 : 0;
    }
    if (!message->cars.empty()) {
      const geometry_msgs::Vector3& velocity = message->cars.back().twist.linear;
      train.speed_last = std::hypot(velocity.x, velocity.y);
    }
    const std::lock_guard<std::mutex> lock(mutex);
    see_publisher(event);
    data.cars = message;
    data.train = train;
    rate.add(Clock::now(), train.time);
  }
  void on_couplers(const ::ros::MessageEvent<CouplerForces const>& event) {
    const std::lock_guard<std::mutex> lock(mutex);
    see_publisher(event);
    // A node that was started again counts its runs from 1 again, and may do so before the probe misses it.
    if (event.getConnectionHeaderPtr() != forces_sender) data.forces = {};
    forces_sender = event.getConnectionHeaderPtr();
    data.couplers = event.getConstMessage();
    data.forces.add(*data.couplers);
  }
  void on_pile_up(const ::ros::MessageEvent<PileUp const>& event) {
    const std::lock_guard<std::mutex> lock(mutex);
    see_publisher(event);
    data.pile_up = event.getConstMessage();
  }

  void follow_seeks(const std::string& node) {
    for (;;) {
      Seek::Request request;
      {
        const std::lock_guard<std::mutex> lock(mutex);
        if (node != data.node) return;
        if (!seek_to) {
          data.pending.erase("seek");
          return;
        }
        request.time = *std::exchange(seek_to, std::nullopt);
      }
      Seek::Response response;
      const bool reached = service_calls.call<Seek>(node + "/seek", request, response);
      if (reached && response.success) continue;
      Answer answer{0, "seek", false, reached ? response.message : node + "/seek: no answer"};
      const std::lock_guard<std::mutex> lock(mutex);
      if (node != data.node) return;
      answer.number = data.answer.number + 1;
      data.answer = std::move(answer);
    }
  }

  void answered(const std::string& node, Answer answer) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (node != data.node) return;
    data.pending.erase(answer.service);
    answer.number = data.answer.number + 1;
    data.answer = std::move(answer);
  }
};

NodeLink::NodeLink(const std::string& node)
    : core_(std::make_shared<Core>()), probe_([core = core_] { core->probe(); }, kProbePeriod) {
  set_node(node);
}

NodeLink::~NodeLink() { core_->close(); }

void NodeLink::set_node(const std::string& node) {
  core_->set_node(node);
  probe_.post([core = core_] { core->probe(); });
}

NodeView NodeLink::view() const {
  const std::lock_guard<std::mutex> lock(core_->mutex);
  NodeView view = core_->data;
  const bool there = view.present || is_replay(view);
  const bool running = there && view.run_info && view.run_info->state == RunInfo::RUNNING;
  if (running) view.achieved_rate = core_->rate.rate(Clock::now());
  return view;
}

template <class Service>
void NodeLink::call(Worker& worker, const std::string& service, const typename Service::Request& request) {
  std::string node;
  {
    const std::lock_guard<std::mutex> lock(core_->mutex);
    node = core_->data.node;
    if (node.empty() || !core_->data.pending.insert(service).second) return;
  }
  worker.post([core = core_, node, service, request] {
    if (node != core->current_node()) return;
    typename Service::Response response;
    const bool reached = core->service_calls.call<Service>(node + "/" + service, request, response);
    Answer answer{0, service, reached && response.success, response.message};
    if (!reached) answer.message = node + "/" + service + ": no answer";
    core->answered(node, std::move(answer));
  });
}

void NodeLink::resume() { call<std_srvs::Trigger>(calls_, "resume", {}); }
void NodeLink::pause() { call<std_srvs::Trigger>(calls_, "pause", {}); }

void NodeLink::step(std::uint32_t ticks) {
  Step::Request request;
  request.ticks = ticks;
  call<Step>(steps_, "step", request);
}

void NodeLink::set_rate(double rate) {
  SetRate::Request request;
  request.rate = rate;
  call<SetRate>(calls_, "set_rate", request);
}

void NodeLink::set_colours(scene::Colours colours) {
  SetColours::Request request;
  request.colours = std::string(to_string(colours));
  call<SetColours>(calls_, "set_colours", request);
}

void NodeLink::restart(const std::vector<std::string>& overrides, bool start_paused, const std::string& scenario) {
  Restart::Request request;
  request.scenario = scenario;
  request.overrides = overrides;
  request.start_paused = start_paused;
  call<Restart>(calls_, "restart", request);
}

void NodeLink::seek(double time) {
  std::string node;
  {
    const std::lock_guard<std::mutex> lock(core_->mutex);
    node = core_->data.node;
    if (node.empty()) return;
    core_->seek_to = time;
    if (!core_->data.pending.insert("seek").second) return;  // taken up when the one under way has been answered
  }
  calls_.post([core = core_, node] { core->follow_seeks(node); });
}

}  // namespace train_derail::rviz_panel
