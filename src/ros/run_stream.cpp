#include "train_derail/ros/run_stream.hpp"

#include <algorithm>
#include <cmath>

#include "train_derail/ros/messages.hpp"

namespace train_derail::ros_face {

namespace {

/// Spacing of ~impacts and ~outcome while the run is under way, simulated [s].
constexpr double kOutcomeInterval = 1.0;

}  // namespace

RunStream::RunStream(const StreamOptions& options, std::vector<MessageSink*> sinks)
    : options_(options), sinks_(std::move(sinks)), events_(options.event_coupler_force) {}

void RunStream::start_run(const simulation::Simulation& simulation, const RunState& state) {
  ++run_id_;
  clock_.start_run();
  events_ = EventDetector(options_.event_coupler_force);
  pile_up_ = PileUpFollower();
  const inputs::Scenario& scenario = simulation.scenario();
  scene_.emplace(scenario, simulation.cars(), options_.frames.world,
                 scenario.output.interval * std::max(1, options_.markers_every));
  grid_points_ = 0;
  markers_empty_ = true;
  if (run_id_ == 1) {
    tf2_msgs::TFMessage fixed;
    fixed.transforms.push_back(make_transform(header(), options_.frames.pod(), 0.0, 0.0, 0.0));
    send<TfStaticTopic>(fixed);
  }
  inputs_ = to_message(scenario, simulation.cars(), header(), run_id_);
  send<InputsTopic>(inputs_);
  run_info(simulation, state);
  const outcome::Outcome outcome = simulation.outcome();
  send_grid_point(simulation, outcome);
  send_impacts(simulation);
  send<OutcomeTopic>(to_message(outcome, header(), run_id_));
}

void RunStream::grid_point(const simulation::Simulation& simulation, const outcome::Outcome& outcome) {
  clock_.advance(simulation.time());
  send_grid_point(simulation, outcome);
  const auto every = std::max<std::int64_t>(1, std::llround(kOutcomeInterval / simulation.scenario().output.interval));
  if ((grid_points_ - 1) % every == 0 && !simulation.ended()) {
    send_impacts(simulation);
    send<OutcomeTopic>(to_message(outcome, header(), run_id_));
  }
}

void RunStream::end_run(const simulation::Simulation& simulation, const outcome::Outcome& outcome,
                        const RunState& state) {
  // Finds nothing but the end itself if the last grid point has seen it.
  send_events(simulation, outcome);
  complete_markers();
  send_impacts(simulation);
  send<OutcomeTopic>(to_message(outcome, header(), run_id_));
  run_info(simulation, state,
           outcome.message.empty() ? std::string(outcome::to_string(outcome.ended)) : outcome.message);
}

void RunStream::idle(double seconds) {
  clock_.advance_by(seconds);
  rosgraph_msgs::Clock clock;
  clock.clock = clock_.now();
  const tf2_msgs::TFMessage frames = moving_frames(header());
  for (MessageSink* sink : sinks_) sink->idle(clock, frames);
}

tf2_msgs::TFMessage RunStream::moving_frames(const std_msgs::Header& header) const {
  tf2_msgs::TFMessage moving = to_transforms(last_.cars, header, options_.frames);
  moving.transforms.push_back(make_transform(header, options_.frames.pile_up(), pile_up_.x(), pile_up_.y(), 0.0));
  return moving;
}

void RunStream::send_grid_point(const simulation::Simulation& simulation, const outcome::Outcome& outcome) {
  const std_msgs::Header h = header();
  last_ = simulation.snapshot();
  last_outcome_ = outcome;
  const std::vector<outcome::FirstTouch>& touches = simulation.touches();
  const auto recent = std::find_if(touches.rbegin(), touches.rend(), [&](const outcome::FirstTouch& touch) {
    return last_.time - touch.time >= scene_->flash_time();
  });
  last_touches_.assign(recent.base(), touches.end());
  heap_ = find_heap(simulation.cars(), last_.cars);
  pile_up_.update(heap_, last_.time);
  rosgraph_msgs::Clock clock;
  clock.clock = h.stamp;
  send<ClockTopic>(clock);
  send<TfTopic>(moving_frames(h));
  send<CarsTopic>(to_message(last_.cars, last_.time, h, run_id_));
  send<CouplersTopic>(to_message(last_.couplers, last_.time, h, run_id_));
  send<PileUpTopic>(to_message(heap_, last_.time, h, run_id_));
  markers_sent_ = false;
  if (options_.markers_every > 0 &&
      (markers_empty_ || (grid_points_ % options_.markers_every == 0 && markers_wanted()))) {
    send_markers();
  }
  ++grid_points_;
  send_events(simulation, outcome);
}

void RunStream::send_events(const simulation::Simulation& simulation, const outcome::Outcome& outcome) {
  for (const Occurrence& occurrence : events_.observe(simulation.snapshot(), outcome, simulation.incidents())) {
    send<EventsTopic>(to_message(occurrence, header(), run_id_));
  }
}

void RunStream::send_impacts(const simulation::Simulation& simulation) {
  Impacts now = to_message(simulation.incidents().impacts, simulation.time(), header(), run_id_);
  if (now.run_id == impacts_.run_id && now.impacts == impacts_.impacts) return;
  impacts_ = std::move(now);
  send<ImpactsTopic>(impacts_);
}

void RunStream::complete_markers() {
  if (options_.markers_every > 0 && !markers_sent_) send_markers();
}

void RunStream::send_markers() {
  scene_->update(last_, last_outcome_, last_touches_, pile_up_.x(), pile_up_.y(), clock_.now());
  if (markers_empty_) {
    send<MarkersTopic>(scene_->markers_on_empty());
  } else {
    send<MarkersTopic>(scene_->markers());
  }
  markers_empty_ = false;
  markers_sent_ = true;
}

bool RunStream::markers_wanted() const {
  return std::any_of(sinks_.begin(), sinks_.end(), [](const MessageSink* sink) { return sink->wants_markers(); });
}

void RunStream::run_info(const simulation::Simulation& simulation, const RunState& state, const std::string& message) {
  RunInfo info;
  info.header = header();
  info.run_id = run_id_;
  info.state = state.state;
  info.message = message;
  info.start = clock_.start();
  info.time = simulation.time();
  info.rate = state.rate;
  info.clock_publishers = state.clock_publishers;
  info.interval = simulation.scenario().output.interval;
  info.cars = static_cast<std::uint32_t>(simulation.cars().size());
  info.title = simulation.scenario().title;
  info.kept_until = info.time;
  send<RunInfoTopic>(info);
}

std_msgs::Header RunStream::header() const {
  std_msgs::Header h;
  h.stamp = clock_.now();
  h.frame_id = options_.frames.world;
  return h;
}

}  // namespace train_derail::ros_face
